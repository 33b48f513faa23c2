//! [`GltfError`].

use thiserror::Error;

/// What is wrong with a glTF or GLB file. Everything is counted from 0, as in the file.
#[derive(Debug, Clone, PartialEq, Error)]
pub enum GltfError {
    /// Too short for a GLB header.
    #[error("the GLB header needs 12 bytes, the file has {bytes}; it may be cut off")]
    NoHeader {
        /// The file's size.
        bytes: usize,
    },
    /// Another version of the format.
    #[error("is glTF version {version}; version 2 can be read")]
    Version {
        /// As the file has it.
        version: String,
    },
    /// The GLB header claims more than there is.
    #[error("the GLB header claims {claimed} bytes, the file has {bytes}; it may be cut off")]
    Truncated {
        /// As the header says.
        claimed: u32,
        /// The file's size.
        bytes: usize,
    },
    /// A chunk of the GLB container.
    #[error("GLB chunk: {message}")]
    Chunk {
        /// What is wrong.
        message: String,
    },
    /// Not the JSON of a glTF file.
    #[error("JSON: {message}")]
    Json {
        /// What is wrong, with line and column.
        message: String,
    },
    /// An extension without which the file cannot be read as it is meant.
    #[error(
        "requires the extension {extension}, which cannot be read; save it without, or with that data decoded"
    )]
    Extension {
        /// Its name.
        extension: String,
    },
    /// A number that names something that does not exist.
    #[error("{place} names {what} {index} of {count}")]
    BadReference {
        /// Where.
        place: String,
        /// What.
        what: &'static str,
        /// The number.
        index: usize,
        /// How many there are.
        count: usize,
    },
    /// A value that the format does not know.
    #[error("{place} has no valid {what}")]
    BadValue {
        /// Where.
        place: String,
        /// What.
        what: &'static str,
    },
    /// A buffer that cannot be read.
    #[error("buffer {buffer} ({source_name}) cannot be read: {message}")]
    Buffer {
        /// Its number.
        buffer: usize,
        /// The file's name, or what it is instead.
        source_name: String,
        /// Why not.
        message: String,
    },
    /// A buffer that is shorter than the JSON says.
    #[error("buffer {buffer} ({source_name}) has {bytes} bytes of {claimed}; it may be cut off")]
    ShortBuffer {
        /// Its number.
        buffer: usize,
        /// The file's name, or what it is instead.
        source_name: String,
        /// Its size.
        bytes: usize,
        /// As the JSON says.
        claimed: u64,
    },
    /// A buffer view beyond its buffer.
    #[error(
        "buffer view {view} takes {length} bytes from byte {offset} of buffer {buffer}, which has {bytes}"
    )]
    BadView {
        /// Its number.
        view: usize,
        /// Its length.
        length: u64,
        /// Its start.
        offset: u64,
        /// The buffer's number.
        buffer: usize,
        /// The buffer's size.
        bytes: usize,
    },
    /// An accessor beyond its buffer view.
    #[error(
        "accessor {accessor} takes {count} rows of {row} bytes, one every {stride}, from byte {offset} of buffer view {view}, which has {bytes}"
    )]
    BadAccessor {
        /// Its number.
        accessor: usize,
        /// Its rows.
        count: u64,
        /// Bytes of a row.
        row: usize,
        /// Bytes from row to row.
        stride: usize,
        /// Its start.
        offset: u64,
        /// The view's number.
        view: usize,
        /// The view's size.
        bytes: usize,
    },
    /// An accessor without data.
    #[error("accessor {accessor} has no data{hint}")]
    NoData {
        /// Its number.
        accessor: usize,
        /// What may be the reason.
        hint: String,
    },
    /// An accessor of zeros, to be changed by sparse values, that is larger than any data in the file.
    #[error(
        "accessor {accessor} claims {count} rows that are stored nowhere, more than the {bytes} bytes of all buffers"
    )]
    TooManyZeros {
        /// Its number.
        accessor: usize,
        /// Its rows.
        count: u64,
        /// Size of all buffers.
        bytes: usize,
    },
    /// An accessor of another type than its use asks for.
    #[error("accessor {accessor} is {found}; expected {expected}")]
    AccessorType {
        /// Its number.
        accessor: usize,
        /// Its type.
        found: String,
        /// What is needed.
        expected: String,
    },
    /// A sparse value for a row that does not exist.
    #[error("accessor {accessor}: sparse value {number} is for row {row} of {count}")]
    SparseIndex {
        /// The accessor's number.
        accessor: usize,
        /// Which sparse value.
        number: usize,
        /// The row.
        row: u64,
        /// Rows of the accessor.
        count: usize,
    },
    /// An attribute with another number of rows than the positions.
    #[error("{primitive}: {attribute} has {found} rows for {vertices} positions")]
    RowCount {
        /// Which primitive.
        primitive: String,
        /// Which attribute.
        attribute: String,
        /// Its rows.
        found: usize,
        /// Rows of `POSITION`.
        vertices: usize,
    },
    /// NaN or infinite.
    #[error("{primitive}: {attribute} of vertex {vertex} is not finite: {value:?}")]
    NotFinite {
        /// Which primitive.
        primitive: String,
        /// Which attribute.
        attribute: String,
        /// Which row.
        vertex: usize,
        /// Its value.
        value: Vec<f64>,
    },
    /// A triangle names a vertex that does not exist.
    #[error("{primitive}: index {number} is vertex {vertex} of {vertices}")]
    BadIndex {
        /// Which primitive.
        primitive: String,
        /// Which index.
        number: usize,
        /// The vertex.
        vertex: u32,
        /// How many there are.
        vertices: usize,
    },
    /// Triangles need three indices each.
    #[error("{primitive}: has {count} indices, which is no multiple of 3")]
    IndexCount {
        /// Which primitive.
        primitive: String,
        /// Its indices.
        count: usize,
    },
    /// A node below itself.
    #[error("{node} is below itself; nodes must form a tree")]
    CyclicNode {
        /// Which node.
        node: String,
    },
    /// A node with two parents.
    #[error("{node} is a child of both {first} and {second}; nodes must form a tree")]
    TwoParents {
        /// Which node.
        node: String,
        /// One parent.
        first: String,
        /// The other.
        second: String,
    },
    /// A transform that gives no finite positions.
    #[error("the transform of {node} is not finite, or takes positions out of range")]
    BadTransform {
        /// Which node.
        node: String,
    },
    /// Instances of meshes add up to more than fits in memory.
    #[error("{node}: with its mesh the scene has more than {limit} {what}")]
    TooLarge {
        /// Which node.
        node: String,
        /// The bound.
        limit: usize,
        /// `vertices` or `triangles`.
        what: &'static str,
    },
}

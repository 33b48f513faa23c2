//! [`PlyError`].

use thiserror::Error;

/// What is wrong with a PLY file. Rows are counted from 0, as face lists count vertices; lines from 1.
#[derive(Debug, Clone, PartialEq, Error)]
pub enum PlyError {
    /// The first line is not `ply`.
    #[error("line 1: expected \"ply\", found {found:?}")]
    NotPly {
        /// What is there.
        found: String,
    },
    /// A line of the header makes no sense.
    #[error("line {line}: expected {expected}, found {found:?}")]
    Header {
        /// Number of the line.
        line: usize,
        /// What may stand there.
        expected: &'static str,
        /// The line.
        found: String,
    },
    /// The header does not end.
    #[error("the header has no \"{missing}\" line; the file may be cut off")]
    UnfinishedHeader {
        /// The statement that is missing.
        missing: &'static str,
    },
    /// More rows than the rest of the file can hold.
    #[error(
        "line {line}: element {element:?} claims {rows} rows, at least {least} bytes; only {remaining} bytes follow, so the file is cut off or the count is wrong"
    )]
    TooManyRows {
        /// Where the header claims it.
        line: usize,
        /// Name of the element.
        element: String,
        /// The claim.
        rows: u64,
        /// Bytes that so many rows take at least.
        least: u128,
        /// Bytes that are left for them.
        remaining: usize,
    },
    /// The file ends inside a row.
    #[error("{element} {row}: the file ends before property {property:?}; it may be cut off")]
    Truncated {
        /// Name of the element.
        element: String,
        /// Number of the row.
        row: usize,
        /// The property that is missing.
        property: String,
    },
    /// A list is longer than the rest of the file, or its length is no count.
    #[error("{element} {row}: list {property:?} claims {length} entries; only {remaining} bytes follow")]
    BadListLength {
        /// Name of the element.
        element: String,
        /// Number of the row.
        row: usize,
        /// Name of the property.
        property: String,
        /// The claim.
        length: f64,
        /// Bytes that are left for it.
        remaining: usize,
    },
    /// A word of an ASCII body is no number.
    #[error("line {line}: {element} {row}: property {property:?} is {found:?}, which is not a number")]
    NotANumber {
        /// Number of the line.
        line: usize,
        /// Name of the element.
        element: String,
        /// Number of the row.
        row: usize,
        /// Name of the property.
        property: String,
        /// What is there.
        found: String,
    },
    /// A line of an ASCII body goes on after its row.
    #[error(
        "line {line}: {element} {row}: the line has more values than the header gives it properties, or a row before it has fewer"
    )]
    ExtraValues {
        /// Number of the line.
        line: usize,
        /// Name of the element.
        element: String,
        /// Number of the row.
        row: usize,
    },
    /// An element that a mesh needs is not there.
    #[error("has no element {element:?}{hint}")]
    NoElement {
        /// Name of the element.
        element: &'static str,
        /// What that means.
        hint: &'static str,
    },
    /// A property that a mesh needs is not there.
    #[error("element {element:?} has no {kind} property {property:?}")]
    NoProperty {
        /// Name of the element.
        element: &'static str,
        /// `scalar` or `list`.
        kind: &'static str,
        /// Name of the property.
        property: &'static str,
    },
    /// A value is NaN or infinite.
    #[error("{element} {row}: property {property:?} is not finite: {value}")]
    NotFinite {
        /// Name of the element.
        element: &'static str,
        /// Number of the row.
        row: usize,
        /// Name of the property.
        property: String,
        /// The value.
        value: f64,
    },
    /// A face names a vertex that does not exist.
    #[error("face {face} uses vertex {index} of {vertices}")]
    BadIndex {
        /// Number of the face.
        face: usize,
        /// The vertex that it names.
        index: f64,
        /// How many there are.
        vertices: usize,
    },
    /// The texture coordinates of a face are not two for each corner.
    #[error("face {face} has {found} texture coordinate values for {corners} corners")]
    BadTexcoords {
        /// Number of the face.
        face: usize,
        /// Length of its list.
        found: usize,
        /// How many corners it has.
        corners: usize,
    },
}

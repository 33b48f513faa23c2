//! Why a file is no model.

use std::path::PathBuf;

use thiserror::Error;

/// Why a file could not be read or written.
#[derive(Debug, Error)]
pub enum FileError {
    /// The file system said no.
    #[error("{}: {error}", path.display())]
    Io {
        /// The file.
        path: PathBuf,
        /// What it said.
        error: std::io::Error,
    },
    /// The bytes are no model.
    #[error("{}: {error}", path.display())]
    Invalid {
        /// The file.
        path: PathBuf,
        /// Why.
        error: InvalidModel,
    },
}

/// Why bytes are no model.
#[derive(Debug, Error)]
pub enum InvalidModel {
    /// The file is larger than any model.
    #[error("it has {bytes} bytes; models have at most {most}")]
    TooLarge {
        /// Its size.
        bytes: u64,
        /// The limit.
        most: u64,
    },
    /// The header is longer than any model's.
    #[error("it claims a header of {claimed} bytes; models have at most {most}")]
    HeaderTooLong {
        /// What the first eight bytes say.
        claimed: u64,
        /// The limit.
        most: u64,
    },
    /// The file ends within the header.
    #[error("it ends after {bytes} bytes, within the header; copy it again")]
    TruncatedHeader {
        /// Its size.
        bytes: usize,
    },
    /// The header claims another size than the file has.
    #[error("its tensors claim {claimed} bytes, and {present} follow the header; copy it again")]
    Claims {
        /// End of the last tensor.
        claimed: u64,
        /// Bytes after the header.
        present: u64,
    },
    /// No safetensors file.
    #[error("it is no safetensors file: {0}")]
    Container(String),
    /// A safetensors file of something else.
    #[error(
        "it is a safetensors file without the metadata of a model; models are written by `osculate train`"
    )]
    NoMetadata,
    /// Another format.
    #[error("its format is {0:?}, not \"osculate-sbtf\"")]
    Format(String),
    /// Another version.
    #[error("its format version is {found}; this program reads 1 to {known}")]
    Version {
        /// In the file.
        found: u64,
        /// Newest known here.
        known: u32,
    },
    /// The metadata does not have the fields that it should.
    #[error("its metadata: {0}")]
    Metadata(serde_json::Error),
    /// The architecture is none.
    #[error("its architecture: {0}")]
    Architecture(String),
    /// A tensor is absent.
    #[error("tensor {0:?} is missing")]
    Missing(String),
    /// A tensor has another type.
    #[error("tensor {tensor:?} has type {found}; expected {wanted}")]
    Type {
        /// Its name.
        tensor: String,
        /// In the file.
        found: String,
        /// What would do.
        wanted: String,
    },
    /// A tensor does not have the shape that the architecture asks for.
    #[error("tensor {tensor:?} has shape {found:?}; the architecture asks for {wanted:?}")]
    Shape {
        /// Its name.
        tensor: String,
        /// In the file.
        found: Vec<usize>,
        /// By the architecture.
        wanted: Vec<usize>,
    },
    /// A tensor holds an infinity or NaN.
    #[error("tensor {tensor:?}: number {index} is {value}; train or export it again")]
    NotFinite {
        /// Its name.
        tensor: String,
        /// Its place.
        index: usize,
        /// What is there.
        value: f32,
    },
    /// There is a tensor that the architecture knows nothing of.
    #[error("tensor {0:?} is none that the architecture has")]
    Unexpected(String),
}

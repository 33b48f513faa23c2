//! `.sbtf` files: a [`StoredModel`](crate::infer::StoredModel) with where it comes from, as safetensors.
//!
//! `docs/sbtf-format.md` has the layout on one page; `tools/reference/sbtf_numpy.py` reads and evaluates files without this
//! crate. The same model makes the same bytes, and a file that is read and written again has the bytes it had.

mod check;
mod error;
mod layout;
mod metadata;
mod read;
mod write;

#[cfg(test)]
mod tests;

pub use error::{FileError, InvalidModel};
pub use metadata::{MicrostructureSource, ModelFile, Provenance};

/// Newest version of the format; readers refuse newer ones. A file has the oldest version that says what it says: 1 unless taps lie
/// along other ways than version 1 knows, or the sampler has forward lobes, uneven bands or ranges of curvature, which are of version 3.
pub const FORMAT_VERSION: u32 = 3;

/// Longest header that is read, in bytes.
pub const LONGEST_HEADER: u64 = 1 << 20;

/// Largest file that is read, in bytes.
pub const LARGEST_FILE: u64 = 1 << 31;

//! Cross-crate tests live in `tests/tests/`, one file per theme; recorded data in `tests/data/`. Input that several of them
//! share is made here.

pub mod broken_files;
pub mod hard_cases;
pub mod samples;
pub mod surfaces;

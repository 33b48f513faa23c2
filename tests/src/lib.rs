//! Cross-crate tests live in `tests/tests/`, one file per theme; recorded data in `tests/data/`.

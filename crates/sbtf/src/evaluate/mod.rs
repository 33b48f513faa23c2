//! How good a material is: its answers against exact ones, on queries that no training has seen.

mod appearance;
mod coverage;
mod silhouettes;

pub use appearance::{AppearanceOptions, Pair, appearance_pairs};
pub use coverage::{Coverage, CoverageOptions, coverage};
pub use silhouettes::{SilhouetteOptions, SilhouetteScore, silhouettes, total};

//! How good a material is: its answers against exact ones, on queries that no training has seen.

mod appearance;
mod silhouettes;

pub use appearance::{AppearanceOptions, Pair, appearance_pairs};
pub use silhouettes::{SilhouetteOptions, SilhouetteScore, silhouettes, total};

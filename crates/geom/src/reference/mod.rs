//! What curvature should be: recorded libigl output, closed forms, and the comparison with them.
//!
//! A comparison takes one [`Expected`] per vertex. [`ReferenceFile`] and [`Shape`] make them, [`compare()`] measures how
//! far an estimate is off, relative to `|kappa| + 1 / (bounding box diagonal)`, which no flat vertex makes infinite and
//! no change of units alters.

mod analytic;
mod compare;
mod matching;
mod npz;
mod quantiles;
mod shape_words;

pub(crate) use analytic::level_set_curvature;
pub use analytic::{Axis, NotOnShape, SaddleForm, Shape};
pub use compare::{
    Bounds, CompareOptions, Comparison, DEFAULT_CONDITION_LIMIT, Expected, SkipReason, Skipped, WorstVertex,
    compare,
};
pub use matching::{Matching, Triangulation, match_rows};
pub use npz::{ReferenceError, ReferenceFile, ReferenceSetting};
pub use quantiles::Quantiles;
pub use shape_words::ParseShapeError;

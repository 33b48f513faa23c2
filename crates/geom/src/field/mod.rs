//! Curvature between the vertices: interpolation, curvature along a ray, and what lies past the point where it enters.
//!
//! [`Filter`] is the one interface to all ways to turn a ray at a surface point into the curvature that a material is asked
//! with; [`CurvatureField`] holds the data.

mod azimuths;
mod baked;
mod baked_chord;
mod chord;
mod corners;
mod direction;
mod filter;
mod front;
mod glance;
mod march;
mod queries;
mod section;
mod skip;
mod slice;
mod start;
mod surface_field;
mod trail;
mod vertex_bend;
mod walk_length;

#[cfg(test)]
mod tests;

pub use baked::{BakedError, BakedMinimum};
pub use baked_chord::{BakedChord, BakedChordError};
pub use chord::Chord;
pub use filter::{Filter, FilterAnswer, FilterKind, FilterQuery};
pub use front::MAX_CROSSINGS;
pub use march::March;
pub use queries::spread_queries;
pub use section::Stop;
pub use skip::SkipBounds;
pub use surface_field::{CurvatureField, SurfacePoint};
pub use walk_length::WalkLength;

//! Curvature between the vertices: interpolation, curvature along a ray, and its minimum past a point.

mod direction;
mod march;
mod surface_field;

pub use march::{MAX_CROSSINGS, March, Stop};
pub use surface_field::{CurvatureField, SurfacePoint};

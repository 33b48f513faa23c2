//! Principal curvature at the vertices of a surface.

mod estimate;
mod kernel;
mod libigl;
mod libigl_normals;
mod moments;
mod options;
mod principal;
mod quadric;
mod shape_operator;
mod walker;

pub use estimate::estimate;
pub use options::{CurvatureOptions, Method, Neighbourhood, OptionsError};
pub use principal::{Principal, Status, VertexCurvature};

//! Principal curvature at the vertices of a surface.

mod options;
mod principal;

pub use options::{CurvatureOptions, Method, Neighbourhood, OptionsError};
pub use principal::{Principal, Status, VertexCurvature};

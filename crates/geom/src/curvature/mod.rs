//! Principal curvature at the vertices of a surface.

mod algebraic;
mod auto;
mod batch;
mod creases;
mod error_bar;
mod estimate;
mod jet;
mod kernel;
mod lanes;
mod libigl;
mod libigl_normals;
mod local_fit;
mod moments;
mod normals;
mod options;
mod principal;
mod quadric;
mod shape_operator;
mod support;
mod walker;
mod workspace;

pub use estimate::estimate;
pub use options::{CurvatureOptions, Features, Method, Neighbourhood, OptionsError};
pub use principal::{Principal, Status, VertexCurvature};
pub use workspace::Workspace;

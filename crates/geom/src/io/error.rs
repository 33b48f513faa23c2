//! [`ReadProblem`]: why a file could not be read.

use thiserror::Error;

use super::{ObjError, PlyError, StlError};
use crate::MeshError;

/// What is wrong with a mesh file. The message names the element and the value.
#[derive(Debug, Error)]
pub enum ReadProblem {
    /// Vertices at most.
    #[error("has no triangles ({vertices} vertices); curvature needs a surface")]
    NoTriangles {
        /// How many vertices it has.
        vertices: usize,
    },
    /// The data read makes no valid mesh.
    #[error(transparent)]
    Mesh(#[from] MeshError),
    /// Not a valid OBJ file.
    #[error(transparent)]
    Obj(#[from] ObjError),
    /// Not a valid PLY file.
    #[error(transparent)]
    Ply(#[from] PlyError),
    /// Not a valid STL file.
    #[error(transparent)]
    Stl(#[from] StlError),
}

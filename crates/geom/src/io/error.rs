//! [`ReadError`]: which file could not be read, and why.

use std::path::PathBuf;

use thiserror::Error;

use super::{Format, GltfError, ObjError, PlyError, StlError};
use crate::MeshError;

/// A mesh file that could not be read.
#[derive(Debug, Error)]
#[error("{}: {problem}", path.display())]
pub struct ReadError {
    /// As it was given.
    pub path: PathBuf,
    /// What is wrong with it.
    pub problem: Box<ReadProblem>,
}

/// What is wrong with a mesh file. The message names the element and the value.
#[derive(Debug, Error)]
pub enum ReadProblem {
    /// The operating system's answer.
    #[error("cannot be read: {0}")]
    Unreadable(std::io::Error),
    /// The extension is none of those that can be read.
    #[error("{extension:?} is no known extension; meshes are read from .obj, .ply, .stl, .gltf and .glb")]
    UnknownExtension {
        /// Without the dot.
        extension: String,
    },
    /// There is no extension to tell the format by.
    #[error("has no extension to tell its format by; meshes are read from .obj, .ply, .stl, .gltf and .glb")]
    NoExtension,
    /// The content is in another format than the extension says.
    #[error(
        "the extension says {expected}, the content is {found}; rename it to end in .{}",
        found.extension()
    )]
    WrongExtension {
        /// By the extension.
        expected: Format,
        /// By the content.
        found: Format,
    },
    /// Nothing in it.
    #[error("is empty (0 bytes)")]
    EmptyFile,
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
    /// Not a valid glTF file.
    #[error(transparent)]
    Gltf(#[from] GltfError),
}

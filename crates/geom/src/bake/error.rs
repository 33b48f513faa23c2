//! What can go wrong with a bake file.

use std::io;

use thiserror::Error;

use crate::MeshError;

/// Why a bake was not written. The target file is untouched.
#[derive(Debug, Error)]
pub enum WriteError {
    /// A value is too large for the float type of the file.
    #[error(
        "vertex {vertex}: the {attribute} {value:e} does not fit into the file's floats; rescale the mesh, or write a .ply with 64-bit floats"
    )]
    DoesNotFit {
        /// `position`, `UV`, `curvature` or `direction`.
        attribute: &'static str,
        /// Index of the vertex.
        vertex: usize,
        /// The first component that does not fit.
        value: f64,
    },
    /// glTF has no accessor without elements.
    #[error("the mesh has no vertices, and glTF cannot hold an empty mesh; nothing is there to bake")]
    Empty,
    /// Binary glTF counts bytes with 32 bits.
    #[error(
        "the file would take {bytes} bytes, more than the 4 GiB that a .glb can hold; write a .ply instead"
    )]
    TooLarge {
        /// Size of the whole file.
        bytes: u64,
    },
    /// What the file system says.
    #[error(transparent)]
    Io(#[from] io::Error),
}

/// Why a file is not a bake that can be read.
#[derive(Debug, Error)]
pub enum ReadError {
    /// The file holds no provenance record: it is a mesh, perhaps, but nothing that Osculate baked.
    #[error("holds no curvature baked by osculate; bake it first with `osculate bake`")]
    NotBaked,
    /// Neither `.glb` nor `.ply`.
    #[error("the extension {0:?} is not one of .glb and .ply, the two that a bake has")]
    Extension(String),
    /// Written by a later version.
    #[error("has bake format version {found}, this program knows up to {known}; update osculate")]
    Version {
        /// In the file.
        found: u64,
        /// [`FORMAT_VERSION`](super::FORMAT_VERSION).
        known: u32,
    },
    /// The container or its contents break their format.
    #[error("{0}; bake the source mesh again")]
    Invalid(String),
    /// The geometry is not a mesh.
    #[error(transparent)]
    Mesh(#[from] MeshError),
    /// What the file system says.
    #[error(transparent)]
    Io(#[from] io::Error),
}

impl ReadError {
    pub(super) fn invalid(what: impl std::fmt::Display) -> Self {
        Self::Invalid(what.to_string())
    }
}

//! [`SceneError`]: why a scene cannot be rendered.

use thiserror::Error;

/// Why a scene cannot be rendered.
#[derive(Debug, Error)]
pub enum SceneError {
    /// A texture of a mesh cannot be decoded.
    #[error("object {object}, material {material:?}: {source}")]
    Texture {
        /// Index of the object.
        object: usize,
        /// Name of the material.
        material: String,
        /// What is wrong.
        source: crate::texture::TextureError,
    },
    /// A position with a coordinate beyond [`FARTHEST`](super::FARTHEST).
    #[error(
        "object {object}: vertex {vertex} is at {position:?}; pictures are made in single precision, which reaches to {}: use a larger unit",
        crate::FARTHEST
    )]
    TooFar {
        /// Index of the object.
        object: usize,
        /// Index of the vertex.
        vertex: usize,
        /// Where it is.
        position: [f64; 3],
    },
    /// No coordinate of any subject is as large as [`SMALLEST`](super::SMALLEST).
    #[error(
        "no coordinate of the scene's objects is beyond {reach:e}; pictures are made in single precision, which reaches down to {:e}: use a smaller unit",
        crate::SMALLEST
    )]
    TooSmall {
        /// The largest.
        reach: f32,
    },
    /// Curvature that belongs to another mesh.
    #[error("object {object}: curvature of {found} vertices for a mesh of {vertices}")]
    CurvatureLength {
        /// Index of the object.
        object: usize,
        /// Entries.
        found: usize,
        /// Vertices.
        vertices: usize,
    },
    /// More triangles than there are numbers for them.
    #[error(
        "object {object}: {triangles} triangles with those of the objects before it; a scene has at most 2^32"
    )]
    TooMany {
        /// Index of the object.
        object: usize,
        /// Triangles so far.
        triangles: u64,
    },
    /// An effect that this build was made without, see [`EFFECTS`](crate::EFFECTS).
    #[error(
        "the scene calls for {effect} ({reason}), which this build lacks; build it without OSCULATE_WITHOUT"
    )]
    Lacking {
        /// Which one.
        effect: &'static str,
        /// Why it is called for.
        reason: String,
    },
    /// An image without pixels, or larger than any use.
    #[error("an image of {width} x {height} pixels; each side must be 1 to 32768")]
    ImageSize {
        /// Width.
        width: u32,
        /// Height.
        height: u32,
    },
}

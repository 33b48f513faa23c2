//! Microstructures: what lies under the bounding surface.
//!
//! One tile covers the unit square of UV and repeats. It is either a [`HeightField`] with [`Maps`] or a [`TileMesh`].

mod height_field;
pub mod import;
mod maps;
pub mod measured;
pub mod pattern;
pub mod preview;
mod provenance;
mod recipes;
mod seam;
mod statistics;
mod tile_mesh;

pub use height_field::HeightField;
pub use maps::{Grid, Maps, Reflectance};
pub use recipes::{BUILTINS, Builtin, DEFAULT_RESOLUTION};
pub use seam::{Seam, SeamReport};
pub use statistics::{FieldReport, MeshReport, MicroReport, SlopeReport};
pub use tile_mesh::{TileMesh, TileTriangle};

/// A material's geometry and reflectance on one tile.
#[derive(Debug, Clone)]
pub struct Microstructure {
    /// A short name for reports.
    pub name: String,
    /// What a ray can hit.
    pub geometry: Geometry,
}

impl Microstructure {
    /// The procedural material of a name, see [`BUILTINS`]; height fields have [`DEFAULT_RESOLUTION`] texels a side.
    #[must_use]
    pub fn builtin(name: &str) -> Option<Self> {
        Builtin::find(name).map(|builtin| builtin.build(DEFAULT_RESOLUTION))
    }

    /// The same material with another depth in UV units; `None` for a mesh, which has its own.
    ///
    /// # Panics
    ///
    /// If the depth is not positive and finite.
    #[must_use]
    pub fn with_depth(self, depth: f32) -> Option<Self> {
        let Geometry::HeightField(field) = self.geometry else { return None };
        Some(Self { geometry: Geometry::HeightField(field.with_depth(depth)), ..self })
    }

    /// Names of all procedural materials.
    pub fn builtin_names() -> impl Iterator<Item = &'static str> {
        BUILTINS.iter().map(|builtin| builtin.name)
    }
}

/// The geometry of a microstructure.
#[derive(Debug, Clone)]
pub enum Geometry {
    /// One height over each point; opaque.
    HeightField(HeightField),
    /// Any triangles between `z = -depth` and 0; rays may pass through.
    TileMesh(TileMesh),
}

impl Geometry {
    /// Distance between the bounding surface and the deepest point that the geometry may have, in UV units.
    #[must_use]
    pub fn depth(&self) -> f32 {
        match self {
            Self::HeightField(field) => field.depth(),
            Self::TileMesh(mesh) => mesh.depth(),
        }
    }
}

//! [`SilhouetteMaterial`]: a silhouette BTF as the material of a mesh.

use std::fmt;
use std::sync::Arc;

use osculate_geom::field::FilterKind;
use osculate_sbtf::SilhouetteBtf;
use osculate_sbtf::sampling::Sampler;
use serde::{Deserialize, Serialize};

/// A material whose query knows the curvature of the surface it lies under. It shades front faces only and may let rays pass.
#[derive(Clone)]
pub struct SilhouetteMaterial {
    /// What answers the queries.
    pub btf: Arc<dyn SilhouetteBtf + Send + Sync>,
    /// Depth of the material in tiles, for the plan and the walks over the mesh.
    pub depth: f32,
    /// Tiles per UV unit of the mesh, along u and v; positive.
    pub tiles: [f32; 2],
    /// World length of a tile, positive: with [`Self::depth`] it fixes how deep the material is in the world.
    pub tile_size: f32,
    /// Where directions to the light are drawn from.
    pub sampler: Arc<Sampler>,
    /// What is handed over of the ray's way.
    pub query: QueryForm,
}

impl fmt::Debug for SilhouetteMaterial {
    fn fmt(&self, f: &mut fmt::Formatter<'_>) -> fmt::Result {
        f.debug_struct("SilhouetteMaterial")
            .field("depth", &self.depth)
            .field("tiles", &self.tiles)
            .field("tile_size", &self.tile_size)
            .field("query", &self.query)
            .finish_non_exhaustive()
    }
}

/// What a silhouette BTF is told of the ray's way below the bounding surface.
#[derive(Debug, Clone, Copy, PartialEq, Eq, Default, Serialize, Deserialize)]
#[serde(rename_all = "snake_case")]
pub enum QueryForm {
    /// Curvature from the scene's filter, and UV that go on as they do at the entry point (Kuznetsov et al. 2022, Sec. 4.2).
    Paper,
    /// Also the mean rate at which UV change along the chord, where the filter finds it; see
    /// [`Filter::Chord`](osculate_geom::field::Filter::Chord).
    #[default]
    Chord,
}

impl QueryForm {
    /// The form that makes use of all that a filter finds.
    #[must_use]
    pub fn of_filter(filter: FilterKind) -> Self {
        match filter {
            FilterKind::Chord | FilterKind::BakedChord => Self::Chord,
            FilterKind::Point | FilterKind::March | FilterKind::Baked => Self::Paper,
        }
    }
}

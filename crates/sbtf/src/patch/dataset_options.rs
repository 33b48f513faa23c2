//! [`DatasetOptions`]: which samples there are, and why there can be none.

use thiserror::Error;

use super::{GrazingOptions, TileOptions, TransportOptions};

/// What samples there are.
#[derive(Debug, Clone, PartialEq)]
pub struct DatasetOptions {
    /// Curvatures, 1/UV units. Default -2.5 to 2.5.
    pub kappa_range: [f32; 2],
    /// How colours are found, and opacities of tile meshes.
    pub tracing: Tracing,
    /// Number of different patches, that is of curvatures and directions; `None`, the default, never repeats one. The paper has 2,400.
    pub patches: Option<u64>,
    /// Patches in a batch, where there are patches: of triangles, or a number of them. Each appears in so many batches one after the
    /// other, so that one is made per batch. Default 8; the paper's protocol is 1.
    pub patches_per_batch: u64,
    /// Share of the opacity samples of tile meshes on convex patches that graze, evenly in dip; the others are even over the
    /// hemisphere, since holes are seen from everywhere. Default 0.1.
    pub grazing: f32,
    /// What opacity samples of tile meshes say of the silhouette cosine.
    pub silhouettes: Silhouettes,
    /// Transport.
    pub transport: TransportOptions,
    /// Triangulation; `largest_curvature` is taken from `kappa_range`.
    pub tile: TileOptions,
    /// Everything random follows from it.
    pub seed: u64,
}

/// What opacity samples of tile meshes say of the silhouette cosine. Those of height fields always have it.
#[derive(Debug, Clone, Copy, PartialEq)]
pub enum Silhouettes {
    /// NaN: enough for the direct head.
    Unknown,
    /// It is searched by tracing, some fifty rays a sample; NaN where opacity is no step.
    Traced(GrazingOptions),
}

/// How colours are found, and opacities of tile meshes.
#[derive(Debug, Clone, Copy, PartialEq, Eq)]
pub enum Tracing {
    /// Through the field or mesh as it is bent for each sample on its own.
    March,
    /// By rays in the triangles of patches, which samples share.
    Triangles,
}

impl Default for DatasetOptions {
    fn default() -> Self {
        Self {
            kappa_range: [-2.5, 2.5],
            tracing: Tracing::March,
            patches: None,
            patches_per_batch: 8,
            grazing: 0.1,
            silhouettes: Silhouettes::Unknown,
            transport: TransportOptions::default(),
            tile: TileOptions::default(),
            seed: 0,
        }
    }
}

impl DatasetOptions {
    /// The size in the paper, section 4.4: 2,400 patches, each of which fills one batch of 65,536 queries.
    #[must_use]
    pub fn paper() -> Self {
        Self { patches: Some(2400), patches_per_batch: 1, ..Self::default() }
    }

    pub(super) fn check(&self) -> Result<(), DatasetError> {
        let [least, most] = self.kappa_range;
        if !(least.is_finite() && most.is_finite() && least <= most) {
            return Err(DatasetError::KappaRange(least, most));
        }
        for (name, is_zero) in [
            ("the number of patches", self.patches == Some(0)),
            ("the number of patches per batch", self.patches_per_batch == 0),
            ("the number of bounces", self.transport.bounces == 0),
        ] {
            if is_zero {
                return Err(DatasetError::Zero(name));
            }
        }
        Ok(())
    }
}

/// Why there can be no dataset.
#[derive(Debug, Error, PartialEq)]
pub enum DatasetError {
    /// The range of curvatures is not one.
    #[error("the range of curvatures {0} to {1} is not finite or not ascending")]
    KappaRange(f32, f32),
    /// A count is zero.
    #[error("{0} must not be 0")]
    Zero(&'static str),
    /// Rays that look straight down do not hit it.
    #[error("{name}: none of {tries} rays hits the material")]
    NothingToHit {
        /// The microstructure.
        name: String,
        /// Rays that were tried.
        tries: u32,
    },
}

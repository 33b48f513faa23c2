//! Meshes with curvature as files: `.glb` for viewers and the renderer, `.ply` for tools that read properties.
//!
//! Both hold one row per vertex of the source mesh, in its order, unused vertices included. Curvature is equal on all
//! copies that a UV or normal seam makes of one position.
//!
//! | | `.glb` | `.ply` |
//! |---|---|---|
//! | `kappa_max`, `kappa_min` | `_CURVATURE`, VEC2 float | `k1`, `k2` |
//! | direction of `kappa_max` | `_CURVATURE_DIR`, VEC3 float, unit | `d1x` `d1y` `d1z` |
//! | direction of `kappa_min` | `NORMAL x _CURVATURE_DIR`, not stored | `d2x` `d2y` `d2z` |
//! | estimated absolute error | `_CURVATURE_ERROR`, SCALAR float | `curvature_error` |
//! | [`Status`](crate::curvature::Status) | `_CURVATURE_STATUS`, SCALAR unsigned byte | `curvature_status` |
//! | lowering by the filter, N azimuths, if baked | `_CURVATURE_FILTER_0` .. `_CURVATURE_FILTER_(N / 4 - 1)`, VEC4 float | `filter_0` .. `filter_(N - 1)` |
//! | bound on that | `_CURVATURE_FILTER_BOUND`, SCALAR float | `filter_bound` |
//! | [`Provenance`] | `osculate` in the asset's extras | JSON over lines `comment osculate ...` |
//!
//! A vertex without an estimate has curvature 0, a direction across its normal, and as error the largest finite value
//! of the float type, because glTF forbids infinities; the value just below means an estimate of unknown error.
//!
//! Value `k` of the filter's rows is by how much the minimum past the vertex is below the curvature there, on the way into
//! the direction `cos(2 pi k / N) d1 + sin(2 pi k / N) d2`; see [`BakedMinimum`](crate::field::BakedMinimum) and
//! [`SkipBounds`](crate::field::SkipBounds). The largest finite bound stands for none.
//!
//! What a round trip keeps: every bit of what the file holds. Reading a file and writing what was read gives the same
//! bytes. What it loses: a `.glb` rounds to 32-bit floats; a `.ply` has no materials, texture images or parts.

mod baked_mesh;
mod error;
mod filter_rows;
mod float;
mod glb_read;
mod glb_write;
mod ply;
mod rows;
mod run;

use std::path::Path;

pub use baked_mesh::{BakedMesh, FORMAT_VERSION, Facing, NormalSource, Provenance, Source, Units};
pub use error::{ReadError, WriteError};
pub use filter_rows::{FilterOptions, FilterRecord, FilterRows};
pub(crate) use float::nearest_f32;
pub use glb_write::write_glb;
pub use ply::{Precision, write_ply};
pub use run::{BakeOptions, bake};

/// Reads a `.glb` or `.ply` that [`write_glb`] or [`write_ply`] wrote.
///
/// # Errors
///
/// [`ReadError::NotBaked`] for a readable file without baked curvature, and otherwise what is wrong with it.
pub fn read_baked(path: &Path) -> Result<BakedMesh, ReadError> {
    let extension = path.extension().unwrap_or_default().to_string_lossy().to_lowercase();
    match extension.as_str() {
        "glb" => read_baked_glb(&std::fs::read(path)?),
        "ply" => read_baked_ply(&std::fs::read(path)?),
        _ => Err(ReadError::Extension(extension)),
    }
}

pub use glb_read::read_baked_glb;
pub use ply::read_baked_ply;

#[cfg(test)]
mod tests;

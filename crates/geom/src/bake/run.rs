//! From a mesh to a bake.

use super::{BakedMesh, Facing, FilterOptions, FilterRows, NormalSource, Provenance, Source};
use crate::Mesh;
use crate::curvature::{CurvatureOptions, OptionsError, estimate};
use crate::field::CurvatureField;
use crate::mesh::{Surface, Weld};

/// How a mesh is baked.
#[derive(Debug, Clone, Copy, PartialEq, Default)]
pub struct BakeOptions {
    /// The estimator and its options.
    pub curvature: CurvatureOptions,
    /// Which vertices are merged before the estimate. Default: those of equal position.
    pub weld: Weld,
    /// Whether to turn the surface over first. Default: kept.
    pub facing: Facing,
    /// Whether to bake the minimum filter too. Default: no.
    pub filter: Option<FilterOptions>,
}

/// Estimates the curvature of a mesh and spreads it over the copies that seams make of a vertex.
///
/// Runs on rayon's current pool; the same bits for any number of threads.
///
/// # Errors
///
/// Options out of range.
pub fn bake(mesh: Mesh, source: Source, options: &BakeOptions) -> Result<BakedMesh, OptionsError> {
    let mesh = match options.facing {
        Facing::Kept => mesh,
        Facing::Flipped => mesh.flipped(),
    };
    // All of it by a thread of the pool, so that no step begins with one that has to wake up.
    rayon::scope(|_| bake_in_pool(mesh, source, options))
}

fn bake_in_pool(mesh: Mesh, source: Source, options: &BakeOptions) -> Result<BakedMesh, OptionsError> {
    let surface = Surface::new(&mesh, options.weld);
    let estimated = estimate(&surface, &options.curvature)?;
    let filter = options.filter.map(|filter| {
        let field = CurvatureField::new(surface.clone(), &estimated[..]);
        FilterRows::bake(&field, &filter)
    });
    let curvature = surface.spread(estimated);
    let mut provenance = Provenance::new(source, options.curvature);
    provenance.weld = options.weld;
    provenance.facing = options.facing;
    provenance.normals = if mesh.normals().is_some() { NormalSource::File } else { NormalSource::Computed };
    drop(surface);
    let baked = BakedMesh::new(mesh, curvature, provenance);
    Ok(match filter {
        Some((rows, record)) => baked.with_filter(rows, record),
        None => baked,
    })
}

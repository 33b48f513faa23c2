//! The table of the minimum filter and the bounds of walks, per vertex of a baked mesh.

use serde::{Deserialize, Serialize};

use crate::field::{BakedError, BakedMinimum, CurvatureField, SkipBounds, WalkLength};
use crate::mesh::Surface;

/// How the filter is baked.
#[derive(Debug, Clone, Copy, PartialEq)]
pub struct FilterOptions {
    /// Directions per vertex: one of [`BakedMinimum::AZIMUTHS`].
    pub azimuths: usize,
    /// How far past a vertex to look. Default: [`WalkLength::of_mesh`].
    pub walk: Option<WalkLength>,
}

/// How a filter was baked, and how good it is.
#[derive(Debug, Clone, Copy, PartialEq, Serialize, Deserialize)]
pub struct FilterRecord {
    /// Directions per vertex.
    pub azimuths: usize,
    /// How far past a vertex the walks went.
    pub walk: WalkLength,
    /// The longest walk that the bounds hold for, world units.
    pub bound_length: f64,
    /// How far the table is from the walk, 1/length; `None` on a mesh without area.
    pub error: Option<BakedError>,
}

/// What is baked of the filter: one row per mesh vertex, equal on the copies that a seam makes of one vertex.
#[derive(Debug, Clone, PartialEq)]
pub struct FilterRows {
    azimuths: usize,
    lowering: Vec<f32>,
    bound: Vec<f32>,
}

/// Queries that the error of a table is measured on: enough for a 99 % quantile to within a few hundredths of itself.
const ERROR_QUERIES: usize = 1 << 14;

impl FilterRows {
    /// Joins `azimuths` values by which a walk lowers the curvature, and one bound on that, per vertex. `None` if the number of
    /// azimuths is not one of [`BakedMinimum::AZIMUTHS`], the lengths do not agree, or a value is negative or not finite.
    #[must_use]
    pub fn new(azimuths: usize, lowering: Vec<f32>, bound: Vec<f32>) -> Option<Self> {
        let fits = BakedMinimum::AZIMUTHS.contains(&azimuths) && lowering.len() == azimuths * bound.len();
        let is_valid = |values: &[f32]| values.iter().copied().all(is_valid);
        (fits && is_valid(&lowering) && is_valid(&bound)).then_some(Self { azimuths, lowering, bound })
    }

    /// Bakes the filter of a field.
    ///
    /// # Panics
    ///
    /// If the number of azimuths is not offered.
    #[must_use]
    pub fn bake(field: &CurvatureField<'_>, options: &FilterOptions) -> (Self, FilterRecord) {
        let (surface, diagonal) = (field.surface(), field.diagonal());
        let walk = options.walk.unwrap_or_else(|| WalkLength::of_mesh(diagonal));
        let table = BakedMinimum::new(field, options.azimuths, walk);
        let bounds = SkipBounds::new(field, walk.nominal(diagonal));
        let longest = table.walk().longest(diagonal);
        let error = if longest <= bounds.length() {
            table.error(field, &bounds, ERROR_QUERIES)
        } else {
            table.error(field, &SkipBounds::new(field, longest), ERROR_QUERIES)
        };
        let row = |vertex| table.row(vertex).expect("the table is filled");
        let rows = (0..surface.positions().len()).map(row).collect();
        let lowering = surface.spread::<Vec<f32>>(rows).concat();
        let bound = surface.spread(bounds.per_vertex(surface));
        let record = FilterRecord {
            azimuths: options.azimuths,
            walk: table.walk(),
            bound_length: bounds.length(),
            error,
        };
        (Self { azimuths: options.azimuths, lowering, bound }, record)
    }

    /// Directions per vertex.
    #[must_use]
    pub fn azimuths(&self) -> usize {
        self.azimuths
    }

    /// By how much a walk lowers the curvature, `azimuths` values per mesh vertex, 1/length.
    #[must_use]
    pub fn lowering(&self) -> &[f32] {
        &self.lowering
    }

    /// Bound on the effect of a walk from any triangle around each mesh vertex, 1/length.
    #[must_use]
    pub fn bound(&self) -> &[f32] {
        &self.bound
    }

    /// The table on a surface of the mesh.
    ///
    /// # Panics
    ///
    /// If the surface belongs to another mesh.
    #[must_use]
    pub fn minimum(&self, surface: &Surface<'_>, walk: WalkLength) -> BakedMinimum {
        let rows = first_copies(surface, self.bound.len());
        let lowering = rows.flat_map(|v| self.lowering[v * self.azimuths..][..self.azimuths].iter().copied());
        BakedMinimum::from_rows(self.azimuths, lowering.collect(), walk)
            .expect("checked when the rows were made")
    }

    /// The bounds on a surface of the mesh, for walks of at most `length`.
    ///
    /// # Panics
    ///
    /// If the surface belongs to another mesh.
    #[must_use]
    pub fn bounds(&self, surface: &Surface<'_>, length: f64) -> SkipBounds {
        let per_vertex: Vec<f32> = first_copies(surface, self.bound.len()).map(|v| self.bound[v]).collect();
        SkipBounds::from_vertices(surface, &per_vertex, length)
    }
}

/// The first mesh vertex of each surface vertex.
fn first_copies(surface: &Surface<'_>, vertices: usize) -> impl Iterator<Item = usize> {
    let mut first = vec![usize::MAX; surface.positions().len()];
    for vertex in (0..vertices).rev() {
        first[surface.surface_from_vertex(vertex)] = vertex;
    }
    first.into_iter()
}

/// Whether a value may stand in a row.
pub(super) fn is_valid(x: f32) -> bool {
    x.is_finite() && x >= 0.0
}

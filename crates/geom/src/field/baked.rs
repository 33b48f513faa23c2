//! The minimum filter in a table: precomputed per vertex for a set of azimuths.
//!
//! The table holds by how much the walk lowers the curvature, not the curvature itself: what the ray's direction does at the
//! point is known exactly and costs little, and what is left is small, never negative and mostly smooth. It is interpolated
//! linearly in the azimuth, at each corner in that corner's own frame of principal directions, and then over the triangle.
//!
//! # How far off it is
//!
//! By [`SkipBounds`], a walk lowers the section's curvature by an amount in `[0, V]` from every point of a triangle, its
//! corners included. The interpolated amount is a mean of such amounts. So the table is never further than `V` from the walk of the
//! same length. That holds always and says little; how far off it typically is is measured on spread queries, and both are
//! reported ([`BakedError`]).

use rayon::prelude::*;
use serde::{Deserialize, Serialize};

use super::azimuths::{Around, Between};
use super::corners::Corners;
use super::march::minimum_past;
use super::queries::spread_queries;
use super::skip::SkipBounds;
use super::start::Start;
use super::surface_field::CurvatureField;
use super::walk_length::WalkLength;
use crate::bake::nearest_f32;

/// For every surface vertex, by how much the minimum filter lowers the curvature in a number of directions.
#[derive(Debug, Clone, PartialEq)]
pub struct BakedMinimum {
    azimuths: usize,
    /// `azimuths` per surface vertex, 1/length, not negative.
    lowering: Vec<f32>,
    walk: WalkLength,
}

/// How far a table is from the walk that it replaces, 1/length.
#[derive(Debug, Clone, Copy, PartialEq, Serialize, Deserialize)]
pub struct BakedError {
    /// Queries that it was measured on: points even over the area, directions even over the hemisphere.
    pub queries: usize,
    /// Half of them are off by at most this.
    pub median: f64,
    /// 99 % of them are.
    pub p99: f64,
    /// The worst of them.
    pub max: f64,
    /// No query is off by more: proved, see [`SkipBounds`]. `None` where a triangle has no bound.
    pub proved: Option<f64>,
}

impl BakedMinimum {
    /// How many azimuths a table may have.
    pub const AZIMUTHS: [usize; 4] = [4, 8, 16, 32];

    /// From `azimuths` values per surface vertex: by how much the curvature is lowered on the way into the direction
    /// `cos(2 pi k / azimuths) d1 + sin(2 pi k / azimuths) d2`. `None` if the number of azimuths is not one of
    /// [`AZIMUTHS`](Self::AZIMUTHS), the number of values is no multiple of it, or a value is negative or not finite.
    #[must_use]
    pub fn from_rows(azimuths: usize, lowering: Vec<f32>, walk: WalkLength) -> Option<Self> {
        let fits = Self::AZIMUTHS.contains(&azimuths) && lowering.len().is_multiple_of(azimuths);
        let is_valid = fits && lowering.iter().all(|x| x.is_finite() && *x >= 0.0);
        is_valid.then_some(Self { azimuths, lowering, walk })
    }

    /// Directions per vertex.
    #[must_use]
    pub fn azimuths(&self) -> usize {
        self.azimuths
    }

    /// The values of a surface vertex.
    ///
    /// # Panics
    ///
    /// If it is out of range.
    #[must_use]
    pub fn row(&self, vertex: usize) -> &[f32] {
        &self.lowering[vertex * self.azimuths..][..self.azimuths]
    }

    /// How far the walks went that the table replaces.
    #[must_use]
    pub fn walk(&self) -> WalkLength {
        self.walk
    }

    /// Bytes that it takes.
    #[must_use]
    pub fn bytes(&self) -> usize {
        size_of_val(&*self.lowering)
    }

    /// Whether so many questions about a mesh with so many vertices are answered sooner with a table of 16 directions than by walks.
    #[must_use]
    pub fn pays(questions: u64, vertices: usize) -> bool {
        /// A table takes as long as this many of them per vertex save.
        const PER_VERTEX: u64 = 100;
        questions >= PER_VERTEX * vertices as u64
    }

    /// The filtered curvature of a ray: the lesser of that along it, and the section's less what the table has for its way.
    pub(super) fn kappa(&self, field: &CurvatureField<'_>, start: &Start) -> f64 {
        let Some(at) = &start.section else { return start.along(field) };
        let corners = Corners::of(field, start.point).expect("a corner has an estimate");
        let [lowering] = corners.mean_at(|vertex, principal| {
            let row = self.row(vertex);
            [Between::new(principal, &at.forward, self.azimuths).mix(|k| f64::from(row[k]))]
        });
        // Steep rays see another curvature than the section has, and only the section's is lowered on the way.
        start.along(field).min(at.kappa - lowering)
    }

    /// Measures how far the table is from the walk, on `queries` spread queries. `None` without any.
    ///
    /// `bounds` are for the proof, so they must hold for the longest walk of the table's rule.
    ///
    /// # Panics
    ///
    /// If they do not.
    #[must_use]
    pub fn error(
        &self,
        field: &CurvatureField<'_>,
        bounds: &SkipBounds,
        queries: usize,
    ) -> Option<BakedError> {
        assert!(
            bounds.length() >= self.walk.longest(field.diagonal()),
            "bounds for shorter walks prove nothing"
        );
        let spread = spread_queries(field, queries, self.walk);
        let errors = spread.par_iter().filter_map(|query| {
            let start = Start::new(field, query.point, query.w)?;
            let length = self.walk.resolve(start.along(field), start.cosine, field.diagonal());
            let march = minimum_past(field, &start, length);
            Some((march.kappa - self.kappa(field, &start)).abs())
        });
        let mut errors: Vec<f64> = errors.collect();
        errors.sort_unstable_by(f64::total_cmp);
        let largest = bounds.bounds().iter().copied().fold(0.0, f32::max);
        Some(BakedError {
            queries: errors.len(),
            median: quantile(&errors, 0.5)?,
            p99: quantile(&errors, 0.99)?,
            max: *errors.last()?,
            proved: (largest < SkipBounds::UNKNOWN).then_some(f64::from(largest)),
        })
    }
}

/// Nearest rank in sorted values.
pub(super) fn quantile(sorted: &[f64], share: f64) -> Option<f64> {
    #[allow(clippy::cast_possible_truncation, clippy::cast_sign_loss, reason = "a share of a length")]
    let rank = (share * sorted.len() as f64).ceil() as usize;
    sorted.get(rank.max(1) - 1).copied()
}

/// Walks from every vertex in `azimuths` directions, evenly spaced from the direction of the larger principal curvature.
///
/// A vertex without an estimate, or without a triangle, has zeros. The same bits for any number of threads.
///
/// # Panics
///
/// If `azimuths` is not one of [`BakedMinimum::AZIMUTHS`].
#[must_use]
pub fn bake_minimum(field: &CurvatureField<'_>, azimuths: usize, walk: WalkLength) -> BakedMinimum {
    assert!(BakedMinimum::AZIMUTHS.contains(&azimuths), "{azimuths} azimuths are not offered");
    let walk = walk.for_table();
    let row = |around: Option<Around<'_>>| -> Vec<f32> {
        let lowered = |k: usize| {
            let azimuth = std::f64::consts::TAU * k as f64 / azimuths as f64;
            let start = around.as_ref()?.start(field, azimuth, 0.0)?;
            let length = walk.resolve(start.along(field), start.cosine, field.diagonal());
            Some(nearest_f32((start.kappa(field) - minimum_past(field, &start, length).kappa).max(0.0)))
        };
        (0..azimuths).map(|k| lowered(k).unwrap_or(0.0)).collect()
    };
    let lowering = Around::every_vertex(field).map(row).collect::<Vec<_>>().concat();
    BakedMinimum { azimuths, lowering, walk }
}

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
//! same length, but for rounding: it answers in single precision, which is off by some 1e-6 of the largest curvature at the corners, over the
//! sine of the ray to the normal. That holds always and says little; how far off it typically is is measured on spread queries, and both
//! are reported ([`BakedError`]).

use std::sync::atomic::AtomicU32;
use std::sync::atomic::Ordering::Relaxed;

use rayon::prelude::*;
use serde::{Deserialize, Serialize};

use super::azimuths::{Around, Between, FirstTriangles};
use super::glance::Glance;
use super::march::minimum_past;
use super::queries::spread_queries;
use super::skip::SkipBounds;
use super::start::Start;
use super::surface_field::CurvatureField;
use super::walk_length::WalkLength;
use crate::bake::nearest_f32;

/// For every surface vertex, by how much the minimum filter lowers the curvature in a number of directions, in single precision: curvatures have
/// to be in its range.
#[derive(Debug)]
pub struct BakedMinimum {
    azimuths: usize,
    /// Bits of `azimuths` numbers per surface vertex, 1/length, not negative. Whoever finds an [`UNKNOWN`] one computes it; two threads that do
    /// so at the same time write the same bits.
    lowering: Vec<AtomicU32>,
    /// Where fans begin, for what is unknown; `None` if nothing is.
    first: Option<FirstTriangles>,
    walk: WalkLength,
}

/// Bits of no number that a table holds.
const UNKNOWN: u32 = u32::MAX;

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
    /// No query is off by more, but for rounding to single precision: proved, see [`SkipBounds`]. `None` where a triangle has no bound.
    pub proved: Option<f64>,
}

impl PartialEq for BakedMinimum {
    /// The same walks, and the same of them known.
    fn eq(&self, other: &Self) -> bool {
        let bits = |table: &Self| table.lowering.iter().map(|x| x.load(Relaxed)).collect::<Vec<_>>();
        (self.azimuths, self.walk, bits(self)) == (other.azimuths, other.walk, bits(other))
    }
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
        let bits = lowering.into_iter().map(|x| AtomicU32::new(x.to_bits()));
        is_valid.then(|| Self { azimuths, lowering: bits.collect(), first: None, walk })
    }

    /// Walks from every vertex in `azimuths` directions, evenly spaced from the direction of the larger principal curvature.
    ///
    /// A vertex without an estimate, or without a triangle, has zeros. The same bits for any number of threads.
    ///
    /// # Panics
    ///
    /// If `azimuths` is not one of [`AZIMUTHS`](Self::AZIMUTHS).
    #[must_use]
    pub fn new(field: &CurvatureField<'_>, azimuths: usize, walk: WalkLength) -> Self {
        let table = Self::on_demand(field, azimuths, walk);
        table.fill(field);
        table
    }

    /// The same, but walks are taken when they are asked for first: where no ray goes costs nothing. Answers are the same bits. `field` must be
    /// the one that the table is asked with.
    ///
    /// # Panics
    ///
    /// If `azimuths` is not one of [`AZIMUTHS`](Self::AZIMUTHS).
    #[must_use]
    pub fn on_demand(field: &CurvatureField<'_>, azimuths: usize, walk: WalkLength) -> Self {
        assert!(Self::AZIMUTHS.contains(&azimuths), "{azimuths} azimuths are not offered");
        let entries = field.surface().positions().len() * azimuths;
        let lowering = (0..entries).into_par_iter().map(|_| AtomicU32::new(UNKNOWN)).collect();
        Self { azimuths, lowering, first: Some(FirstTriangles::new(field)), walk: walk.for_table() }
    }

    /// Takes all walks that have not been asked for, in parallel. `field` must be that of all other questions.
    pub fn fill(&self, field: &CurvatureField<'_>) {
        self.lowering.par_chunks(self.azimuths).enumerate().for_each(|(vertex, row)| {
            let unknown = |place: &AtomicU32| place.load(Relaxed) == UNKNOWN;
            if row.iter().any(unknown) {
                let around = self.around(field, vertex);
                for (azimuth, place) in row.iter().enumerate().filter(|(_, place)| unknown(place)) {
                    place.store(self.walked(field, around.as_ref(), azimuth).to_bits(), Relaxed);
                }
            }
        });
    }

    /// By how much the walk lowers the curvature at a vertex in a direction.
    fn lowering(&self, field: &CurvatureField<'_>, vertex: usize, azimuth: usize) -> f32 {
        let place = &self.lowering[vertex * self.azimuths + azimuth];
        let known = place.load(Relaxed);
        if known != UNKNOWN {
            return f32::from_bits(known);
        }
        let lowered = self.walked(field, self.around(field, vertex).as_ref(), azimuth);
        place.store(lowered.to_bits(), Relaxed);
        lowered
    }

    /// `None` for a vertex without an estimate, or without a triangle.
    fn around<'p>(&self, field: &'p CurvatureField<'_>, vertex: usize) -> Option<Around<'p>> {
        Around::vertex(field, self.first.as_ref()?, vertex)
    }

    /// What a walk finds; zero where there is none.
    fn walked(&self, field: &CurvatureField<'_>, around: Option<&Around<'_>>, azimuth: usize) -> f32 {
        let angle = std::f64::consts::TAU * azimuth as f64 / self.azimuths as f64;
        let Some(start) = around.and_then(|around| around.start(field, angle, 0.0)) else { return 0.0 };
        let length = self.walk.resolve(start.along(field), start.cosine, field.diagonal());
        nearest_f32((start.kappa(field) - minimum_past(field, &start, length).kappa).max(0.0))
    }

    /// Directions per vertex.
    #[must_use]
    pub fn azimuths(&self) -> usize {
        self.azimuths
    }

    /// The values of a surface vertex; `None` if not all are known yet.
    ///
    /// # Panics
    ///
    /// If it is out of range.
    #[must_use]
    pub fn row(&self, vertex: usize) -> Option<Vec<f32>> {
        let bits = self.lowering[vertex * self.azimuths..][..self.azimuths].iter().map(|x| x.load(Relaxed));
        bits.map(|bits| (bits != UNKNOWN).then(|| f32::from_bits(bits))).collect()
    }

    /// How far the walks went that the table replaces.
    #[must_use]
    pub fn walk(&self) -> WalkLength {
        self.walk
    }

    /// Pairs of vertex and direction in which walks have been taken.
    #[must_use]
    pub fn known(&self) -> usize {
        self.lowering.iter().filter(|x| x.load(Relaxed) != UNKNOWN).count()
    }

    /// Bytes that it takes.
    #[must_use]
    pub fn bytes(&self) -> usize {
        size_of_val(&*self.lowering) + self.first.as_ref().map_or(0, FirstTriangles::bytes)
    }

    /// Whether so many questions about a mesh with so many vertices are answered sooner with a table of 16 directions on demand than by walks.
    #[must_use]
    pub fn pays(questions: u64, vertices: usize) -> bool {
        /// What rays ask for of a table takes as long as this many of them per vertex save.
        const PER_VERTEX: u64 = 60;
        questions >= PER_VERTEX * vertices as u64
    }

    /// The filtered curvature of a ray: the lesser of that along it, and the section's less what the table has for its way.
    pub(super) fn kappa(&self, field: &CurvatureField<'_>, glance: &Glance) -> f64 {
        let Some(at) = &glance.section else { return glance.along() };
        let mut lowering = 0.0;
        for (vertex, weight, turn) in glance.turns(at.forward) {
            for (azimuth, share) in Between::new(turn, self.azimuths).shares() {
                lowering += f64::from(weight * share) * f64::from(self.lowering(field, vertex, azimuth));
            }
        }
        // Steep rays see another curvature than the section has, and only the section's is lowered on the way.
        glance.along().min(glance.kappa(at, 0.0) - lowering)
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
            Some((march.kappa - self.kappa(field, &Glance::new(field, query.point, &query.w)?)).abs())
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

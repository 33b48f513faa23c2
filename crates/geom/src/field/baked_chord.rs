//! The chord query in a table: precomputed per vertex for a set of azimuths and elevations.
//!
//! The table holds what a walk adds to what is known at the point, not the answer itself: to the curvature of the section, and to the UV
//! rate of the triangle. Both are zero for short chords, so that steep rays lose nothing, and vary slowly over a mesh that
//! resolves its surface. They are interpolated linearly in azimuth and in the root of the ray's cosine, at each corner in that corner's own
//! frame of principal directions, and then over the triangle.
//!
//! A chord jumps where the ray passes from coming out again to dying below the material; the table makes a slope of that, as wide as
//! its step in elevation.

mod ground;
mod spoke;

use std::sync::OnceLock;

use rayon::prelude::*;
use serde::{Deserialize, Serialize};

use ground::Ground;
use spoke::Spoke;

use super::azimuths::{Around, Between, FirstTriangles};
use super::baked::quantile;
use super::chord::{PACE, chord};
use super::glance::{Glance, widen};
use super::queries::spread_queries;
use super::start::Start;
use super::surface_field::CurvatureField;
use super::walk_length::WalkLength;

/// Per direction and elevation: a curvature, and the two components of a UV rate.
const VALUES: usize = 3;
/// Elevations that are kept; the one after them, normal incidence, has zeros.
const ELEVATIONS: usize = 6;

/// For every surface vertex, what chords add in a number of directions and elevations to the curvature and the UV rate at the vertex.
#[derive(Debug, Clone, PartialEq)]
pub struct BakedChord {
    azimuths: usize,
    walk: WalkLength,
    first: FirstTriangles,
    /// Per surface vertex, once it was asked for: per azimuth, once that was.
    vertices: Vec<OnceLock<Box<[OnceLock<Spoke>]>>>,
}

/// How far a table is from the chords that it replaces.
#[derive(Debug, Clone, Copy, PartialEq, Serialize, Deserialize)]
pub struct BakedChordError {
    /// Queries that it was measured on: points even over the area, directions even over the hemisphere.
    pub queries: usize,
    /// Of the curvature, 1/length: what half of the queries are off by at most.
    pub kappa_median: f64,
    /// What 99 % of them are.
    pub kappa_p99: f64,
    /// Of the UV rate, relative to it; zero without UV.
    pub rate_median: f64,
    /// What 99 % of them are.
    pub rate_p99: f64,
}

impl BakedChord {
    /// Directions per vertex, by default.
    pub const AZIMUTHS: usize = 12;

    /// Follows chords from every vertex in `azimuths` directions, evenly spaced from the direction of the larger principal curvature, and
    /// at six elevations each. `walk` is how far they go.
    ///
    /// A vertex without an estimate, or without a triangle, has zeros. The same bits for any number of threads.
    ///
    /// # Panics
    ///
    /// If `azimuths` is zero.
    #[must_use]
    pub fn new(field: &CurvatureField<'_>, azimuths: usize, walk: WalkLength) -> Self {
        let table = Self::on_demand(field, azimuths, walk);
        table.fill(field);
        table
    }

    /// The same, but chords from a vertex in a direction are followed when they are asked for first: where no ray goes costs nothing. Answers
    /// are the same bits. `field` must be the one that the table is asked with.
    ///
    /// # Panics
    ///
    /// If `azimuths` is zero.
    #[must_use]
    pub fn on_demand(field: &CurvatureField<'_>, azimuths: usize, walk: WalkLength) -> Self {
        assert!(azimuths > 0, "a table of no azimuths");
        let vertices = field.surface().positions().iter().map(|_| OnceLock::new()).collect();
        Self { azimuths, walk, first: FirstTriangles::new(field), vertices }
    }

    /// Follows all chords that have not been asked for, in parallel. `field` must be that of all other questions.
    pub fn fill(&self, field: &CurvatureField<'_>) {
        (0..self.vertices.len()).into_par_iter().for_each(|vertex| {
            (0..self.azimuths).for_each(|azimuth| {
                self.spoke(field, vertex, azimuth);
            });
        });
    }

    fn spoke(&self, field: &CurvatureField<'_>, vertex: usize, azimuth: usize) -> &Spoke {
        let unknown = || (0..self.azimuths).map(|_| OnceLock::new()).collect();
        self.vertices[vertex].get_or_init(unknown)[azimuth].get_or_init(|| {
            let around = Around::vertex(field, &self.first, vertex);
            let angle = std::f64::consts::TAU * azimuth as f64 / self.azimuths as f64;
            Spoke::new(field, around.as_ref(), angle, self.walk)
        })
    }

    /// Whether so many questions about a mesh with so many vertices are answered sooner with a table on demand than by walks.
    #[must_use]
    pub fn pays(questions: u64, vertices: usize) -> bool {
        /// What rays ask for of a table takes as long as this many of them per vertex save.
        const PER_VERTEX: u64 = 100;
        questions >= PER_VERTEX * vertices as u64
    }

    /// Directions per vertex.
    #[must_use]
    pub fn azimuths(&self) -> usize {
        self.azimuths
    }

    /// How far the walks went that the table replaces.
    #[must_use]
    pub fn walk(&self) -> WalkLength {
        self.walk
    }

    /// Pairs of vertex and direction in which chords have been followed.
    #[must_use]
    pub fn known(&self) -> usize {
        let spokes = self.vertices.iter().filter_map(OnceLock::get).flatten();
        spokes.filter(|spoke| spoke.get().is_some()).count()
    }

    /// Bytes that it takes by now.
    #[must_use]
    pub fn bytes(&self) -> usize {
        let spokes = self.vertices.iter().filter_map(OnceLock::get).map(|spokes| size_of_val(&**spokes));
        size_of_val(&*self.vertices) + self.first.bytes() + spokes.sum::<usize>()
    }

    /// Curvature of the ray's circle, and its mean UV rate if the field has UVs.
    pub(super) fn answer(&self, field: &CurvatureField<'_>, glance: &Glance) -> (f64, Option<[f64; 2]>) {
        let Some(at) = &glance.section else { return (glance.along(), None) };
        let level = Level::of(glance.cosine);
        let mut sum = [0.0; VALUES];
        for (vertex, weight, turn) in glance.turns(at.forward) {
            for (azimuth, share) in Between::new(turn, self.azimuths).shares() {
                self.spoke(field, vertex, azimuth).add(&mut sum, &level, weight * share);
            }
        }
        let [kappa, ahead, aside] = sum;
        let way = [1.0 + ahead, aside].map(f64::from);
        let ground = Ground::new(field, glance.triangle, &widen(at.plane), &widen(at.forward));
        (glance.kappa(at, kappa), ground.map(|ground| ground.uv_of(way)))
    }

    /// Measures how far the table is from the chords, on `queries` spread queries. `None` without any.
    #[must_use]
    pub fn error(&self, field: &CurvatureField<'_>, queries: usize) -> Option<BakedChordError> {
        let spread = spread_queries(field, queries, self.walk);
        let off = spread.par_iter().filter_map(|query| {
            let start = Start::new(field, query.point, query.w)?;
            let exact = chord(field, &start, self.walk, PACE);
            let (kappa, rate) = self.answer(field, &Glance::new(field, query.point, &query.w)?);
            let off = exact.uv_rate.zip(rate).map_or(0.0, |(exact, rate)| {
                (exact[0] - rate[0]).hypot(exact[1] - rate[1]) / exact[0].hypot(exact[1])
            });
            Some(((exact.kappa - kappa).abs(), off))
        });
        let (mut kappas, mut rates): (Vec<f64>, Vec<f64>) = off.unzip();
        kappas.sort_unstable_by(f64::total_cmp);
        rates.sort_unstable_by(f64::total_cmp);
        Some(BakedChordError {
            queries: kappas.len(),
            kappa_median: quantile(&kappas, 0.5)?,
            kappa_p99: quantile(&kappas, 0.99)?,
            rate_median: quantile(&rates, 0.5)?,
            rate_p99: quantile(&rates, 0.99)?,
        })
    }
}

/// Where a cosine lies between the elevations of a table.
struct Level {
    below: usize,
    share: f32,
}

/// Cosine of an elevation of the table: closer to each other towards the horizon, where chords are long.
fn cosine(level: usize) -> f64 {
    (level as f64 / ELEVATIONS as f64).powi(2)
}

impl Level {
    #[inline]
    fn of(cosine: f32) -> Self {
        let place = cosine.sqrt() * ELEVATIONS as f32;
        #[allow(clippy::cast_possible_truncation, clippy::cast_sign_loss, reason = "cosines are in [0, 1]")]
        let below = (place as usize).min(ELEVATIONS - 1);
        Self { below, share: place - below as f32 }
    }

    /// Elevations that are kept, and their shares.
    #[inline]
    fn nodes(&self) -> impl Iterator<Item = (usize, f32)> {
        let nodes = [(self.below, 1.0 - self.share), (self.below + 1, self.share)];
        nodes.into_iter().filter(|(node, _)| *node < ELEVATIONS)
    }
}

//! The chord query in a table: precomputed per vertex for a set of azimuths and elevations.
//!
//! The table holds what a walk adds to what is known at the point, not the answer itself: to the curvature of the section, and to the UV
//! rate of the triangle. Both are zero for short chords, so that steep rays lose nothing, and vary slowly over a mesh that
//! resolves its surface. They are interpolated linearly in azimuth and in the root of the ray's cosine, at each corner in that corner's own
//! frame of principal directions, and then over the triangle.
//!
//! A chord jumps where the ray passes from coming out again to dying below the material; the table makes a slope of that, as wide as
//! its step in elevation.

use rayon::prelude::*;
use serde::{Deserialize, Serialize};

use super::azimuths::{Around, Between, over_corners};
use super::baked::quantile;
use super::chord::{PACE, chord};
use super::queries::spread_queries;
use super::section::Beginning;
use super::start::{Start, StartSection};
use super::surface_field::CurvatureField;
use super::walk_length::WalkLength;
use crate::Vec3;

/// Per direction and elevation: a curvature, and the two components of a UV rate.
const VALUES: usize = 3;
/// Elevations that are kept; the one after them, normal incidence, has zeros.
const ELEVATIONS: usize = 6;
/// Numbers per vertex and azimuth.
const ROW: usize = ELEVATIONS * VALUES;

/// For every surface vertex, what chords add in a number of directions and elevations to the curvature and the UV rate at the vertex.
#[derive(Debug, Clone, PartialEq)]
pub struct BakedChord {
    azimuths: usize,
    walk: WalkLength,
    /// Per surface vertex: what a step of its curvatures is, 1/length, and one of its rates.
    steps: Vec<[f32; 2]>,
    /// Per surface vertex, azimuth and elevation: curvature and both UV rates, in steps.
    rows: Vec<i16>,
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
    pub const AZIMUTHS: usize = 16;

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
        assert!(azimuths > 0, "a table of no azimuths");
        let additions = |around: Option<Around<'_>>| {
            let Some(around) = around else { return ([0.0; 2], vec![0; azimuths * ROW]) };
            let directions = (0..azimuths).flat_map(|k| (0..ELEVATIONS).map(move |level| (k, level)));
            let values = directions.flat_map(|(k, level)| {
                let azimuth = std::f64::consts::TAU * k as f64 / azimuths as f64;
                let start = around.start(field, azimuth, cosine(level));
                start.and_then(|start| addition(field, &start, walk)).unwrap_or_default()
            });
            in_steps(&values.collect::<Vec<f64>>())
        };
        let (steps, rows): (Vec<_>, Vec<_>) = Around::every_vertex(field).map(additions).unzip();
        Self { azimuths, walk, steps, rows: rows.concat() }
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

    /// Bytes that it takes.
    #[must_use]
    pub fn bytes(&self) -> usize {
        size_of_val(&*self.rows) + size_of_val(&*self.steps)
    }

    /// Curvature of the ray's circle, and its mean UV rate if the field has UVs.
    pub(super) fn answer(&self, field: &CurvatureField<'_>, start: &Start) -> (f64, Option<[f64; 2]>) {
        let Some(at) = &start.section else { return (start.along(field), None) };
        let level = Level::of(start.cosine);
        let added = over_corners(field, start.point, |vertex, principal| {
            let between = Between::new(principal, &at.forward, self.azimuths);
            self.at(vertex, &between, &level)
        });
        let [kappa, ahead, aside] = added.unwrap_or_default();
        let rate =
            Ground::new(field, start.point.triangle, at).map(|ground| ground.uv_of([1.0 + ahead, aside]));
        (at.kappa + kappa, rate)
    }

    /// Between two azimuths and two elevations of a vertex.
    fn at(&self, vertex: usize, between: &Between, level: &Level) -> [f64; VALUES] {
        let row = |entry: usize| -> &[i16; ROW] {
            let rows = &self.rows[(vertex * self.azimuths + entry) * ROW..];
            rows.first_chunk().expect("a row for every azimuth")
        };
        let [before, after] = between.entries.map(row);
        let [step, rate_step] = self.steps[vertex].map(f64::from);
        let mut values = [0.0; VALUES];
        for (node, share) in level.nodes() {
            for (k, value) in values.iter_mut().enumerate() {
                let [one, two] = [before, after].map(|row| f64::from(row[node * VALUES + k]));
                *value += share * (one + between.share * (two - one));
            }
        }
        let [kappa, ahead, aside] = values;
        [kappa * step, ahead * rate_step, aside * rate_step]
    }

    /// Measures how far the table is from the chords, on `queries` spread queries. `None` without any.
    #[must_use]
    pub fn error(&self, field: &CurvatureField<'_>, queries: usize) -> Option<BakedChordError> {
        let spread = spread_queries(field, queries, self.walk);
        let off = spread.par_iter().filter_map(|query| {
            let start = Start::new(field, query.point, query.w)?;
            let exact = chord(field, &start, self.walk, PACE);
            let (kappa, rate) = self.answer(field, &start);
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
    share: f64,
}

/// Cosine of an elevation of the table: closer to each other towards the horizon, where chords are long.
fn cosine(level: usize) -> f64 {
    (level as f64 / ELEVATIONS as f64).powi(2)
}

impl Level {
    fn of(cosine: f64) -> Self {
        let place = cosine.sqrt() * ELEVATIONS as f64;
        #[allow(clippy::cast_possible_truncation, clippy::cast_sign_loss, reason = "cosines are in [0, 1]")]
        let below = (place as usize).min(ELEVATIONS - 1);
        Self { below, share: place - below as f64 }
    }

    /// Elevations that are kept, and their shares.
    fn nodes(&self) -> impl Iterator<Item = (usize, f64)> {
        let nodes = [(self.below, 1.0 - self.share), (self.below + 1, self.share)];
        nodes.into_iter().filter(|(node, _)| *node < ELEVATIONS)
    }
}

/// A triangle in the axes of a ray: the way it goes in the triangle's plane, and to the side of that.
struct Ground {
    /// UV per length along both.
    uv_from_axes: [[f64; 2]; 2],
}

impl Ground {
    /// `None` without UVs, and for triangles without area.
    fn new(field: &CurvatureField<'_>, triangle: usize, at: &StartSection) -> Option<Self> {
        let uvs = field.corner_uvs(triangle)?;
        let [a, b, c] = field.surface().corners(triangle);
        let edges = [b - a, c - a];
        let normal = edges[0].cross(&edges[1]);
        let squared = normal.norm_squared();
        let ahead = at.plane.normal.cross(&normal);
        // The triangle may be turned over.
        let ahead = ahead * ahead.dot(&at.forward).signum();
        let aside = at.plane.normal * squared - normal * normal.dot(&at.plane.normal);
        let along = |axis: Vec3| {
            let unit = axis.try_normalize(0.0)?;
            // Shares of both edges in the unit vector.
            let shares =
                [unit.cross(&edges[1]).dot(&normal), edges[0].cross(&unit).dot(&normal)].map(|x| x / squared);
            let rate =
                [0, 1].map(|k| shares[0] * (uvs[1][k] - uvs[0][k]) + shares[1] * (uvs[2][k] - uvs[0][k]));
            rate.iter().all(|x| x.is_finite()).then_some(rate)
        };
        Some(Self { uv_from_axes: [along(ahead)?, along(aside)?] })
    }

    fn uv_of(&self, [ahead, aside]: [f64; 2]) -> [f64; 2] {
        let [one, two] = self.uv_from_axes;
        [0, 1].map(|k| ahead * one[k] + aside * two[k])
    }

    /// `None` where UV have no area.
    fn axes_of(&self, uv: [f64; 2]) -> Option<[f64; 2]> {
        let [one, two] = self.uv_from_axes;
        let determinant = one[0] * two[1] - one[1] * two[0];
        let axes =
            [uv[0] * two[1] - uv[1] * two[0], one[0] * uv[1] - one[1] * uv[0]].map(|x| x / determinant);
        axes.iter().all(|x| x.is_finite()).then_some(axes)
    }
}

/// What a chord adds to the curvature of the section, and to the way along its first triangle. `None` without a section, and where the
/// surface ends at once.
fn addition(field: &CurvatureField<'_>, start: &Start, walk: WalkLength) -> Option<[f64; VALUES]> {
    /// Of the first piece to the triangle's longest side. Over a boundary vertex a plane cuts off pieces of the size of rounding, whose
    /// chords have no direction.
    const LEAST_PIECE: f64 = 1e-9;
    let at = start.section.as_ref()?;
    let piece = Beginning::new(field, at.plane, start.point, at.forward)?.piece;
    let triangle = piece.from.triangle;
    let [a, b, c] = field.surface().corners(triangle);
    let side = [b - a, c - b, a - c].iter().map(Vec3::norm).fold(0.0, f64::max);
    if (piece.exit.position - piece.from_position).norm() <= LEAST_PIECE * side {
        return None;
    }
    let found = chord(field, start, walk, PACE);
    let axes = found.uv_rate.and_then(|rate| Ground::new(field, triangle, at)?.axes_of(rate));
    let [ahead, aside] = axes.map_or([0.0; 2], |[ahead, aside]| [ahead - 1.0, aside]);
    Some([found.kappa - at.kappa, ahead, aside])
}

/// The numbers of a vertex in 16 bits, and what a step is of curvatures and of rates.
fn in_steps(values: &[f64]) -> ([f32; 2], Vec<i16>) {
    let is_kappa = |k: usize| k.is_multiple_of(VALUES);
    let step = |of_kappa: bool| {
        let largest = values.iter().enumerate().filter(|(k, _)| is_kappa(*k) == of_kappa);
        #[allow(clippy::cast_possible_truncation, reason = "a step is as coarse")]
        let step = (largest.map(|(_, x)| x.abs()).fold(0.0, f64::max) / f64::from(i16::MAX)) as f32;
        step
    };
    let [kappa, rate] = [true, false].map(step);
    let narrow = |(k, value): (usize, &f64)| {
        let step = f64::from(if is_kappa(k) { kappa } else { rate });
        #[allow(clippy::cast_possible_truncation, reason = "a cast saturates, and makes nothing of 0 / 0")]
        let steps = (value / step).round() as i16;
        steps
    };
    ([kappa, rate], values.iter().enumerate().map(narrow).collect())
}

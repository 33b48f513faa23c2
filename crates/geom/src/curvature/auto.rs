//! The estimator that is told an error and finds neighbourhood and degree, vertex by vertex.
//!
//! A fit of degree 4 on three rings is what clean data calls for: it is accurate and cheap, so it comes first. When its
//! change between degrees is clearly no noise, the two inner rings of the same points are fitted too, which costs little and is
//! often better. When the error bar is over the tolerance, its two parts say what to do. Where noise dominates, more points help: the
//! neighbourhood grows, noise falls with its area and more, and lower degrees become the better ones, until bias takes over.
//! Where bias dominates, the surface is under-sampled there, and fewer points may help. Every level is judged again with what
//! larger ones show about bias: it falls with the square of the radius (for degrees 2 and 3) or more, and a large neighbourhood
//! tells it from noise.

use super::error_bar::{ErrorBar, error_bar, next_guess};
use super::estimate::{Prepared, Scratch};
use super::local_fit::{Cloud, Guess, LocalFit};
use super::support::{LEAST_FACING, Reach, gather_rings, grow_rings, reach_of_ring, reference_normal};
use super::{Status, VertexCurvature};

/// Rings of the first level.
const FIRST_RINGS: u32 = 3;
/// Rings of the further levels; areas about double.
const LATER_RINGS: [u32; 5] = [4, 6, 8, 11, 16];

/// A curvature whose sagitta over the neighbourhood is this share of its radius counts as flat: the tolerance is
/// relative to the curvature, or to this one if that is larger. Otherwise a plane could not be had to any tolerance.
const FLAT: f64 = 0.01;

/// Change between degrees over its standard error at which it is not noise. In a smaller neighbourhood, which is then tried,
/// there are too few points to tell.
const CERTAIN: f64 = 6.0;
/// The same ratio at which a larger neighbourhood is out of the question.
const CLEAR: f64 = 20.0;
/// The same ratio below which the bias of the highest degree means nothing. Noise alone makes about 1 of it.
const BELIEVED: f64 = 2.0;
/// Radius of a neighbourhood over the radius of curvature at which its rim faces away.
const AROUND: f64 = 1.2;
/// Caution in telling a level's bias from a larger one's.
const BY_COMPARISON: f64 = 2.0;

/// One neighbourhood with its fits.
#[derive(Debug, Clone, Copy)]
pub(super) struct Level {
    fit: LocalFit,
    /// Of degrees 2 to 4; none where the fitted surface faces away.
    bars: [Option<ErrorBar>; 3],
    /// Of the highest degree that was fitted, wherever it faces.
    highest: ErrorBar,
}

/// One degree of one level, with its error bar.
#[derive(Debug, Clone, Copy)]
struct Choice {
    level: usize,
    degree: usize,
    bar: ErrorBar,
}

pub(super) fn estimate_vertex(
    prepared: &Prepared<'_>,
    vertex: u32,
    tolerance: f64,
    most_rings: u32,
    scratch: &mut Scratch<'_>,
) -> VertexCurvature {
    let mut levels = std::mem::take(&mut scratch.levels);
    levels.clear();
    let gathered = climb(prepared, vertex, tolerance, most_rings, scratch, &mut levels);
    let estimate = match choose(&levels) {
        Some(choice) => choice.estimate(prepared, vertex, &levels, tolerance),
        None if gathered <= LocalFit::unknowns(2) => VertexCurvature::undetermined(Status::FewNeighbours),
        None => VertexCurvature::undetermined(Status::RankDeficient),
    };
    scratch.levels = levels;
    estimate
}

/// Adds levels until one holds the tolerance or larger ones are no use; how many vertices the last one has.
fn climb(
    prepared: &Prepared<'_>,
    vertex: u32,
    tolerance: f64,
    most_rings: u32,
    scratch: &mut Scratch<'_>,
    levels: &mut Vec<Level>,
) -> usize {
    let mut reach = gather_rings(prepared, vertex, FIRST_RINGS.min(most_rings), scratch);
    let mut guess = flat_guess(scratch);
    let mut later = LATER_RINGS.into_iter();
    loop {
        let level = Level::new(&scratch.cloud, reach, &guess);
        levels.extend(level);
        guess = level.and_then(|level| level.next_guess()).unwrap_or(guess);
        let mut choice = choose(levels);
        let first = later.len() == LATER_RINGS.len();
        if first && levels.first().is_some_and(|level| level.certainty() > CERTAIN) {
            // Noise makes smaller neighbourhoods worse, so where a smaller one is better, larger ones are no use.
            let near = reach_of_ring(&scratch.walker, FIRST_RINGS - 1);
            levels.splice(0..0, Level::new(&scratch.cloud, near, &guess));
            choice = choose(levels);
            if choice.is_some_and(|choice| choice.level + 1 < levels.len()) {
                return reach.count;
            }
        }
        let done = choice.is_some_and(|choice| {
            // Two larger neighbourhoods were no better, or it is good enough.
            choice.level + 2 < levels.len() || choice.holds(levels, tolerance)
        });
        let trend = level.map_or(Trend::Noise, |level| level.trend());
        let Some(rings) = later.next().filter(|&rings| rings <= most_rings) else { return reach.count };
        if done || trend == Trend::Bias {
            return reach.count;
        }
        let previous = reach.count;
        reach = grow_rings(prepared, vertex, rings, scratch);
        if reach.count == previous {
            return reach.count; // The component is exhausted.
        }
    }
}

/// The guess that a flat fit of degree 2 on the inner rings gives.
fn flat_guess(scratch: &Scratch<'_>) -> Guess {
    let one = reach_of_ring(&scratch.walker, 1);
    let two = reach_of_ring(&scratch.walker, 2);
    let normal = Guess::from_normal(reference_normal(&scratch.cloud, one.count));
    let fit = LocalFit::new(&scratch.cloud, two.count, two.farthest, 2, &normal);
    fit.and_then(|fit| next_guess(&fit, 2)).unwrap_or(normal)
}

/// What makes the fits of a level wrong.
#[derive(Debug, Clone, Copy, PartialEq, Eq)]
enum Trend {
    Noise,
    Bias,
}

impl Level {
    /// `None` if the points have no extent or no polynomial is determined.
    fn new(cloud: &Cloud, reach: Reach, guess: &Guess) -> Option<Self> {
        let outward = cloud.normal(0);
        let fit = LocalFit::new(cloud, reach.count, reach.farthest, 4, guess)?;
        let faces_out = |degree| fit.facing(degree, &outward).is_some_and(|facing| facing > LEAST_FACING);
        let all = [2, 3, 4].map(|degree| error_bar(&fit, degree));
        let highest = all.iter().rev().flatten().next().copied()?;
        let bars = [2, 3, 4].map(|degree| all[degree - 2].filter(|_| faces_out(degree)));
        bars.iter().any(Option::is_some).then_some(Self { fit, bars, highest })
    }

    /// What degree 4 adds to degree 3, over its standard error; zero without these degrees.
    fn certainty(&self) -> f64 {
        let change = self.fit.change(3, 4).zip(self.fit.standard_error(4));
        change.map_or(0.0, |(change, noise)| change / noise)
    }

    fn best_degree(&self) -> Option<(usize, ErrorBar)> {
        let bars = (2..).zip(self.bars).filter_map(|(degree, bar)| Some((degree, bar?)));
        bars.min_by(|a, b| a.1.typical().total_cmp(&b.1.typical()))
    }

    /// By the highest degree: as long as that one suffers from noise, more points help it and, more so, lower ones. But not
    /// where the neighbourhood already reaches around the surface.
    fn trend(&self) -> Trend {
        let Some((degree, best)) = self.best_degree() else { return Trend::Noise };
        let certain = self.fit.curvature(degree).unwrap_or(0.0) - best.noise;
        let (highest, certainty) = (&self.highest, self.certainty());
        // The bias of a highest degree that is all noise is noise itself.
        let biased = highest.bias > highest.noise && certainty > BELIEVED;
        if certain * self.fit.length > AROUND || biased || certainty > CLEAR {
            Trend::Bias
        } else {
            Trend::Noise
        }
    }

    fn next_guess(&self) -> Option<Guess> {
        next_guess(&self.fit, self.best_degree()?.0)
    }

    /// The bias of one of its degrees, told from how a larger level's compares.
    fn bias_seen_from(&self, larger: &Self, degree: usize) -> Option<f64> {
        let bias = larger.bars[degree - 2]?.bias;
        let ratio = (self.fit.length / larger.fit.length).min(1.0).powi(2);
        Some(bias * BY_COMPARISON * if degree == 4 { ratio * ratio } else { ratio })
    }
}

/// The degree and level with the smallest error bar.
fn choose(levels: &[Level]) -> Option<Choice> {
    let mut best: Option<Choice> = None;
    for (index, level) in levels.iter().enumerate() {
        for degree in 2..=4 {
            let Some(own) = level.bars[degree - 2] else { continue };
            let seen = levels[index + 1..].iter().filter_map(|larger| level.bias_seen_from(larger, degree));
            let bar = ErrorBar { bias: seen.fold(own.bias, f64::min), ..own };
            if best.is_none_or(|best| bar.typical() < best.bar.typical()) {
                best = Some(Choice { level: index, degree, bar });
            }
        }
    }
    best.filter(|best| best.bar.typical().is_finite())
}

impl Choice {
    /// Whether the error bar is within the tolerance.
    fn holds(&self, levels: &[Level], tolerance: f64) -> bool {
        let fit = &levels[self.level].fit;
        let flat = FLAT / fit.length;
        let scale = fit.curvature(self.degree).unwrap_or(0.0).max(flat);
        self.bar.stated() <= tolerance * scale
    }

    fn estimate(
        &self,
        prepared: &Prepared<'_>,
        vertex: u32,
        levels: &[Level],
        tolerance: f64,
    ) -> VertexCurvature {
        let fit = &levels[self.level].fit;
        let error = self.bar.stated() + prepared.rounding_error(vertex, fit.length);
        let status = if self.holds(levels, tolerance) { Status::Ok } else { Status::OverTolerance };
        match fit.principal(self.degree) {
            Some(principal) => VertexCurvature { principal: Some(principal), error, status },
            None => VertexCurvature::undetermined(Status::RankDeficient),
        }
    }
}

#[cfg(test)]
mod tests {
    use super::*;
    use crate::Vec3;

    /// A level of points over the unit disc, of a bowl with a fourth-degree term and heights off by up to `noise`.
    fn level(fourth: f64, noise: f64) -> Level {
        let mut cloud = Cloud::default();
        cloud.reserve(60);
        for i in 0..60 {
            let t = f64::from(i);
            let (radius, angle) = ((t / 60.0).sqrt(), 2.4 * t);
            let (x, y) = (radius * angle.cos(), radius * angle.sin());
            let z = -0.05 * (x * x + y * y) + fourth * x.powi(4) + noise * (78.233 * t * t).sin();
            cloud.push(&Vec3::new(x, y, z), &Vec3::z(), radius * radius);
        }
        let reach = Reach { count: cloud.len(), farthest: 1.0 };
        Level::new(&cloud, reach, &Guess::from_normal(Vec3::z())).unwrap()
    }

    #[test]
    fn a_fourth_degree_beyond_doubt_ends_the_climb() {
        let (sure, unsure) = (level(5e-3, 4e-5), level(1e-2, 1e-3));
        assert!(sure.certainty() > CLEAR && unsure.certainty() < CERTAIN);
        // Neither reaches around the surface, and by their error bars both would gain from more points.
        for level in [&sure, &unsure] {
            let highest = level.bars[2].unwrap();
            assert!(highest.bias < highest.noise, "{highest:?}");
        }
        assert_eq!((sure.trend(), unsure.trend()), (Trend::Bias, Trend::Noise));
    }
}

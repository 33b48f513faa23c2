//! [`Sampler`]: mixtures of lobes, one for every part of a grid over the queries.

use glam::{Vec2, Vec3};
use serde::{Deserialize, Serialize};
use thiserror::Error;

use super::grid::{MOST, equal_edges};
use super::lobe::{ReadyLobe, View};
use super::{Grid, Lobe};
use crate::query::Incidence;

/// Draws directions to the light, and gives their density.
#[derive(Debug, Clone, PartialEq, Serialize, Deserialize)]
#[serde(try_from = "Parts", into = "Parts")]
pub struct Sampler {
    lobes: Vec<ReadyLobe>,
    grid: Grid,
    /// `[cells v, cells u, curvatures, bands, lobes]`; each mixture sums to 1.
    weights: Vec<f32>,
    /// Sums of the weights of a mixture, up to and with each lobe.
    sums: Vec<f32>,
}

/// What files hold.
#[derive(Debug, Clone, PartialEq, Serialize, Deserialize)]
struct Parts {
    lobes: Vec<Lobe>,
    /// Bands of `cos_o`, of the same width unless edges are stated.
    bands: usize,
    #[serde(default, skip_serializing_if = "Vec::is_empty")]
    view_edges: Vec<f32>,
    #[serde(default, skip_serializing_if = "Vec::is_empty")]
    curvature_edges: Vec<f32>,
    /// Cells along u and v.
    cells: [usize; 2],
    weights: Vec<f32>,
}

/// Why numbers make no sampler.
#[derive(Debug, Clone, PartialEq, Error)]
pub enum SamplerError {
    /// The sizes do not fit, or are too large.
    #[error("{lobes} lobes and {mixtures} mixtures do not go with {weights} weights")]
    Sizes {
        /// Number of lobes.
        lobes: usize,
        /// Number of mixtures that the grid asks for.
        mixtures: usize,
        /// Number of weights.
        weights: usize,
    },
    /// Edges do not ascend or mean nothing, or there are too many of something.
    #[error(
        "edges must ascend, those of views between 0 and 1; {grid:?} does not do, with bands as many as edges and one more, \
         and at most {MOST} of everything"
    )]
    Grid {
        /// The grid.
        grid: Grid,
    },
    /// A lobe's number is out of range.
    #[error("lobe {index} is {lobe:?}, which cannot be drawn from")]
    Lobe {
        /// Its place.
        index: usize,
        /// The lobe.
        lobe: Lobe,
    },
    /// A mixture has a negative weight, does not sum to 1, or leaves directions out.
    #[error(
        "mixture {index} has weights {weights:?}; they must be at least 0, sum to 1, and have a uniform part"
    )]
    Mixture {
        /// Its place.
        index: usize,
        /// Its weights.
        weights: Vec<f32>,
    },
}

impl Sampler {
    /// Mixtures of these lobes with weights `[cells v, cells u, curvatures, bands, lobes]`.
    ///
    /// # Errors
    ///
    /// Sizes that do not fit, and mixtures that are no densities over the whole sphere.
    pub fn new(lobes: Vec<Lobe>, grid: Grid, weights: Vec<f32>) -> Result<Self, SamplerError> {
        if !grid.is_valid() {
            return Err(SamplerError::Grid { grid });
        }
        let mixtures = grid.len();
        if !(1..=MOST).contains(&lobes.len()) || weights.len() != mixtures * lobes.len() {
            let (lobes, weights) = (lobes.len(), weights.len());
            return Err(SamplerError::Sizes { lobes, mixtures, weights });
        }
        if let Some(index) = lobes.iter().position(|lobe| !lobe.is_valid()) {
            return Err(SamplerError::Lobe { index, lobe: lobes[index] });
        }
        let mut sums = Vec::with_capacity(weights.len());
        for (index, mixture) in weights.chunks_exact(lobes.len()).enumerate() {
            let mut sum = 0.0;
            sums.extend(mixture.iter().map(|weight| {
                sum += weight;
                sum
            }));
            let uniform =
                lobes.iter().zip(mixture).any(|(lobe, weight)| *lobe == Lobe::Uniform && *weight > 0.0);
            // 64 additions of f32.
            if !uniform || mixture.iter().any(|&w| w.is_nan() || w < 0.0) || (sum - 1.0).abs() > 1e-5 {
                return Err(SamplerError::Mixture { index, weights: mixture.to_vec() });
            }
        }
        let lobes = lobes.into_iter().map(Lobe::ready).collect();
        Ok(Self { lobes, grid, weights, sums })
    }

    /// Cosine around the normal, with a tenth uniform: what to take for a material that has no fit.
    #[must_use]
    pub fn cosine() -> Self {
        Self::new(vec![Lobe::Uniform, Lobe::Cosine { tilt: 0.0 }], Grid::default(), vec![0.1, 0.9])
            .expect("a tenth and nine tenths")
    }

    /// Its lobes.
    #[must_use]
    pub fn lobes(&self) -> impl ExactSizeIterator<Item = Lobe> {
        self.lobes.iter().map(|ready| ready.lobe)
    }

    /// What its mixtures are told apart by.
    #[must_use]
    pub fn grid(&self) -> &Grid {
        &self.grid
    }

    /// Number of lobes with a weight, in the mean over mixtures: what a density costs.
    #[must_use]
    pub fn lobes_in_use(&self) -> f64 {
        self.weights.iter().filter(|weight| **weight > 0.0).count() as f64 / self.grid.len() as f64
    }

    /// Whether versions of the file format before 3 can say what it is.
    pub(crate) fn is_of_version_2(&self) -> bool {
        let is_new = |lobe: Lobe| matches!(lobe, Lobe::Forward { .. });
        let equal = self.grid.view_edges == equal_edges(self.grid.bands());
        equal && self.grid.curvature_edges.is_empty() && !self.lobes().any(is_new)
    }

    /// A unit direction to the light and its density per steradian, for three numbers in `[0, 1)`: which lobe, and where in it.
    #[must_use]
    pub fn sample(&self, query: &Incidence, pick: f32, u: Vec2) -> (Vec3, f32) {
        let wi = self.draw(query, pick, u);
        (wi, self.pdf(query, wi))
    }

    /// The direction of [`sample`](Self::sample) alone.
    #[must_use]
    pub fn draw(&self, query: &Incidence, pick: f32, u: Vec2) -> Vec3 {
        let first = self.first(query);
        let sums = &self.sums[first..first + self.lobes.len()];
        // The last lobe with a weight where rounding left the sum below `pick`.
        let last = sums.partition_point(|&sum| sum < sums[sums.len() - 1]);
        let lobe = sums.partition_point(|&sum| sum <= pick).min(last);
        self.lobes[lobe].sample(&View::new(query.wo), u)
    }

    /// The density of [`sample`](Self::sample) at a direction, per steradian; over 0.
    #[must_use]
    pub fn pdf(&self, query: &Incidence, wi: Vec3) -> f32 {
        let first = self.first(query);
        let weights = &self.weights[first..first + self.lobes.len()];
        let view = View::new(query.wo);
        let part = |(lobe, &weight): (&ReadyLobe, &f32)| {
            if weight > 0.0 { weight * lobe.pdf(&view, wi) } else { 0.0 }
        };
        self.lobes.iter().zip(weights).map(part).sum()
    }

    /// Where the mixture for this query begins in the weights.
    fn first(&self, query: &Incidence) -> usize {
        self.grid.index(query) * self.lobes.len()
    }
}

impl TryFrom<Parts> for Sampler {
    type Error = SamplerError;

    fn try_from(parts: Parts) -> Result<Self, SamplerError> {
        let Parts { lobes, bands, view_edges, curvature_edges, cells, weights } = parts;
        let edges = if view_edges.is_empty() { equal_edges(bands) } else { view_edges };
        let grid = Grid { view_edges: edges, curvature_edges, cells };
        if grid.bands() != bands {
            return Err(SamplerError::Grid { grid });
        }
        Self::new(lobes, grid, weights)
    }
}

impl From<Sampler> for Parts {
    fn from(sampler: Sampler) -> Self {
        let bands = sampler.grid.bands();
        let Grid { mut view_edges, curvature_edges, cells } = sampler.grid;
        if view_edges == equal_edges(bands) {
            view_edges.clear();
        }
        let lobes = sampler.lobes.iter().map(|ready| ready.lobe).collect();
        Self { lobes, bands, view_edges, curvature_edges, cells, weights: sampler.weights }
    }
}

#[cfg(test)]
mod tests {
    use super::super::chi_square;
    use super::*;

    fn seen_from(wo: Vec3) -> Incidence {
        Incidence { uv: Vec2::ZERO, wo, kappa_hat: 0.0 }
    }

    fn mixtures() -> Vec<Sampler> {
        let all = vec![
            Lobe::Uniform,
            Lobe::Cosine { tilt: 0.0 },
            Lobe::Cosine { tilt: 1.5 },
            Lobe::Below,
            Lobe::Mirror { sharpness: 0.5 },
            Lobe::Mirror { sharpness: 60.0 },
            Lobe::Back { sharpness: 8.0 },
            Lobe::Forward { sharpness: 40.0, height: 0.3 },
            Lobe::Forward { sharpness: 12.0, height: -0.15 },
        ];
        let mut samplers: Vec<Sampler> = (1..all.len())
            .map(|k| Sampler::new(vec![Lobe::Uniform, all[k]], Grid::default(), vec![0.05, 0.95]).unwrap())
            .collect();
        let weights = vec![0.1, 0.1, 0.1, 0.1, 0.1, 0.2, 0.1, 0.1, 0.1];
        samplers.push(Sampler::new(all, Grid::default(), weights).unwrap());
        samplers.push(Sampler::cosine());
        samplers
    }

    #[test]
    fn samples_follow_the_density_and_the_density_integrates_to_one() {
        let views = [Vec3::Z, Vec3::new(0.6, 0.0, 0.8), Vec3::new(-0.7, 0.71, 0.05).normalize()];
        for (k, sampler) in mixtures().iter().enumerate() {
            for wo in views {
                let test = chi_square::test(
                    |pick, u| sampler.sample(&seen_from(wo), pick, u),
                    |wi| sampler.pdf(&seen_from(wo), wi),
                    100_000,
                    k as u64,
                );
                // 30 tests: one in 300 runs would fail by chance, were the seeds not fixed.
                assert!(test.p_value > 1e-4, "mixture {k}, {wo}: {test:?}");
                assert!((test.integral - 1.0).abs() < 6e-4, "mixture {k}, {wo}: {test:?}");
            }
        }
    }

    #[test]
    fn a_wrong_density_is_found() {
        let sampler = &mixtures()[8];
        let wo = Vec3::new(0.6, 0.0, 0.8);
        let test = chi_square::test(
            |pick, u| sampler.sample(&seen_from(wo), pick, u),
            // The mirrored lobe, a fifth of the mixture, 10 % wider.
            |wi| {
                let lobe = |sharpness| Lobe::Mirror { sharpness }.pdf(wo, wi);
                sampler.pdf(&seen_from(wo), wi) + 0.2 * (lobe(50.0) - lobe(60.0))
            },
            100_000,
            1,
        );
        assert!(test.p_value < 1e-4, "{test:?}");
    }

    #[test]
    fn the_density_of_a_sample_is_the_density_there_to_the_bit() {
        let weights =
            (0..2 * 3 * 2 * 3).flat_map(|k| [0.1 + 0.01 * k as f32, 0.9 - 0.01 * k as f32]).collect();
        let lobes = vec![Lobe::Uniform, Lobe::Forward { sharpness: 3.0, height: 0.2 }];
        let grid = Grid { view_edges: vec![0.1, 0.3], curvature_edges: vec![0.0], cells: [2, 3] };
        let sampler = Sampler::new(lobes, grid, weights).unwrap();
        for k in 0..1000 {
            let t = |x: f32| (x * k as f32).fract();
            let (uv, wo) =
                (Vec2::new(t(0.37) * 4.0 - 2.0, t(0.71)), Vec3::new(t(0.13), -t(0.57), t(0.91)).normalize());
            let query = Incidence { uv, wo, kappa_hat: t(0.29) - 0.5 };
            let (wi, pdf) = sampler.sample(&query, t(0.77), Vec2::new(t(0.317), t(0.613)));
            assert_eq!(pdf.to_bits(), sampler.pdf(&query, wi).to_bits());
            assert!(pdf > 0.0 && (wi.length() - 1.0).abs() < 1e-6);
        }
    }

    #[test]
    fn ends_of_the_unit_interval_give_directions() {
        for sampler in mixtures() {
            for wo in [Vec3::Z, Vec3::X, Vec3::new(1.0, 0.0, 1e-6)] {
                for x in [0.0, 1.0 - f32::EPSILON / 2.0] {
                    for y in [0.0, 1.0 - f32::EPSILON / 2.0] {
                        for pick in [0.0, 0.5, 1.0 - f32::EPSILON / 2.0] {
                            let (wi, pdf) = sampler.sample(&seen_from(wo), pick, Vec2::new(x, y));
                            assert!(wi.is_finite() && pdf > 0.0 && pdf.is_finite(), "{wi} {pdf}");
                        }
                    }
                }
            }
        }
    }

    #[test]
    fn numbers_that_are_no_density_are_refused() {
        let new = |lobes, weights| Sampler::new(lobes, Grid::default(), weights);
        let two = vec![Lobe::Uniform, Lobe::Below];
        assert!(matches!(new(two.clone(), vec![1.0]), Err(SamplerError::Sizes { .. })));
        assert!(matches!(new(two.clone(), vec![1.0, 0.1]), Err(SamplerError::Mixture { .. })));
        assert!(matches!(new(two.clone(), vec![0.0, 1.0]), Err(SamplerError::Mixture { .. })));
        assert!(matches!(new(two, vec![f32::NAN, 1.0]), Err(SamplerError::Mixture { .. })));
        let sharp = vec![Lobe::Uniform, Lobe::Mirror { sharpness: f32::INFINITY }];
        assert!(matches!(new(sharp, vec![0.5, 0.5]), Err(SamplerError::Lobe { index: 1, .. })));
        let high = vec![Lobe::Uniform, Lobe::Forward { sharpness: 8.0, height: 1.1 }];
        assert!(matches!(new(high, vec![0.5, 0.5]), Err(SamplerError::Lobe { index: 1, .. })));
        let grid = Grid { view_edges: vec![0.5, 0.4], ..Grid::default() };
        assert!(matches!(
            Sampler::new(vec![Lobe::Uniform], grid, vec![1.0; 3]),
            Err(SamplerError::Grid { .. })
        ));
    }

    #[test]
    fn files_say_what_the_grid_is_and_old_ones_are_understood() {
        let read = |text: &str| serde_json::from_str::<Sampler>(text);
        let old = r#"{"lobes":["uniform"],"bands":4,"cells":[1,1],"weights":[1.0,1.0,1.0,1.0]}"#;
        let sampler = read(old).unwrap();
        assert_eq!(sampler.grid().view_edges, [0.25, 0.5, 0.75]);
        assert!(sampler.is_of_version_2());
        assert_eq!(serde_json::to_string(&sampler).unwrap(), old);
        let new = r#"{"lobes":["uniform",{"forward":{"sharpness":40.0,"height":0.3}}],"bands":2,"view_edges":[0.1],"#.to_owned()
            + r#""curvature_edges":[0.5],"cells":[1,1],"weights":[0.5,0.5,0.5,0.5,0.5,0.5,0.5,0.5]}"#;
        let sampler = read(&new).unwrap();
        assert_eq!((sampler.grid().bands(), sampler.grid().curvatures()), (2, 2));
        assert!(!sampler.is_of_version_2());
        assert_eq!(serde_json::to_string(&sampler).unwrap(), new);
        for (from, to) in [
            ("[0.1]", "[0.1,0.2]"),
            ("[0.1]", "[1.5]"),
            ("\"bands\":2", "\"bands\":0"),
            ("[0.5]", "[0.5,0.5]"),
        ] {
            assert!(read(&new.replacen(from, to, 1)).is_err(), "{to}");
        }
        assert!(read(&old.replace("\"bands\":4", "\"bands\":4000000000")).is_err());
    }
}

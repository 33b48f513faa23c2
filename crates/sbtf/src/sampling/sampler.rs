//! [`Sampler`]: a mixture of lobes with weights per band of views and cell of the texture.

use glam::{Vec2, Vec3};
use serde::{Deserialize, Serialize};
use thiserror::Error;

use super::Lobe;
use crate::model::inside_tile;

/// Draws directions to the light, and gives their density.
#[derive(Debug, Clone, PartialEq, Serialize, Deserialize)]
#[serde(try_from = "Parts", into = "Parts")]
pub struct Sampler {
    parts: Parts,
    /// Sums of the weights of a mixture, up to and with each lobe.
    sums: Vec<f32>,
}

/// What files hold.
#[derive(Debug, Clone, PartialEq, Serialize, Deserialize)]
struct Parts {
    lobes: Vec<Lobe>,
    /// Bands of equal `cos_o`.
    bands: usize,
    /// Cells along u and v.
    cells: [usize; 2],
    /// `[cells v, cells u, bands, lobes]`; each mixture sums to 1.
    weights: Vec<f32>,
}

/// Why numbers make no sampler.
#[derive(Debug, Clone, PartialEq, Error)]
pub enum SamplerError {
    /// The sizes do not fit, or are too large.
    #[error("{lobes} lobes, {bands} bands and {cells:?} cells do not go with {weights} weights")]
    Sizes {
        /// Number of lobes.
        lobes: usize,
        /// Number of bands.
        bands: usize,
        /// Number of cells.
        cells: [usize; 2],
        /// Number of weights.
        weights: usize,
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

/// Most lobes, bands, and cells along an axis.
const MOST: usize = 64;

impl Sampler {
    /// A mixture of these lobes with weights `[cells v, cells u, bands, lobes]`.
    ///
    /// # Errors
    ///
    /// Sizes that do not fit, and mixtures that are no densities over the whole sphere.
    pub fn new(
        lobes: Vec<Lobe>,
        bands: usize,
        cells: [usize; 2],
        weights: Vec<f32>,
    ) -> Result<Self, SamplerError> {
        Parts { lobes, bands, cells, weights }.try_into()
    }

    /// Cosine around the normal, with a tenth uniform: what to take for a material that has no fit.
    #[must_use]
    pub fn cosine() -> Self {
        Self::new(vec![Lobe::Uniform, Lobe::Cosine { tilt: 0.0 }], 1, [1, 1], vec![0.1, 0.9])
            .expect("a tenth and nine tenths")
    }

    /// Its lobes.
    #[must_use]
    pub fn lobes(&self) -> &[Lobe] {
        &self.parts.lobes
    }

    /// Bands of views, and cells along u and v.
    #[must_use]
    pub fn sizes(&self) -> (usize, [usize; 2]) {
        (self.parts.bands, self.parts.cells)
    }

    /// Where the mixture for this view begins in the weights.
    #[allow(clippy::cast_possible_truncation, clippy::cast_sign_loss, reason = "saturating, then clamped")]
    pub(super) fn mixture(&self, uv: Vec2, wo: Vec3) -> usize {
        let Parts { lobes, bands, cells, .. } = &self.parts;
        let cell = |x: f32, n: usize| ((inside_tile(x) * n as f32) as usize).min(n - 1);
        let band = ((wo.z * *bands as f32) as usize).min(bands - 1);
        ((cell(uv.y, cells[1]) * cells[0] + cell(uv.x, cells[0])) * bands + band) * lobes.len()
    }

    /// A unit direction to the light and its density per steradian, for three numbers in `[0, 1)`: which lobe, and where in it.
    #[must_use]
    pub fn sample(&self, uv: Vec2, wo: Vec3, pick: f32, u: Vec2) -> (Vec3, f32) {
        let first = self.mixture(uv, wo);
        let sums = &self.sums[first..first + self.parts.lobes.len()];
        // The last lobe with a weight where rounding left the sum below `pick`.
        let last = sums.partition_point(|&sum| sum < sums[sums.len() - 1]);
        let lobe = sums.partition_point(|&sum| sum <= pick).min(last);
        let wi = self.parts.lobes[lobe].sample(wo, u);
        (wi, self.mixture_pdf(first, wo, wi))
    }

    /// The density of [`sample`](Self::sample) at a direction, per steradian; over 0.
    #[must_use]
    pub fn pdf(&self, uv: Vec2, wo: Vec3, wi: Vec3) -> f32 {
        self.mixture_pdf(self.mixture(uv, wo), wo, wi)
    }

    fn mixture_pdf(&self, first: usize, wo: Vec3, wi: Vec3) -> f32 {
        let lobes = &self.parts.lobes;
        let weights = &self.parts.weights[first..first + lobes.len()];
        let part =
            |(lobe, &weight): (&Lobe, &f32)| if weight > 0.0 { weight * lobe.pdf(wo, wi) } else { 0.0 };
        lobes.iter().zip(weights).map(part).sum()
    }
}

impl TryFrom<Parts> for Sampler {
    type Error = SamplerError;

    fn try_from(parts: Parts) -> Result<Self, SamplerError> {
        let Parts { lobes, bands, cells, weights } = &parts;
        let sizes = [lobes.len(), *bands, cells[0], cells[1]];
        if sizes.iter().any(|n| !(1..=MOST).contains(n)) || weights.len() != sizes.iter().product::<usize>() {
            let (lobes, weights) = (lobes.len(), weights.len());
            return Err(SamplerError::Sizes { lobes, bands: *bands, cells: *cells, weights });
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
        Ok(Self { parts, sums })
    }
}

impl From<Sampler> for Parts {
    fn from(sampler: Sampler) -> Self {
        sampler.parts
    }
}

#[cfg(test)]
mod tests {
    use super::super::chi_square;
    use super::*;

    fn mixtures() -> Vec<Sampler> {
        let all = vec![
            Lobe::Uniform,
            Lobe::Cosine { tilt: 0.0 },
            Lobe::Cosine { tilt: 1.5 },
            Lobe::Below,
            Lobe::Mirror { sharpness: 0.5 },
            Lobe::Mirror { sharpness: 60.0 },
            Lobe::Back { sharpness: 8.0 },
        ];
        let mut samplers: Vec<Sampler> = (1..all.len())
            .map(|k| Sampler::new(vec![Lobe::Uniform, all[k]], 1, [1, 1], vec![0.05, 0.95]).unwrap())
            .collect();
        let weights = vec![0.1, 0.2, 0.1, 0.1, 0.2, 0.2, 0.1];
        samplers.push(Sampler::new(all, 1, [1, 1], weights).unwrap());
        samplers.push(Sampler::cosine());
        samplers
    }

    #[test]
    fn samples_follow_the_density_and_the_density_integrates_to_one() {
        let views = [Vec3::Z, Vec3::new(0.6, 0.0, 0.8), Vec3::new(-0.7, 0.71, 0.05).normalize()];
        for (k, sampler) in mixtures().iter().enumerate() {
            for wo in views {
                let test = chi_square::test(
                    |pick, u| sampler.sample(Vec2::ZERO, wo, pick, u),
                    |wi| sampler.pdf(Vec2::ZERO, wo, wi),
                    100_000,
                    k as u64,
                );
                // 24 tests: one in 400 runs would fail by chance, were the seeds not fixed.
                assert!(test.p_value > 1e-4, "mixture {k}, {wo}: {test:?}");
                assert!((test.integral - 1.0).abs() < 6e-4, "mixture {k}, {wo}: {test:?}");
            }
        }
    }

    #[test]
    fn a_wrong_density_is_found() {
        let sampler = &mixtures()[6];
        let wo = Vec3::new(0.6, 0.0, 0.8);
        let test = chi_square::test(
            |pick, u| sampler.sample(Vec2::ZERO, wo, pick, u),
            // The mirrored lobe, a fifth of the mixture, 10 % wider.
            |wi| {
                let lobe = |sharpness| Lobe::Mirror { sharpness }.pdf(wo, wi);
                sampler.pdf(Vec2::ZERO, wo, wi) + 0.2 * (lobe(50.0) - lobe(60.0))
            },
            100_000,
            1,
        );
        assert!(test.p_value < 1e-4, "{test:?}");
    }

    #[test]
    fn the_density_of_a_sample_is_the_density_there_to_the_bit() {
        let weights = (0..2 * 3 * 4).flat_map(|k| [0.1 + 0.01 * k as f32, 0.9 - 0.01 * k as f32]).collect();
        let lobes = vec![Lobe::Uniform, Lobe::Back { sharpness: 3.0 }];
        let sampler = Sampler::new(lobes, 4, [2, 3], weights).unwrap();
        for k in 0..1000 {
            let t = |x: f32| (x * k as f32).fract();
            let (uv, wo) =
                (Vec2::new(t(0.37) * 4.0 - 2.0, t(0.71)), Vec3::new(t(0.13), -t(0.57), t(0.91)).normalize());
            let (wi, pdf) = sampler.sample(uv, wo, t(0.77), Vec2::new(t(0.317), t(0.613)));
            assert_eq!(pdf.to_bits(), sampler.pdf(uv, wo, wi).to_bits());
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
                            let (wi, pdf) = sampler.sample(Vec2::ZERO, wo, pick, Vec2::new(x, y));
                            assert!(wi.is_finite() && pdf > 0.0 && pdf.is_finite(), "{wi} {pdf}");
                        }
                    }
                }
            }
        }
    }

    #[test]
    fn numbers_that_are_no_density_are_refused() {
        let new = |lobes, weights| Sampler::new(lobes, 1, [1, 1], weights);
        let two = vec![Lobe::Uniform, Lobe::Below];
        assert!(matches!(new(two.clone(), vec![1.0]), Err(SamplerError::Sizes { .. })));
        assert!(matches!(new(two.clone(), vec![1.0, 0.1]), Err(SamplerError::Mixture { .. })));
        assert!(matches!(new(two.clone(), vec![0.0, 1.0]), Err(SamplerError::Mixture { .. })));
        assert!(matches!(new(two, vec![f32::NAN, 1.0]), Err(SamplerError::Mixture { .. })));
        let sharp = vec![Lobe::Uniform, Lobe::Mirror { sharpness: f32::INFINITY }];
        assert!(matches!(new(sharp, vec![0.5, 0.5]), Err(SamplerError::Lobe { index: 1, .. })));
    }
}

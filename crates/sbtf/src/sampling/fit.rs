//! [`fit`]: the mixture with the least variance, found on the material itself.

use glam::{Vec2, Vec3};
use serde::{Deserialize, Serialize};

use super::{Lobe, Sampler};
use crate::query::{Answer, Query, SilhouetteBtf};
use crate::random::Random;

/// What a fit looks at.
#[derive(Debug, Clone, PartialEq)]
pub struct FitOptions {
    /// Views per mixture of the finest form; default 64.
    pub views: usize,
    /// Lights per view; default 32.
    pub lights: usize,
    /// Bands of viewing angles; default 4.
    pub bands: usize,
    /// Cells of the texture along each axis; default 8.
    pub cells: usize,
    /// Range of curvatures that queries are drawn from.
    pub kappa_range: [f32; 2],
    /// Seed of the random numbers; default 1.
    pub seed: u64,
}

impl FitOptions {
    /// The defaults for a range of curvatures.
    #[must_use]
    pub fn new(kappa_range: [f32; 2]) -> Self {
        Self { views: 64, lights: 32, bands: 4, cells: 8, kappa_range, seed: 1 }
    }
}

/// A sampler, and what it was chosen from.
#[derive(Debug, Clone, PartialEq)]
pub struct SamplingFit {
    /// The one to take.
    pub sampler: Sampler,
    /// Everything that was measured, the simplest first.
    pub candidates: Vec<Candidate>,
}

/// A form that was measured.
#[derive(Debug, Clone, PartialEq, Serialize, Deserialize)]
pub struct Candidate {
    /// What it is.
    pub name: String,
    /// Variance of one sample over the square of its mean, averaged over views that it was not fitted to.
    pub variance: f64,
    /// Lobes that it has.
    pub lobes: usize,
}

/// What mixtures are made of. Sharper mirrors than 400 are narrower than what networks of this size resolve.
const LOBES: [Lobe; 11] = [
    Lobe::Uniform,
    Lobe::Cosine { tilt: 0.0 },
    Lobe::Below,
    Lobe::Cosine { tilt: 0.5 },
    Lobe::Cosine { tilt: 2.0 },
    Lobe::Mirror { sharpness: 2.0 },
    Lobe::Mirror { sharpness: 8.0 },
    Lobe::Mirror { sharpness: 40.0 },
    Lobe::Mirror { sharpness: 400.0 },
    Lobe::Back { sharpness: 2.0 },
    Lobe::Back { sharpness: 10.0 },
];

/// Least weight of the uniform lobe: it bounds the weight of a sample where the fit is wrong.
const UNIFORM: f64 = 0.05;
/// Lobes that have less everywhere are dropped: they cost time and change nothing.
const NEGLIGIBLE: f64 = 0.01;
/// How much less variance a larger form must have.
const WORTH: f64 = 0.97;
const ITERATIONS: usize = 60;

/// Fits a sampler to a material. Deterministic; takes well under a second with a compiled model.
#[must_use]
pub fn fit(material: &dyn SilhouetteBtf, options: &FitOptions) -> SamplingFit {
    let (bands, cells) = (options.bands.max(1), options.cells.max(1));
    let train = Views::draw(material, options, options.seed);
    let held_out = Views::draw(material, options, !options.seed);
    let forms = [
        ("cosine, uniform and below", 3, 1, 1),
        ("all lobes", LOBES.len(), 1, 1),
        ("all lobes per band of views", LOBES.len(), bands, 1),
        ("all lobes per band and cell", LOBES.len(), bands, cells),
    ];
    let mut best: Option<(Sampler, f64)> = None;
    let mut candidates = Vec::new();
    for (name, lobes, bands, cells) in forms {
        let sampler = train.mixtures(&LOBES[..lobes], bands, cells);
        let variance = held_out.variance(&sampler);
        candidates.push(Candidate { name: name.to_owned(), variance, lobes: sampler.lobes().len() });
        if best.as_ref().is_none_or(|(_, least)| variance < WORTH * least) {
            best = Some((sampler, variance));
        }
    }
    let sampler = best.map_or_else(Sampler::cosine, |(sampler, _)| sampler);
    SamplingFit { sampler, candidates }
}

/// Lit views of a material.
struct Views {
    views: Vec<View>,
}

/// One view that hits, and what it shows under several lights.
struct View {
    uv: Vec2,
    wo: Vec3,
    /// Direction, and squared brightness over the density that it was drawn with and over the squared mean.
    lights: Vec<(Vec3, f64)>,
}

impl Views {
    /// Views in all cells and bands; lights from all lobes alike, so that sharp highlights are met.
    fn draw(material: &dyn SilhouetteBtf, options: &FitOptions, seed: u64) -> Self {
        let (mut random, lights) = (Random::new(seed, 0, 0), options.lights.max(1));
        let proposal = Sampler::new(LOBES.to_vec(), 1, [1, 1], vec![1.0 / LOBES.len() as f32; LOBES.len()])
            .expect("equal weights");
        let count = options.views.max(1) * options.bands.max(1) * options.cells.max(1).pow(2);
        let mut views = Vec::new();
        let (mut queries, mut answers) = (Vec::new(), vec![Answer::default(); lights]);
        for _ in 0..count {
            let uv = Vec2::new(random.unit(), random.unit());
            // At 1e-3 the tangent plane is a thousandth away.
            let (z, angle) = (1e-3 + 0.999 * random.unit(), std::f32::consts::TAU * random.unit());
            let radius = (1.0 - z * z).max(0.0).sqrt();
            let wo = Vec3::new(radius * angle.cos(), radius * angle.sin(), z);
            let [low, high] = options.kappa_range;
            let kappa_hat = low + (high - low) * random.unit();
            queries.clear();
            queries.extend((0..lights).map(|_| {
                let (wi, _) = proposal.sample(uv, wo, random.unit(), Vec2::new(random.unit(), random.unit()));
                Query { uv, wo, wi, kappa_hat }
            }));
            if material.alpha(uv, wo, kappa_hat) <= 0.0 {
                continue;
            }
            material.eval_batch(&queries, &mut answers);
            let lit = queries.iter().zip(&answers).map(|(query, answer)| {
                let brightness = f64::from(answer.rgb.element_sum()) / 3.0;
                (query.wi, brightness, f64::from(proposal.pdf(uv, wo, query.wi)))
            });
            let lit: Vec<_> = lit.collect();
            let mean = lit.iter().map(|(_, f, q)| f / q).sum::<f64>() / lights as f64;
            if mean > 0.0 {
                let lights = lit.iter().map(|&(wi, f, q)| (wi, f * f / (q * mean * mean))).collect();
                views.push(View { uv, wo, lights });
            }
        }
        Self { views }
    }

    /// The best mixture of these lobes for every band and cell.
    fn mixtures(&self, lobes: &[Lobe], bands: usize, cells: usize) -> Sampler {
        let count = bands * cells * cells;
        let equal = vec![1.0 / lobes.len() as f32; lobes.len() * count];
        let index = Sampler::new(lobes.to_vec(), bands, [cells; 2], equal).expect("equal weights");
        let mut rows: Vec<Vec<(f64, Vec<f64>)>> = vec![Vec::new(); count];
        for view in &self.views {
            let mixture = &mut rows[index.mixture(view.uv, view.wo) / lobes.len()];
            mixture.extend(view.lights.iter().map(|&(wi, square)| {
                (square, lobes.iter().map(|lobe| f64::from(lobe.pdf(view.wo, wi))).collect())
            }));
        }
        let fitted: Vec<Vec<f64>> = rows.iter().map(|rows| least_variance(rows, lobes.len())).collect();
        let kept = |k: &usize| *k == 0 || fitted.iter().any(|weights| weights[*k] >= NEGLIGIBLE);
        let kept: Vec<usize> = (0..lobes.len()).filter(kept).collect();
        let weights = fitted.iter().flat_map(|weights| normalised(&kept, weights)).collect();
        let lobes = kept.iter().map(|&k| lobes[k]).collect();
        Sampler::new(lobes, bands, [cells; 2], weights).expect("fitted weights are densities")
    }

    /// Variance of one sample over the square of its mean.
    fn variance(&self, sampler: &Sampler) -> f64 {
        let second = |view: &View| {
            let over =
                view.lights.iter().map(|&(wi, square)| square / f64::from(sampler.pdf(view.uv, view.wo, wi)));
            over.sum::<f64>() / view.lights.len() as f64
        };
        // Cannot be negative but by noise of the estimate.
        self.views.iter().map(second).sum::<f64>() / self.views.len().max(1) as f64 - 1.0
    }
}

#[allow(clippy::cast_possible_truncation, reason = "weights are f32 in files")]
fn normalised(kept: &[usize], weights: &[f64]) -> Vec<f32> {
    let sum: f64 = kept.iter().map(|&k| weights[k]).sum();
    kept.iter().map(|&k| (weights[k] / sum) as f32).collect()
}

/// Weights that minimise the sum of `square / mixture density`, a convex function of them.
///
/// Every step multiplies a weight by the square root of its share of the gradient, which leaves their sum near 1 and comes to
/// rest only where all shares of lobes with weight are equal: the condition of the minimum.
fn least_variance(rows: &[(f64, Vec<f64>)], lobes: usize) -> Vec<f64> {
    let mut weights = vec![1.0 / lobes as f64; lobes];
    for _ in 0..ITERATIONS {
        let mut gradient = vec![0.0; lobes];
        for (square, densities) in rows {
            let density: f64 = weights.iter().zip(densities).map(|(w, p)| w * p).sum();
            for (g, p) in gradient.iter_mut().zip(densities) {
                *g += square * p / (density * density);
            }
        }
        let scale: f64 = weights.iter().zip(&gradient).map(|(w, g)| w * g).sum();
        if scale <= 0.0 || !scale.is_finite() {
            break;
        }
        weights.iter_mut().zip(&gradient).for_each(|(w, g)| *w *= (g / scale).sqrt());
        let sum: f64 = weights.iter().sum();
        weights.iter_mut().for_each(|w| *w /= sum);
        if weights[0] < UNIFORM {
            let rest = (1.0 - UNIFORM) / (1.0 - weights[0]);
            weights[1..].iter_mut().for_each(|w| *w *= rest);
            weights[0] = UNIFORM;
        }
    }
    weights
}

#[cfg(test)]
mod tests {
    use super::*;

    /// Reflects as one lobe does, of a sharpness that depends on the cell.
    struct OneLobe(fn(Vec2) -> Lobe);

    impl SilhouetteBtf for OneLobe {
        fn eval(&self, query: &Query) -> Answer {
            Answer { rgb: Vec3::splat(self.0(query.uv).pdf(query.wo, query.wi)), alpha: 1.0 }
        }

        fn alpha(&self, _: Vec2, _: Vec3, _: f32) -> f32 {
            1.0
        }
    }

    fn options() -> FitOptions {
        FitOptions { views: 16, lights: 64, cells: 2, ..FitOptions::new([-1.0, 1.0]) }
    }

    #[test]
    fn a_material_that_is_a_lobe_gets_that_lobe() {
        for lobe in &LOBES[1..] {
            let constant = *lobe;
            // A function pointer cannot capture; the sharpest mirror stands for all of its kind.
            let material = match constant {
                Lobe::Mirror { .. } => OneLobe(|_| Lobe::Mirror { sharpness: 40.0 }),
                Lobe::Cosine { .. } => OneLobe(|_| Lobe::Cosine { tilt: 0.0 }),
                Lobe::Back { .. } => OneLobe(|_| Lobe::Back { sharpness: 10.0 }),
                _ => OneLobe(|_| Lobe::Below),
            };
            let fit = fit(&material, &options());
            let best = fit.candidates.iter().map(|c| c.variance).fold(f64::INFINITY, f64::min);
            // With 5 % uniform the variance of sampling a density by itself is at most 0.05 / 0.95; noise adds to it.
            assert!(best < 0.15, "{constant:?}: {:?}", fit.candidates);
        }
    }

    #[test]
    fn cells_are_kept_where_they_pay() {
        let split = OneLobe(|uv| if uv.x < 0.5 { Lobe::Mirror { sharpness: 40.0 } } else { Lobe::Below });
        let fit_of = |material| fit(&material, &options());
        let (split, even) = (fit_of(split), fit_of(OneLobe(|_| Lobe::Cosine { tilt: 0.0 })));
        assert_eq!(split.sampler.sizes().1, [2, 2], "{:?}", split.candidates);
        assert_eq!(even.sampler.sizes(), (1, [1, 1]), "{:?}", even.candidates);
    }

    #[test]
    fn a_black_material_gets_a_sampler_too() {
        struct Black;
        impl SilhouetteBtf for Black {
            fn eval(&self, _: &Query) -> Answer {
                Answer { rgb: Vec3::ZERO, alpha: 1.0 }
            }
            fn alpha(&self, _: Vec2, _: Vec3, _: f32) -> f32 {
                1.0
            }
        }
        let sampler = fit(&Black, &options()).sampler;
        assert!(sampler.pdf(Vec2::ZERO, Vec3::Z, -Vec3::Z) > 0.0);
    }
}

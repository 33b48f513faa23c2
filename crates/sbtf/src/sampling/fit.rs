//! [`fit`]: the mixtures with the least noise, found on the material itself.

use rayon::prelude::*;
use serde::{Deserialize, Serialize};

use super::views::{LitFrom, Views};
use super::{Grid, Lobe, Sampler};
use crate::query::SilhouetteBtf;

/// What a fit looks at.
#[derive(Debug, Clone, PartialEq)]
pub struct FitOptions {
    /// Views per band and cell; default 128.
    pub views: usize,
    /// Lights per view; default 32.
    pub lights: usize,
    /// Where bands of `cos_o` meet; by default closer to the horizon, where highlights change most with the view.
    pub view_edges: Vec<f32>,
    /// Where ranges of curvature meet; by default at -0.1 and 0.3 of the largest: on concave surfaces everything that grazing rays meet
    /// faces them, on strongly convex ones only tops are hit.
    pub curvature_edges: Vec<f32>,
    /// Cells of the texture along each axis; default 4.
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
        let [low, high] = kappa_range;
        let largest = low.abs().max(high.abs());
        let inside = |edge: &f32| *edge > low && *edge < high;
        Self {
            views: 128,
            lights: 32,
            view_edges: vec![0.1, 0.2, 0.35, 0.5, 0.75],
            curvature_edges: [-0.1 * largest, 0.3 * largest].into_iter().filter(inside).collect(),
            cells: 4,
            kappa_range,
            seed: 1,
        }
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
    /// Variance of one sample over the square of its mean, averaged in proportion to brightness over views that it was not fitted to.
    pub variance: f64,
    /// Lobes that it has.
    pub lobes: usize,
}

/// What mixtures are made of. Sharper mirrors than 400 are narrower than what networks of this size resolve; forward lobes of 40 are as
/// wide as the highlights of a texel are.
pub(super) const LOBES: [Lobe; 16] = [
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
    Lobe::Forward { sharpness: 40.0, height: -0.15 },
    Lobe::Forward { sharpness: 40.0, height: 0.0 },
    Lobe::Forward { sharpness: 40.0, height: 0.15 },
    Lobe::Forward { sharpness: 40.0, height: 0.3 },
    Lobe::Forward { sharpness: 40.0, height: 0.5 },
];

/// Least weight of the uniform lobe: it bounds the weight of a sample where the fit is wrong.
const UNIFORM: f64 = 0.05;
/// Smaller parts of a mixture are left out: they cost time and change nothing.
const NEGLIGIBLE: f64 = 0.01;
/// How much less variance a larger form must have.
const WORTH: f64 = 0.97;
const ITERATIONS: usize = 60;
/// A part of the grid with fewer views than this has the mixture of all views: it would learn the few by heart.
const FEWEST_VIEWS: usize = 16;

/// Fits a sampler to a material. Deterministic for any number of threads; takes about two seconds of processor time with a compiled
/// model.
#[must_use]
pub fn fit(material: &dyn SilhouetteBtf, options: &FitOptions) -> SamplingFit {
    let train = Views::draw(material, options, options.seed);
    let held_out = Views::draw(material, options, !options.seed);
    let views = Grid { view_edges: options.view_edges.clone(), ..Grid::default() };
    let curved = Grid { curvature_edges: options.curvature_edges.clone(), ..views.clone() };
    let cells = Grid { cells: [options.cells.max(1); 2], ..views.clone() };
    let forms = [
        ("cosine, uniform and below", 3, Grid::default()),
        ("all lobes", LOBES.len(), Grid::default()),
        ("all lobes per band of views", LOBES.len(), views),
        ("all lobes per band and curvature", LOBES.len(), curved),
        ("all lobes per band and cell", LOBES.len(), cells),
    ];
    let mut best: Option<(Sampler, f64)> = None;
    let mut candidates = Vec::new();
    for (name, lobes, grid) in forms {
        let sampler = mixtures(&train, &LOBES[..lobes], grid);
        let variance = held_out.variance(&sampler);
        candidates.push(Candidate { name: name.to_owned(), variance, lobes: sampler.lobes().len() });
        if best.as_ref().is_none_or(|(_, least)| variance < WORTH * least) {
            best = Some((sampler, variance));
        }
    }
    let sampler = best.map_or_else(Sampler::cosine, |(sampler, _)| sampler);
    SamplingFit { sampler, candidates }
}

/// Of the moment of a sample's weight that fits minimise. The second gives the least variance; a larger one gives more weight to what is
/// rare and bright. On foam 2.5 lowers what one weight in ten thousand exceeds by a fifth for a twentieth more variance; 3 by a
/// third for a seventh.
const MOMENT: f64 = 2.5;

/// What a mixture is fitted to: moments to divide by a power of its density, and every lobe's density there.
#[derive(Debug, Clone, Default)]
struct Rows {
    views: usize,
    moments: Vec<f32>,
    densities: Vec<f32>,
}

/// The best mixture of these lobes for every part of the grid.
fn mixtures(views: &Views, lobes: &[Lobe], grid: Grid) -> Sampler {
    let mut parts = vec![Rows::default(); grid.len()];
    for view in views.iter() {
        let rows = &mut parts[grid.index(&view.at)];
        rows.views += 1;
        for light in &view.lights {
            rows.moments.push(moment(light, view.mean));
            rows.densities.extend(lobes.iter().map(|lobe| lobe.pdf(view.at.wo, light.wi)));
        }
    }
    let equal = vec![1.0 / lobes.len() as f64; lobes.len()];
    let whole = least_moment(&parts, equal.clone());
    // Lobes that vanish in the whole may matter in a part.
    let start: Vec<f64> = whole.iter().zip(&equal).map(|(w, e)| (w + e) / 2.0).collect();
    let fitted: Vec<Vec<f64>> = parts
        .par_iter()
        .map(|rows| {
            let enough = grid.len() > 1 && rows.views >= FEWEST_VIEWS;
            let part = std::slice::from_ref(rows);
            without_crumbs(if enough { least_moment(part, start.clone()) } else { whole.clone() })
        })
        .collect();
    let kept = |k: &usize| fitted.iter().any(|weights| weights[*k] > 0.0);
    let kept: Vec<usize> = (0..lobes.len()).filter(kept).collect();
    let weights = fitted.iter().flat_map(|weights| normalised(&kept, weights)).collect();
    let lobes = kept.iter().map(|&k| lobes[k]).collect();
    Sampler::new(lobes, grid, weights).expect("fitted weights are densities")
}

/// Over the mean: a display shows about the square root of the radiance, so that what is seen of noise goes with variance over mean. Over
/// its square, bright views, whose noise is seen, would count as little as black ones.
#[allow(clippy::cast_possible_truncation, reason = "sums over many of them need no more digits")]
fn moment(light: &LitFrom, mean: f64) -> f32 {
    (light.brightness.powf(MOMENT) / (light.density * mean)) as f32
}

fn without_crumbs(mut weights: Vec<f64>) -> Vec<f64> {
    weights[1..].iter_mut().filter(|w| **w < NEGLIGIBLE).for_each(|w| *w = 0.0);
    weights
}

#[allow(clippy::cast_possible_truncation, reason = "weights are f32 in files")]
fn normalised(kept: &[usize], weights: &[f64]) -> Vec<f32> {
    let sum: f64 = kept.iter().map(|&k| weights[k]).sum();
    kept.iter().map(|&k| (weights[k] / sum) as f32).collect()
}

/// Weights that minimise the sum of `moment / density^(MOMENT - 1)` of the mixture, a convex function of them.
///
/// Every step multiplies a weight by a root of its share of the gradient, which leaves their sum near 1 and comes to
/// rest only where all shares of lobes with weight are equal: the condition of the minimum.
fn least_moment(parts: &[Rows], mut weights: Vec<f64>) -> Vec<f64> {
    let lobes = weights.len();
    for _ in 0..ITERATIONS {
        let mut gradient = vec![0.0; lobes];
        for rows in parts {
            for (&moment, densities) in rows.moments.iter().zip(rows.densities.chunks_exact(lobes)) {
                let density: f64 = weights.iter().zip(densities).map(|(w, &p)| w * f64::from(p)).sum();
                let share = f64::from(moment) / density.powf(MOMENT);
                for (g, &p) in gradient.iter_mut().zip(densities) {
                    *g += share * f64::from(p);
                }
            }
        }
        let scale: f64 = weights.iter().zip(&gradient).map(|(w, g)| w * g).sum();
        if scale <= 0.0 || !scale.is_finite() {
            break;
        }
        weights.iter_mut().zip(&gradient).for_each(|(w, g)| *w *= (g / scale).powf(1.0 / MOMENT));
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
    use glam::{Vec2, Vec3};

    use super::*;
    use crate::query::{Answer, Incidence, Query};

    /// Reflects as one lobe does, which depends on the query.
    struct OneLobe(fn(&Query) -> Lobe);

    impl SilhouetteBtf for OneLobe {
        fn eval(&self, query: &Query) -> Answer {
            Answer { rgb: Vec3::splat(self.0(query).pdf(query.wo, query.wi)), alpha: 1.0 }
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
        for material in [
            OneLobe(|_| Lobe::Cosine { tilt: 0.0 }),
            OneLobe(|_| Lobe::Below),
            OneLobe(|_| Lobe::Mirror { sharpness: 40.0 }),
            OneLobe(|_| Lobe::Back { sharpness: 10.0 }),
            OneLobe(|_| Lobe::Forward { sharpness: 40.0, height: 0.3 }),
        ] {
            let candidates = fit(&material, &options()).candidates;
            let best = candidates.iter().map(|c| c.variance).fold(f64::INFINITY, f64::min);
            // With 5 % uniform the variance of sampling a density by itself is at most 0.05 / 0.95; noise adds to it.
            assert!(best < 0.15, "{candidates:?}");
        }
    }

    #[test]
    fn cells_are_kept_where_they_pay() {
        let split =
            OneLobe(|query| if query.uv.x < 0.5 { Lobe::Mirror { sharpness: 40.0 } } else { Lobe::Below });
        let fit_of = |material| fit(&material, &options());
        let (split, even) = (fit_of(split), fit_of(OneLobe(|_| Lobe::Cosine { tilt: 0.0 })));
        assert_eq!(split.sampler.grid().cells, [2, 2], "{:?}", split.candidates);
        assert_eq!(even.sampler.grid(), &Grid::default(), "{:?}", even.candidates);
    }

    #[test]
    fn curvatures_are_told_apart_where_it_pays() {
        // On convex surfaces the highlight sinks to the horizon.
        let bent = OneLobe(|query| Lobe::Forward {
            sharpness: 40.0,
            height: if query.kappa_hat > 0.3 { 0.0 } else { 0.5 },
        });
        let fit = fit(&bent, &options());
        assert_eq!(fit.sampler.grid().curvatures(), 3, "{:?}", fit.candidates);
        // Half of the weight on either lobe has a variance of 1; what is left is noise of few lights and the fit's crumbs.
        let [.., views, curved, _] = &fit.candidates[..] else { panic!("{:?}", fit.candidates) };
        assert!(curved.variance < 0.3 * views.variance, "{:?}", fit.candidates);
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
        assert!(sampler.pdf(&Incidence { uv: Vec2::ZERO, wo: Vec3::Z, kappa_hat: 0.0 }, -Vec3::Z) > 0.0);
    }
}

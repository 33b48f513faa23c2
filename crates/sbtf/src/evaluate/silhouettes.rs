//! Silhouettes on held-out cylinders.
//!
//! A cylinder of this curvature is looked at across its axis from afar. Of the band along its outline that a ray can pass without hitting the
//! material (impact between the bounding surface and the material's depth below it), the *base error* is the share that is
//! empty in truth: there an opaque bounding surface is wrong. What a material gets wrong in that band, in either direction,
//! over the base error, is the share of the base error that it leaves: `(1 - IoU) / (1 - IoU_base)` with the area of the
//! base mesh as the unit.

use glam::{Vec2, Vec3};
use rayon::prelude::*;

use crate::query::SilhouetteBtf;
use crate::random::Random;
use crate::silhouette::cosine_of_dip;

/// What rays are asked.
#[derive(Debug, Clone, PartialEq)]
pub struct SilhouetteOptions {
    /// Curvatures of the cylinders, positive, 1/UV units.
    pub kappas: Vec<f32>,
    /// Rays for each of them.
    pub rays: u32,
    /// Where the rays come from; any but what training used.
    pub seed: u64,
}

impl Default for SilhouetteOptions {
    /// Six curvatures between those of a wall and of a pipe, 100,000 rays each.
    fn default() -> Self {
        Self { kappas: vec![0.1, 0.3, 0.6, 1.0, 1.6, 2.4], rays: 100_000, seed: 0x0005_1100_e77e }
    }
}

/// What came of the rays at one curvature, or at several.
#[derive(Debug, Clone, Copy, PartialEq, serde::Serialize)]
pub struct SilhouetteScore {
    /// Curvature, 1/UV units.
    pub kappa: f32,
    /// Width of the empty part of the band, UV units: the base error.
    pub base: f64,
    /// Width of what is opaque and should not be.
    pub excess: f64,
    /// Width of what should be opaque and is not.
    pub missing: f64,
}

impl SilhouetteScore {
    /// Share of the base error that is left; 0 where there is none to begin with and nothing is wrong.
    #[must_use]
    pub fn left(&self) -> f64 {
        let wrong = self.excess + self.missing;
        if wrong == 0.0 { 0.0 } else { wrong / self.base }
    }
}

/// The sum over curvatures, each weighted by the width of what it shows.
#[must_use]
pub fn total(scores: &[SilhouetteScore]) -> SilhouetteScore {
    let sum = |value: fn(&SilhouetteScore) -> f64| scores.iter().map(value).sum();
    SilhouetteScore {
        kappa: f32::NAN,
        base: sum(|s| s.base),
        excess: sum(|s| s.excess),
        missing: sum(|s| s.missing),
    }
}

/// Compares the silhouettes of a material of this depth with the true ones; one score per curvature.
///
/// Rays are stratified in their impact, and even over the tile and over azimuths. Opacities between 0 and 1 count as shares.
pub fn silhouettes(
    truth: &dyn SilhouetteBtf,
    test: &dyn SilhouetteBtf,
    depth: f32,
    options: &SilhouetteOptions,
) -> Vec<SilhouetteScore> {
    options.kappas.iter().map(|&kappa| score(truth, test, depth, kappa, options)).collect()
}

fn score(
    truth: &dyn SilhouetteBtf,
    test: &dyn SilhouetteBtf,
    depth: f32,
    kappa: f32,
    options: &SilhouetteOptions,
) -> SilhouetteScore {
    let ray = |index: u32| {
        let mut random = Random::new(options.seed, u64::from(kappa.to_bits()), index.into());
        let dip = (index as f32 + random.unit()) / options.rays as f32;
        let uv = Vec2::new(random.unit(), random.unit());
        let cosine = cosine_of_dip(dip, kappa, depth);
        let sine = (1.0 - cosine * cosine).sqrt();
        let (y, x) = (std::f32::consts::TAU * random.unit()).sin_cos();
        let wo = Vec3::new(sine * x, sine * y, cosine);
        let (a, b) = (f64::from(truth.alpha(uv, wo, kappa)), f64::from(test.alpha(uv, wo, kappa)));
        [1.0 - a, (b - a).max(0.0), (a - b).max(0.0)]
    };
    // Summed in a fixed order, so that threads do not matter.
    let rays: Vec<[f64; 3]> = (0..options.rays).into_par_iter().map(ray).collect();
    let width = f64::from(depth) / f64::from(options.rays);
    let sum = |k: usize| width * rays.iter().map(|r| r[k]).sum::<f64>();
    SilhouetteScore { kappa, base: sum(0), excess: sum(1), missing: sum(2) }
}

#[cfg(test)]
mod tests {
    use super::*;
    use crate::query::{Answer, Query};
    use crate::silhouette::dip_of_cosine;

    /// Opaque from this dip on.
    struct Step(f32);

    impl SilhouetteBtf for Step {
        fn eval(&self, _: &Query) -> Answer {
            unreachable!("only opacity is asked")
        }

        fn alpha(&self, _: Vec2, wo: Vec3, kappa_hat: f32) -> f32 {
            if dip_of_cosine(wo.z, kappa_hat, 0.1) >= self.0 { 1.0 } else { 0.0 }
        }
    }

    #[test]
    fn steps_at_different_dips() {
        let options = SilhouetteOptions { rays: 10_000, ..Default::default() };
        let of = |truth: f32, test: f32| total(&silhouettes(&Step(truth), &Step(test), 0.1, &options));
        // The unit of all is the width of the six bands, 0.6.
        let too_early = of(0.5, 0.4);
        assert!(
            (too_early.base - 0.3).abs() < 1e-4 && (too_early.excess - 0.06).abs() < 1e-4,
            "{too_early:?}"
        );
        assert!((too_early.left() - 0.2).abs() < 1e-3 && too_early.missing == 0.0);
        let too_late = of(0.5, 0.55);
        assert!((too_late.left() - 0.1).abs() < 1e-3 && too_late.excess == 0.0);
        assert_eq!(of(0.0, 0.0).left(), 0.0);
        assert!((of(0.3, 0.0).left() - 1.0).abs() < 1e-3, "an opaque base leaves all of its error");
    }
}

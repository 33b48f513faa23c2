//! Pictures of a material on held-out patches, beside exact ones.

use std::sync::Arc;

use glam::{Vec2, Vec3};

use crate::query::{Answer, Query, SilhouetteBtf};
use crate::random::Random;

/// Which pictures.
#[derive(Debug, Clone, PartialEq)]
pub struct AppearanceOptions {
    /// Curvatures, 1/UV units.
    pub kappas: Vec<f32>,
    /// Pairs of viewer and light at each of them. Scores of shiny materials over few pairs say little: four of them can be off by over a
    /// decibel.
    pub pairs: u32,
    /// Pixels along u and v; a picture shows the tile once.
    pub size: u32,
    /// Where viewers and lights come from; any but what training used.
    pub seed: u64,
}

impl Default for AppearanceOptions {
    fn default() -> Self {
        Self { kappas: vec![-1.5, 0.0, 0.5, 1.5, 2.4], pairs: 16, size: 96, seed: 0xa99e_a4a2_ce00 }
    }
}

/// The tile seen from one direction under one light: what an orthographic viewer sees who looks along `-wo` at every point.
#[derive(Debug, Clone)]
pub struct Pair {
    /// Curvature, 1/UV units.
    pub kappa: f32,
    /// Direction to the viewer.
    pub wo: Vec3,
    /// Direction to the light.
    pub wi: Vec3,
    /// Exact radiance under irradiance pi, row of the highest v first; black where the ray passes.
    pub truth: Arc<[Vec3]>,
    /// The tested material's.
    pub test: Vec<Vec3>,
}

/// Asks all materials for the same pictures; those of each of `tests`, beside those of `truth`.
pub fn appearance_pairs(
    truth: &dyn SilhouetteBtf,
    tests: &[&dyn SilhouetteBtf],
    options: &AppearanceOptions,
) -> Vec<Vec<Pair>> {
    let mut pairs = vec![Vec::new(); tests.len()];
    for &kappa in &options.kappas {
        for index in 0..options.pairs {
            let mut random = Random::new(options.seed, u64::from(kappa.to_bits()), index.into());
            let wo = direction(&mut random, 0.15..0.95);
            let wi = direction(&mut random, -0.1..0.95);
            let queries: Vec<Query> =
                pixels(options.size).map(|uv| Query { uv, wo, wi, kappa_hat: kappa }).collect();
            let ask = |btf: &dyn SilhouetteBtf| {
                let mut answers = vec![Answer::default(); queries.len()];
                btf.eval_batch(&queries, &mut answers);
                answers.iter().map(|a| std::f32::consts::PI * a.alpha * a.rgb).collect::<Vec<Vec3>>()
            };
            let truth: Arc<[Vec3]> = ask(truth).into();
            for (pairs, test) in pairs.iter_mut().zip(tests) {
                pairs.push(Pair { kappa, wo, wi, truth: Arc::clone(&truth), test: ask(*test) });
            }
        }
    }
    pairs
}

/// A direction of even azimuth, its cosine even in the range.
fn direction(random: &mut Random, cosines: std::ops::Range<f32>) -> Vec3 {
    let cosine = cosines.start + (cosines.end - cosines.start) * random.unit();
    let sine = (1.0 - cosine * cosine).sqrt();
    let (y, x) = (std::f32::consts::TAU * random.unit()).sin_cos();
    Vec3::new(sine * x, sine * y, cosine)
}

/// Texture coordinates of the pixels' centres, the row of the highest v first.
fn pixels(size: u32) -> impl Iterator<Item = Vec2> {
    let at = move |i: u32| (i as f32 + 0.5) / size as f32;
    (0..size * size).map(move |i| Vec2::new(at(i % size), 1.0 - at(i / size)))
}

#[cfg(test)]
mod tests {
    use super::*;

    struct Plain(f32);

    impl SilhouetteBtf for Plain {
        fn eval(&self, query: &Query) -> Answer {
            Answer { rgb: Vec3::splat(self.0 * query.uv.y), alpha: 1.0 }
        }

        fn alpha(&self, _: Vec2, _: Vec3, _: f32) -> f32 {
            1.0
        }
    }

    #[test]
    fn pictures_stand_upright_and_are_scaled() {
        let options = AppearanceOptions { size: 4, pairs: 1, ..Default::default() };
        let found = appearance_pairs(&Plain(1.0), &[&Plain(0.5), &Plain(0.25)], &options);
        for (pairs, share) in found.into_iter().zip([0.5, 0.25]) {
            assert_eq!(pairs.len(), options.kappas.len());
            for pair in pairs {
                assert!((pair.truth[0].x - std::f32::consts::PI * 0.875).abs() < 1e-6);
                assert!((pair.test[15].x - std::f32::consts::PI * 0.125 * share).abs() < 1e-6);
                assert!(pair.wo.z > 0.0 && pair.wo.is_normalized() && pair.wi.is_normalized());
            }
        }
    }
}

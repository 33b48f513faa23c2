//! [`Views`]: what a material shows to views from all sides, under lights that are drawn so that highlights are met.

use std::f32::consts::TAU;

use glam::{Vec2, Vec3};
use rayon::prelude::*;

use super::fit::LOBES;
use super::{FitOptions, Grid, Sampler};
use crate::query::{Answer, Incidence, Query, SilhouetteBtf};
use crate::random::Random;

/// Lit views of a material.
pub(super) struct Views {
    views: Vec<View>,
}

/// One view that hits, and what it shows under several lights.
pub(super) struct View {
    pub at: Incidence,
    pub lights: Vec<LitFrom>,
    /// Brightness under light of radiance 1 from everywhere, estimated; over 0.
    pub mean: f64,
}

/// A light of a view.
#[derive(Debug, Clone, Copy)]
pub(super) struct LitFrom {
    pub wi: Vec3,
    /// What the view reflects of it.
    pub brightness: f64,
    /// With which it was drawn.
    pub density: f64,
}

impl Views {
    /// Views of all directions, places and curvatures; lights from all lobes alike, so that sharp highlights are met.
    pub(super) fn draw(material: &dyn SilhouetteBtf, options: &FitOptions, seed: u64) -> Self {
        let parts = (options.view_edges.len() + 1) * options.cells.max(1).pow(2);
        let equal = vec![1.0 / LOBES.len() as f32; LOBES.len()];
        let proposal = Sampler::new(LOBES.to_vec(), Grid::default(), equal).expect("equal weights");
        let views = (0..options.views.max(1) * parts).into_par_iter().filter_map(|index| {
            let mut random = Random::new(seed, 0, index as u64);
            let at = incidence(&mut random, [0.0, 1.0], options.kappa_range);
            View::light(material, at, &proposal, options.lights.max(1), &mut random)
        });
        Self { views: views.collect() }
    }

    pub(super) fn iter(&self) -> impl Iterator<Item = &View> {
        self.views.iter()
    }

    /// Variance of one sample over the square of its mean, averaged over views in proportion to their brightness.
    pub(super) fn variance(&self, sampler: &Sampler) -> f64 {
        // Second moment over mean, of which the average in proportion to means is a plain sum.
        let second = |view: &View| {
            let square = |light: &LitFrom| {
                light.brightness.powi(2) / (light.density * f64::from(sampler.pdf(&view.at, light.wi)))
            };
            view.lights.iter().map(square).sum::<f64>() / (view.lights.len() as f64 * view.mean)
        };
        let brightness: f64 = self.views.iter().map(|view| view.mean).sum();
        // Cannot be negative but by noise of the estimate.
        if brightness > 0.0 { self.views.iter().map(second).sum::<f64>() / brightness - 1.0 } else { 0.0 }
    }
}

impl View {
    /// `None` where the ray passes above the material, and where nothing is reflected.
    fn light(
        material: &dyn SilhouetteBtf,
        at: Incidence,
        proposal: &Sampler,
        lights: usize,
        random: &mut Random,
    ) -> Option<Self> {
        let lights = lit(material, at, proposal, lights, random)?;
        let weight = |light: &LitFrom| light.brightness / light.density;
        let mean = lights.iter().map(weight).sum::<f64>() / lights.len() as f64;
        (mean > 0.0).then_some(Self { at, lights, mean })
    }
}

/// A view with `cos_o` in a range, of any place, azimuth and curvature in a range.
pub(super) fn incidence(random: &mut Random, [from, to]: [f32; 2], [low, high]: [f32; 2]) -> Incidence {
    let uv = Vec2::new(random.unit(), random.unit());
    // At 1e-3 the tangent plane is a thousandth away.
    let (z, angle) = ((from + (to - from) * random.unit()).max(1e-3), TAU * random.unit());
    let radius = (1.0 - z * z).max(0.0).sqrt();
    let wo = Vec3::new(radius * angle.cos(), radius * angle.sin(), z);
    Incidence { uv, wo, kappa_hat: low + (high - low) * random.unit() }
}

/// Lights that a sampler draws; `None` where the ray passes above the material.
pub(super) fn lit(
    material: &dyn SilhouetteBtf,
    at: Incidence,
    sampler: &Sampler,
    count: usize,
    random: &mut Random,
) -> Option<Vec<LitFrom>> {
    let Incidence { uv, wo, kappa_hat } = at;
    if material.alpha(uv, wo, kappa_hat) <= 0.0 {
        return None;
    }
    let drawn: Vec<(Vec3, f32)> = (0..count)
        .map(|_| sampler.sample(&at, random.unit(), Vec2::new(random.unit(), random.unit())))
        .collect();
    let queries: Vec<Query> = drawn.iter().map(|&(wi, _)| Query { uv, wo, wi, kappa_hat }).collect();
    let mut answers = vec![Answer::default(); count];
    material.eval_batch(&queries, &mut answers);
    let light = |(&(wi, density), answer): (&(Vec3, f32), &Answer)| {
        let brightness = f64::from(answer.rgb.element_sum()) / 3.0;
        LitFrom { wi, brightness, density: density.into() }
    };
    Some(drawn.iter().zip(&answers).map(light).collect())
}

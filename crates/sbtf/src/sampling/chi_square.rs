//! Pearson's chi-square test of a sampler against its density, on bins over the sphere.

use std::f64::consts::{PI, TAU};

use glam::{Vec2, Vec3};

use crate::chi_square::p_value;

/// Bins in z and in azimuth.
const BINS: [usize; 2] = [24, 32];
/// Midpoints per bin of the integral, along z and azimuth: a lobe of sharpness 60 at the pole is off by 4e-4.
const POINTS: [usize; 2] = [48, 8];
#[derive(Debug)]
pub(super) struct ChiSquare {
    /// Chance of a statistic at least as large, were sampler and density the same.
    pub p_value: f64,
    /// Of the density over the sphere.
    pub integral: f64,
}

/// Draws `count` samples with a fixed seed and compares their bins with the density's integrals.
pub(super) fn test(
    sample: impl Fn(f32, Vec2) -> (Vec3, f32),
    pdf: impl Fn(Vec3) -> f32,
    count: usize,
    seed: u64,
) -> ChiSquare {
    let mut random = crate::random::Random::new(seed, 0, 0);
    let mut observed = vec![0.0; BINS[0] * BINS[1]];
    for _ in 0..count {
        let (wi, _) = sample(random.unit(), Vec2::new(random.unit(), random.unit()));
        observed[bin(wi)] += 1.0;
    }
    let expected: Vec<f64> = (0..observed.len()).map(|k| integral(k, &pdf)).collect();
    let total: f64 = expected.iter().sum();
    let counts: Vec<f64> = expected.iter().map(|share| share * count as f64).collect();
    ChiSquare { p_value: p_value(&observed, &counts), integral: total }
}

#[allow(clippy::cast_possible_truncation, clippy::cast_sign_loss, reason = "saturating, then clamped")]
fn bin(w: Vec3) -> usize {
    let z = ((f64::from(w.z) + 1.0) / 2.0 * BINS[0] as f64) as usize;
    let turn = (f64::from(w.y).atan2(f64::from(w.x)) + PI) / TAU;
    z.min(BINS[0] - 1) * BINS[1] + ((turn * BINS[1] as f64) as usize).min(BINS[1] - 1)
}

/// Of the density over a bin.
#[allow(clippy::cast_possible_truncation, reason = "directions are f32")]
fn integral(bin: usize, pdf: &impl Fn(Vec3) -> f32) -> f64 {
    let at = |k: usize, i: usize, axis: usize| {
        (k as f64 + (i as f64 + 0.5) / POINTS[axis] as f64) / BINS[axis] as f64
    };
    let mut sum = 0.0;
    for i in 0..POINTS[0] {
        let z = 2.0 * at(bin / BINS[1], i, 0) - 1.0;
        for j in 0..POINTS[1] {
            let angle = TAU * at(bin % BINS[1], j, 1) - PI;
            let r = (1.0 - z * z).sqrt();
            let w = [r * angle.cos(), r * angle.sin(), z].map(|x| x as f32);
            sum += f64::from(pdf(Vec3::from(w)));
        }
    }
    sum * 4.0 * PI / (BINS[0] * BINS[1] * POINTS[0] * POINTS[1]) as f64
}

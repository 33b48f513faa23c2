//! Photometric stereo: normal and albedo of each texel from its brightness under several lights.

use glam::{Mat3, Vec3};
use rayon::prelude::*;

use super::Problem;
use crate::micro::Grid;

/// Rounds of reweighting; weights change by under a percent after six.
const ROUNDS: usize = 8;
/// Below this share of the brightest observation, an observation is a shadow, whatever the fit says.
const SHADOW: f32 = 0.02;
/// Residuals beyond so many robust standard deviations do not count (Tukey's biweight; 4.685 is efficient for Gaussian noise).
const TUKEY: f32 = 4.685;
/// Residuals are at least so large a share of the brightness: quantisation, and that no surface is exactly matt.
const NOISE_FLOOR: f32 = 0.003;

/// What the images say.
#[derive(Debug, Clone)]
pub struct Estimate {
    /// Unit normals, z > 0.
    pub normals: Grid<Vec3>,
    /// Linear RGB, not clamped.
    pub albedo: Grid<Vec3>,
    /// Root mean square residual of the observations that were used, over their mean.
    pub residual: f32,
    /// Share of the observations that were left out.
    pub left_out: f32,
}

/// Refuses lights that do not determine a normal.
pub(super) fn check_lights(directions: &[Vec3]) -> Result<(), Problem> {
    let spread = smallest_spread(directions.iter().map(|&d| (d, 1.0)));
    // The error of a normal is that of the images over the root of this: tenfold at 0.01.
    if spread < 0.01 {
        let message = "the lights nearly lie in one plane with the surface's point, which leaves the normals open; add lights from other sides";
        return Err(Problem::key("direction", message));
    }
    Ok(())
}

/// A lower bound of the smallest eigenvalue of the mean of `d d^T`, times three: about 0.4 for lights from everywhere, 0 for lights in a plane.
fn smallest_spread(weighted: impl Iterator<Item = (Vec3, f32)>) -> f32 {
    let (sum, total) = moments(weighted);
    if total <= 0.0 {
        return 0.0;
    }
    let m = sum * (1.0 / total);
    // det = e1 e2 e3 with e2, e3 at most the trace's halves.
    let trace = m.x_axis.x + m.y_axis.y + m.z_axis.z;
    3.0 * m.determinant() / (0.25 * trace * trace)
}

fn moments(weighted: impl Iterator<Item = (Vec3, f32)>) -> (Mat3, f32) {
    weighted.fold((Mat3::ZERO, 0.0), |(m, total), (d, w)| {
        (m + Mat3::from_cols(d * (w * d.x), d * (w * d.y), d * (w * d.z)), total + w)
    })
}

/// Normals and albedos of `size * size` texels from one row-major image per light, in units of the light's intensity.
///
/// Each texel starts from the observations between its shadows and highlights by rank, and is refined by reweighted least squares
/// in which what disagrees with the matt model, shadows and highlights above all, loses its weight.
///
/// # Panics
///
/// If the images have not that many texels, or there is not one direction per image.
#[must_use]
pub fn estimate(observations: &[Vec<Vec3>], directions: &[Vec3], size: usize) -> Estimate {
    assert_eq!(observations.len(), directions.len(), "one direction per image");
    assert!(observations.iter().all(|image| image.len() == size * size), "square images of one size");
    let texels: Vec<Texel> =
        (0..size * size).into_par_iter().map(|i| solve_texel(observations, directions, i)).collect();
    let sum = |value: fn(&Texel) -> f64| texels.iter().map(value).sum::<f64>();
    let used = sum(|t| t.used).max(1.0);
    let mean = (sum(|t| t.brightness) / used).max(f64::MIN_POSITIVE);
    #[allow(clippy::cast_possible_truncation, reason = "a report")]
    Estimate {
        normals: Grid::new(size, size, texels.iter().map(|t| t.normal).collect()),
        albedo: Grid::new(size, size, texels.iter().map(|t| t.albedo).collect()),
        residual: ((sum(|t| t.squares) / used).sqrt() / mean) as f32,
        left_out: (1.0 - sum(|t| t.used) / (directions.len() * texels.len()) as f64) as f32,
    }
}

struct Texel {
    normal: Vec3,
    albedo: Vec3,
    /// Sums over the observations that count: how many, their brightness, their squared residuals.
    used: f64,
    brightness: f64,
    squares: f64,
}

fn solve_texel(observations: &[Vec<Vec3>], directions: &[Vec3], i: usize) -> Texel {
    let grey: Vec<f32> = observations.iter().map(|image| image[i].element_sum() / 3.0).collect();
    let mut weights = by_rank(&grey);
    let mut fit = solve(directions, &grey, &weights);
    for _ in 0..ROUNDS {
        let Some(b) = fit else { break };
        let refined = reweighted(directions, &grey, b);
        if smallest_spread(directions.iter().copied().zip(refined.iter().copied())) < 0.005 {
            break;
        }
        weights = refined;
        fit = solve(directions, &grey, &weights);
    }
    let b = fit.or_else(|| solve(directions, &grey, &vec![1.0; grey.len()])).unwrap_or(Vec3::Z);
    // A slope over 80 degrees is no reading of a camera above.
    let normal = b.normalize_or(Vec3::Z);
    let normal = normal.with_z(normal.z.max(0.17)).normalize();
    let (mut colour, mut shading) = (Vec3::ZERO, 0.0);
    let (mut used, mut brightness, mut squares) = (0.0, 0.0, 0.0);
    for (k, (&d, &w)) in directions.iter().zip(&weights).enumerate() {
        let cosine = d.dot(normal).max(0.0);
        colour += observations[k][i] * (w * cosine);
        shading += w * cosine * cosine;
        // Half the weight: the biweight at about two and a half standard deviations.
        if w > 0.5 {
            used += 1.0;
            brightness += f64::from(grey[k]);
            squares += f64::from(grey[k] - d.dot(b)).powi(2);
        }
    }
    let albedo = if shading > 0.0 { colour / shading } else { Vec3::ZERO };
    Texel { normal, albedo, used, brightness, squares }
}

/// 1 for the observations between the darkest third and the brightest tenth, as long as four remain; 0 for the others.
fn by_rank(grey: &[f32]) -> Vec<f32> {
    let n = grey.len();
    let (mut dark, mut bright) = (n / 3, n / 10);
    while n - dark - bright < 4.min(n) {
        if dark > 0 { dark -= 1 } else { bright -= 1 }
    }
    let mut order: Vec<usize> = (0..n).collect();
    order.sort_by(|&a, &b| grey[a].total_cmp(&grey[b]));
    let mut weights = vec![0.0; n];
    order[dark..n - bright].iter().for_each(|&k| weights[k] = 1.0);
    weights
}

/// Weights by how well each observation agrees with `b`, albedo times normal.
fn reweighted(directions: &[Vec3], grey: &[f32], b: Vec3) -> Vec<f32> {
    let residuals: Vec<f32> = directions.iter().zip(grey).map(|(d, g)| g - d.dot(b)).collect();
    let brightest = grey.iter().copied().fold(0.0, f32::max);
    let lit = |k: usize| grey[k] > SHADOW * brightest && directions[k].dot(b) > 0.0;
    let mut sizes: Vec<f32> = (0..grey.len()).filter(|&k| lit(k)).map(|k| residuals[k].abs()).collect();
    sizes.sort_by(f32::total_cmp);
    // The median over that of a Gaussian.
    let median = sizes.get(sizes.len() / 2).copied().unwrap_or(0.0);
    let scale = (median / 0.6745).max(NOISE_FLOOR * brightest).max(f32::MIN_POSITIVE);
    let weight = |k: usize| {
        let x = residuals[k] / (TUKEY * scale);
        if lit(k) && x.abs() < 1.0 { (1.0 - x * x).powi(2) } else { 0.0 }
    };
    (0..grey.len()).map(weight).collect()
}

/// The weighted least squares `d . b = grey`; `None` where it is not determined.
fn solve(directions: &[Vec3], grey: &[f32], weights: &[f32]) -> Option<Vec3> {
    let (matrix, total) = moments(directions.iter().copied().zip(weights.iter().copied()));
    // Singular to single precision.
    if total <= 0.0 || matrix.determinant() <= 1e-6 * total.powi(3) {
        return None;
    }
    let right: Vec3 = directions.iter().zip(grey).zip(weights).map(|((&d, &g), &w)| d * (g * w)).sum();
    let b = matrix.inverse() * right;
    (b.is_finite() && b.z > 0.0).then_some(b)
}

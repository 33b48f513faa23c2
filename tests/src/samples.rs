//! Estimates beside the truth on the irregular shapes of the studies.

use osculate_geom::curvature::{CurvatureOptions, Principal, VertexCurvature, estimate};
use osculate_geom::mesh::{Surface, Weld};
use osculate_geom::shapes::study::{StudyShape, add_noise};
use osculate_geom::{Mesh, Vec3};

/// One vertex, its errors relative to the shape's radius of curvature.
#[derive(Debug, Clone, Copy)]
pub struct Sample {
    /// Where the vertex is without noise.
    pub point: Vec3,
    /// The truth there.
    pub exact: Principal,
    /// What was estimated.
    pub estimate: VertexCurvature,
    /// Error of the worse curvature; infinite without an estimate.
    pub error: f64,
    /// Stated error; zero without an estimate, so that saying nothing does not count as being right.
    pub stated: f64,
}

impl Sample {
    /// Angle between the directions of the maximum, degrees; 90 without an estimate.
    #[must_use]
    pub fn angle(&self) -> f64 {
        let Some(found) = self.estimate.principal else { return 90.0 };
        found.d1.cross(&self.exact.d1).norm().atan2(found.d1.dot(&self.exact.d1).abs()).to_degrees()
    }
}

/// A shape of about so many vertices, made from `seeds[0]` and moved by `noise` mean edges from `seeds[1]`, with estimates.
#[must_use]
pub fn samples(
    shape: StudyShape,
    vertices: usize,
    seeds: [u64; 2],
    noise: f64,
    options: &CurvatureOptions,
) -> Vec<Sample> {
    let clean = shape.mesh(vertices, seeds[0]);
    let estimates = run(&add_noise(&clean, noise, seeds[1]), options);
    let radius = shape.radius();
    let sample = |(point, estimate): (&Vec3, VertexCurvature)| {
        let exact = shape.exact(point);
        let error = estimate.principal.map_or(f64::INFINITY, |found| {
            (found.kappa_max - exact.kappa_max).abs().max((found.kappa_min - exact.kappa_min).abs()) * radius
        });
        let stated = if estimate.principal.is_some() { estimate.error * radius } else { 0.0 };
        Sample { point: *point, exact, estimate, error, stated }
    };
    std::iter::zip(clean.positions(), estimates).map(sample).collect()
}

/// Estimates at the vertices of a mesh as it is.
///
/// # Panics
///
/// If the options are not valid.
#[must_use]
pub fn run(mesh: &Mesh, options: &CurvatureOptions) -> Vec<VertexCurvature> {
    estimate(&Surface::new(mesh, Weld::Off), options).expect("valid options")
}

/// What `percent` of the values are at most.
#[must_use]
pub fn quantile(values: impl Iterator<Item = f64>, percent: usize) -> f64 {
    let mut values: Vec<f64> = values.collect();
    values.sort_by(f64::total_cmp);
    values[(values.len() - 1) * percent / 100]
}

/// Share of the vertices whose error is at most the stated one.
#[must_use]
pub fn covered(samples: &[Sample]) -> f64 {
    samples.iter().filter(|s| s.error <= s.stated).count() as f64 / samples.len() as f64
}

/// Median of the stated over the true error.
#[must_use]
pub fn looseness(samples: &[Sample]) -> f64 {
    quantile(samples.iter().map(|s| s.stated / s.error.max(1e-300)), 50)
}

/// Geometric mean of positive numbers.
#[must_use]
pub fn geometric_mean(values: &[f64]) -> f64 {
    (values.iter().map(|v| v.ln()).sum::<f64>() / values.len() as f64).exp()
}

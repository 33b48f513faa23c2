//! Queries spread over a surface, for measuring filters.

use super::filter::FilterQuery;
use super::surface_field::{CurvatureField, SurfacePoint};
use super::walk_length::WalkLength;
use crate::Vec3;

/// `count` queries spread evenly: points over the area, directions over the hemisphere about the normal, by the additive
/// recurrence of the roots of `x^6 = x + 1` (Roberts, "The unreasonable effectiveness of quasirandom sequences", 2018).
///
/// The same queries for the same field. Triangles without area, and points whose corners' normals cancel, are left out, so
/// that there may be fewer than `count`.
#[must_use]
pub fn spread_queries(field: &CurvatureField<'_>, count: usize, length: WalkLength) -> Vec<FilterQuery> {
    let surface = field.surface();
    let mut areas = Vec::with_capacity(surface.triangles().len());
    let mut total = 0.0;
    for triangle in 0..surface.triangles().len() {
        let [a, b, c] = surface.corners(triangle);
        total += (b - a).cross(&(c - a)).norm();
        areas.push(total);
    }
    if total <= 0.0 {
        return Vec::new();
    }
    (0..count).filter_map(|index| query(field, &areas, sequence(index), length)).collect()
}

/// Largest root of `x^6 = x + 1`: the sequence's steps are its powers.
const ROOT: f64 = 1.134_724_138_401_519_4;

fn sequence(index: usize) -> [f64; 5] {
    std::array::from_fn(|k| {
        let step = ROOT.powi(-i32::try_from(k + 1).expect("at most five"));
        (0.5 + step * (index + 1) as f64).fract()
    })
}

fn query(field: &CurvatureField<'_>, areas: &[f64], u: [f64; 5], length: WalkLength) -> Option<FilterQuery> {
    let target = u[0] * areas.last()?;
    let triangle = areas.partition_point(|&sum| sum <= target).min(areas.len() - 1);
    // Folding the square onto the triangle keeps the points even.
    let (x, y) = if u[1] + u[2] > 1.0 { (1.0 - u[1], 1.0 - u[2]) } else { (u[1], u[2]) };
    let point = SurfacePoint { triangle, barycentric: [1.0 - x - y, x, y] };
    let n = field.unit_normal(point)?;
    let axis = Vec3::ith(n.iamin(), 1.0);
    let t = (axis - n * n.dot(&axis)).normalize();
    let (sin, cos) = (std::f64::consts::TAU * u[3]).sin_cos();
    let sine = (1.0 - u[4] * u[4]).sqrt();
    let w = n * u[4] + (t * cos + n.cross(&t) * sin) * sine;
    Some(FilterQuery { point, w, length })
}

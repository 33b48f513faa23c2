//! The quadratic patch over a triangle, which the section is lifted onto.

use crate::Vec3;
use crate::field::section::{Piece, SideEnd};
use crate::field::surface_field::{CurvatureField, SurfacePoint};

/// Height of the quadratic patch above the triangle.
pub(super) fn lift(field: &CurvatureField<'_>, point: SurfacePoint) -> f64 {
    let b = point.barycentric;
    let side = |k: usize| {
        let weight = b[k] * b[(k + 1) % 3];
        if weight == 0.0 { 0.0 } else { weight * bend(field, point.triangle, k) }
    };
    0.5 * (side(0) + side(1) + side(2))
}

/// The same where a side is crossed.
pub(super) fn lift_on_side(field: &CurvatureField<'_>, [one, two]: &[SideEnd; 2]) -> f64 {
    let weight = one.weight * two.weight;
    let edge = two.position - one.position;
    let (mut sum, mut count) = (0.0, 0.0);
    for bend in [field.bend(one.vertex), field.bend(two.vertex)] {
        if bend.is_known {
            sum += bend.form(&edge);
            count += 1.0;
        }
    }
    if count > 0.0 { 0.5 * weight * sum / (count * field.bend_scale()) } else { 0.0 }
}

/// The second fundamental form along a side of a triangle: the mean of those corners that have an estimate.
fn bend(field: &CurvatureField<'_>, triangle: usize, side: usize) -> f64 {
    let corners = field.surface().triangles()[triangle];
    let (a, b) = (corners[side], corners[(side + 1) % 3]);
    let positions = field.surface().positions();
    let edge = positions[b as usize] - positions[a as usize];
    let (mut sum, mut count) = (0.0, 0.0);
    for principal in [a, b].into_iter().filter_map(|v| field.principal(v)) {
        let (x1, x2) = (principal.d1.dot(&edge), principal.d2.dot(&edge));
        sum += principal.kappa_max * x1 * x1 + principal.kappa_min * x2 * x2;
        count += 1.0;
    }
    if count > 0.0 { sum / count } else { 0.0 }
}

/// The lifted section's unit tangent at the start; `None` where the first piece is too short to have a direction.
pub(super) fn lifted_tangent(field: &CurvatureField<'_>, normal: Vec3, piece: &Piece) -> Option<Vec3> {
    /// Relative to the triangle's longest side. The direction of a shorter piece carries the rounding of its ends.
    const SHORTEST: f64 = 1e-6;
    let along = piece.exit.position - piece.from_position;
    if along.norm() <= SHORTEST * longest_side(field, piece.from.triangle) {
        return None;
    }
    let (from, to) = (piece.from.barycentric, piece.exit.point.barycentric);
    let rise: f64 = (0..3)
        .map(|i| {
            let j = (i + 1) % 3;
            let change = (to[i] - from[i]) * from[j] + from[i] * (to[j] - from[j]);
            0.5 * change * bend(field, piece.from.triangle, i)
        })
        .sum();
    (along + normal * rise).try_normalize(0.0)
}

pub(super) fn longest_side(field: &CurvatureField<'_>, triangle: usize) -> f64 {
    let [a, b, c] = field.surface().corners(triangle);
    (b - a).norm_squared().max((c - b).norm_squared()).max((a - c).norm_squared()).sqrt()
}

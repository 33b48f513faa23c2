//! The quadratic patch over a triangle, which the section is lifted onto.

use crate::Vec3;
use crate::curvature::Principal;
use crate::field::section::{Piece, SideEnd, longest_side};
use crate::field::surface_field::CurvatureField;

/// The quadratic patch over a triangle.
pub(super) struct Patch {
    /// The second fundamental form along each side.
    bends: [f64; 3],
    /// Length of the longest side.
    pub longest_side: f64,
}

impl Patch {
    pub fn new(field: &CurvatureField<'_>, triangle: usize) -> Self {
        let (corners, vertices) = (field.surface().corners(triangle), field.surface().triangles()[triangle]);
        let estimates = vertices.map(|v| field.principal(v));
        let edges = [0, 1, 2].map(|k| corners[(k + 1) % 3] - corners[k]);
        let bends = [0, 1, 2].map(|k| bend(&edges[k], [estimates[k], estimates[(k + 1) % 3]]));
        Self { bends, longest_side: longest_side(corners) }
    }

    /// Height above the triangle.
    pub fn lift(&self, [a, b, c]: [f64; 3]) -> f64 {
        // A side without a share counts for nothing, however wild the estimates at its ends.
        let side = |weight: f64, bend: f64| if weight == 0.0 { 0.0 } else { weight * bend };
        let [ab, bc, ca] = self.bends;
        0.5 * (side(a * b, ab) + side(b * c, bc) + side(c * a, ca))
    }

    /// The lifted section's unit tangent at the start; `None` where the first piece is too short to have a direction.
    pub fn lifted_tangent(&self, normal: Vec3, piece: &Piece) -> Option<Vec3> {
        /// Relative to the triangle's longest side. The direction of a shorter piece carries the rounding of its ends.
        const SHORTEST: f64 = 1e-6;
        let along = piece.exit.position - piece.from_position;
        if along.norm() <= SHORTEST * self.longest_side {
            return None;
        }
        let (from, to) = (piece.from.barycentric, piece.exit.point.barycentric);
        let rise: f64 = (0..3)
            .map(|i| {
                let j = (i + 1) % 3;
                let change = (to[i] - from[i]) * from[j] + from[i] * (to[j] - from[j]);
                0.5 * change * self.bends[i]
            })
            .sum();
        (along + normal * rise).try_normalize(0.0)
    }
}

/// The second fundamental form along a side: the mean of those ends that have an estimate.
fn bend(edge: &Vec3, ends: [Option<&Principal>; 2]) -> f64 {
    let (mut sum, mut count) = (0.0, 0.0);
    for principal in ends.into_iter().flatten() {
        let (x1, x2) = (principal.d1.dot(edge), principal.d2.dot(edge));
        sum += principal.kappa_max * x1 * x1 + principal.kappa_min * x2 * x2;
        count += 1.0;
    }
    if count > 0.0 { sum / count } else { 0.0 }
}

/// Height of the patch where a side is crossed.
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

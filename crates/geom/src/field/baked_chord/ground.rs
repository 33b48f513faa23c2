//! [`Ground`]: UV rates as ways along a triangle, so that a table's hold in every chart.

use crate::Vec3;
use crate::field::surface_field::CurvatureField;

/// A triangle in the axes of a ray: the way it goes in the triangle's plane, and to the side of that.
pub(super) struct Ground {
    /// UV per length along both.
    uv_from_axes: [[f64; 2]; 2],
}

impl Ground {
    /// `plane` is the unit normal of the ray's plane, `forward` the way it goes. `None` without UVs, and for triangles without area.
    pub fn new(field: &CurvatureField<'_>, triangle: usize, plane: &Vec3, forward: &Vec3) -> Option<Self> {
        let uvs = field.corner_uvs(triangle)?;
        let [a, b, c] = field.surface().corners(triangle);
        let edges = [b - a, c - a];
        let normal = edges[0].cross(&edges[1]);
        // Both in the triangle's plane: along the ray, this way or the other, and a quarter turn from there, longer by the length of the normal.
        let ahead = plane.cross(&normal);
        let aside = normal.cross(&ahead);
        let (area, length) = (normal.norm(), ahead.norm());
        // The triangle may be turned over.
        let sign = if ahead.dot(forward) < 0.0 { -1.0 } else { 1.0 };
        // A vector `v` in this plane is `edges[1] . (normal x v)` and `-edges[0] . (normal x v)` of both edges, over the squared normal. And `normal x
        // ahead` is `aside`, `normal x aside` is `ahead` times the squared normal, negated.
        let scale = 1.0 / (area * length);
        let (of_ahead, of_aside) = (sign * scale / area, scale);
        let shares = [
            [of_ahead * edges[1].dot(&aside), -of_ahead * edges[0].dot(&aside)],
            [-of_aside * edges[1].dot(&ahead), of_aside * edges[0].dot(&ahead)],
        ];
        let sides = [1, 2].map(|corner: usize| [0, 1].map(|k: usize| uvs[corner][k] - uvs[0][k]));
        let uv_from_axes =
            shares.map(|[one, two]| [0, 1].map(|k: usize| one * sides[0][k] + two * sides[1][k]));
        uv_from_axes.iter().flatten().all(|x| x.is_finite()).then_some(Self { uv_from_axes })
    }

    pub fn uv_of(&self, [ahead, aside]: [f64; 2]) -> [f64; 2] {
        let [one, two] = self.uv_from_axes;
        [0, 1].map(|k| ahead * one[k] + aside * two[k])
    }

    /// `None` where UV have no area.
    pub fn axes_of(&self, uv: [f64; 2]) -> Option<[f64; 2]> {
        let [one, two] = self.uv_from_axes;
        let determinant = one[0] * two[1] - one[1] * two[0];
        let axes =
            [uv[0] * two[1] - uv[1] * two[0], one[0] * uv[1] - one[1] * uv[0]].map(|x| x / determinant);
        axes.iter().all(|x| x.is_finite()).then_some(axes)
    }
}

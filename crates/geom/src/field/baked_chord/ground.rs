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
        let squared = normal.norm_squared();
        // The inner products with these are a vector's shares of both edges.
        let duals = [edges[1].cross(&normal) / squared, normal.cross(&edges[0]) / squared];
        let gradients =
            [0, 1].map(|k| duals[0] * (uvs[1][k] - uvs[0][k]) + duals[1] * (uvs[2][k] - uvs[0][k]));
        let ahead = plane.cross(&normal);
        // As long as `ahead` times the normal.
        let aside = plane * squared - normal * normal.dot(plane);
        let length = ahead.norm();
        // The triangle may be turned over.
        let ahead = ahead * (ahead.dot(forward).signum() / length);
        let aside = aside / (length * squared.sqrt());
        let uv_from_axes = [ahead, aside].map(|axis| gradients.map(|gradient| gradient.dot(&axis)));
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

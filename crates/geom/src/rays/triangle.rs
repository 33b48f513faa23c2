//! Watertight ray-triangle intersection for one triangle: the reference that the packet kernels must match bit by bit.

use super::ray::PreparedRay;

/// The scaled barycentric weights of a hit and its distance.
#[derive(Debug, Clone, Copy, PartialEq)]
pub(super) struct TriangleHit {
    pub t: f32,
    /// Weights of the corners times their sum.
    pub weights: [f32; 3],
}

/// Intersects one triangle, by Woop, Benthin and Wald (JCGT 2013), without culling.
///
/// The ray becomes the z axis by a translation, a permutation of axes and a shear. The signs of the three edge functions
/// then say whether the axis passes the triangle. An edge shared by two triangles gives exactly negated values in both,
/// because only one product is subtracted from the other and nothing is fused; so no ray slips between them.
pub(super) fn intersect(ray: &PreparedRay, corners: &[[f32; 3]; 3]) -> Option<TriangleHit> {
    let [a, b, c] = corners.map(|p| sheared(ray, p));
    let mut u = c[0] * b[1] - c[1] * b[0];
    let mut v = a[0] * c[1] - a[1] * c[0];
    let mut w = b[0] * a[1] - b[1] * a[0];
    if u == 0.0 || v == 0.0 || w == 0.0 {
        [u, v, w] = edges_in_double([a, b, c]);
    }
    if (u < 0.0 || v < 0.0 || w < 0.0) && (u > 0.0 || v > 0.0 || w > 0.0) {
        return None;
    }
    let determinant = u + v + w;
    let scale = ray.shear[2];
    let t = (u * (scale * a[2]) + v * (scale * b[2]) + w * (scale * c[2])) / determinant;
    // A determinant of 0 makes t NaN or infinite, and the comparisons false.
    (t > 0.0 && t <= ray.t_max && determinant != 0.0).then_some(TriangleHit { t, weights: [u, v, w] })
}

/// The three edge functions, with products that are exact, for where one of them is 0 in single precision.
#[allow(clippy::cast_possible_truncation, reason = "only sign and zero matter, and rounding keeps both")]
pub(super) fn edges_in_double(corners: [[f32; 3]; 3]) -> [f32; 3] {
    let [a, b, c] = corners.map(|p| p.map(f64::from));
    [
        (c[0] * b[1] - c[1] * b[0]) as f32,
        (a[0] * c[1] - a[1] * c[0]) as f32,
        (b[0] * a[1] - b[1] * a[0]) as f32,
    ]
}

fn sheared(ray: &PreparedRay, p: [f32; 3]) -> [f32; 3] {
    let [x, y, z] = ray.axes;
    let along = p[z] - ray.origin[z];
    [(p[x] - ray.origin[x]) - ray.shear[0] * along, (p[y] - ray.origin[y]) - ray.shear[1] * along, along]
}

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
    // A determinant of 0 makes t NaN or infinite.
    if !(t <= ray.t_max && determinant != 0.0) {
        return None;
    }
    let t = settled(ray, corners, t)?;
    Some(TriangleHit { t, weights: [u, v, w] })
}

/// Up to which share of the corners' distances `t` is computed again in double precision.
///
/// `t` blends the corners' distances, so its error follows the size of the triangle: a ray that starts a few millionths beside
/// a large triangle could hit it, or lose its neighbour in a corner. This share is far more than any rounding of triangles that
/// are not seen edge-on, and so little that few hits pay for it.
pub(super) const UNCERTAIN: f32 = 1.0 / 64.0;

/// The distance of a hit whose single-precision distance is `t`, or `None` if it lies at or behind the origin.
fn settled(ray: &PreparedRay, corners: &[[f32; 3]; 3], t: f32) -> Option<f32> {
    let z = ray.axes[2];
    let distance = corners.iter().map(|p| (p[z] - ray.origin[z]).abs()).fold(0.0, f32::max);
    if t.abs() <= distance * ray.shear[2].abs() * UNCERTAIN {
        return exact_distance(ray, corners);
    }
    (t > 0.0).then_some(t)
}

/// The distance to the plane of a triangle, if it is in the ray's range.
#[allow(clippy::cast_possible_truncation, reason = "distances are f32")]
pub(super) fn exact_distance(ray: &PreparedRay, corners: &[[f32; 3]; 3]) -> Option<f32> {
    let [a, b, c] = corners.map(|p| glam::Vec3::from(p).as_dvec3());
    let normal = (b - a).cross(c - a);
    let origin = glam::Vec3::from(ray.origin).as_dvec3();
    let exact = normal.dot(a - origin) / normal.dot(glam::Vec3::from(ray.direction).as_dvec3());
    let rounded = exact as f32;
    // NaN where the ray lies in the plane.
    (rounded > 0.0 && rounded <= ray.t_max).then_some(rounded)
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

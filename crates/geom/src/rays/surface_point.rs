//! A point on a triangle with a bound on its rounding error, and how to leave it without hitting it again.

use glam::Vec3;

/// A point on a triangle.
#[derive(Debug, Clone, Copy, PartialEq)]
pub struct SurfacePoint {
    /// The point.
    pub position: Vec3,
    /// Bound on the rounding error of each coordinate of `position`.
    pub error: Vec3,
    /// Unit normal of the triangle, counter-clockwise; zero for a triangle without area.
    pub normal: Vec3,
}

impl SurfacePoint {
    /// The point with these barycentric weights in the triangle.
    #[must_use]
    pub fn new(corners: [Vec3; 3], weights: [f32; 3]) -> Self {
        let [a, b, c] = corners;
        let [u, v, w] = weights;
        let position = u * a + v * b + w * c;
        // Three products and two sums: gamma(7) of the magnitudes covers them with the weights' own rounding (Pharr, Jakob,
        // Humphreys, "Physically Based Rendering", section 6.8.5).
        let magnitude = (u * a).abs() + (v * b).abs() + (w * c).abs();
        Self { position, error: gamma(7) * magnitude, normal: unit_normal(corners) }
    }

    /// An origin for rays in `direction` that lies on the same side of the triangle's plane as they go.
    ///
    /// The offset is the error bound seen along the normal, so it follows the scale of the coordinates.
    #[must_use]
    pub fn origin_towards(&self, direction: Vec3) -> Vec3 {
        let side = if direction.dot(self.normal) < 0.0 { -1.0 } else { 1.0 };
        self.offset_by(side * self.normal, self.position)
    }

    /// As [`Self::origin_towards`] on the side of `normal` (unit), for a point beside `position` that shares its error.
    #[must_use]
    pub fn offset_by(&self, normal: Vec3, position: Vec3) -> Vec3 {
        // Twice the bound: once for this point, once for the rounding in the next intersection test, which starts here.
        let distance = 2.0 * self.error.dot(normal.abs());
        let offset = distance * normal;
        let away = |p: f32, o: f32| {
            let moved = p + o;
            if o > 0.0 {
                moved.next_up()
            } else if o < 0.0 {
                moved.next_down()
            } else {
                moved
            }
        };
        Vec3::new(away(position.x, offset.x), away(position.y, offset.y), away(position.z, offset.z))
    }
}

/// Unit normal, computed in double precision so that slivers and small scales keep theirs.
#[allow(clippy::cast_possible_truncation, reason = "geometry becomes f32 here")]
fn unit_normal(corners: [Vec3; 3]) -> Vec3 {
    let [a, b, c] = corners.map(Vec3::as_dvec3);
    (b - a).cross(c - a).try_normalize().unwrap_or_default().as_vec3()
}

/// Bound on the relative error of `n` rounded operations in a row (Higham).
fn gamma(n: u32) -> f32 {
    let nu = n as f32 * 0.5 * f32::EPSILON;
    nu / (1.0 - nu)
}

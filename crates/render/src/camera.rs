//! [`Camera`]: a pinhole, or a thin lens if it has an aperture.

use glam::Vec3;

use crate::math::concentric_disk;

/// A perspective camera. Right-handed; image x goes right and y goes down.
#[derive(Debug, Clone, Copy, PartialEq)]
pub struct Camera {
    position: Vec3,
    right: Vec3,
    up: Vec3,
    forward: Vec3,
    tan_half_fov: f32,
    lens_radius: f32,
    focus_distance: f32,
}

/// A ray through a point of the image.
#[derive(Debug, Clone, Copy, PartialEq)]
pub(crate) struct CameraRay {
    pub origin: Vec3,
    pub direction: Vec3,
}

impl Camera {
    /// A camera at `position` that looks at `target`; `fov_y` is the full vertical field of view in radians.
    ///
    /// `up` parallel to the view direction is replaced by another axis. Without a lens radius everything is in focus.
    ///
    /// # Panics
    ///
    /// If `position` equals `target`, anything is not finite, or `fov_y` is not in `(0, pi)`.
    #[must_use]
    pub fn look_at(position: Vec3, target: Vec3, up: Vec3, fov_y: f32) -> Self {
        assert!(
            position.is_finite() && target.is_finite() && position != target,
            "{position} looks at {target}"
        );
        assert!(fov_y > 0.0 && fov_y < std::f32::consts::PI, "a field of view of {fov_y} rad");
        let forward = (target - position).normalize();
        let right = forward.cross(up).try_normalize().unwrap_or_else(|| forward.any_orthonormal_vector());
        let focus_distance = position.distance(target);
        Self {
            position,
            right,
            up: right.cross(forward),
            forward,
            tan_half_fov: (0.5 * fov_y).tan(),
            lens_radius: 0.0,
            focus_distance,
        }
    }

    /// A camera that sees all points from the direction `towards_viewer`, centred, with a small margin.
    ///
    /// `aspect` is width over height. A single point is seen from distance 1; without points the origin is.
    #[must_use]
    pub fn framing(points: &[Vec3], towards_viewer: Vec3, fov_y: f32, aspect: f32) -> Self {
        /// Share of the image, along the tighter axis, that the points span.
        const FILL: f32 = 0.88;
        let (lower, upper) = points
            .iter()
            .fold((Vec3::INFINITY, Vec3::NEG_INFINITY), |(lower, upper), p| (lower.min(*p), upper.max(*p)));
        let center = if points.is_empty() { Vec3::ZERO } else { 0.5 * (lower + upper) };
        let trial = Self::look_at(center + towards_viewer.normalize(), center, Vec3::Y, fov_y);
        let tan = [FILL * trial.tan_half_fov * aspect, FILL * trial.tan_half_fov];
        // On each axis the two planes of the view pyramid that touch the points: `x - tan * depth` is largest on one,
        // `-x - tan * depth` on the other. They meet at the camera.
        let mut touch = [[f32::NEG_INFINITY; 2]; 2];
        for point in points {
            let offset = *point - center;
            let depth = offset.dot(trial.forward);
            for (axis, x) in [offset.dot(trial.right), offset.dot(trial.up)].into_iter().enumerate() {
                touch[axis][0] = touch[axis][0].max(x - tan[axis] * depth);
                touch[axis][1] = touch[axis][1].max(-x - tan[axis] * depth);
            }
        }
        if touch[0][0] == f32::NEG_INFINITY {
            return trial;
        }
        let shift = |axis: usize| 0.5 * (touch[axis][0] - touch[axis][1]);
        let distance = |axis: usize| 0.5 * (touch[axis][0] + touch[axis][1]) / tan[axis];
        let distance = distance(0).max(distance(1));
        let distance = if distance > 0.0 { distance } else { 1.0 };
        let target = center + shift(0) * trial.right + shift(1) * trial.up;
        Self::look_at(target - distance * trial.forward, target, Vec3::Y, fov_y)
    }

    /// Adds a thin lens: points at `focus_distance` along the view direction are sharp.
    #[must_use]
    pub fn with_lens(mut self, radius: f32, focus_distance: f32) -> Self {
        (self.lens_radius, self.focus_distance) = (radius, focus_distance);
        self
    }

    /// Where the camera stands.
    #[must_use]
    pub fn position(&self) -> Vec3 {
        self.position
    }

    /// Unit view direction.
    #[must_use]
    pub fn forward(&self) -> Vec3 {
        self.forward
    }

    /// Distance of the plane of focus along the view direction.
    #[must_use]
    pub fn focus_distance(&self) -> f32 {
        self.focus_distance
    }

    /// Whether points out of focus are blurred.
    #[must_use]
    pub fn has_depth_of_field(&self) -> bool {
        self.lens_radius > 0.0
    }

    /// The ray through a point of an image of the given size in pixels; the first pixel covers `[0, 1]^2`.
    pub(crate) fn pinhole_ray(&self, x: f32, y: f32, width: f32, height: f32) -> CameraRay {
        CameraRay { origin: self.position, direction: self.through(x, y, width, height).normalize() }
    }

    /// As [`Self::pinhole_ray`], from a point on the lens that `u` picks.
    pub(crate) fn lens_ray(&self, x: f32, y: f32, width: f32, height: f32, u: [f32; 2]) -> CameraRay {
        let focus = self.position + self.focus_distance * self.through(x, y, width, height);
        let [dx, dy] = concentric_disk(u);
        let origin = self.position + self.lens_radius * (dx * self.right + dy * self.up);
        CameraRay { origin, direction: (focus - origin).normalize() }
    }

    /// Direction through the image point, at depth 1.
    fn through(&self, x: f32, y: f32, width: f32, height: f32) -> Vec3 {
        let scale = 2.0 * self.tan_half_fov / height;
        self.forward + (x - 0.5 * width) * scale * self.right - (y - 0.5 * height) * scale * self.up
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn framing_keeps_the_box_inside_and_fills_the_image() {
        let points: Vec<Vec3> = (0..200_u16)
            .map(|i| {
                let angle = f32::from(i) * 0.7;
                Vec3::new(angle.cos() * 3.0, f32::from(i) * 0.01, angle.sin() - 5.0)
            })
            .collect();
        for towards in [Vec3::Z, Vec3::new(1.0, 0.5, 1.0), Vec3::Y] {
            let camera = Camera::framing(&points, towards, 0.6, 1.5);
            let mut extent = [0.0_f32; 4];
            for point in &points {
                let offset = *point - camera.position;
                let scale = offset.dot(camera.forward) * camera.tan_half_fov;
                let (x, y) = (offset.dot(camera.right) / (1.5 * scale), offset.dot(camera.up) / scale);
                extent = [extent[0].max(x), extent[1].max(-x), extent[2].max(y), extent[3].max(-y)];
            }
            let (wide, high) = (extent[0].max(extent[1]), extent[2].max(extent[3]));
            // The tighter axis is filled as promised, and from both sides.
            assert!((wide.max(high) - 0.88).abs() < 1e-3, "{towards}: {extent:?}");
            let tight = if wide > high { &extent[..2] } else { &extent[2..] };
            assert!((tight[0] - tight[1]).abs() < 1e-3, "{towards}: {extent:?}");
        }
    }
}

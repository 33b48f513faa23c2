//! [`RectangleLight`].

use glam::{DVec3, Vec3};

use super::{LightSample, Receiver, Sees};
use crate::math::luminance;

/// A rectangle that emits the same radiance in all directions of one side. It is visible, and blocks light.
#[derive(Debug, Clone, Copy, PartialEq)]
pub struct RectangleLight {
    /// The centre.
    pub center: Vec3,
    /// From the centre to the middle of one edge.
    pub half_u: Vec3,
    /// From the centre to the middle of the next edge, perpendicular to `half_u`. It shines towards `half_u x half_v`.
    pub half_v: Vec3,
    /// Linear RGB radiance.
    pub radiance: Vec3,
}

impl RectangleLight {
    /// A light at `center` that faces `target`, of the given size. Its horizontal axis is horizontal.
    #[must_use]
    pub fn facing(center: Vec3, target: Vec3, width: f32, height: f32, radiance: Vec3) -> Self {
        let normal = (target - center).normalize_or(Vec3::NEG_Y);
        let u = Vec3::Y.cross(normal).try_normalize().unwrap_or(Vec3::X);
        let v = normal.cross(u);
        Self { center, half_u: 0.5 * width * u, half_v: 0.5 * height * v, radiance }
    }

    /// The four corners, counter-clockwise seen from the lit side.
    #[must_use]
    pub fn corners(&self) -> [Vec3; 4] {
        let (c, u, v) = (self.center, self.half_u, self.half_v);
        [c - u - v, c + u - v, c + u + v, c - u + v]
    }

    /// Along the normal, as long as a quarter of the area; in double precision, because its square is the fourth power of a length.
    fn across(&self) -> DVec3 {
        self.half_u.as_dvec3().cross(self.half_v.as_dvec3())
    }

    /// Unit normal of the emitting side.
    #[must_use]
    pub fn normal(&self) -> Vec3 {
        self.across().normalize_or_zero().as_vec3()
    }

    /// Area.
    #[must_use]
    #[allow(clippy::cast_possible_truncation, reason = "rendering is f32")]
    pub fn area(&self) -> f32 {
        4.0 * self.across().length() as f32
    }

    pub(crate) fn sample(&self, from: Vec3, u: [f32; 2]) -> Option<LightSample> {
        let point = self.center + (2.0 * u[0] - 1.0) * self.half_u + (2.0 * u[1] - 1.0) * self.half_v;
        let to_light = point - from;
        let distance = to_light.length();
        let wi = to_light / distance;
        let pdf = self.pdf(wi, distance);
        (pdf > 0.0).then_some(LightSample { wi, distance, radiance: self.radiance, pdf })
    }

    /// Density over solid angle of a point at `distance` in direction `wi`; 0 behind the light.
    pub(crate) fn pdf(&self, wi: Vec3, distance: f32) -> f32 {
        let cosine = -wi.dot(self.normal());
        if cosine > 0.0 && distance > 0.0 { distance * distance / (cosine * self.area()) } else { 0.0 }
    }

    /// Rough irradiance that a surface point receives, for choosing among lights: 0 only if it is exactly 0.
    pub(crate) fn importance(&self, receiver: &Receiver) -> f32 {
        let Receiver { origin: from, normal, sees } = *receiver;
        let to_center = self.center - from;
        let cosine = -to_center.dot(self.normal());
        let above =
            sees == Sees::Sphere || self.corners().iter().any(|&corner| (corner - from).dot(normal) > 0.0);
        if cosine <= 0.0 || !above {
            return 0.0;
        }
        let area = self.area();
        let distance_squared = to_center.length_squared();
        let (square, length) = (distance_squared + area, (distance_squared + area).sqrt());
        let facing = to_center.dot(normal).max(0.1 * distance_squared.sqrt()) / length;
        // Quotients of like powers, which single precision holds at any scale.
        luminance(self.radiance) * facing * (area / square) * (cosine / length)
    }
}

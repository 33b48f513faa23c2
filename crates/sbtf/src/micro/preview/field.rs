//! Height fields, marched.

use glam::{Vec2, Vec3};

use super::{Scene, Surface};
use crate::micro::HeightField;

/// A height field and the step of the march.
pub(super) struct FieldScene<'a> {
    field: &'a HeightField,
    /// UV units; features narrower than this may be missed.
    step: f32,
}

impl<'a> FieldScene<'a> {
    pub(super) fn new(field: &'a HeightField) -> Self {
        let texels = field.heights().width().max(field.heights().height());
        Self { field, step: 0.7 / (texels as f32).clamp(64.0, 1024.0) }
    }

    /// First parameter in `(0, longest)` where the ray is below the surface.
    fn march(&self, origin: Vec3, direction: Vec3, longest: f32) -> Option<f32> {
        let below = |t: f32| {
            let p = origin + t * direction;
            p.z < self.field.z(p.truncate())
        };
        // Steep rays cross heights faster than texels.
        let step = self.step.min(self.field.depth() / (64.0 * direction.z.abs().max(1e-6)));
        let mut t = step;
        while t < longest + step {
            if below(t) {
                let (mut low, mut high) = (t - step, t);
                for _ in 0..8 {
                    let middle = 0.5 * (low + high);
                    if below(middle) {
                        high = middle;
                    } else {
                        low = middle;
                    }
                }
                return Some(low);
            }
            t += step;
        }
        None
    }

    fn normal(&self, uv: Vec2) -> Vec3 {
        let (u, v) = (1.0 / self.field.heights().width() as f32, 1.0 / self.field.heights().height() as f32);
        let slope = |d: Vec2, step: f32| (self.field.z(uv + d) - self.field.z(uv - d)) / (2.0 * step);
        let normal = Vec3::new(-slope(Vec2::new(u, 0.0), u), -slope(Vec2::new(0.0, v), v), 1.0).normalize();
        let Some(map) = &self.field.maps().normal else { return normal };
        let detail = map.lookup(uv);
        let tangent = (Vec3::X - normal * normal.x).normalize();
        let bent = tangent * detail.x + normal.cross(tangent) * detail.y + normal * detail.z;
        bent.normalize_or(normal)
    }
}

impl Scene for FieldScene<'_> {
    fn hit(&self, origin: Vec3, direction: Vec3) -> Option<Surface> {
        // Below the deepest point there is always a hit.
        let longest = (origin.z + self.field.depth()) / -direction.z;
        let t = self.march(origin, direction, longest).unwrap_or(longest);
        let position = origin + t * direction;
        let uv = position.truncate();
        Some(Surface { position, normal: self.normal(uv), reflectance: self.field.maps().reflectance(uv) })
    }

    fn shadowed(&self, from: &Surface, direction: Vec3) -> bool {
        let p = from.position;
        // Lifted off by what bilinear patches may bulge within a step.
        let origin = p.with_z(self.field.z(p.truncate())) + from.normal * self.step;
        let longest = (-origin.z / direction.z).min(1.0);
        self.march(origin, direction, longest).is_some()
    }
}

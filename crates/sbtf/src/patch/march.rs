//! [`BentField`]: a height field bent for one query, and rays marched through it.
//!
//! Nothing is built per curvature and direction, and there are no triangles: this is the exact answer that patches approximate, and
//! what the oracle asks. A ray skips stretches over whose highest texel it passes; elsewhere the sign of its height over the
//! surface is looked at twice per texel, and a change of sign is bisected. What is thinner than half a texel along a ray, and the
//! bulge of a bilinear cell over two samples, can be missed.

use glam::{DVec2, DVec3, Vec2, Vec3};

use super::shell::Shell;
use super::sweep::STRETCHES;
use super::tile::FieldShading;
use super::transport::{Space, Transport, Vertex};
use super::{Bend, Sweep};

/// Distance after which a ray counts as lost, UV units.
const LONGEST: f64 = 64.0;

/// A height field on a cylinder, around the point where a viewer's ray enters; the origin of coordinates is there.
pub(crate) struct BentField<'a> {
    heights: &'a Sweep,
    shading: &'a FieldShading,
    shell: Shell,
    uv: DVec2,
    /// Direction across the axis in UV.
    across: DVec2,
    light: DVec3,
    /// Even steps of a ray, instead of as many as it takes.
    steps: Option<u32>,
}

/// A half line.
#[derive(Debug, Clone, Copy)]
pub(crate) struct FieldRay {
    origin: DVec3,
    direction: DVec3,
}

enum Found {
    At(f64),
    Left,
    Lost,
}

impl<'a> BentField<'a> {
    /// Bends a field along the way of a viewer's ray. `wo` and `wi` are in the frame of the entry point.
    pub fn new(
        heights: &'a Sweep,
        shading: &'a FieldShading,
        uv: Vec2,
        kappa: f32,
        wo: Vec3,
        wi: Vec3,
    ) -> (Self, FieldRay) {
        let across = DVec2::from(-wo.truncate()).try_normalize().unwrap_or(DVec2::X);
        let [low, high] = heights.z_range().map(f64::from);
        let slack = 1e-9 + 1e-6 * (high - low);
        let shell = Shell { bend: Bend { kappa: f64::from(kappa) }, low: low - slack, high: high + slack };
        let inside = DVec2::from(uv) - DVec2::from(uv).floor();
        let uv = if inside.is_finite() { inside } else { DVec2::ZERO };
        let mut field = Self { heights, shading, shell, uv, across, light: DVec3::Z, steps: None };
        field.light = field.patch_from_uv(wi.as_dvec3());
        let ray = FieldRay { origin: DVec3::ZERO, direction: -field.patch_from_uv(wo.as_dvec3()) };
        (field, ray)
    }

    /// The same, for rays that take this many even steps through the layer and see nothing in between.
    pub fn with_steps(self, steps: u32) -> Self {
        Self { steps: Some(steps), ..self }
    }

    fn patch_from_uv(&self, p: DVec3) -> DVec3 {
        let (c, s) = (self.across.x, self.across.y);
        DVec3::new(c * p.x + s * p.y, c * p.y - s * p.x, p.z)
    }

    /// Texture coordinates in `[0, 1)` of a foot `(s, r)`.
    #[allow(clippy::cast_possible_truncation, reason = "inside the tile")]
    fn uv_at(&self, s: f64, r: f64) -> Vec2 {
        let uv = self.uv + self.across * s + DVec2::new(-self.across.y, self.across.x) * r;
        (uv - uv.floor()).as_vec2()
    }

    /// Height over the surface of a point on a ray; negative inside the material.
    fn clearance(&self, ray: &FieldRay, t: f64) -> f64 {
        let p = self.shell.bend.unbend(ray.origin + t * ray.direction);
        p.z - self.shell.bend.height(f64::from(self.heights.z_at(self.uv_at(p.x, p.y))))
    }

    fn find(&self, ray: &FieldRay) -> Found {
        if self.clearance(ray, 0.0) <= 0.0 {
            return Found::At(0.0);
        }
        let Some([start, end]) = self.shell.span(ray.origin, ray.direction) else { return Found::Left };
        if let Some(steps) = self.steps {
            let stop = end.min(start + LONGEST);
            let hit = self.search(ray, start, stop, (stop - start) / f64::from(steps));
            return hit.map_or(Found::Left, Found::At);
        }
        // Feet move faster than the point where the layer is bent together below.
        let core = self.shell.bend.core(self.shell.low).min(self.shell.bend.core(self.shell.high)).min(1.0);
        let speed = ray.direction.x.hypot(ray.direction.z) / core.max(0.02) + ray.direction.y.abs();
        let texel = f64::from(self.heights.texel()) / speed;
        let stretches = STRETCHES.map(|n| f64::from(n) * texel);
        let stop = end.min(start + LONGEST);
        let mut t = start;
        while t < stop {
            if self.is_clear(ray, 0, t, t + stretches[0]) {
                t += stretches[0];
                continue;
            }
            let long = (t + stretches[0]).min(stop);
            while t < long {
                let next = (t + stretches[1]).min(long);
                if !self.is_clear(ray, 1, t, t + stretches[1])
                    && let Some(hit) = self.search(ray, t, next, 0.5 * texel)
                {
                    return Found::At(hit);
                }
                t = next;
            }
        }
        let upwards = self.shell.bend.unbend(ray.origin + end * ray.direction).z
            > 0.5 * (self.shell.low + self.shell.high);
        if end.is_finite() && stop == end && upwards { Found::Left } else { Found::Lost }
    }

    /// Whether a stretch of the ray is above the highest texel around it.
    #[allow(clippy::cast_possible_truncation, reason = "a height")]
    fn is_clear(&self, ray: &FieldRay, level: usize, from: f64, to: f64) -> bool {
        let bend = self.shell.bend;
        let at = |t: f64| bend.unbend(ray.origin + t * ray.direction);
        let (a, middle, b) = (at(from), at(0.5 * (from + to)), at(to));
        // The height is a convex function of the way over a convex surface: the tangents at the ends bound it from below. On
        // a hollow one it is concave, and least at an end. Twice the sag covers both.
        let sag = (0.5 * (a.z + b.z) - middle.z).max(0.0);
        let lowest = a.z.min(b.z).min(middle.z) - 2.0 * sag;
        lowest > f64::from(self.heights.highest_near(level, self.uv_at(middle.x, middle.y)))
    }

    /// The first change of sign among samples.
    fn search(&self, ray: &FieldRay, from: f64, to: f64, step: f64) -> Option<f64> {
        let mut above = from;
        while above < to {
            let next = (above + step).min(to);
            if self.clearance(ray, next) <= 0.0 {
                return Some(self.bisect(ray, above, next));
            }
            above = next;
        }
        None
    }

    /// A point above the surface within 2^-30 of the step from it.
    fn bisect(&self, ray: &FieldRay, mut above: f64, mut below: f64) -> f64 {
        for _ in 0..30 {
            let middle = 0.5 * (above + below);
            if self.clearance(ray, middle) > 0.0 { above = middle } else { below = middle }
        }
        above
    }

    /// Texture coordinates of a point on a ray less those of the entry point.
    pub fn offset(&self, ray: &FieldRay, t: f64) -> Vec2 {
        let p = self.shell.bend.unbend(ray.origin + t * ray.direction);
        (self.across * p.x + DVec2::new(-self.across.y, self.across.x) * p.y).as_vec2()
    }

    /// Normal of the bilinear surface in `(u, v, z)`, by differences over a hundredth of a texel.
    fn facet(&self, uv: Vec2) -> Vec3 {
        let h = 0.01 * self.heights.texel();
        let slope = |by: Vec2| (self.heights.z_at(uv + by) - self.heights.z_at(uv - by)) / (2.0 * h);
        Vec3::new(-slope(Vec2::new(h, 0.0)), -slope(Vec2::new(0.0, h)), 1.0)
    }
}

impl Space for BentField<'_> {
    type Ray = FieldRay;
    type Hit = f64;
    type Start = DVec3;

    fn closest(&self, ray: &FieldRay) -> Option<f64> {
        match self.find(ray) {
            Found::At(t) => Some(t),
            Found::Left | Found::Lost => None,
        }
    }

    fn leaves(&self, ray: &FieldRay) -> bool {
        matches!(self.find(ray), Found::Left)
    }

    fn vertex(&self, ray: &FieldRay, &t: &f64, transport: &Transport) -> Option<Vertex<DVec3>> {
        let bend = self.shell.bend;
        let position = ray.origin + t * ray.direction;
        let foot = bend.unbend(position);
        let uv = self.uv_at(foot.x, foot.y);
        let point = self.shading.point(uv);
        let bent = |n: Vec3| bend.normal(foot.x, foot.z, self.patch_from_uv(n.as_dvec3())).as_vec3();
        let wo = -ray.direction.as_vec3();
        let facet = bent(self.facet(uv));
        let geometric = if facet.dot(wo) < 0.0 { -facet } else { facet };
        let smooth = if point.normal == Vec3::ZERO { Vec3::ZERO } else { bent(point.normal) };
        // Off the surface by more than the samples of the next ray resolve, and less than anyone sees.
        let start = position + 2e-3 * f64::from(self.heights.texel()) * geometric.as_dvec3();
        Some(Vertex::new(start, wo, geometric, smooth, transport.bsdf(&point.reflectance)))
    }

    fn ray_from(&self, start: &DVec3, direction: Vec3) -> FieldRay {
        FieldRay { origin: *start, direction: direction.as_dvec3() }
    }

    fn light_at(&self, _start: &DVec3) -> Vec3 {
        self.light.as_vec3()
    }
}

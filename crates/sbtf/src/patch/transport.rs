//! Light inside a bent patch: the reference that networks learn from.
//!
//! A path starts where the viewer's ray meets the material. At each of its vertices the directional light is asked for (next-event
//! estimation; it cannot be met by chance), then a direction is drawn from the BRDF. The estimate of the radiance is unbiased for the
//! stated number of bounces.
//!
//! **What belongs to the material.** A ray that leaves through the bounding surface is the renderer's from there on: it
//! is not blocked by anything, also in a hollow where it would come back, and a path that leaves sees no other light. So
//! does one that leaves a see-through material below. Height fields are closed below: nothing passes.
//!
//! **Two normals.** Light is reflected about the shading normal. A direction above its horizon that goes into the surface itself is
//! absorbed, as in other renderers: a Lambert surface whose two normals are at the angle `t` loses `(1 - cos t) / 2` of the light.

use glam::{DVec3, Vec2, Vec3};

use super::Patch;
use super::surface::{LocalRay, PatchHit, SurfaceHit, Trace};
use crate::brdf::{Bsdf, BsdfParameters, EnergyTable, Frame};
use crate::micro::Reflectance;
use crate::random::Random;

/// What light does.
#[derive(Debug, Clone, Copy, PartialEq)]
pub struct TransportOptions {
    /// How often light is reflected at most; 1 is direct light only. Default 4.
    pub bounces: u32,
    /// Strength of the dielectric layer: 0.5, the default, reflects 4 % at normal incidence; 0 leaves the Lambert base.
    pub specular: f32,
}

impl Default for TransportOptions {
    fn default() -> Self {
        Self { bounces: 4, specular: 0.5 }
    }
}

/// The options with the table that the BRDF needs.
#[derive(Debug, Clone)]
pub struct Transport {
    options: TransportOptions,
    table: EnergyTable,
}

impl Transport {
    /// Makes the table.
    #[must_use]
    pub fn new(options: TransportOptions) -> Self {
        Self { options, table: EnergyTable::new() }
    }
}

/// What a ray found, and one estimate of what it sees.
#[derive(Debug, Clone, Copy, PartialEq)]
pub struct PatchSample {
    /// Texture coordinates of the first hit less those of the entry point.
    pub offset: Vec2,
    /// Radiance towards the viewer under a light that gives a surface facing it unit irradiance.
    pub rgb: Vec3,
}

/// Where light travels: a bent patch of triangles, or the height field itself.
pub(crate) trait Space {
    /// A half line.
    type Ray: Copy;
    /// Where one meets the material.
    type Hit;
    /// A point that rays leave the material from.
    type Start;

    /// The first hit.
    fn closest(&self, ray: &Self::Ray) -> Option<Self::Hit>;

    /// Whether a ray leaves without a hit.
    fn leaves(&self, ray: &Self::Ray) -> bool;

    /// The hit as a vertex of a path; `None` where the surface has no area.
    fn vertex(&self, ray: &Self::Ray, hit: &Self::Hit, transport: &Transport) -> Option<Vertex<Self::Start>>;

    /// The ray from a start in a direction in the coordinates there.
    fn ray_from(&self, start: &Self::Start, direction: Vec3) -> Self::Ray;

    /// The direction of the light in the coordinates of a start.
    fn light_at(&self, start: &Self::Start) -> Vec3;
}

/// A vertex of a path.
pub(crate) struct Vertex<Start> {
    /// Where rays start that stay on the viewer's side.
    pub start: Start,
    /// Of the surface itself, on the viewer's side.
    pub geometric: Vec3,
    /// Around the shading normal.
    pub frame: Frame,
    /// Direction to the viewer, in the frame.
    pub wo: Vec3,
    pub bsdf: Bsdf,
}

impl<Start> Vertex<Start> {
    /// `wo` in the coordinates of `start`; `geometric` on the viewer's side; `smooth` zero for `geometric`.
    pub fn new(start: Start, wo: Vec3, geometric: Vec3, smooth: Vec3, bsdf: Bsdf) -> Self {
        let smooth = match smooth.dot(geometric) {
            _ if smooth == Vec3::ZERO => geometric,
            side if side < 0.0 => -smooth,
            _ => smooth,
        };
        let frame = Frame::new(facing_viewer(smooth, wo));
        Self { start, geometric, frame, wo: frame.local_from_world(wo), bsdf }
    }

    /// Whether a direction goes into the surface, where its light is lost.
    fn absorbs(&self, direction: Vec3) -> bool {
        self.geometric.dot(direction) < 0.0
    }
}

impl Transport {
    pub(super) fn bsdf(&self, r: &Reflectance) -> Bsdf {
        let parameters = BsdfParameters {
            base_color: r.albedo,
            metallic: r.metalness,
            roughness: r.roughness,
            specular: self.options.specular,
        };
        Bsdf::new(&parameters, &self.table)
    }

    /// One sample of the radiance along a ray that met the material.
    pub(crate) fn radiance<S: Space>(
        &self,
        space: &S,
        ray: S::Ray,
        hit: S::Hit,
        random: &mut Random,
    ) -> Vec3 {
        let (mut ray, mut hit) = (ray, hit);
        let (mut throughput, mut rgb) = (Vec3::ONE, Vec3::ZERO);
        for left in (0..self.options.bounces).rev() {
            let Some(vertex) = space.vertex(&ray, &hit, self) else { break };
            rgb += throughput * self.direct(space, &vertex);
            if left == 0 {
                break;
            }
            let (pick, u) = (random.unit(), [random.unit(), random.unit()]);
            let Some(sample) = vertex.bsdf.sample(vertex.wo, pick, u, &self.table) else { break };
            throughput *= sample.weight;
            let direction = vertex.frame.world_from_local(sample.wi);
            if vertex.absorbs(direction) {
                break;
            }
            ray = space.ray_from(&vertex.start, direction);
            let Some(next) = space.closest(&ray) else { break };
            hit = next;
        }
        rgb
    }

    /// Light from the directional source that a vertex reflects towards the path's start.
    fn direct<S: Space>(&self, space: &S, vertex: &Vertex<S::Start>) -> Vec3 {
        let light = space.light_at(&vertex.start);
        if vertex.absorbs(light) {
            return Vec3::ZERO;
        }
        let (value, _) = vertex.bsdf.eval(vertex.wo, vertex.frame.local_from_world(light), &self.table);
        let free = value != Vec3::ZERO && space.leaves(&space.ray_from(&vertex.start, light));
        if free { value } else { Vec3::ZERO }
    }
}

impl Patch {
    /// Texture coordinates of the first hit less those of the entry point; `None` where the ray passes. `wo` is a unit vector in
    /// the frame of the entry point; it ought to lie in the plane of the normal and [`Patch::across`], along which the patch
    /// has its curvature.
    #[must_use]
    pub fn first_hit(&self, uv: Vec2, wo: Vec3) -> Option<Vec2> {
        if wo.z <= 0.0 {
            return None;
        }
        let entry = Entry::new(self, uv, wo);
        match self.trace::<false>(&entry.ray) {
            Trace::Hit(hit) => Some(entry.offset(self, &hit, &self.surface_hit(&hit))),
            Trace::Left => None,
            Trace::Lost => self.tile().is_closed().then_some(Vec2::ZERO),
        }
    }

    /// Whether a ray from the viewer hits; see [`Self::first_hit`].
    #[must_use]
    pub fn hits(&self, uv: Vec2, wo: Vec3) -> bool {
        if wo.z <= 0.0 {
            return false;
        }
        match self.trace::<true>(&Entry::new(self, uv, wo).ray) {
            Trace::Hit(_) => true,
            Trace::Left => false,
            Trace::Lost => self.tile().is_closed(),
        }
    }

    /// One sample of what a ray sees under a light from `wi`; `None` where it passes. See [`Self::first_hit`].
    ///
    /// A ray that is lost in a closed material (it grazes a flat patch for 64 tiles, or met a gap of rounding) sees black.
    #[must_use]
    pub fn sample(
        &self,
        transport: &Transport,
        uv: Vec2,
        wo: Vec3,
        wi: Vec3,
        random: &mut Random,
    ) -> Option<PatchSample> {
        if wo.z <= 0.0 {
            return None;
        }
        let entry = Entry::new(self, uv, wo);
        let hit = match self.trace::<false>(&entry.ray) {
            Trace::Hit(hit) => hit,
            Trace::Left => return None,
            Trace::Lost if self.tile().is_closed() => {
                return Some(PatchSample { offset: Vec2::ZERO, rgb: Vec3::ZERO });
            }
            Trace::Lost => return None,
        };
        let surface = self.surface_hit(&hit);
        let offset = entry.offset(self, &hit, &surface);
        let lit = LitPatch { patch: self, home: entry.ray.block, light: entry.direction(self, wi) };
        Some(PatchSample { offset, rgb: transport.radiance(&lit, entry.ray, hit, random) })
    }
}

/// A patch with a light.
struct LitPatch<'a> {
    patch: &'a Patch,
    /// The block whose coordinates `light` is in.
    home: [i32; 2],
    light: DVec3,
}

impl Space for LitPatch<'_> {
    type Ray = LocalRay;
    type Hit = PatchHit;
    type Start = ([i32; 2], Vec3);

    fn closest(&self, ray: &LocalRay) -> Option<PatchHit> {
        match self.patch.trace::<false>(ray) {
            Trace::Hit(hit) => Some(hit),
            Trace::Left | Trace::Lost => None,
        }
    }

    fn leaves(&self, ray: &LocalRay) -> bool {
        matches!(self.patch.trace::<true>(ray), Trace::Left)
    }

    fn vertex(&self, ray: &LocalRay, hit: &PatchHit, transport: &Transport) -> Option<Vertex<Self::Start>> {
        let patch = self.patch;
        let bend = patch.bend();
        let surface = patch.surface_hit(hit);
        let shift = patch.shift(ray.block, hit.block);
        let wo = -bend.direction_seen_from(shift.x, ray.direction.as_dvec3()).as_vec3();
        let geometric = surface.point.normal;
        if geometric == Vec3::ZERO {
            return None;
        }
        let geometric = if geometric.dot(wo) < 0.0 { -geometric } else { geometric };
        let uv = patch.middle(hit.block) + surface.local.truncate().as_dvec2();
        let uv = (uv - uv.floor()).as_vec2();
        let point = patch.tile().point(surface.triangle, surface.weights, uv);
        let foot = patch.patch_from_uv(surface.local.as_dvec3());
        let smooth = if point.normal == Vec3::ZERO {
            Vec3::ZERO
        } else {
            bend.normal(foot.x, foot.z, patch.patch_from_uv(point.normal.as_dvec3())).as_vec3()
        };
        // Rays start on the surface that the triangles stand for, where that is above them: their facets throw no shadows.
        let lift = patch.tile().lift(uv, surface.local.z);
        let up = bend.vector(foot.x, DVec3::Z).as_vec3();
        let origin = surface.point.offset_by(geometric, surface.point.position + lift * up);
        Some(Vertex::new((hit.block, origin), wo, geometric, smooth, transport.bsdf(&point.reflectance)))
    }

    fn ray_from(&self, &(block, origin): &Self::Start, direction: Vec3) -> LocalRay {
        LocalRay { block, origin, direction }
    }

    fn light_at(&self, start: &Self::Start) -> Vec3 {
        let shift = self.patch.shift(self.home, start.0);
        self.patch.bend().direction_seen_from(shift.x, self.light).as_vec3()
    }
}

/// Where the viewer's ray enters.
struct Entry {
    ray: LocalRay,
    /// Arc length of the entry point from the middle of its block.
    s: f64,
    /// Texture coordinates of the entry point from the middle of its block.
    local: glam::DVec2,
}

impl Entry {
    #[allow(clippy::cast_possible_truncation, reason = "tracing is in f32")]
    fn new(patch: &Patch, uv: Vec2, wo: Vec3) -> Self {
        let (block, local) = patch.locate(uv);
        let foot = patch.patch_from_uv(local.extend(0.0));
        let bend = patch.bend();
        let towards = bend.vector(foot.x, patch.patch_from_uv(wo.as_dvec3()));
        let origin = patch.backed_off(bend.point(foot), towards, f64::from(wo.z));
        let ray = LocalRay { block, origin: origin.as_vec3(), direction: -towards.as_vec3() };
        Self { ray, s: foot.x, local }
    }

    /// A direction in the frame of the entry point, in the coordinates of the ray.
    fn direction(&self, patch: &Patch, w: Vec3) -> DVec3 {
        patch.bend().vector(self.s, patch.patch_from_uv(w.as_dvec3()))
    }

    fn offset(&self, patch: &Patch, hit: &PatchHit, surface: &SurfaceHit) -> Vec2 {
        let blocks = patch.middle(hit.block) - patch.middle(self.ray.block);
        (blocks + surface.local.truncate().as_dvec2() - self.local).as_vec2()
    }
}

/// Bends a shading normal that faces away from the viewer back to just facing it, as the renderer does at silhouettes of
/// smooth-shaded triangles.
fn facing_viewer(normal: Vec3, wo: Vec3) -> Vec3 {
    const LEAST: f32 = 0.02;
    let cosine = normal.dot(wo);
    if cosine >= LEAST { normal } else { (normal + (LEAST - cosine) * wo).normalize() }
}

#[cfg(test)]
mod tests;

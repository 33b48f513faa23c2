//! The path tracer, one path after the other: what [`wavefront`](crate::wavefront) does for many side by side, as it is easiest to read.
//!
//! Light is gathered by next-event estimation and by BSDF sampling, combined with the power heuristic (Veach 1997). One
//! light is drawn per path vertex, in proportion to a rough estimate of what it contributes there. Every random number has a
//! fixed dimension, so that leaving an effect out does not change what the others draw.

use glam::Vec3;
use osculate_geom::rays::{Hit, Ray};

use crate::camera::CameraRay;
use crate::counters::Counters;
use crate::lighting::{
    Last, PathLimits, Strategy, draw_light, environment_light, light_importance, light_weight,
    rectangle_light, shadow_ray,
};
use crate::lights::LightSample;
use crate::prepared::Prepared;
use crate::present::Simulated;
use crate::sampler::Sampler;
use crate::shading::ShadingPoint;
use crate::silhouette::{Met, Purpose, SilhouettePoint};
use crate::vertex::{Surface, Vertex};

/// The first random dimension of a path vertex. The camera has two, every vertex six: one for opacities on the way there, from the
/// second on those of its light, from the fourth on those of its direction.
#[inline]
pub(crate) fn first_dimension(depth: u32) -> u64 {
    2 + u64::from(depth) * 6
}

/// Vertices after which paths may be ended at random.
const ROULETTE_DEPTH: u32 = 4;

/// Radiance along a camera ray.
pub(crate) fn radiance(
    scene: &Prepared,
    effects: Simulated,
    limits: PathLimits,
    camera_ray: CameraRay,
    sampler: &mut Sampler,
    counters: &mut Counters,
) -> Vec3 {
    let mut total = Vec3::ZERO;
    let mut throughput = Vec3::ONE;
    let mut ray = Ray::new(camera_ray.origin, camera_ray.direction);
    let mut last: Option<Last> = None;
    for depth in 0.. {
        let base = first_dimension(depth);
        sampler.seek(base);
        let found = next_surface(scene, effects, &mut ray, sampler, counters);
        counters.bounce_rays += u64::from(depth > 0);
        let Some(Found { hit, silhouette }) = found else {
            if effects.environment() {
                total += throughput * environment_light(scene, limits, ray.direction, last);
            }
            return total;
        };
        if effects.area_lights()
            && let Some(light) = scene.rectangle_of(hit.triangle)
        {
            return total + throughput * rectangle_light(scene, limits, light, &ray, &hit, last);
        }
        if depth == limits.max_depth {
            return total;
        }
        counters.indirect_vertices += u64::from(depth > 0);
        let surface;
        let vertex = match &silhouette {
            Some(point) if effects.silhouettes() => Vertex::Silhouette(point.enter(counters)),
            _ => {
                surface = surface_at(scene, effects, &hit, -ray.direction, counters);
                Vertex::Surface(&surface)
            }
        };
        let receiver = vertex.receiver();
        let importance = light_importance(scene, effects, &receiver);
        sampler.seek(base + 1);
        if importance > 0.0 {
            let lit = direct_light(scene, effects, limits, &vertex, importance, sampler, counters);
            total += throughput * lit;
        }
        let last_vertex = depth + 1 == limits.max_depth || !effects.interreflection();
        let needs_ray = !last_vertex || limits.strategy != Strategy::Lights;
        // Without lights that a ray can hit, the ray of the last vertex would find nothing.
        if !needs_ray || (last_vertex && !effects.environment() && !effects.area_lights()) {
            return total;
        }
        sampler.seek(base + 3);
        let (pick, u) = (sampler.next_1d(), sampler.next_2d());
        counters.reflectance_queries += u64::from(vertex.is_silhouette());
        let Some(sample) = vertex.sample(pick, u, &scene.energy) else { return total };
        throughput *= sample.weight;
        if !survives(&mut throughput, depth, sampler) {
            return total;
        }
        last = Some(Last { receiver, importance, pdf: sample.pdf });
        ray = Ray::new(vertex.origin_towards(sample.wi), sample.wi);
        if last_vertex {
            counters.bounce_rays += 1;
            return total
                + throughput * light_at_end(scene, effects, limits, &mut ray, last, sampler, counters);
        }
    }
    total
}

/// Ends paths that carry little at random, and those that carry nothing.
#[inline]
pub(crate) fn survives(throughput: &mut Vec3, depth: u32, sampler: &mut Sampler) -> bool {
    if depth + 1 >= ROULETTE_DEPTH {
        let survival = throughput.max_element().min(0.95);
        if sampler.next_1d() >= survival {
            return false;
        }
        *throughput /= survival;
    }
    *throughput != Vec3::ZERO
}

/// Light along a ray that only looks for lights.
fn light_at_end(
    scene: &Prepared,
    effects: Simulated,
    limits: PathLimits,
    ray: &mut Ray,
    last: Option<Last>,
    sampler: &mut Sampler,
    counters: &mut Counters,
) -> Vec3 {
    match next_surface(scene, effects, ray, sampler, counters) {
        None if effects.environment() => environment_light(scene, limits, ray.direction, last),
        Some(Found { hit, .. }) if effects.area_lights() => scene
            .rectangle_of(hit.triangle)
            .map_or(Vec3::ZERO, |light| rectangle_light(scene, limits, light, ray, &hit, last)),
        _ => Vec3::ZERO,
    }
}

/// A hit that is not passed through.
pub(crate) struct Found<'a> {
    pub hit: Hit,
    /// What was found out about the material there on the way, if it has silhouettes.
    pub silhouette: Option<SilhouettePoint<'a>>,
}

/// The next hit that is not passed through. Moves the ray's origin to where the last passed surface was.
fn next_surface<'a>(
    scene: &'a Prepared,
    effects: Simulated,
    ray: &mut Ray,
    sampler: &mut Sampler,
    counters: &mut Counters,
) -> Option<Found<'a>> {
    counters.rays += 1;
    let mut hit = scene.geometry.closest_hit(ray)?;
    if !effects.pass_through() {
        return Some(Found { hit, silhouette: None });
    }
    let mut chance = sampler.next_1d();
    loop {
        let (opacity, silhouette) = opacity_of(scene, effects, &hit, ray.direction, Purpose::Path, counters);
        if chance < opacity {
            return Some(Found { hit, silhouette });
        }
        // What is left of the number is as good as new.
        chance = (chance - opacity) / (1.0 - opacity);
        counters.pass_throughs += 1;
        counters.rays += 1;
        ray.origin = scene.geometry.surface_point(&hit).origin_towards(ray.direction);
        hit = scene.geometry.closest_hit(ray)?;
    }
}

/// Share of light in this direction that the surface stops, and what was found out about its material.
fn opacity_of<'a>(
    scene: &'a Prepared,
    effects: Simulated,
    hit: &Hit,
    direction: Vec3,
    purpose: Purpose,
    counters: &mut Counters,
) -> (f32, Option<SilhouettePoint<'a>>) {
    let met = if effects.silhouettes() { Met::new(scene, hit, -direction, purpose, counters) } else { None };
    match met {
        Some(Met::Front(point)) => (point.alpha(counters), Some(point)),
        Some(Met::Opaque) => (1.0, None),
        Some(Met::Back) => (0.0, None),
        None => (plain_opacity(scene, hit), None),
    }
}

/// Opacity of a surface without silhouettes.
pub(crate) fn plain_opacity(scene: &Prepared, hit: &Hit) -> f32 {
    scene.material_of(hit.triangle).map_or(1.0, |material| material.opacity)
}

/// The ordinary surface at a hit.
#[inline(always)]
pub(crate) fn surface_at<'a>(
    scene: &'a Prepared,
    effects: Simulated,
    hit: &Hit,
    wo: Vec3,
    counters: &mut Counters,
) -> Surface<'a> {
    let point = ShadingPoint::new(scene, hit, wo);
    let bsdf = point.bsdf(scene, base_color(effects, &point, counters));
    Surface { point, bsdf }
}

fn base_color(effects: Simulated, point: &ShadingPoint<'_>, counters: &mut Counters) -> Vec3 {
    let material = point.material;
    match &material.base_color_texture {
        Some(texture) if effects.textures() => {
            counters.texture_lookups += 1;
            material.base_color * texture.lookup(point.uv)
        }
        _ => material.base_color,
    }
}

/// Light from one light, drawn in proportion to its importance, that the point reflects to the viewer.
#[inline(always)]
fn direct_light(
    scene: &Prepared,
    effects: Simulated,
    limits: PathLimits,
    vertex: &Vertex<'_>,
    importance: f32,
    sampler: &mut Sampler,
    counters: &mut Counters,
) -> Vec3 {
    let (pick, u) = (sampler.next_1d(), sampler.next_2d());
    let receiver = vertex.receiver();
    let Some((sample, chance)) = draw_light(scene, effects, &receiver, pick * importance, u, counters) else {
        return Vec3::ZERO;
    };
    let chance = chance / importance;
    counters.reflectance_queries += u64::from(vertex.is_silhouette());
    counters.below_horizon_lights += u64::from(receiver.is_below(sample.wi));
    let (f, bsdf_pdf) = vertex.eval(sample.wi, &scene.energy);
    if f == Vec3::ZERO {
        return Vec3::ZERO;
    }
    let Some(weight) = light_weight(limits, &sample, chance, bsdf_pdf) else { return Vec3::ZERO };
    let visible = transmittance(scene, effects, vertex.origin_towards(sample.wi), &sample, counters);
    weight * visible * f * sample.radiance
}

/// Share of light that gets from a light sample to the point.
fn transmittance(
    scene: &Prepared,
    effects: Simulated,
    origin: Vec3,
    sample: &LightSample,
    counters: &mut Counters,
) -> f32 {
    let mut ray = shadow_ray(origin, sample);
    counters.shadow_rays += 1;
    if !effects.shadow_pass_through() {
        return if scene.geometry.any_hit(&ray) { 0.0 } else { 1.0 };
    }
    let mut left = 1.0;
    while let Some(hit) = scene.geometry.closest_hit(&ray) {
        left *= 1.0 - opacity_of(scene, effects, &hit, ray.direction, Purpose::Shadow, counters).0;
        if left <= 0.0 {
            return 0.0;
        }
        counters.pass_throughs += 1;
        counters.shadow_pass_throughs += 1;
        counters.shadow_rays += 1;
        ray.origin = scene.geometry.surface_point(&hit).origin_towards(ray.direction);
        ray.t_max -= hit.t;
    }
    left
}

//! The path tracer, compiled once for each set of effects.
//!
//! Light is gathered by next-event estimation and by BSDF sampling, combined with the power heuristic (Veach 1997). One
//! light is drawn per path vertex, in proportion to a rough estimate of what it contributes there. Every random number has a
//! fixed dimension, so that leaving an effect out does not change what the others draw.

use glam::Vec3;
use osculate_geom::rays::{Hit, Ray};

use crate::camera::CameraRay;
use crate::counters::Counters;
use crate::effects::Effects;
use crate::lights::{LightSample, Receiver};
use crate::math::power_heuristic;
use crate::prepared::Prepared;
use crate::sampler::Sampler;
use crate::shading::ShadingPoint;
use crate::silhouette::{Met, SilhouettePoint};
use crate::vertex::Vertex;

/// How light is gathered. For tests that compare the strategies; the default combines them.
#[derive(Debug, Clone, Copy, PartialEq, Eq, Default)]
pub enum Strategy {
    /// Both, weighted by the power heuristic.
    #[default]
    Combined,
    /// Points on lights only.
    Lights,
    /// BSDF directions only. Directional lights, which no direction hits, are still drawn.
    Bsdf,
}

/// What a path may do.
#[derive(Debug, Clone, Copy)]
pub(crate) struct PathLimits {
    pub max_depth: u32,
    pub strategy: Strategy,
}

/// Radiance along a camera ray.
pub(crate) type RadianceFn = fn(&Prepared, PathLimits, CameraRay, &mut Sampler, &mut Counters) -> Vec3;

/// Random dimensions of the camera; those of path vertex `i` start at `CAMERA_DIMENSIONS + i * VERTEX_DIMENSIONS`.
const CAMERA_DIMENSIONS: u64 = 2;
const VERTEX_DIMENSIONS: u64 = 6;

/// Vertices after which paths may be ended at random.
const ROULETTE_DEPTH: u32 = 4;

/// The integrator with exactly these effects compiled in.
pub(crate) fn specialised(effects: Effects) -> RadianceFn {
    macro_rules! table {
        ($($bits:literal)*) => { [$(radiance::<$bits> as RadianceFn),*] };
    }
    const TABLE: [RadianceFn; 128] = table!(
        0 1 2 3 4 5 6 7 8 9 10 11 12 13 14 15 16 17 18 19 20 21 22 23 24 25 26 27 28 29 30 31
        32 33 34 35 36 37 38 39 40 41 42 43 44 45 46 47 48 49 50 51 52 53 54 55 56 57 58 59 60 61 62 63
        64 65 66 67 68 69 70 71 72 73 74 75 76 77 78 79 80 81 82 83 84 85 86 87 88 89 90 91 92 93 94 95
        96 97 98 99 100 101 102 103 104 105 106 107 108 109 110 111 112 113 114 115 116 117 118 119 120 121 122 123 124 125 126 127
    );
    TABLE[effects.path_bits()]
}

/// What must be remembered of the last vertex to weight light that the next ray meets.
#[derive(Clone, Copy)]
struct Last {
    receiver: Receiver,
    /// Sum of the lights' importances there.
    importance: f32,
    pdf: f32,
}

fn radiance<const BITS: usize>(
    scene: &Prepared,
    limits: PathLimits,
    camera_ray: CameraRay,
    sampler: &mut Sampler,
    counters: &mut Counters,
) -> Vec3 {
    let effects = const { Effects::from_path_bits(BITS) };
    let mut total = Vec3::ZERO;
    let mut throughput = Vec3::ONE;
    let mut ray = Ray::new(camera_ray.origin, camera_ray.direction);
    let mut last: Option<Last> = None;
    for depth in 0.. {
        let base = CAMERA_DIMENSIONS + u64::from(depth) * VERTEX_DIMENSIONS;
        sampler.seek(base);
        let found = next_surface(scene, effects, &mut ray, sampler, counters);
        counters.bounce_rays += u64::from(depth > 0);
        let Some(Found { hit, silhouette }) = found else {
            if effects.environment {
                total += throughput * environment_light(scene, limits, ray.direction, last);
            }
            return total;
        };
        if effects.area_lights
            && let Some(light) = scene.rectangle_of(hit.triangle)
        {
            return total + throughput * rectangle_light(scene, limits, light, &ray, &hit, last);
        }
        if depth == limits.max_depth {
            return total;
        }
        let vertex = match silhouette {
            Some(point) if effects.silhouettes => Vertex::Silhouette(point.enter()),
            _ => surface_vertex(scene, effects, &hit, -ray.direction, counters),
        };
        let receiver = vertex.receiver();
        let importance = light_importance(scene, effects, &receiver);
        sampler.seek(base + 1);
        if importance > 0.0 {
            let lit = direct_light(scene, effects, limits, &vertex, importance, sampler, counters);
            total += throughput * lit;
        }
        let last_vertex = depth + 1 == limits.max_depth || !effects.interreflection;
        let needs_ray = !last_vertex || limits.strategy != Strategy::Lights;
        // Without lights that a ray can hit, the ray of the last vertex would find nothing.
        if !needs_ray || (last_vertex && !effects.environment && !effects.area_lights) {
            return total;
        }
        sampler.seek(base + 3);
        let (pick, u) = (sampler.next_1d(), sampler.next_2d());
        counters.reflectance_queries += u64::from(vertex.is_silhouette());
        let Some(sample) = vertex.sample(pick, u, &scene.energy) else { return total };
        throughput *= sample.weight;
        if depth + 1 >= ROULETTE_DEPTH {
            let survival = throughput.max_element().min(0.95);
            if sampler.next_1d() >= survival {
                return total;
            }
            throughput /= survival;
        }
        if throughput == Vec3::ZERO {
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

/// Light along a ray that only looks for lights.
fn light_at_end(
    scene: &Prepared,
    effects: Effects,
    limits: PathLimits,
    ray: &mut Ray,
    last: Option<Last>,
    sampler: &mut Sampler,
    counters: &mut Counters,
) -> Vec3 {
    match next_surface(scene, effects, ray, sampler, counters) {
        None if effects.environment => environment_light(scene, limits, ray.direction, last),
        Some(Found { hit, .. }) if effects.area_lights => scene
            .rectangle_of(hit.triangle)
            .map_or(Vec3::ZERO, |light| rectangle_light(scene, limits, light, ray, &hit, last)),
        _ => Vec3::ZERO,
    }
}

/// A hit that is not passed through.
struct Found<'a> {
    hit: Hit,
    /// What was found out about the material there on the way, if it has silhouettes.
    silhouette: Option<SilhouettePoint<'a>>,
}

/// The next hit that is not passed through. Moves the ray's origin to where the last passed surface was.
fn next_surface<'a>(
    scene: &'a Prepared,
    effects: Effects,
    ray: &mut Ray,
    sampler: &mut Sampler,
    counters: &mut Counters,
) -> Option<Found<'a>> {
    counters.rays += 1;
    let mut hit = scene.bvh.closest_hit(ray)?;
    if !effects.transparency && !effects.silhouettes {
        return Some(Found { hit, silhouette: None });
    }
    let mut chance = sampler.next_1d();
    loop {
        let (opacity, silhouette) = opacity_of(scene, effects, &hit, ray.direction, counters);
        if chance < opacity {
            return Some(Found { hit, silhouette });
        }
        // What is left of the number is as good as new.
        chance = (chance - opacity) / (1.0 - opacity);
        counters.pass_throughs += 1;
        counters.rays += 1;
        ray.origin = scene.bvh.surface_point(&hit).origin_towards(ray.direction);
        hit = scene.bvh.closest_hit(ray)?;
    }
}

/// Share of light in this direction that the surface stops, and what was found out about its material.
fn opacity_of<'a>(
    scene: &'a Prepared,
    effects: Effects,
    hit: &Hit,
    direction: Vec3,
    counters: &mut Counters,
) -> (f32, Option<SilhouettePoint<'a>>) {
    if effects.silhouettes
        && let Some(met) = Met::new(scene, hit, -direction)
    {
        let Met::Front(point) = met else { return (0.0, None) };
        counters.opacity_queries += 1;
        return (point.alpha(), Some(point));
    }
    let material = scene.material_of.get(hit.triangle as usize);
    (material.map_or(1.0, |&m| scene.materials[m as usize].opacity), None)
}

fn surface_vertex<'a>(
    scene: &'a Prepared,
    effects: Effects,
    hit: &Hit,
    wo: Vec3,
    counters: &mut Counters,
) -> Vertex<'a> {
    let point = ShadingPoint::new(scene, hit, wo);
    let bsdf = point.bsdf(scene, base_color(effects, &point, counters));
    Vertex::Surface { point, bsdf }
}

fn base_color(effects: Effects, point: &ShadingPoint<'_>, counters: &mut Counters) -> Vec3 {
    let material = point.material;
    match &material.base_color_texture {
        Some(texture) if effects.textures => {
            counters.texture_lookups += 1;
            material.base_color * texture.lookup(point.uv)
        }
        _ => material.base_color,
    }
}

/// Light from one light, drawn in proportion to its importance, that the point reflects to the viewer.
fn direct_light(
    scene: &Prepared,
    effects: Effects,
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
    let (f, bsdf_pdf) = vertex.eval(sample.wi, &scene.energy);
    if f == Vec3::ZERO {
        return Vec3::ZERO;
    }
    let weight = if sample.pdf.is_infinite() {
        1.0 / chance
    } else {
        let pdf = sample.pdf * chance;
        let share = match limits.strategy {
            Strategy::Combined => power_heuristic(pdf, bsdf_pdf),
            Strategy::Lights => 1.0,
            Strategy::Bsdf => return Vec3::ZERO,
        };
        share / pdf
    };
    let visible = transmittance(scene, effects, vertex.origin_towards(sample.wi), &sample, counters);
    weight * visible * f * sample.radiance
}

/// Share of light that gets from a light sample to the point.
fn transmittance(
    scene: &Prepared,
    effects: Effects,
    origin: Vec3,
    sample: &LightSample,
    counters: &mut Counters,
) -> f32 {
    // Stops short of the light, which is itself a triangle: 1e-4 of the way covers the rounding of its distance.
    let mut ray = Ray::segment(origin, sample.wi, sample.distance * (1.0 - 1e-4));
    counters.shadow_rays += 1;
    if !effects.transparency && !effects.silhouettes {
        return if scene.bvh.any_hit(&ray) { 0.0 } else { 1.0 };
    }
    let mut left = 1.0;
    while let Some(hit) = scene.bvh.closest_hit(&ray) {
        left *= 1.0 - opacity_of(scene, effects, &hit, ray.direction, counters).0;
        if left <= 0.0 {
            return 0.0;
        }
        counters.pass_throughs += 1;
        counters.shadow_rays += 1;
        ray.origin = scene.bvh.surface_point(&hit).origin_towards(ray.direction);
        ray.t_max -= hit.t;
    }
    left
}

/// Sum of the importances of all lights at a point.
fn light_importance(scene: &Prepared, effects: Effects, receiver: &Receiver) -> f32 {
    let mut sum = 0.0;
    if effects.area_lights {
        sum += scene.rectangles.iter().map(|r| r.importance(receiver)).sum::<f32>();
    }
    if effects.directional_lights {
        sum += scene.suns.iter().map(|s| s.importance * receiver.facing(s.wi)).sum::<f32>();
    }
    if effects.environment {
        sum += scene.environment.as_ref().map_or(0.0, |e| e.importance(receiver));
    }
    sum
}

/// The light at `position` in the sum of importances, a point on it, and its importance.
fn draw_light(
    scene: &Prepared,
    effects: Effects,
    receiver: &Receiver,
    mut position: f32,
    u: [f32; 2],
    counters: &mut Counters,
) -> Option<(LightSample, f32)> {
    if effects.area_lights {
        for rectangle in &scene.rectangles {
            let importance = rectangle.importance(receiver);
            if position < importance {
                counters.area_light_samples += 1;
                return Some((rectangle.sample(receiver.origin, u)?, importance));
            }
            position -= importance;
        }
    }
    if effects.directional_lights {
        for sun in &scene.suns {
            let importance = sun.importance * receiver.facing(sun.wi);
            if position < importance {
                counters.directional_samples += 1;
                let (wi, radiance) = (sun.wi, sun.irradiance);
                let sample = LightSample { wi, distance: f32::INFINITY, radiance, pdf: f32::INFINITY };
                return Some((sample, importance));
            }
            position -= importance;
        }
    }
    if effects.environment
        && let Some(environment) = &scene.environment
    {
        counters.environment_samples += 1;
        return Some((environment.sample(receiver.normal, u)?, environment.importance(receiver)));
    }
    // Rounding can leave a crumb beyond the last light.
    None
}

/// Radiance of the environment along a ray that hit nothing.
fn environment_light(scene: &Prepared, limits: PathLimits, direction: Vec3, last: Option<Last>) -> Vec3 {
    let Some(environment) = &scene.environment else { return Vec3::ZERO };
    let share = bsdf_share(limits, last, |last| {
        environment.pdf(last.receiver.normal, direction) * environment.importance(&last.receiver)
            / last.importance
    });
    share * environment.radiance(direction)
}

/// Radiance of an area light that a ray hit.
fn rectangle_light(
    scene: &Prepared,
    limits: PathLimits,
    light: usize,
    ray: &Ray,
    hit: &Hit,
    last: Option<Last>,
) -> Vec3 {
    let rectangle = &scene.rectangles[light];
    if ray.direction.dot(rectangle.normal()) >= 0.0 {
        return Vec3::ZERO;
    }
    let share = bsdf_share(limits, last, |last| {
        // From the last vertex, not from where a transparent surface was passed.
        let distance = hit.t + ray.origin.distance(last.receiver.origin);
        let chance = rectangle.importance(&last.receiver) / last.importance;
        rectangle.pdf(ray.direction, distance) * chance
    });
    share * rectangle.radiance
}

/// Weight of light that a BSDF sample found, given the density with which light sampling would have found it.
fn bsdf_share(limits: PathLimits, last: Option<Last>, light_pdf: impl Fn(&Last) -> f32) -> f32 {
    match (limits.strategy, last) {
        (_, None) | (Strategy::Bsdf, _) => 1.0,
        (Strategy::Lights, Some(_)) => 0.0,
        (Strategy::Combined, Some(last)) => {
            if last.importance > 0.0 {
                power_heuristic(last.pdf, light_pdf(&last))
            } else {
                1.0
            }
        }
    }
}

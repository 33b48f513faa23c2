//! [`trace`]: many paths side by side, one stage after the other, so that rays are traced together and materials with silhouettes are asked in batches.
//!
//! What a path draws and adds does not depend on the others: every random number has its dimension, a batch's answers do not
//! depend on what else is in it, and each path adds up its own light in its own order. So the picture does not depend on how many
//! paths go side by side. It is the picture of [`crate::integrator`], to the bit where a material's batches give the bits of its
//! single answers.
//!
//! A round takes all paths over one vertex:
//! 1. find the next surface (`passing`): closest hits, opacities in a batch, again for the rays that pass;
//! 2. enter the materials in a batch;
//! 3. draw a light and a direction at every vertex, and ask for the colours of both in a batch;
//! 4. follow the shadow rays (`passing`), then go on in the drawn direction.
//!
//! Every stage is a function of its own, and what it calls for a path is inlined: what a scene does without costs a comparison, whatever else is compiled.

mod batches;
mod passing;

use glam::Vec3;
use osculate_geom::rays::Ray;

use crate::camera::CameraRay;
use crate::counters::Counters;
use crate::integrator::{first_dimension, surface_at, survives};
use crate::lighting::{
    Last, PathLimits, Strategy, draw_light, environment_light, light_importance, light_weight,
    rectangle_light, shadow_ray,
};
use crate::lights::{LightSample, Receiver};
use crate::prepared::Prepared;
use crate::present::Simulated;
use crate::sampler::Sampler;
use crate::silhouette::SilhouettePoint;
use crate::vertex::{Scattered, Surface, Vertex};
use batches::{Batches, ColourRequest};
use passing::{Found, Shadow, next_surfaces, transmittances};

/// A path from the camera.
#[derive(Debug)]
pub(crate) struct Path {
    ray: Ray,
    sampler: Sampler,
    throughput: Vec3,
    total: Vec3,
    last: Option<Last>,
}

impl Path {
    /// About to look for its first surface; the sampler has drawn what the camera needs.
    pub(crate) fn new(ray: CameraRay, sampler: Sampler) -> Self {
        let ray = Ray::new(ray.origin, ray.direction);
        Self { ray, sampler, throughput: Vec3::ONE, total: Vec3::ZERO, last: None }
    }

    /// Radiance along its camera ray, once it was traced.
    pub(crate) fn radiance(&self) -> Vec3 {
        self.total
    }
}

/// What all stages know.
#[derive(Clone, Copy)]
struct Context<'a> {
    scene: &'a Prepared,
    effects: Simulated,
    limits: PathLimits,
}

/// A vertex of a path.
struct Node<'v> {
    path: usize,
    vertex: Vertex<'v>,
    receiver: Receiver,
    /// Sum of the lights' importances.
    importance: f32,
    light: Option<LightQuery>,
    /// The direction in which the path goes on.
    next: Option<Scattered>,
}

/// A light that was drawn, the chance of that, and what the surface makes of it.
struct LightQuery {
    sample: LightSample,
    chance: f32,
    f: Vec3,
    pdf: f32,
}

/// Traces all paths to their ends.
#[inline(never)]
pub(crate) fn trace(
    scene: &Prepared,
    effects: Simulated,
    limits: PathLimits,
    paths: &mut [Path],
    counters: &mut Counters,
) {
    let cx = Context { scene, effects, limits };
    let mut batches = Batches::default();
    let mut active: Vec<usize> = (0..paths.len()).collect();
    for depth in 0.. {
        if active.is_empty() {
            return;
        }
        for &path in &active {
            paths[path].sampler.seek(first_dimension(depth));
        }
        counters.bounce_rays += if depth > 0 { active.len() as u64 } else { 0 };
        let mut points = Vec::with_capacity(active.len());
        let found = next_surfaces(cx, paths, &active, &mut points, &mut batches, counters);
        let arrived = arrive(cx, paths, &active, found, depth);
        counters.indirect_vertices += if depth > 0 { arrived.len() as u64 } else { 0 };
        let surfaces = surfaces(cx, paths, &arrived, counters);
        let mut nodes = vertices(cx, &arrived, &points, &surfaces, &mut batches, counters);
        let is_last = depth + 1 == limits.max_depth || !effects.interreflection();
        // Without lights that a ray can hit, the ray of the last vertex would find nothing.
        let lights_to_hit = effects.environment() || effects.area_lights();
        let goes_on = if is_last { limits.strategy != Strategy::Lights && lights_to_hit } else { true };
        draw(cx, paths, &mut nodes, depth, goes_on, &mut batches, counters);
        light(cx, paths, &nodes, &mut batches, counters);
        active = go_on(paths, &nodes, depth);
        if is_last {
            counters.bounce_rays += active.len() as u64;
            look_for_lights(cx, paths, &active, &mut batches, counters);
            return;
        }
    }
}

/// Ends the paths that met a light or nothing, and those that are long enough; the others with what they found.
#[inline(never)]
fn arrive(
    cx: Context<'_>,
    paths: &mut [Path],
    active: &[usize],
    found: Vec<Option<Found>>,
    depth: u32,
) -> Vec<(usize, Found)> {
    let mut arrived = Vec::with_capacity(active.len());
    for (&index, found) in active.iter().zip(found) {
        let path = &mut paths[index];
        match found {
            None if cx.effects.environment() => path.add_environment(cx),
            None => {}
            Some(found) => {
                let is_light =
                    cx.effects.area_lights() && cx.scene.rectangle_of(found.hit.triangle).is_some();
                if is_light {
                    path.add_rectangle(cx, &found);
                } else if depth < cx.limits.max_depth {
                    arrived.push((index, found));
                }
            }
        }
    }
    arrived
}

impl Path {
    /// Adds the environment's light along the ray, which found nothing.
    fn add_environment(&mut self, cx: Context<'_>) {
        let light = environment_light(cx.scene, cx.limits, self.ray.direction, self.last);
        self.total += self.throughput * light;
    }

    /// Adds the light of the area light that was found.
    fn add_rectangle(&mut self, cx: Context<'_>, found: &Found) {
        if let Some(light) = cx.scene.rectangle_of(found.hit.triangle) {
            let light = rectangle_light(cx.scene, cx.limits, light, &self.ray, &found.hit, self.last);
            self.total += self.throughput * light;
        }
    }
}

/// What is known of those that arrived at ordinary surfaces, in their order.
#[inline(never)]
fn surfaces<'a>(
    cx: Context<'a>,
    paths: &[Path],
    arrived: &[(usize, Found)],
    counters: &mut Counters,
) -> Vec<Surface<'a>> {
    let mut surfaces = Vec::with_capacity(arrived.len());
    for (path, found) in arrived.iter().filter(|(_, found)| found.point.is_none()) {
        let wo = -paths[*path].ray.direction;
        surfaces.push(surface_at(cx.scene, cx.effects, &found.hit, wo, counters));
    }
    surfaces
}

/// The vertices where paths arrived.
#[inline(never)]
fn vertices<'v>(
    cx: Context<'_>,
    arrived: &[(usize, Found)],
    points: &'v [SilhouettePoint<'v>],
    surfaces: &'v [Surface<'v>],
    batches: &mut Batches,
    counters: &mut Counters,
) -> Vec<Node<'v>> {
    let entered: Vec<_> = arrived.iter().filter_map(|(_, found)| Some(&points[found.point?])).collect();
    let entries = batches.entries(&entered, counters);
    let silhouettes =
        entered.into_iter().zip(entries).map(|(point, entry)| Vertex::Silhouette(point.entered(entry)));
    let (mut silhouettes, mut surfaces) = (silhouettes, surfaces.iter().map(Vertex::Surface));
    let mut nodes = Vec::with_capacity(arrived.len());
    for (path, found) in arrived {
        let vertex = if found.point.is_some() { silhouettes.next() } else { surfaces.next() };
        let Some(vertex) = vertex else { continue };
        let receiver = vertex.receiver();
        let importance = light_importance(cx.scene, cx.effects, &receiver);
        nodes.push(Node { path: *path, vertex, receiver, importance, light: None, next: None });
    }
    nodes
}

/// Draws a light and, if paths go on, a direction at every vertex, and evaluates the surfaces for both.
#[inline(never)]
fn draw(
    cx: Context<'_>,
    paths: &mut [Path],
    nodes: &mut [Node<'_>],
    depth: u32,
    goes_on: bool,
    batches: &mut Batches,
    counters: &mut Counters,
) {
    let energy = &cx.scene.energy;
    let mut requests = Vec::with_capacity(2 * nodes.len());
    for (index, node) in nodes.iter_mut().enumerate() {
        let sampler = &mut paths[node.path].sampler;
        sampler.seek(first_dimension(depth) + 1);
        node.draw_light(cx, sampler, counters);
        if let Some(LightQuery { sample, f, pdf, .. }) = &mut node.light {
            match &node.vertex {
                Vertex::Silhouette(point) => {
                    counters.reflectance_queries += 1;
                    counters.below_horizon_lights += u64::from(node.receiver.is_below(sample.wi));
                    *pdf = point.pdf(sample.wi);
                    requests.push(ColourRequest::new(point, sample.wi, index));
                }
                Vertex::Surface(_) => (*f, *pdf) = node.vertex.eval(sample.wi, energy),
            }
        }
        if !goes_on {
            continue;
        }
        sampler.seek(first_dimension(depth) + 3);
        let (pick, u) = (sampler.next_1d(), sampler.next_2d());
        if let Vertex::Silhouette(point) = &node.vertex {
            counters.reflectance_queries += 1;
            let wi = point.draw(pick, u);
            node.next = Some(Scattered { wi, weight: Vec3::ZERO, pdf: point.pdf(wi) });
            requests.push(ColourRequest::new(point, wi, index).of_direction());
        } else {
            node.next = node.vertex.sample(pick, u, energy);
        }
    }
    for (request, rgb) in requests.iter().zip(batches.colours(&requests)) {
        let node = &mut nodes[request.node];
        if request.is_direction {
            node.next = node.next.and_then(|drawn| Scattered::new(drawn.wi, rgb, drawn.pdf));
        } else if let Some(light) = &mut node.light {
            light.f = rgb;
        }
    }
}

impl Node<'_> {
    fn draw_light(&mut self, cx: Context<'_>, sampler: &mut Sampler, counters: &mut Counters) {
        if self.importance <= 0.0 {
            return;
        }
        let (pick, u) = (sampler.next_1d(), sampler.next_2d());
        let drawn = draw_light(cx.scene, cx.effects, &self.receiver, pick * self.importance, u, counters);
        self.light = drawn.map(|(sample, chance)| LightQuery {
            sample,
            chance: chance / self.importance,
            f: Vec3::ZERO,
            pdf: 0.0,
        });
    }
}

/// Adds the light of the lights that were drawn, as far as it gets there.
#[inline(never)]
fn light(
    cx: Context<'_>,
    paths: &mut [Path],
    nodes: &[Node<'_>],
    batches: &mut Batches,
    counters: &mut Counters,
) {
    let mut shadows = Vec::with_capacity(nodes.len());
    let mut unshadowed = Vec::with_capacity(nodes.len());
    for node in nodes {
        let Some(LightQuery { sample, chance, f, pdf }) = &node.light else { continue };
        if *f == Vec3::ZERO {
            continue;
        }
        let Some(weight) = light_weight(cx.limits, sample, *chance, *pdf) else { continue };
        shadows.push(Shadow::new(shadow_ray(node.vertex.origin_towards(sample.wi), sample)));
        unshadowed.push((node.path, weight, *f, sample.radiance));
    }
    transmittances(cx, &mut shadows, batches, counters);
    for ((path, weight, f, radiance), shadow) in unshadowed.into_iter().zip(&shadows) {
        let path = &mut paths[path];
        path.total += path.throughput * (weight * shadow.left() * f * radiance);
    }
}

/// Turns paths into their next direction; returns those that go on.
#[inline(never)]
fn go_on(paths: &mut [Path], nodes: &[Node<'_>], depth: u32) -> Vec<usize> {
    let mut active = Vec::with_capacity(nodes.len());
    for node in nodes {
        let Some(Scattered { wi, weight, pdf }) = node.next else { continue };
        let path = &mut paths[node.path];
        path.throughput *= weight;
        if !survives(&mut path.throughput, depth, &mut path.sampler) {
            continue;
        }
        path.last = Some(Last { receiver: node.receiver, importance: node.importance, pdf });
        path.ray = Ray::new(node.vertex.origin_towards(wi), wi);
        active.push(node.path);
    }
    active
}

/// Light along rays that only look for lights.
#[inline(never)]
fn look_for_lights(
    cx: Context<'_>,
    paths: &mut [Path],
    active: &[usize],
    batches: &mut Batches,
    counters: &mut Counters,
) {
    let found = next_surfaces(cx, paths, active, &mut Vec::new(), batches, counters);
    for (&path, found) in active.iter().zip(found) {
        let path = &mut paths[path];
        match found {
            None if cx.effects.environment() => path.add_environment(cx),
            Some(found) if cx.effects.area_lights() => path.add_rectangle(cx, &found),
            _ => {}
        }
    }
}

//! Rays that may pass through surfaces: those of paths, which look for the surface that stops them, and shadow rays.

use glam::Vec3;
use osculate_geom::rays::{Hit, Ray};

use super::batches::Batches;
use super::{Context, Path};
use crate::counters::Counters;
use crate::prepared::Prepared;
use crate::silhouette::{Purpose, SilhouettePoint};

/// A ray of a path at a surface that may let it pass.
struct Passing {
    /// Which of the answers it is.
    slot: usize,
    path: usize,
    hit: Hit,
    /// It is stopped where this is less than the opacity.
    chance: f32,
}

/// A hit that is not passed through.
pub(super) struct Found {
    pub hit: Hit,
    /// Which of the points with silhouettes it is, if it is one.
    pub point: Option<usize>,
}

/// For each of these paths the next hit that is not passed through. Moves the rays' origins to where the last passed surface was, and adds all
/// points with silhouettes that were met to `points`.
#[inline(never)]
pub(super) fn next_surfaces<'a>(
    cx: Context<'a>,
    paths: &mut [Path],
    active: &[usize],
    points: &mut Vec<SilhouettePoint<'a>>,
    batches: &mut Batches,
    counters: &mut Counters,
) -> Vec<Option<Found>> {
    counters.rays += active.len() as u64;
    let hits = cx.scene.geometry.closest_hits(active.iter().map(|&path| paths[path].ray));
    if !cx.effects.pass_through() {
        return hits.into_iter().map(|hit| Some(Found { hit: hit?, point: None })).collect();
    }
    let mut found: Vec<Option<Found>> = Vec::new();
    found.resize_with(active.len(), || None);
    let first = |((slot, &path), hit): ((usize, &usize), Option<Hit>)| {
        Some(Passing { slot, path, hit: hit?, chance: paths[path].sampler.next_1d() })
    };
    let mut pending: Vec<Passing> = active.iter().enumerate().zip(hits).filter_map(first).collect();
    while !pending.is_empty() {
        let hits = pending.iter().map(|p| (p.hit, paths[p.path].ray.direction));
        let opacities = batches.opacities(cx, hits, Purpose::Path, points, counters);
        let mut opacities = opacities.into_iter();
        pending.retain_mut(|passing| {
            let Some(opacity) = opacities.next() else { return false };
            if passing.chance < opacity.share {
                found[passing.slot] = Some(Found { hit: passing.hit, point: opacity.point });
                return false;
            }
            // What is left of the number is as good as new.
            passing.chance = (passing.chance - opacity.share) / (1.0 - opacity.share);
            counters.pass_throughs += 1;
            counters.rays += 1;
            let ray = &mut paths[passing.path].ray;
            ray.origin = behind(cx.scene, &passing.hit, ray.direction);
            let next = cx.scene.geometry.closest_hit(ray);
            next.inspect(|&hit| passing.hit = hit).is_some()
        });
    }
    found
}

/// A ray on the way to a light.
#[derive(Debug)]
pub(super) struct Shadow {
    ray: Ray,
    left: f32,
}

impl Shadow {
    pub fn new(ray: Ray) -> Self {
        Self { ray, left: 1.0 }
    }

    /// Share of light that gets through.
    pub fn left(&self) -> f32 {
        self.left
    }
}

/// Follows shadow rays to their lights.
#[inline(never)]
pub(super) fn transmittances(
    cx: Context<'_>,
    shadows: &mut [Shadow],
    batches: &mut Batches,
    counters: &mut Counters,
) {
    counters.shadow_rays += shadows.len() as u64;
    if !cx.effects.shadow_pass_through() {
        let stopped = cx.scene.geometry.any_hits(shadows.iter().map(|shadow| shadow.ray));
        shadows
            .iter_mut()
            .zip(stopped)
            .for_each(|(shadow, stopped)| shadow.left = if stopped { 0.0 } else { 1.0 });
        return;
    }
    let hits = cx.scene.geometry.closest_hits(shadows.iter().map(|shadow| shadow.ray));
    let first = |(k, hit): (usize, Option<Hit>)| Some((k, hit?));
    let mut pending: Vec<(usize, Hit)> = hits.into_iter().enumerate().filter_map(first).collect();
    let mut points = Vec::with_capacity(pending.len());
    while !pending.is_empty() {
        let hits = pending.iter().map(|&(k, hit)| (hit, shadows[k].ray.direction));
        points.clear();
        let opacities = batches.opacities(cx, hits, Purpose::Shadow, &mut points, counters);
        let mut opacities = opacities.into_iter();
        pending.retain_mut(|(k, hit)| {
            let Some(opacity) = opacities.next() else { return false };
            let shadow = &mut shadows[*k];
            shadow.left *= 1.0 - opacity.share;
            if shadow.left <= 0.0 {
                shadow.left = 0.0;
                return false;
            }
            counters.pass_throughs += 1;
            counters.shadow_pass_throughs += 1;
            counters.shadow_rays += 1;
            shadow.ray.origin = behind(cx.scene, hit, shadow.ray.direction);
            shadow.ray.t_max -= hit.t;
            let next = cx.scene.geometry.closest_hit(&shadow.ray);
            next.inspect(|&next| *hit = next).is_some()
        });
    }
}

/// Where a ray goes on that passed through a surface.
fn behind(scene: &Prepared, hit: &Hit, direction: Vec3) -> Vec3 {
    scene.geometry.surface_point(hit).origin_towards(direction)
}

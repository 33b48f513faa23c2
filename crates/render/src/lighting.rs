//! Light that a path vertex gets: which light is drawn there, and what light counts for that a ray finds.

use glam::Vec3;
use osculate_geom::rays::{Hit, Ray};

use crate::counters::Counters;
use crate::lights::{LightSample, Receiver};
use crate::math::power_heuristic;
use crate::prepared::Prepared;
use crate::present::Simulated;

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

/// What must be remembered of the last vertex to weight light that the next ray meets.
#[derive(Debug, Clone, Copy)]
pub(crate) struct Last {
    pub receiver: Receiver,
    /// Sum of the lights' importances there.
    pub importance: f32,
    pub pdf: f32,
}

/// What a light sample counts for, given the chance with which its light was drawn and the density with which the surface would
/// have drawn its direction; `None` where the strategy leaves it to the surface.
#[inline]
pub(crate) fn light_weight(
    limits: PathLimits,
    sample: &LightSample,
    chance: f32,
    bsdf_pdf: f32,
) -> Option<f32> {
    if sample.pdf.is_infinite() {
        return Some(1.0 / chance);
    }
    let pdf = sample.pdf * chance;
    let share = match limits.strategy {
        Strategy::Combined => power_heuristic(pdf, bsdf_pdf),
        Strategy::Lights => 1.0,
        Strategy::Bsdf => return None,
    };
    Some(share / pdf)
}

/// The way from a vertex to a light sample. It stops short of the light, which is itself a triangle: 1e-4 of the way covers the
/// rounding of its distance.
#[inline]
pub(crate) fn shadow_ray(origin: Vec3, sample: &LightSample) -> Ray {
    Ray::segment(origin, sample.wi, sample.distance * (1.0 - 1e-4))
}

/// Sum of the importances of all lights at a point.
#[inline(always)]
pub(crate) fn light_importance(scene: &Prepared, effects: Simulated, receiver: &Receiver) -> f32 {
    let mut sum = 0.0;
    if effects.area_lights() {
        sum += scene.rectangles.iter().map(|r| r.importance(receiver)).sum::<f32>();
    }
    if effects.directional_lights() {
        sum += scene.suns.iter().map(|s| s.importance * receiver.facing(s.wi)).sum::<f32>();
    }
    if effects.environment() {
        sum += scene.environment.as_ref().map_or(0.0, |e| e.importance(receiver));
    }
    sum
}

/// The light at `position` in the sum of importances, a point on it, and its importance.
#[inline(always)]
pub(crate) fn draw_light(
    scene: &Prepared,
    effects: Simulated,
    receiver: &Receiver,
    mut position: f32,
    u: [f32; 2],
    counters: &mut Counters,
) -> Option<(LightSample, f32)> {
    if effects.area_lights() {
        for rectangle in &scene.rectangles {
            let importance = rectangle.importance(receiver);
            if position < importance {
                counters.area_light_samples += 1;
                return Some((rectangle.sample(receiver.origin, u)?, importance));
            }
            position -= importance;
        }
    }
    if effects.directional_lights() {
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
    if effects.environment()
        && let Some(environment) = &scene.environment
    {
        counters.environment_samples += 1;
        return Some((environment.sample(receiver.normal, u)?, environment.importance(receiver)));
    }
    // Rounding can leave a crumb beyond the last light.
    None
}

/// Radiance of the environment along a ray that hit nothing.
#[inline]
pub(crate) fn environment_light(
    scene: &Prepared,
    limits: PathLimits,
    direction: Vec3,
    last: Option<Last>,
) -> Vec3 {
    let Some(environment) = &scene.environment else { return Vec3::ZERO };
    let share = bsdf_share(limits, last, |last| {
        environment.pdf(last.receiver.normal, direction) * environment.importance(&last.receiver)
            / last.importance
    });
    share * environment.radiance(direction)
}

/// Radiance of an area light that a ray hit.
#[inline]
pub(crate) fn rectangle_light(
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

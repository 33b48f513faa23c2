//! Light on a hit: a sun with a highlight, a sky with occlusion.

use std::f32::consts::{FRAC_1_PI, TAU};

use glam::{Vec2, Vec3};

use super::{PreviewOptions, Scene, Surface};
use crate::micro::pattern::{hash, unit};

/// Irradiance of the sun on a surface that faces it, and radiance of the sky times pi.
const SUN: Vec3 = Vec3::new(1.75, 1.65, 1.48);
const SKY: Vec3 = Vec3::new(0.42, 0.47, 0.55);
const SKY_SAMPLES: u32 = 12;

/// Linear RGB along a ray.
pub(super) fn radiance(
    scene: &impl Scene,
    options: &PreviewOptions,
    origin: Vec3,
    direction: Vec3,
    seed: u64,
) -> Vec3 {
    let Some(surface) = scene.hit(origin, direction) else { return ground(origin, direction) };
    let base = surface.reflectance.albedo * (1.0 - surface.reflectance.metalness);
    let cosine = surface.normal.dot(options.sun);
    let mut light = SKY * base * openness(scene, &surface, seed);
    if cosine > 0.0 && !scene.shadowed(&surface, options.sun) {
        light += SUN * cosine * (base + highlight(&surface, -direction, options.sun));
    }
    light
}

/// A chequered plane far below, lit evenly.
fn ground(origin: Vec3, direction: Vec3) -> Vec3 {
    let p = (origin - direction * ((origin.z + 0.6) / direction.z)) * 6.0;
    let odd = (p.x.floor() + p.y.floor()).rem_euclid(2.0) > 0.5;
    Vec3::splat(if odd { 0.5 } else { 0.85 })
}

/// Share of the sky that is seen, weighted by the cosine.
fn openness(scene: &impl Scene, surface: &Surface, seed: u64) -> f32 {
    let (tangent, bitangent) = surface.normal.any_orthonormal_pair();
    let bits = hash(seed, 0, 0);
    let mut open = 0.0;
    for i in 0..SKY_SAMPLES {
        // Cosine-weighted, stratified by the golden ratio, rotated at random.
        let u = (i as f32 + unit(bits, 1)) / SKY_SAMPLES as f32;
        let phi = TAU * (i as f32 * 0.618_034 + unit(bits, 2));
        let disk = Vec2::from_angle(phi) * u.sqrt();
        let direction = tangent * disk.x + bitangent * disk.y + surface.normal * (1.0 - u).max(0.0).sqrt();
        if direction.z > 0.02 && !scene.shadowed(surface, direction) {
            open += 1.0;
        }
    }
    open / SKY_SAMPLES as f32
}

/// GGX with Schlick's Fresnel term, times pi.
fn highlight(surface: &Surface, viewer: Vec3, sun: Vec3) -> Vec3 {
    let half = (viewer + sun).normalize_or(surface.normal);
    // Below 0.04 a highlight is smaller than a pixel and only aliases.
    let alpha = (surface.reflectance.roughness * surface.reflectance.roughness).max(0.04);
    let (n_h, n_v) = (surface.normal.dot(half).max(0.0), surface.normal.dot(viewer).max(1e-3));
    let n_l = surface.normal.dot(sun).max(1e-3);
    let a2 = alpha * alpha;
    let spread = n_h * n_h * (a2 - 1.0) + 1.0;
    let d = a2 * FRAC_1_PI / (spread * spread);
    let smith = |c: f32| c + (a2 + (1.0 - a2) * c * c).sqrt();
    let specular = Vec3::splat(0.04).lerp(surface.reflectance.albedo, surface.reflectance.metalness);
    let fresnel = specular + (Vec3::ONE - specular) * (1.0 - half.dot(sun).clamp(0.0, 1.0)).powi(5);
    fresnel * d / (smith(n_v) * smith(n_l)) * std::f32::consts::PI
}

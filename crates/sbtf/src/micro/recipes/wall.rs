//! Wall: a running bond of worn bricks in rough mortar.

use glam::Vec2;

use super::Texel;
use crate::micro::pattern::{
    dome, fbm, hash, lattice, mix, noise, pick, rise, smooth_max, smooth_min, srgb, unit, warp,
};

/// Bricks along u, and courses along v (an even number, so that the bond repeats).
const BRICKS: u32 = 3;
const COURSES: u32 = 8;
/// Half the width of a joint, in UV units.
const JOINT: f32 = 0.011;

pub(super) fn texel(uv: Vec2) -> Texel {
    let p = warp(uv, [8, 8], 2, 0.004, 1);
    let course = (p.y * COURSES as f32).floor();
    let along = p.x * BRICKS as f32 + 0.5 * course.rem_euclid(2.0);
    let brick = hash(2, lattice(along.floor(), BRICKS), lattice(course, COURSES));
    let centre = Vec2::new(along - along.floor() - 0.5, p.y * COURSES as f32 - course - 0.5);
    let size = Vec2::new(1.0 / BRICKS as f32, 1.0 / COURSES as f32);
    let to_edge = 0.5 * size - (centre * size).abs() - JOINT * (0.8 + 0.6 * unit(brick, 3));
    let chipped = smooth_min(to_edge.x, to_edge.y, 0.012) + 0.006 * fbm(uv, [20, 20], 3, 4);
    let grit = fbm(uv, [32, 32], 4, 5);
    let tilt = 0.25 * (unit(brick, 5) - 0.5) * centre.x + 0.2 * (unit(brick, 6) - 0.5) * centre.y;
    let face = 0.72 + 0.22 * unit(brick, 4) + tilt + 0.05 * grit - 0.12 * pits(uv);
    let fired = face * dome((chipped + 0.004) / 0.016);
    // Mortar has crumbled here and there.
    let crumbled = rise(fbm(uv, [5, 5], 3, 11), 0.15, 0.5);
    let mortar = 0.58 - 0.4 * crumbled + 0.1 * fbm(uv, [28, 28], 4, 7);
    let height = smooth_max(fired, mortar, 0.08);
    let is_brick = rise(fired - mortar, -0.04, 0.08);
    let kinds = [srgb(0x9c4834), srgb(0x843a2e), srgb(0xb06044), srgb(0x703834), srgb(0xa85438)];
    let burnt = pick(&kinds, brick) * (0.85 + 0.3 * unit(brick, 7) + 0.3 * grit);
    let joint = srgb(0xb8ac98) * (0.85 + 0.35 * noise(uv, [100, 100], 8));
    Texel { height, albedo: mix(joint, burnt, is_brick), roughness: 0.93 - 0.13 * is_brick, metalness: 0.0 }
}

/// 1 in scattered pits.
fn pits(uv: Vec2) -> f32 {
    rise(noise(uv, [26, 26], 9) + 0.4 * noise(uv, [60, 60], 10), 0.55, 0.85)
}

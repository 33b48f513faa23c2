//! Wool 2: a plain weave of thick twisted yarn.

use std::f32::consts::PI;

use glam::Vec2;

use super::{Texel, yarn};
use crate::micro::pattern::{fbm, hash, lattice, mix, noise, pick, rise, smooth_max, srgb, warp};

/// Yarns along each axis; an even number, so that over and under alternate across the border.
const YARNS: u32 = 6;
/// Turns of a ply from one crossing to the next; times the yarns a whole number, so that they meet across the border.
const TWIST: f32 = 2.5;

pub(super) fn texel(uv: Vec2) -> Texel {
    let p = warp(uv, [5, 5], 2, 0.008, 1) * YARNS as f32;
    let warp_yarn = strand(p.x, p.y, 0.0);
    let weft_yarn = strand(p.y, p.x, 1.0);
    let height = smooth_max(warp_yarn.0, weft_yarn.0, 0.06);
    let (top, seed) = if warp_yarn.0 > weft_yarn.0 { (p.x, 2) } else { (p.y, 3) };
    let id = hash(seed, lattice(top.floor(), YARNS), 0);
    let dyed: &[_] = if seed == 2 {
        &[srgb(0xd8c4a4), srgb(0xe4d6bc), srgb(0xc8b08c)]
    } else {
        &[srgb(0x8c3a34), srgb(0x6e2c32), srgb(0xa04c3a)]
    };
    let lit = rise(height, -0.3, 0.9);
    let fuzz = 0.025 * noise(uv, [100, 100], 4) + 0.03 * fbm(uv, [44, 44], 2, 5);
    let shade = 0.9 + 0.25 * noise(uv, [130, 130], 6) + 0.3 * fbm(uv, [7, 7], 3, 7);
    let albedo = mix(srgb(0x241814), pick(dyed, id) * shade, 0.15 + 0.85 * lit);
    Texel { height: height + fuzz, albedo, roughness: 0.95, metalness: 0.0 }
}

/// Height of a yarn that runs along `along`, and its own index across. `phase` 1 goes over where 0 goes under.
fn strand(across: f32, along: f32, phase: f32) -> (f32, f32) {
    let yarn = across.floor();
    let place = (across - yarn - 0.5) / 0.47;
    let over = (PI * (along - 0.5 + yarn + phase)).cos();
    // Flattened where it passes over, as cloth is pressed.
    let path = 0.36 * over * (1.15 - 0.15 * over);
    let round = yarn::twisted(place, TWIST * along, 3.0).map_or(-1.0, |r| path + 0.62 * r - 0.1);
    (round.max(-0.55), yarn)
}

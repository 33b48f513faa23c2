//! Leather: pebble grain of two sizes with wrinkles across.

use glam::Vec2;

use super::Texel;
use crate::micro::pattern::{cells, dome, fall, fbm, mix, noise, smooth_min, srgb, unit, warp};

pub(super) fn texel(uv: Vec2) -> Texel {
    let warped = warp(uv, [9, 9], 2, 0.018, 1);
    let (pebble, grain) = (pebbles(warped, [13, 13], 2), pebbles(warped, [29, 29], 3));
    let wrinkle = wrinkles(uv);
    let height = smooth_min(pebble * (0.76 + 0.24 * grain), 0.25 + 1.1 * wrinkle, 0.3)
        + 0.12 * fbm(uv, [3, 3], 2, 4)
        + 0.02 * noise(uv, [90, 90], 5);
    let crease = fall(height, 0.1, 0.75);
    let hide = mix(srgb(0x9c4a1e), srgb(0x7a3416), 0.5 + 0.7 * fbm(uv, [4, 4], 3, 6));
    let albedo = mix(hide, srgb(0x2c130b), 0.9 * crease);
    Texel { height, albedo, roughness: 0.42 + 0.3 * crease, metalness: 0.0 }
}

/// Rounded cells in `[0, 1]`, 0 in the creases between them.
pub(super) fn pebbles(uv: Vec2, counts: [u32; 2], seed: u64) -> f32 {
    let cell = cells(uv, counts, 0.95, seed);
    dome(cell.border / 0.36) * (0.85 + 0.15 * unit(cell.id, 3))
}

/// 0 along a few long creases, 1 away from them.
fn wrinkles(uv: Vec2) -> f32 {
    let line = |counts, seed| {
        let bent = warp(uv, [5, 5], 2, 0.03, seed);
        (noise(bent, counts, seed ^ 9).abs() * 9.0).min(1.0)
    };
    line([3, 5], 7).min(line([5, 2], 8))
}

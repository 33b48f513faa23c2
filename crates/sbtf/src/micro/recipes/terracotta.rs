//! Terracotta: a roof of barrel tiles, rows of covers over rows of pans.

use glam::Vec2;

use super::Texel;
use crate::micro::pattern::{ball, fbm, hash, lattice, mix, noise, pick, ramp, rise, smooth_max, srgb, unit};

/// Pairs of cover and pan along u, and courses along v.
const PAIRS: u32 = 4;
const COURSES: u32 = 4;

pub(super) fn texel(uv: Vec2) -> Texel {
    let cover = tile(uv, 0.0, 1);
    let pan = tile(uv, 0.5, 2);
    let across = |shift: f32| (PAIRS as f32 * uv.x - shift).rem_euclid(1.0) * 2.0 - 1.0;
    // Covers arch up over a bit more than half of the pair, pans hang down between them.
    let arch = 0.36 + 0.52 * ball(across(0.0) / 0.6) + 0.2 * cover.lift;
    let trough = 0.42 - 0.34 * ball(across(0.5) / 0.72) + 0.14 * pan.lift;
    let arch = arch - 1.2 * rise(across(0.0).abs(), 0.55, 0.62);
    let clay = 0.02 * fbm(uv, [30, 30], 3, 3) + 0.012 * noise(uv, [12, 90], 4);
    let height = smooth_max(arch, trough, 0.04) + clay;
    let top = if arch > trough { cover } else { pan };
    let fired = [srgb(0xb55a34), srgb(0xc87448), srgb(0xa0482c), srgb(0xd08a5c), srgb(0xb86440)];
    let weather = fbm(uv, [5, 5], 4, 5);
    let body = pick(&fired, top.id) * (0.9 + 0.2 * unit(top.id, 4) + 0.35 * weather);
    let sooty = ramp(&[srgb(0x5a4438), srgb(0x7c6a52), body], 3.2 * height + 0.7 * weather);
    let albedo = mix(sooty, body, rise(height, 0.15, 0.6));
    Texel { height, albedo, roughness: 0.82 + 0.1 * weather, metalness: 0.0 }
}

#[derive(Clone, Copy)]
struct Tile {
    id: u64,
    /// How far it is raised by the tile below: 0 at its upper end, 1 at its lip.
    lift: f32,
}

/// The tile of a column: `shift` pairs to the right, each course lapped over the next one down.
fn tile(uv: Vec2, shift: f32, seed: u64) -> Tile {
    let column = (PAIRS as f32 * uv.x - shift).floor();
    let own = hash(seed, lattice(column, PAIRS), 0);
    // Lips do not line up exactly from column to column, and none lies along the border, where it would look like a seam.
    let along = COURSES as f32 * uv.y + 0.3 + 0.5 * shift + 0.14 * unit(own, 1);
    let lip = along - along.floor();
    let id = hash(seed, lattice(column, PAIRS), 1 + lattice(along.floor(), COURSES));
    let lift = fall_from_lip(lip) * (0.85 + 0.3 * unit(id, 2));
    Tile { id, lift }
}

/// 1 at the lip, 0 at the far end, with the step at the lip three hundredths of a course wide.
fn fall_from_lip(x: f32) -> f32 {
    rise(x, 0.0, 0.05) * (1.0 - x)
}

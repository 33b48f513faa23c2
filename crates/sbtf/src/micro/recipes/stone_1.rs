//! Stone 1: rounded cobbles set in sand.

use glam::Vec2;

use super::Texel;
use crate::micro::pattern::{ball, cells, dome, fbm, mix, noise, pick, rise, smooth_max, srgb, unit, warp};

pub(super) fn texel(uv: Vec2) -> Texel {
    let cell = cells(warp(uv, [7, 7], 3, 0.022, 1), [6, 6], 0.55, 2);
    let rough = fbm(uv, [22, 22], 4, 3);
    let top = 0.72 + 0.28 * unit(cell.id, 3);
    // A worn shoulder at the border, and the whole face arched: a border distance alone would make pyramids.
    let inside = rise(cell.border, 0.05, 0.11);
    let stone =
        top * dome((cell.border - 0.04).max(0.0) / 0.18) * ball(cell.f1 / 0.78) + 0.05 * rough * inside;
    let sand = 0.22 + 0.07 * fbm(uv, [36, 36], 3, 4);
    let height = smooth_max(stone, sand, 0.06);
    let kinds = [srgb(0x8d867c), srgb(0x6e7680), srgb(0xa38b70), srgb(0x796355), srgb(0xb4aea0)];
    let kind = pick(&kinds, cell.id) * (0.85 + 0.3 * unit(cell.id, 4));
    let speckles = kind * (1.0 + 0.45 * noise(uv, [110, 110], 5) + 0.3 * rough);
    let is_stone = rise(stone - sand, -0.02, 0.05);
    let albedo = mix(srgb(0x8c7452) * (1.0 + 0.4 * noise(uv, [140, 140], 6)), speckles, is_stone);
    Texel { height, albedo, roughness: 0.92 - 0.37 * is_stone, metalness: 0.0 }
}

//! Stone 2: flagstones with angular outlines, split rough, no two level.

use glam::Vec2;

use super::Texel;
use crate::micro::pattern::{cells, fbm, mix, noise, pick, ridges, rise, smooth_max, srgb, unit, warp};

pub(super) fn texel(uv: Vec2) -> Texel {
    let cell = cells(warp(uv, [12, 12], 3, 0.008, 1), [4, 4], 1.0, 2);
    let tilt = Vec2::new(unit(cell.id, 3), unit(cell.id, 4)) - 0.5;
    // Facets: the flat floor of each of a finer set of cells, tilted its own way.
    let chip = cells(warp(uv, [9, 9], 2, 0.02, 3), [11, 11], 1.0, 4);
    let chip_tilt = Vec2::new(unit(chip.id, 3), unit(chip.id, 4)) - 0.5;
    let facets = 0.16 * chip_tilt.dot(chip.offset) + 0.05 * unit(chip.id, 5);
    let split = 0.12 * ridges(uv, [6, 6], 4, 5) + 0.05 * fbm(uv, [26, 26], 3, 6);
    let top = 0.62 + 0.22 * unit(cell.id, 6) + 0.34 * tilt.dot(cell.offset) + facets + split;
    let broken = cell.border + 0.035 * fbm(uv, [18, 18], 3, 7);
    let stone = top * rise(broken, 0.025, 0.085);
    let earth = 0.14 + 0.09 * fbm(uv, [24, 24], 4, 8);
    let height = smooth_max(stone, earth, 0.05);
    let is_stone = rise(stone - earth, -0.02, 0.08);
    let kinds = [srgb(0x6a7274), srgb(0x858074), srgb(0x9a866a), srgb(0x586066)];
    let rust = rise(fbm(uv, [3, 3], 4, 9), 0.05, 0.5);
    let slate = mix(pick(&kinds, cell.id), srgb(0x9a6a40), 0.55 * rust) * (0.8 + 2.2 * split + 1.2 * facets);
    let albedo = mix(srgb(0x4c402c), slate * (1.0 + 0.2 * noise(uv, [120, 120], 10)), is_stone);
    Texel { height, albedo, roughness: 0.85 - 0.2 * is_stone + 0.1 * rust, metalness: 0.0 }
}

//! Cave: limestone eaten away into deep holes with ledges between.

use glam::Vec2;

use super::Texel;
use crate::micro::pattern::{cells, fall, fbm, mix, noise, ramp, ridges, rise, smooth_min, srgb, unit};

pub(super) fn texel(uv: Vec2) -> Texel {
    let warped = crate::micro::pattern::warp(uv, [4, 4], 4, 0.07, 1);
    let rough = fbm(uv, [14, 14], 4, 2);
    let strata = ledges(1.1 * fbm(warped, [2, 3], 2, 3) + 0.1 * rough);
    let rock = 0.78 + 0.2 * strata + 0.05 * rough + 0.06 * ridges(warped, [7, 7], 3, 4);
    let large = hole(warped, [3, 3], 0.07 * rough, 5);
    let small = hole(warped, [8, 8], 0.1 * rough, 6);
    let open = smooth_min(1.0 - large, 1.0 - 0.6 * small, 0.15);
    let height = rock * (0.12 + 0.88 * open) + 0.03 * noise(uv, [40, 40], 7);
    let bands = [srgb(0x8a6a48), srgb(0xc9a87c), srgb(0xb28555), srgb(0xdcc6a0)];
    let stone = ramp(&bands, 0.5 + 0.6 * strata + 0.25 * rough);
    let damp = fall(height, 0.1, 0.7);
    Texel {
        height,
        albedo: mix(stone, srgb(0x4a3a2e), 0.85 * damp),
        roughness: 0.9 - 0.45 * damp,
        metalness: 0.0,
    }
}

/// Flat treads and steep risers, three to a unit.
fn ledges(x: f32) -> f32 {
    let step = (3.0 * x).floor();
    (step + rise(3.0 * x - step, 0.35, 1.0)) / 3.0
}

/// 1 inside of holes; three quarters of the cells have one. `edge` frays their outlines.
fn hole(uv: Vec2, counts: [u32; 2], edge: f32, seed: u64) -> f32 {
    let cell = cells(uv, counts, 0.9, seed);
    let depth = rise(unit(cell.id, 3), 0.15, 0.35) * (0.6 + 0.4 * unit(cell.id, 4));
    // The outline is round where the cell is large enough for it, and follows the cell where it is not.
    let inside = smooth_min(0.5 - cell.f1, cell.border - 0.03, 0.2) + edge;
    depth * rise(inside, 0.0, 0.2)
}

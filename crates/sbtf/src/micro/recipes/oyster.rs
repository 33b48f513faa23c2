//! Oyster: thin plates with wavy lips, each lying on the next.

use glam::Vec2;

use super::Texel;
use crate::micro::pattern::{fbm, hash, lattice, mix, noise, ramp, rise, smooth_max, srgb, unit, wave};

/// Rows of plates in a tile.
const PLATES: u32 = 5;

pub(super) fn texel(uv: Vec2) -> Texel {
    // Half a row up: a lip along the border of the tile would look like a seam.
    let across = uv.y * PLATES as f32 + 0.5;
    let (mut height, mut top) = (f32::MIN, Plate { height: 0.0, behind: 0.0, tint: 0.0 });
    for k in -2..=2_i16 {
        let plate = plate(uv, across, across.floor() + f32::from(k));
        if plate.height > height {
            top = plate;
        }
        height = smooth_max(height, plate.height, 0.05);
    }
    let height = height + 0.06 * fbm(uv, [12, 16], 4, 40);
    let nacre = ramp(&[srgb(0x5c565e), srgb(0x9a9290), srgb(0xd8cfc4), srgb(0xb3a4b0)], top.tint);
    // Growth lines run along the lip and fade behind it.
    let line = wave(4.0 * top.behind + 0.5 * fbm(uv, [6, 6], 3, 41));
    let albedo = mix(nacre, srgb(0x3e363c), 0.45 * line * rise(top.behind, 0.02, 0.3));
    Texel { height, albedo, roughness: 0.62 - 0.34 * top.tint, metalness: 0.0 }
}

#[derive(Clone, Copy)]
struct Plate {
    height: f32,
    /// Distance behind the lip in rows; negative in front of it.
    behind: f32,
    tint: f32,
}

/// The scalloped outline of a lip: round lobes that meet in notches.
fn lobes(x: f32) -> f32 {
    let place = (4.0 * x).rem_euclid(1.0) * 2.0 - 1.0;
    place * place * place * place
}

/// The plate whose lip is about `row` rows up, highest at the lip and sinking behind it below the one that lies on it.
fn plate(uv: Vec2, across: f32, row: f32) -> Plate {
    let own = hash(50, lattice(row, PLATES), 0);
    let wobble = 0.7 * fbm(uv, [3, 1], 3, own)
        + 0.35 * lobes(uv.x + unit(own, 6))
        + 0.12 * noise(uv, [12, 1], own ^ 1);
    let behind = across - row - wobble;
    let waves = noise(uv, [9, 2], own ^ 2);
    let lip = 1.0 + 0.35 * noise(uv, [4, 1], own ^ 3) + 0.22 * waves;
    // Each year's growth is a thin step of its own.
    let years = 0.05 * (1.0 - rise((4.0 * behind).rem_euclid(1.0), 0.0, 0.8));
    let sinking = lip - 0.55 * behind - 0.25 * rise(behind, 0.3, 1.3) + years;
    // In front of the lip the plate ends: down by more than any plate is high, over a tenth of a row.
    let height = sinking - 3.0 * rise(-behind, 0.0, 0.12);
    let tint = (0.1 + 0.55 * unit(own, 5) + 0.6 * noise(uv, [4, 7], own ^ 4)).clamp(0.0, 1.0);
    Plate { height, behind, tint }
}

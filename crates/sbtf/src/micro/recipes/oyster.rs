//! Oyster: thin plates with wavy lips, each lying on the next.

use glam::Vec2;

use super::Texel;
use crate::micro::pattern::{fbm, hash, lattice, mix, noise, ramp, rise, smooth_max, srgb, unit, wave};

/// Rows of plates in a tile.
const PLATES: u32 = 7;

pub(super) fn texel(uv: Vec2) -> Texel {
    let across = uv.y * PLATES as f32;
    let (mut height, mut top) = (f32::MIN, Plate { height: 0.0, behind: 0.0, tint: 0.0 });
    for k in -2..=2_i16 {
        let plate = plate(uv, across, across.floor() + f32::from(k));
        if plate.height > height {
            top = plate;
        }
        height = smooth_max(height, plate.height, 0.05);
    }
    let height = height + 0.05 * fbm(uv, [16, 9], 4, 40);
    let nacre = ramp(&[srgb(0x5c_56_5e), srgb(0x9a_92_90), srgb(0xd8_cf_c4), srgb(0xb3_a4_b0)], top.tint);
    // Growth lines run along the lip and fade behind it.
    let line = wave(9.0 * top.behind + 0.6 * fbm(uv, [12, 6], 3, 41));
    let albedo = mix(nacre, srgb(0x3e_36_3c), 0.35 * line * rise(top.behind, 0.05, 0.5));
    Texel { height, albedo, roughness: 0.62 - 0.34 * top.tint, metalness: 0.0 }
}

#[derive(Clone, Copy)]
struct Plate {
    height: f32,
    /// Distance behind the lip in rows; negative in front of it.
    behind: f32,
    tint: f32,
}

/// The plate whose lip is about `row` rows up, highest at the lip and sinking behind it below the one that lies on it.
fn plate(uv: Vec2, across: f32, row: f32) -> Plate {
    let own = hash(50, lattice(row, PLATES), 0);
    let wobble = 0.75 * fbm(uv, [3, 1], 3, own) + 0.2 * noise(uv, [9, 1], own ^ 1);
    let behind = row + wobble - across;
    let flutes = wave(f32::from(14_u8) * uv.x + 1.5 * noise(uv, [4, 4], own ^ 2));
    let lip = 1.0 + 0.3 * noise(uv, [4, 1], own ^ 3) + 0.1 * flutes;
    let sinking = lip - 0.5 * behind + 0.06 * wave(4.0 * behind);
    // In front of the lip the plate ends: down by more than any plate is high, over a tenth of a row.
    let height = sinking - 3.0 * rise(-behind, 0.0, 0.16);
    let tint = (0.75 * unit(own, 5) + 0.35 * noise(uv, [3, 7], own ^ 4)).clamp(0.0, 1.0);
    Plate { height, behind, tint }
}

//! Wool 1: knitted stockinette, columns of V-shaped stitches.

use glam::Vec2;

use super::{Texel, yarn};
use crate::micro::pattern::{fbm, hash, lattice, mix, noise, rise, smooth_max, srgb, unit, warp};

/// Columns (wales) and rows (courses) of stitches.
const WALES: u32 = 6;
const COURSES: u32 = 8;

pub(super) fn texel(uv: Vec2) -> Texel {
    let p = warp(uv, [4, 4], 2, 0.006, 1) * Vec2::new(WALES as f32, COURSES as f32);
    let wale = p.x.floor();
    // From the middle of the wale, -0.5 to 0.5; both legs of a V are mirror images.
    let x = p.x - wale - 0.5;
    let (mut height, mut ply) = (0.0, 0.0);
    let row = p.y.floor();
    for k in -2..=1_i16 {
        let row = row + f32::from(k);
        let stitch = hash(2, lattice(wale, WALES), lattice(row, COURSES));
        if let Some(leg) = leg(x, p.y - row, stitch) {
            if leg.0 > height {
                ply = leg.1;
            }
            height = smooth_max(height, leg.0, 0.05);
        }
    }
    let fuzz = 0.03 * noise(uv, [90, 110], 3) + 0.02 * fbm(uv, [45, 60], 2, 4);
    let lit = rise(height, 0.1, 0.75);
    let wool = mix(srgb(0x1f5a66), srgb(0x3c8a92), 0.5 + 0.6 * fbm(uv, [6, 6], 3, 5) + 0.5 * ply);
    let albedo = mix(srgb(0x0c222c), wool * (1.0 + 0.3 * noise(uv, [120, 70], 6)), 0.2 + 0.8 * lit);
    Texel { height: height + fuzz * (0.3 + 0.7 * lit), albedo, roughness: 0.92, metalness: 0.0 }
}

/// Height of one leg of a stitch and a shade of its ply. `y`: courses above the foot of the V, which is `x = 0`.
fn leg(x: f32, y: f32, stitch: u64) -> Option<(f32, f32)> {
    const LENGTH: f32 = 1.7;
    let t = y / LENGTH;
    if !(0.0..=1.0).contains(&t) {
        return None;
    }
    // The axis leaves the foot outward and bends upright where the next row holds it.
    let axis = 0.07 + 0.25 * (1.25 * t).min(1.0);
    let radius = 0.225 * (0.62 + 0.38 * (std::f32::consts::PI * t).sin());
    let across = (x.abs() - axis) / radius;
    let turns = 3.0 * t + 0.15 * unit(stitch, 1);
    let round = yarn::twisted(across, if x < 0.0 { -turns } else { turns }, 2.0)?;
    // It comes out from behind the row below, and dives behind the row above.
    let lift = 0.42 * (std::f32::consts::PI * (0.08 + 0.92 * t)).sin() - 0.18 * t;
    Some((0.12 + lift + 0.5 * round * rise(t, 0.0, 0.1), unit(stitch, 2) - 0.5))
}

//! Shell: regular ribs, crossed by growth rings that bend round every rib.

use glam::Vec2;

use super::Texel;
use crate::micro::pattern::{ball, fbm, mix, noise, ramp, rise, srgb, wave};

/// Ribs along u and growth rings along v.
const RIBS: f32 = 6.0;
const RINGS: f32 = 5.0;

pub(super) fn texel(uv: Vec2) -> Texel {
    let place = (RIBS * uv.x).rem_euclid(1.0) * 2.0 - 1.0;
    let rib = ball(0.97 * place);
    // Each ring reaches further on the back of a rib: a scallop.
    let ring = RINGS * uv.y - 0.42 * rib + 0.06 * noise(uv, [8, 5], 1);
    let phase = ring.rem_euclid(1.0);
    // A scale rises slowly and ends in a lip.
    let scale = rise(phase, 0.0, 0.86) * (1.0 - rise(phase, 0.9, 1.0));
    let height = 0.7 * rib + 0.34 * scale * (0.3 + 0.7 * rib) + 0.025 * fbm(uv, [36, 8], 3, 2);
    let band = 0.6 * wave(uv.y) + 0.3 * phase + 0.35 * fbm(uv, [6, 5], 3, 3);
    let colour = ramp(&[srgb(0xf4e4d0), srgb(0xeab296), srgb(0xc86a58), srgb(0x9c4044)], band);
    let albedo = mix(srgb(0xeedcc8), colour, 0.35 + 0.65 * rib);
    Texel { height, albedo, roughness: 0.28 + 0.2 * (1.0 - rib), metalness: 0.0 }
}

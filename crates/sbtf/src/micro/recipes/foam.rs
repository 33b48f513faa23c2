//! Foam: closed bubbles, small ones in the gaps of large ones.

use glam::{Vec2, Vec3};

use super::Texel;
use crate::micro::pattern::{ball, fall, mix, ramp, scatter, smooth_max, srgb, unit};

/// Lattice, radius of the bubbles over a cell, and how high they stand: from a few large ones to a bed of small ones.
const SIZES: [(u32, f32, f32, f32); 4] =
    [(4, 0.34, 0.52, 1.0), (7, 0.32, 0.5, 0.84), (13, 0.36, 0.56, 0.62), (24, 0.5, 0.7, 0.42)];

pub(super) fn texel(uv: Vec2) -> Texel {
    let (mut height, mut tint) = (0.12, 0.5);
    for (level, (count, least, most, top)) in SIZES.into_iter().enumerate() {
        for bubble in scatter(uv, [count, count], 0.75, 20 + level as u64) {
            let radius = least + (most - least) * unit(bubble.id, 3);
            let distance = bubble.offset.length() / radius;
            if distance < 1.0 {
                // Small bubbles are round, large ones are pressed flatter; each one sits a little higher or lower.
                let rise = radius / count as f32 * 4.5;
                let surface = top - 0.1 * unit(bubble.id, 4) - rise.min(0.5) * (1.0 - ball(distance));
                if surface > height {
                    tint = unit(bubble.id, 5);
                }
                height = smooth_max(height, surface, 0.02);
            }
        }
    }
    let film = ramp(&[srgb(0xc4ac6a), srgb(0xdcca98), srgb(0xcfb474), srgb(0xe6dab8)], tint);
    let gap = fall(height, 0.2, 0.75);
    let albedo = mix(film, srgb(0x7c5824), 0.85 * gap).min(Vec3::splat(0.92));
    Texel { height, albedo, roughness: 0.3 + 0.35 * gap, metalness: 0.0 }
}

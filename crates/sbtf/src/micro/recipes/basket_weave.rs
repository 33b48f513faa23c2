//! Basket weave: pairs of red wicker along u, flat grey splints along v, over and under, with gaps to see through.

use std::f32::consts::PI;

use glam::{Vec2, Vec3};

use super::swept::{MeshBuilder, Run, Strand};
use crate::micro::pattern::{hash, noise, srgb, unit};
use crate::micro::{Reflectance, TileMesh};

/// Crossings along each axis, an even number, so that over and under alternate across the border.
const CROSSINGS: u32 = 6;
const DEPTH: f32 = 0.1;
/// Half width and half thickness of the strands, and from the middle of a pair to its strands.
const RED: Vec2 = Vec2::new(0.026, 0.0255);
const GREY: Vec2 = Vec2::new(0.047, 0.0205);
const PAIR: f32 = 0.029;
/// How far strands swing from the middle: at a crossing two of them leave a hair of air between.
const SWING: f32 = 0.5 * DEPTH - RED.y;

/// The mesh.
pub(super) fn build() -> TileMesh {
    let mut mesh = MeshBuilder::default();
    for k in 0..CROSSINGS {
        let middle = (k as f32 + 0.5) / CROSSINGS as f32;
        let strand = Strand { run: Run::AlongU, half: RED, segments: 96, sides: 20, material: 0 };
        for (side, offset) in [-PAIR, PAIR].into_iter().enumerate() {
            let seed = hash(1, k, u32::try_from(side).unwrap_or_default());
            mesh.strand(&strand, |t| weave(t, middle + offset, k, 1.0), |p| fibre(p, seed));
        }
        let strand = Strand { run: Run::AlongV, half: GREY, segments: 96, sides: 24, material: 1 };
        // A quarter turn takes `aside` to -u; the strand belongs into the tile.
        mesh.strand(&strand, |t| weave(t, -middle, k, -1.0), |p| fibre(p, hash(2, k, 0)));
    }
    let wicker = |code, roughness| Reflectance { albedo: srgb(code), roughness, metalness: 0.0 };
    mesh.finish(vec![wicker(0xb03428, 0.42), wicker(0x9a9892, 0.55)], DEPTH)
}

/// Sideways position and z of a strand. `sign` 1 goes over at the first crossing of an even strand, -1 under.
fn weave(along: f32, aside: f32, index: u32, sign: f32) -> Vec2 {
    let parity = if index.is_multiple_of(2) { sign } else { -sign };
    let c = (PI * (along * CROSSINGS as f32 - 0.5)).cos() * parity;
    // Stiff strands lie flat on what they cross and turn quickly between.
    Vec2::new(aside, SWING * c * (1.35 - 0.35 * c * c) - 0.5 * DEPTH)
}

/// Long streaks, and some strands darker than others.
fn fibre(place: Vec2, seed: u64) -> Vec3 {
    let streak = noise(place, [3, 9], seed) + 0.6 * noise(place, [24, 5], seed ^ 1);
    Vec3::splat((0.86 + 0.24 * (unit(seed, 1) - 0.5) + 0.22 * streak).clamp(0.0, 1.0))
}

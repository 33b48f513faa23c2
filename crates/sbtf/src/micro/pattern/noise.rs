//! Gradient noise that repeats.

use glam::Vec2;

use super::hash::{hash, unit};

/// Gradient noise in about `[-1, 1]`, mean 0, twice differentiable (Perlin, "Improving Noise", SIGGRAPH 2002), with one
/// random gradient on each of `counts` lattice points.
#[must_use]
pub fn noise(uv: Vec2, counts: [u32; 2], seed: u64) -> f32 {
    let position = uv * Vec2::new(counts[0] as f32, counts[1] as f32);
    let base = position.floor();
    let f = position - base;
    let corner = |dx: f32, dy: f32| {
        let bits = hash(seed, lattice(base.x + dx, counts[0]), lattice(base.y + dy, counts[1]));
        let gradient = Vec2::new(unit(bits, 0), unit(bits, 1)) * 2.0 - 1.0;
        gradient.dot(f - Vec2::new(dx, dy))
    };
    let fade = f * f * f * (f * (f * 6.0 - 15.0) + 10.0);
    let low = corner(0.0, 0.0) + (corner(1.0, 0.0) - corner(0.0, 0.0)) * fade.x;
    let high = corner(0.0, 1.0) + (corner(1.0, 1.0) - corner(0.0, 1.0)) * fade.x;
    // The sum has a standard deviation of about 0.27; this brings three of them to 1.
    ((low + (high - low) * fade.y) * 1.25).clamp(-1.0, 1.0)
}

/// Fractal noise in about `[-1, 1]`: each octave has twice the frequency and half the amplitude.
#[must_use]
pub fn fbm(uv: Vec2, counts: [u32; 2], octaves: u32, seed: u64) -> f32 {
    octave_sum(counts, octaves, |counts, octave| noise(uv, counts, seed ^ octave))
}

/// Fractal noise of creases in about `[0, 1]`: 1 along sharp crests, as rock has them.
#[must_use]
pub fn ridges(uv: Vec2, counts: [u32; 2], octaves: u32, seed: u64) -> f32 {
    octave_sum(counts, octaves, |counts, octave| {
        let crest = 1.0 - noise(uv, counts, seed ^ octave).abs() * 1.6;
        crest.max(0.0)
    })
}

/// The point moved by a noise vector of at most `amount` UV units along each axis.
#[must_use]
pub fn warp(uv: Vec2, counts: [u32; 2], octaves: u32, amount: f32, seed: u64) -> Vec2 {
    let shift = |seed| fbm(uv, counts, octaves, seed);
    uv + amount * Vec2::new(shift(seed), shift(seed ^ 0x5bd1_e995))
}

fn octave_sum(counts: [u32; 2], octaves: u32, value: impl Fn([u32; 2], u64) -> f32) -> f32 {
    let (mut sum, mut weights, mut weight) = (0.0, 0.0, 1.0);
    for octave in 0..octaves {
        sum += weight * value(counts.map(|n| n << octave), u64::from(octave) << 48);
        weights += weight;
        weight *= 0.5;
    }
    if weights > 0.0 { sum / weights } else { 0.0 }
}

/// The lattice coordinate of a value, brought into `0..count`.
#[allow(
    clippy::cast_possible_truncation,
    clippy::cast_sign_loss,
    reason = "a whole number below a u32 after rem_euclid"
)]
pub fn lattice(x: f32, count: u32) -> u32 {
    (x.rem_euclid(count as f32) as u32).min(count - 1)
}

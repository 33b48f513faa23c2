//! Profiles, blends and colours.

use glam::Vec3;

/// 0 below `from`, 1 above `to`, smooth between (cubic). `from < to`.
#[must_use]
pub fn rise(x: f32, from: f32, to: f32) -> f32 {
    let t = ((x - from) / (to - from)).clamp(0.0, 1.0);
    t * t * (3.0 - 2.0 * t)
}

/// 1 below `from`, 0 above `to`, smooth between (cubic). `from < to`.
#[must_use]
pub fn fall(x: f32, from: f32, to: f32) -> f32 {
    1.0 - rise(x, from, to)
}

/// A smooth bump of height 1 at 0 and width 1 to each side, 0 beyond.
#[must_use]
pub fn bump(x: f32) -> f32 {
    let t = (1.0 - x * x).max(0.0);
    t * t
}

/// The height of a ball of radius 1 over the distance from its axis; 0 beyond.
#[must_use]
pub fn ball(x: f32) -> f32 {
    (1.0 - x * x).max(0.0).sqrt()
}

/// From 0 at 0 steeply up to 1 at 1 and level from there: the shoulder of a worn stone.
#[must_use]
pub fn dome(x: f32) -> f32 {
    ball(1.0 - x.clamp(0.0, 1.0))
}

/// A cosine of period 1 between 0 and 1, 1 at whole numbers.
#[must_use]
pub fn wave(x: f32) -> f32 {
    0.5 + 0.5 * (std::f32::consts::TAU * x).cos()
}

/// The larger of two values, rounded off where they differ by less than `width` (polynomial, after Quilez, "Smooth
/// minimum"). Exceeds the maximum by at most `width / 4`.
#[must_use]
pub fn smooth_max(a: f32, b: f32, width: f32) -> f32 {
    let h = (width - (a - b).abs()).max(0.0) / width;
    a.max(b) + 0.25 * h * h * width
}

/// The smaller of two values, rounded off where they differ by less than `width`.
#[must_use]
pub fn smooth_min(a: f32, b: f32, width: f32) -> f32 {
    -smooth_max(-a, -b, width)
}

/// Linear blend; `t` is clamped to `[0, 1]`.
#[must_use]
pub fn mix(a: Vec3, b: Vec3, t: f32) -> Vec3 {
    a.lerp(b, t.clamp(0.0, 1.0))
}

/// A colour between evenly spaced stops over `[0, 1]`.
///
/// # Panics
///
/// If there are no stops.
#[must_use]
pub fn ramp(stops: &[Vec3], t: f32) -> Vec3 {
    let position = t.clamp(0.0, 1.0) * (stops.len() - 1) as f32;
    #[allow(
        clippy::cast_possible_truncation,
        clippy::cast_sign_loss,
        reason = "clamped to the number of stops"
    )]
    let index = (position as usize).min(stops.len().saturating_sub(2));
    let next = stops[(index + 1).min(stops.len() - 1)];
    mix(stops[index], next, position - index as f32)
}

/// The linear colour of a `0xRRGGBB` in sRGB.
#[must_use]
pub fn srgb(code: u32) -> Vec3 {
    let channel = |shift: u32| crate::colour::linear_from_srgb(((code >> shift) & 255) as f32 / 255.0);
    Vec3::new(channel(16), channel(8), channel(0))
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn profiles_reach_their_ends() {
        assert_eq!((rise(-1.0, 0.0, 2.0), rise(1.0, 0.0, 2.0), rise(3.0, 0.0, 2.0)), (0.0, 0.5, 1.0));
        assert_eq!((fall(0.0, 0.0, 1.0), fall(1.0, 0.0, 1.0)), (1.0, 0.0));
        assert_eq!((dome(0.0), dome(1.0), dome(9.0), bump(1.0), ball(0.0)), (0.0, 1.0, 1.0, 0.0, 1.0));
    }

    #[test]
    fn blends_are_exact_away_from_the_edge_and_bounded_on_it() {
        assert_eq!(smooth_max(1.0, 0.0, 0.5), 1.0);
        assert_eq!(smooth_max(1.0, 1.0, 0.4), 1.1);
        assert_eq!(smooth_min(1.0, 1.0, 0.4), 0.9);
        assert_eq!(ramp(&[Vec3::ZERO, Vec3::ONE, Vec3::X], 0.5), Vec3::ONE);
        assert_eq!(ramp(&[Vec3::ZERO, Vec3::ONE, Vec3::X], 1.0), Vec3::X);
        assert_eq!(ramp(&[Vec3::Y], 0.3), Vec3::Y);
    }

    #[test]
    fn colours_are_linear() {
        assert_eq!(srgb(0xFF00FF), Vec3::new(1.0, 0.0, 1.0));
        assert!((srgb(0x808080).x - 0.2159).abs() < 1e-4);
    }
}

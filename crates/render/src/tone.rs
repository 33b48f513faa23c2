//! From linear radiance to a picture of 8 bits.

use glam::Vec3;

use osculate_sbtf::colour::srgb_from_linear;

/// A picture of 8 bits: sRGB, top row first.
#[derive(Debug, Clone, PartialEq, Eq)]
pub struct Picture {
    /// Width in pixels.
    pub width: u32,
    /// Height in pixels.
    pub height: u32,
    /// Three bytes a pixel.
    pub rgb: Vec<u8>,
}

/// From where on highlights are rolled off.
const SHOULDER: f32 = 0.8;

/// Encodes linear RGB: times `2^exposure`, highlights rolled off, sRGB curve, 8 bits with a fixed dither against banding.
///
/// Up to 0.8 colours are reproduced as they are; above, `0.8 + 0.2 (1 - exp(-(x - 0.8) / 0.2))` continues with the same
/// slope and approaches 1.
///
/// # Panics
///
/// If there are not `width * height` pixels.
#[must_use]
pub fn picture(width: u32, height: u32, linear: &[Vec3], exposure: f32) -> Picture {
    assert_eq!(linear.len(), width as usize * height as usize);
    let gain = exposure.exp2();
    let encode = |(i, colour): (usize, &Vec3)| {
        let (x, y) = (i % width as usize, i / width as usize);
        let dither = interleaved_gradient(x as f32, y as f32) - 0.5;
        (gain * *colour).to_array().map(|c| quantised(255.0 * srgb_from_linear(rolled_off(c)) + dither))
    };
    Picture { width, height, rgb: linear.iter().enumerate().flat_map(encode).collect() }
}

fn rolled_off(x: f32) -> f32 {
    let room = 1.0 - SHOULDER;
    if x <= SHOULDER { x.max(0.0) } else { SHOULDER + room * (1.0 - (-(x - SHOULDER) / room).exp()) }
}

/// Jimenez's noise: nearly even in every 3x3 neighbourhood.
fn interleaved_gradient(x: f32, y: f32) -> f32 {
    (52.982_918 * (0.067_110_56 * x + 0.005_837_15 * y).fract()).fract()
}

#[allow(clippy::cast_possible_truncation, clippy::cast_sign_loss, reason = "clamped to the range of u8")]
fn quantised(x: f32) -> u8 {
    x.round().clamp(0.0, 255.0) as u8
}

//! The sRGB transfer function (IEC 61966-2-1).

/// Linear value of an sRGB value in `[0, 1]`.
#[must_use]
pub fn linear_from_srgb(x: f32) -> f32 {
    if x <= 0.040_45 { x / 12.92 } else { ((x + 0.055) / 1.055).powf(2.4) }
}

/// sRGB value of a linear value; what is outside `[0, 1]` is clamped.
#[must_use]
pub fn srgb_from_linear(x: f32) -> f32 {
    let x = x.clamp(0.0, 1.0);
    if x <= 0.003_130_8 { 12.92 * x } else { 1.055 * x.powf(1.0 / 2.4) - 0.055 }
}

/// A share of the largest code, rounded; NaN is 0.
#[must_use]
pub fn code_8(x: f32) -> u8 {
    u8::try_from(code(x, u8::MAX.into())).unwrap_or(u8::MAX)
}

/// A share of the largest code, rounded; NaN is 0.
#[must_use]
pub fn code_16(x: f32) -> u16 {
    code(x, u16::MAX)
}

#[allow(clippy::cast_possible_truncation, clippy::cast_sign_loss, reason = "clamped to the codes")]
fn code(x: f32, largest: u16) -> u16 {
    (x.clamp(0.0, 1.0) * f32::from(largest) + 0.5) as u16
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn every_code_survives_the_way_there_and_back() {
        for code in 0..=255_u8 {
            assert_eq!(code_8(srgb_from_linear(linear_from_srgb(f32::from(code) / 255.0))), code);
        }
        assert_eq!((code_16(1.0), code_16(0.0), code_16(f32::NAN), code_8(7.0)), (65_535, 0, 0, 255));
    }
}

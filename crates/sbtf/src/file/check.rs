//! Which architectures are accepted from a file.

use crate::infer::{MOST_CHANNELS, MOST_INPUTS, MOST_WIDTH};
use crate::model::{Architecture, OpacityHead, TextureShape};

/// Most texels along an axis of a texture.
const MOST_TEXELS: usize = 8192;
/// Most hidden layers and taps.
const MOST_LAYERS: usize = 16;
const MOST_TAPS: usize = 32;
/// Farthest tap, in reaches.
const FARTHEST_TAP: f32 = 16.0;

/// What is wrong with an architecture.
pub(super) fn architecture(form: &Architecture) -> Result<(), String> {
    if !(form.depth > 0.0 && form.depth.is_finite()) {
        return Err(format!("depth is {}; it must be over 0", form.depth));
    }
    let [low, high] = form.kappa_range;
    if !(low.is_finite() && high.is_finite() && low <= high && low.abs().max(high.abs()) > 0.0) {
        return Err(format!("kappa_range is [{low}, {high}]; it must be finite, ordered and not only 0"));
    }
    within("width", form.width, MOST_WIDTH)?;
    if form.hidden_layers > MOST_LAYERS {
        return Err(format!("hidden_layers is {}; at most {MOST_LAYERS}", form.hidden_layers));
    }
    // Without an opacity module its entries mean nothing, but should be sensible all the same.
    for (name, shape) in [
        ("opacity_texture", form.opacity_texture),
        ("offset_texture", form.offset_texture),
        ("colour_texture", form.colour_texture),
    ] {
        texture(name, shape)?;
    }
    for (name, taps) in [("opacity_taps", &form.opacity_taps), ("offset_taps", &form.offset_taps)] {
        within(&format!("the number of {name}"), taps.len(), MOST_TAPS)?;
        if let Some(tap) = taps.iter().find(|tap| tap.is_nan() || tap.abs() > FARTHEST_TAP) {
            return Err(format!("{name} has {tap}; at most {FARTHEST_TAP}"));
        }
    }
    if form.opacity != OpacityHead::Opaque {
        within("the number of opacity inputs", form.opacity_inputs(), MOST_INPUTS)?;
    }
    within("the number of offset inputs", form.offset_inputs(), MOST_INPUTS)
}

fn texture(name: &str, shape: TextureShape) -> Result<(), String> {
    within(&format!("{name}: width"), shape.width, MOST_TEXELS)?;
    within(&format!("{name}: height"), shape.height, MOST_TEXELS)?;
    within(&format!("{name}: channels"), shape.channels, MOST_CHANNELS)
}

fn within(name: &str, value: usize, most: usize) -> Result<(), String> {
    if (1..=most).contains(&value) { Ok(()) } else { Err(format!("{name} is {value}; 1 to {most}")) }
}

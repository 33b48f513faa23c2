//! Which models a study trains.

use osculate_sbtf::infer::Precision;
use osculate_sbtf::model::{Architecture, TextureShape};

/// A knob that the study turns; all others stay as they are in the default form.
#[derive(Debug, Clone, Copy, PartialEq, Eq, serde::Serialize)]
#[serde(rename_all = "kebab-case")]
pub enum Knob {
    /// None: the default form.
    Default,
    /// Points along the ray at which the opacity network fetches features.
    Taps,
    /// Neurons of a hidden layer.
    Width,
    /// Texels of the textures along a side.
    Resolution,
    /// Features per texel.
    Channels,
    /// Steps of the training.
    Steps,
    /// Bits of the textures' numbers.
    Bits,
}

/// One model.
#[derive(Debug, Clone)]
pub struct Setting {
    /// What is turned.
    pub knob: Knob,
    /// Its value, for tables and labels.
    pub value: String,
    /// The model's form.
    pub form: Architecture,
    /// Steps over those of the default.
    pub effort: f64,
    /// How its textures are kept.
    pub precision: Precision,
}

/// All models of a study of a material of this depth. `quick`: small textures, and the ends of every range only.
pub fn settings(depth: f32, quick: bool) -> Vec<Setting> {
    let mut base = Architecture::taps(depth);
    if quick {
        base = with_textures(base, 32, 8);
    }
    let of = |knob, value: String, form: Architecture| Setting {
        knob,
        value,
        form,
        effort: 1.0,
        precision: Precision::F32,
    };
    let mut all = vec![of(Knob::Default, String::new(), base.clone())];
    for count in pick(&[1, 2, 4, 7], quick) {
        let form = Architecture { opacity_taps: even_taps(count), ..base.clone() };
        all.push(of(Knob::Taps, count.to_string(), form));
    }
    for width in pick(&[12, 16, 32, 48], quick) {
        all.push(of(Knob::Width, width.to_string(), Architecture { width, ..base.clone() }));
    }
    let sizes: &[usize] = if quick { &[8, 16] } else { &[64, 128, 512] };
    for size in pick(sizes, quick) {
        all.push(of(Knob::Resolution, size.to_string(), with_textures(base.clone(), size, 8)));
    }
    for channels in pick(&[4, 12], quick) {
        let size = base.opacity_texture.width;
        all.push(of(Knob::Channels, channels.to_string(), with_textures(base.clone(), size, channels)));
    }
    for effort in pick(&[0.25, 0.5, 2.0], quick) {
        let setting = of(Knob::Steps, format!("x{effort}"), base.clone());
        all.push(Setting { effort, ..setting });
    }
    all
}

/// The precisions that the default model is judged in besides its own.
pub const PRECISIONS: [Precision; 2] = [Precision::F16, Precision::U8];

/// All values, or the first and the last.
fn pick<T: Copy>(values: &[T], quick: bool) -> Vec<T> {
    match values {
        [first, .., last] if quick => vec![*first, *last],
        all => all.to_vec(),
    }
}

/// So many taps, evenly from the entry point to the reach; one tap is the paper's form.
fn even_taps(count: usize) -> Vec<f32> {
    (0..count).map(|i| i as f32 / (count.max(2) - 1) as f32).collect()
}

fn with_textures(form: Architecture, size: usize, channels: usize) -> Architecture {
    let shape = TextureShape::square(size, channels);
    Architecture { opacity_texture: shape, offset_texture: shape, colour_texture: shape, ..form }
}

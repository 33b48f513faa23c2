//! [`StoredModel`]: a model with its textures in the precision they are kept in.

use half::f16;
use serde::{Deserialize, Serialize};

use crate::model::{Architecture, FeatureTexture, Mlp, Model, Module, TextureShape};

/// How the numbers of a feature texture are kept.
#[derive(Debug, Clone, Copy, PartialEq, Eq, Default, Serialize, Deserialize)]
#[serde(rename_all = "kebab-case")]
pub enum Precision {
    /// Four bytes, as trained.
    F32,
    /// Two bytes, relative error 2^-11.
    #[default]
    F16,
    /// One byte and a scale per channel, error 1/510 of the channel's range.
    U8,
}

impl Precision {
    /// All of them, the most precise first.
    pub const ALL: [Self; 3] = [Self::F32, Self::F16, Self::U8];

    /// Its name in files and on the command line.
    #[must_use]
    pub fn name(self) -> &'static str {
        match self {
            Self::F32 => "f32",
            Self::F16 => "f16",
            Self::U8 => "u8",
        }
    }
}

/// A model as files keep it.
#[derive(Debug, Clone, PartialEq)]
pub struct StoredModel {
    /// Its form, which the shapes of everything else follow.
    pub architecture: Architecture,
    /// `None` with [`OpacityHead::Opaque`](crate::model::OpacityHead::Opaque).
    pub opacity: Option<StoredModule>,
    /// As in [`Model`].
    pub offset: StoredModule,
    /// As in [`Model`].
    pub colour: StoredModule,
}

/// A feature texture and the network that reads it.
#[derive(Debug, Clone, PartialEq)]
pub struct StoredModule {
    /// Features.
    pub texture: StoredTexture,
    /// The network, always in f32.
    pub mlp: Mlp,
}

/// A feature texture as files keep it.
#[derive(Debug, Clone, PartialEq)]
pub struct StoredTexture {
    /// Its size.
    pub shape: TextureShape,
    /// `[height, width, channels]`, channels fastest.
    pub texels: Texels,
}

/// The numbers of a feature texture.
#[derive(Debug, Clone, PartialEq)]
pub enum Texels {
    /// Features.
    F32(Vec<f32>),
    /// Features.
    F16(Vec<f16>),
    /// Feature = `offset + scale * code`, per channel.
    U8 {
        /// Codes.
        codes: Vec<u8>,
        /// Feature per code step, `[channels]`.
        scale: Vec<f32>,
        /// Feature of code 0, `[channels]`.
        offset: Vec<f32>,
    },
}

impl StoredModel {
    /// Rounds the textures of a model.
    #[must_use]
    pub fn new(model: &Model, precision: Precision) -> Self {
        let module = |module: &Module| StoredModule {
            texture: StoredTexture::new(&module.texture, precision),
            mlp: module.mlp.clone(),
        };
        Self {
            architecture: model.architecture.clone(),
            opacity: model.opacity.as_ref().map(module),
            offset: module(&model.offset),
            colour: module(&model.colour),
        }
    }

    /// The model with what rounding left of its textures.
    #[must_use]
    pub fn to_model(&self) -> Model {
        let module =
            |module: &StoredModule| Module { texture: module.texture.features(), mlp: module.mlp.clone() };
        Model {
            architecture: self.architecture.clone(),
            opacity: self.opacity.as_ref().map(module),
            offset: module(&self.offset),
            colour: module(&self.colour),
        }
    }

    /// The modules that there are, with their names in files.
    pub fn modules(&self) -> impl Iterator<Item = (&'static str, &StoredModule)> {
        let opacity = self.opacity.iter().map(|module| ("opacity", module));
        opacity.chain([("offset", &self.offset), ("colour", &self.colour)])
    }

    /// Bytes of all textures and networks.
    #[must_use]
    pub fn bytes(&self) -> usize {
        let network = |mlp: &Mlp| {
            4 * mlp.layers.iter().map(|layer| layer.weights.len() + layer.biases.len()).sum::<usize>()
        };
        self.modules().map(|(_, module)| module.texture.bytes() + network(&module.mlp)).sum()
    }
}

impl StoredTexture {
    /// Rounds a texture. Halves saturate at ±65504.
    #[must_use]
    pub fn new(texture: &FeatureTexture, precision: Precision) -> Self {
        let (limit, texels) = (f16::MAX.to_f32(), &texture.texels);
        let texels = match precision {
            Precision::F32 => Texels::F32(texels.clone()),
            Precision::F16 => {
                Texels::F16(texels.iter().map(|x| f16::from_f32(x.clamp(-limit, limit))).collect())
            }
            Precision::U8 => quantised(texels, texture.shape.channels),
        };
        Self { shape: texture.shape, texels }
    }

    /// The features.
    #[must_use]
    pub fn features(&self) -> FeatureTexture {
        let channels = self.shape.channels;
        let texels = match &self.texels {
            Texels::F32(texels) => texels.clone(),
            Texels::F16(texels) => texels.iter().map(|x| x.to_f32()).collect(),
            Texels::U8 { codes, scale, offset } => {
                let feature =
                    |(i, &code): (usize, &u8)| offset[i % channels] + scale[i % channels] * f32::from(code);
                codes.iter().enumerate().map(feature).collect()
            }
        };
        FeatureTexture { shape: self.shape, texels }
    }

    /// How its numbers are kept.
    #[must_use]
    pub fn precision(&self) -> Precision {
        match self.texels {
            Texels::F32(_) => Precision::F32,
            Texels::F16(_) => Precision::F16,
            Texels::U8 { .. } => Precision::U8,
        }
    }

    /// Bytes of the texels and their scales.
    #[must_use]
    pub fn bytes(&self) -> usize {
        match &self.texels {
            Texels::F32(texels) => 4 * texels.len(),
            Texels::F16(texels) => 2 * texels.len(),
            Texels::U8 { codes, scale, offset } => codes.len() + 4 * (scale.len() + offset.len()),
        }
    }
}

#[allow(clippy::cast_possible_truncation, clippy::cast_sign_loss, reason = "rounded to 0..=255 first")]
fn quantised(texels: &[f32], channels: usize) -> Texels {
    let mut range = vec![(f32::INFINITY, f32::NEG_INFINITY); channels];
    for (i, &x) in texels.iter().enumerate() {
        let (low, high) = &mut range[i % channels];
        (*low, *high) = (low.min(x), high.max(x));
    }
    // Halved first: the range of f32 itself would overflow.
    let scale: Vec<f32> = range.iter().map(|(low, high)| (high / 2.0 - low / 2.0) / 127.5).collect();
    let code = |(i, &x): (usize, &f32)| {
        let (low, scale) = (range[i % channels].0, scale[i % channels]);
        if scale > 0.0 { ((x - low) / scale).round().clamp(0.0, 255.0) as u8 } else { 0 }
    };
    let codes = texels.iter().enumerate().map(code).collect();
    Texels::U8 { codes, scale, offset: range.iter().map(|(low, _)| *low).collect() }
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn rounding_stays_within_its_promise() {
        let shape = TextureShape { width: 16, height: 8, channels: 3 };
        // Channels of different sizes; the last is constant.
        let texels = (0..shape.len()).map(|i| match i % 3 {
            0 => (i as f32).sin(),
            1 => 1e3 * (i as f32).cos() - 5e3,
            _ => 0.25,
        });
        let texture = FeatureTexture { shape, texels: texels.collect() };
        for precision in Precision::ALL {
            let rounded = StoredTexture::new(&texture, precision).features();
            for (i, (a, b)) in texture.texels.iter().zip(&rounded.texels).enumerate() {
                let range = [2.0, 2e3, 0.0][i % 3];
                let bound = match precision {
                    Precision::F32 => 0.0,
                    Precision::F16 => a.abs() / 2048.0,
                    // A thousandth for the rounding of offset + scale * code.
                    Precision::U8 => range / 510.0 * 1.001 + a.abs() * 2e-7,
                };
                assert!((a - b).abs() <= bound, "{precision:?} {i}: {a} became {b}");
            }
        }
    }
}

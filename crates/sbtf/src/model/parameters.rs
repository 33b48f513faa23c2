//! [`Model`]: an architecture with its numbers.

use super::{Architecture, OpacityHead, TextureShape};

/// A trained material, or one that is being trained.
#[derive(Debug, Clone, PartialEq)]
pub struct Model {
    /// Its form, which the shapes of everything else follow.
    pub architecture: Architecture,
    /// `None` with [`OpacityHead::Opaque`].
    pub opacity: Option<Module>,
    /// Moves the texture coordinates to where the ray hits.
    pub offset: Module,
    /// Gives the colour. It predicts `ln(1 + rgb)`, so that highlights do not drown the rest.
    pub colour: Module,
}

/// A feature texture and the network that reads it.
#[derive(Debug, Clone, PartialEq)]
pub struct Module {
    /// Learned features.
    pub texture: FeatureTexture,
    /// The network.
    pub mlp: Mlp,
}

/// Learned features over one tile, bilinear between texels and repeated, laid out as [`Grid`](crate::micro::Grid) is.
#[derive(Debug, Clone, PartialEq)]
pub struct FeatureTexture {
    /// Its size.
    pub shape: TextureShape,
    /// `[height, width, channels]`, channels fastest.
    pub texels: Vec<f32>,
}

/// A fully connected network.
#[derive(Debug, Clone, PartialEq)]
pub struct Mlp {
    /// First to last. A rectifier follows each but the last.
    pub layers: Vec<Layer>,
}

/// `y = W x + b`.
#[derive(Debug, Clone, PartialEq)]
pub struct Layer {
    /// Length of `x`.
    pub inputs: usize,
    /// Length of `y`.
    pub outputs: usize,
    /// `[outputs, inputs]`, inputs fastest.
    pub weights: Vec<f32>,
    /// `[outputs]`.
    pub biases: Vec<f32>,
}

impl Model {
    /// A model of zeros.
    #[must_use]
    pub fn zeroed(architecture: Architecture) -> Self {
        let module = |shape: TextureShape, inputs: usize, outputs: usize| Module {
            texture: FeatureTexture { shape, texels: vec![0.0; shape.len()] },
            mlp: Mlp::zeroed(&architecture.layer_sizes(inputs, outputs)),
        };
        let opacity = (architecture.opacity != OpacityHead::Opaque)
            .then(|| module(architecture.opacity_texture, architecture.opacity_inputs(), 1));
        let offset =
            module(architecture.offset_texture, architecture.offset_inputs(), architecture.offset_outputs());
        let colour = module(architecture.colour_texture, architecture.colour_inputs(), 3);
        Self { opacity, offset, colour, architecture }
    }
}

impl Mlp {
    /// A network of zeros with these layer sizes, inputs first.
    #[must_use]
    pub fn zeroed(sizes: &[usize]) -> Self {
        let layer = |pair: &[usize]| Layer {
            inputs: pair[0],
            outputs: pair[1],
            weights: vec![0.0; pair[0] * pair[1]],
            biases: vec![0.0; pair[1]],
        };
        Self { layers: sizes.windows(2).map(layer).collect() }
    }
}

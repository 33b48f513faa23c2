//! Models of random numbers, of the size that training begins with.

use super::{Architecture, Mlp, Model};
use crate::random::Random;

impl Model {
    /// An untrained model: features uniform in `[-1, 1]`, weights with the variance of He et al. ("Delving deep into rectifiers", ICCV 2015), biases up
    /// to 0.1. The same for the same seed.
    #[must_use]
    pub fn untrained(architecture: Architecture, seed: u64) -> Self {
        let mut model = Self::zeroed(architecture);
        let mut random = Random::new(seed, 0, 0);
        let mut uniform = move || random.signed();
        let modules = model.opacity.iter_mut().chain([&mut model.offset, &mut model.colour]);
        for module in modules {
            module.texture.texels.fill_with(&mut uniform);
            randomise(&mut module.mlp, &mut uniform);
        }
        model
    }
}

fn randomise(mlp: &mut Mlp, uniform: &mut impl FnMut() -> f32) {
    for layer in &mut mlp.layers {
        let bound = (6.0 / layer.inputs as f32).sqrt();
        layer.weights.fill_with(|| bound * uniform());
        layer.biases.fill_with(|| 0.1 * uniform());
    }
}

//! Models of random numbers, of the size that training begins with.

use super::{Architecture, Mlp, Model};

impl Model {
    /// An untrained model: features uniform in `[-1, 1]`, weights with the variance of He et al. ("Delving deep into rectifiers", ICCV 2015), biases up
    /// to 0.1. The same for the same seed.
    #[must_use]
    pub fn untrained(architecture: Architecture, seed: u64) -> Self {
        let mut model = Self::zeroed(architecture);
        let mut state = seed;
        let mut uniform = move || {
            // SplitMix64 (Steele et al., "Fast splittable pseudorandom number generators", OOPSLA 2014).
            state = state.wrapping_add(0x9e37_79b9_7f4a_7c15);
            let z = (state ^ (state >> 30)).wrapping_mul(0xbf58_476d_1ce4_e5b9);
            let z = (z ^ (z >> 27)).wrapping_mul(0x94d0_49bb_1331_11eb);
            ((z ^ (z >> 31)) >> 40) as f32 / (1u64 << 23) as f32 - 1.0
        };
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

//! [`Learner`]: a module with what Adam remembers of it.

use rayon::prelude::*;

use super::blur::{LEAST_SIGMA, blur};
use super::kernels::{AdamStep, InstructionSet, Shape, adam};
use super::shard::{SHARD, Shard};
use super::texture::{Footprints, gather};
use crate::model::{FeatureTexture, Layer, Mlp, Module, TextureShape};
use crate::random::Random;

/// Numbers that are learned, and their moments.
#[derive(Debug, Clone, PartialEq)]
pub(crate) struct Parameters {
    pub(crate) values: Vec<f32>,
    pub(crate) means: Vec<f32>,
    pub(crate) squares: Vec<f32>,
}

impl Parameters {
    fn new(values: Vec<f32>) -> Self {
        let zeros = vec![0.0; values.len()];
        Self { values, means: zeros.clone(), squares: zeros }
    }

    /// The rows with their names.
    pub(crate) fn rows(&self) -> [(&'static str, &[f32]); 3] {
        [("values", &self.values), ("means", &self.means), ("squares", &self.squares)]
    }

    /// One step, in parallel; every number is on its own, so that the pieces do not matter.
    fn step(&mut self, set: InstructionSet, step: AdamStep, gradient: &[f32]) {
        const PIECE: usize = 1 << 15;
        (self.values.par_chunks_mut(PIECE))
            .zip(self.means.par_chunks_mut(PIECE))
            .zip(self.squares.par_chunks_mut(PIECE))
            .zip(gradient.par_chunks(PIECE))
            .for_each(|(((values, means), squares), gradient)| {
                adam(set, step, values, means, squares, gradient);
            });
    }
}

/// How a step is taken.
#[derive(Debug, Clone, Copy, PartialEq)]
pub(crate) struct Update {
    /// Rate of the networks.
    pub(crate) network: f64,
    /// Rate of the textures.
    pub(crate) texture: f64,
    /// Standard deviation of the blur, in texels.
    pub(crate) sigma: f64,
    /// Samples after which networks are moved; textures wait for the whole batch.
    pub(crate) network_batch: usize,
}

/// All that a learner has learned.
#[derive(Debug, Clone, PartialEq)]
pub(crate) struct LearnerState {
    pub(crate) texture: Parameters,
    /// Layer by layer, weights `[outputs, inputs]`, then biases.
    pub(crate) network: Parameters,
    /// Steps taken.
    pub(crate) steps: u64,
}

/// A module that learns.
#[derive(Debug, Clone)]
pub(crate) struct Learner {
    pub(crate) set: InstructionSet,
    pub(crate) shape: TextureShape,
    pub(crate) layers: Shape,
    pub(crate) state: LearnerState,
    seen: Vec<f32>,
    blurred: bool,
    scratch: Vec<f32>,
    texture_gradient: Vec<f32>,
}

/// Range of initial features. The first blur shrinks them thirtyfold; from zeros nothing tells texels apart.
const FEATURES: f32 = 0.5;

impl Update {
    /// Shards after which networks are moved, and how often that is in a batch of so many samples.
    pub(crate) fn parts(&self, samples: usize) -> (usize, u64) {
        let shards = self.network_batch.div_ceil(SHARD).max(1);
        (shards, samples.div_ceil(SHARD).div_ceil(shards).max(1) as u64)
    }
}

impl Learner {
    /// Random features, and weights after He et al. ("Delving deep into rectifiers", ICCV 2015) so that signals keep their size.
    /// `start` becomes the biases of the last layer: a first guess at the outputs.
    pub(crate) fn new(shape: TextureShape, sizes: Vec<usize>, start: &[f32], random: &mut Random) -> Self {
        let layers = Shape::new(sizes);
        let texels = (0..shape.len()).map(|_| FEATURES * random.signed()).collect();
        let mut network = Vec::with_capacity(layers.parameters());
        let last = layers.sizes().len() - 2;
        for (index, pair) in layers.sizes().windows(2).enumerate() {
            // Outputs begin near the first guess: a tenth of the usual size.
            let range = (6.0 / pair[0] as f32).sqrt() * if index == last { 0.1 } else { 1.0 };
            network.extend((0..pair[0] * pair[1]).map(|_| range * random.signed()));
            network.extend((0..pair[1]).map(|o| if index == last { start[o] } else { 0.0 }));
        }
        let state =
            LearnerState { texture: Parameters::new(texels), network: Parameters::new(network), steps: 0 };
        let scratch = || vec![0.0; shape.len()];
        Self {
            set: InstructionSet::best(),
            shape,
            layers,
            state,
            seen: scratch(),
            blurred: false,
            scratch: scratch(),
            texture_gradient: scratch(),
        }
    }

    /// Begins with these features instead of random ones, if there are any.
    pub(crate) fn begin_with(&mut self, texels: impl FnOnce(TextureShape) -> Option<Vec<f32>>) {
        if let Some(texels) = texels(self.shape).filter(|texels| texels.len() == self.shape.len()) {
            self.state.texture = Parameters::new(texels);
        }
    }

    /// Makes the features that the network will see.
    pub(crate) fn look(&mut self, sigma: f64) {
        self.blurred = sigma >= LEAST_SIGMA;
        if self.blurred {
            self.seen.copy_from_slice(&self.state.texture.values);
            blur(self.set, self.shape, sigma, &mut self.seen, &mut self.scratch);
        }
    }

    /// The features that the network sees.
    pub(crate) fn texels(&self) -> &[f32] {
        if self.blurred { &self.seen } else { &self.state.texture.values }
    }

    /// Sums the shards' gradients of the network, in the order of the shards.
    pub(crate) fn network_gradient<'a>(&self, shards: impl Iterator<Item = &'a Shard>) -> Vec<f32> {
        let mut sum = vec![0.0; self.state.network.values.len()];
        for shard in shards {
            sum.iter_mut().zip(&shard.network).for_each(|(sum, g)| *sum += g);
        }
        sum
    }

    /// Gathers the shards' gradients of the texture, in the order of the shards.
    pub(crate) fn texture_gradient(&mut self, footprints: &[&Footprints], sigma: f64) -> &[f32] {
        gather(self.set, self.shape, footprints, &mut self.texture_gradient);
        if self.blurred {
            blur(self.set, self.shape, sigma, &mut self.texture_gradient, &mut self.scratch);
        }
        &self.texture_gradient
    }

    /// Moves the network down the gradients of a part of a batch; `part` counts from 0, `parts` is their number in every batch.
    pub(crate) fn step_network<'a>(
        &mut self,
        shards: impl Iterator<Item = &'a Shard>,
        update: Update,
        [part, parts]: [u64; 2],
    ) {
        let gradient = self.network_gradient(shards);
        let adam = AdamStep::new(update.network, self.state.steps * parts + part + 1);
        self.state.network.step(self.set, adam, &gradient);
    }

    /// Moves the texture down the gradients of a whole batch, which ends its step.
    pub(crate) fn step_texture(&mut self, footprints: &[&Footprints], update: Update) {
        self.texture_gradient(footprints, update.sigma);
        self.state.steps += 1;
        let adam = AdamStep::new(update.texture, self.state.steps);
        self.state.texture.step(self.set, adam, &self.texture_gradient);
    }

    /// The module with the features that its network last saw.
    pub(crate) fn module(&self) -> Module {
        let mut rest = self.state.network.values.as_slice();
        let mut take = |count: usize| {
            let (head, tail) = rest.split_at(count);
            rest = tail;
            head.to_vec()
        };
        let layers = (self.layers.sizes().windows(2))
            .map(|pair| Layer {
                inputs: pair[0],
                outputs: pair[1],
                weights: take(pair[0] * pair[1]),
                biases: take(pair[1]),
            })
            .collect();
        Module {
            texture: FeatureTexture { shape: self.shape, texels: self.texels().to_vec() },
            mlp: Mlp { layers },
        }
    }
}

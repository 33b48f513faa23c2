//! [`Shard`]: the part of a batch whose gradients are summed in one order, and room for one network's work on it.

use super::kernels::{BLOCK, ROW, Shape, Tap, backward, drain, fetch, forward};
use super::learner::Learner;
use super::texture::Footprints;

/// Samples in a shard: enough to make up for its sums, few enough to share a batch among threads. Fixed, so that results
/// do not depend on the number of threads.
pub(crate) const SHARD: usize = 4 * BLOCK;

/// A network's rows, gradients and footprints for one shard.
#[derive(Debug, Clone)]
pub(crate) struct Shard {
    pub(crate) rows: Vec<f32>,
    pub(crate) gradients: Vec<f32>,
    pub(crate) footprints: Footprints,
    /// Of the network, after [`Shard::finish`].
    pub(crate) network: Vec<f32>,
    accumulators: Vec<f32>,
    taps: Vec<Tap>,
    taps_per_sample: usize,
}

impl Shard {
    pub(crate) fn new(layers: &Shape, taps_per_sample: usize) -> Self {
        Self {
            rows: layers.block(),
            gradients: layers.block(),
            footprints: Footprints::default(),
            network: vec![0.0; layers.parameters()],
            accumulators: layers.accumulators(),
            taps: vec![Tap::default(); taps_per_sample * BLOCK],
            taps_per_sample,
        }
    }

    /// Forgets the batch before.
    pub(crate) fn begin(&mut self, learner: &Learner) {
        self.footprints.clear(learner.shape);
        self.network.fill(0.0);
    }

    /// Fetches the features of one tap of all samples of the block.
    pub(crate) fn fetch(&mut self, learner: &Learner, index: usize, uv: &[[f32; BLOCK]; 2]) {
        let taps = &mut self.taps[index * BLOCK..][..BLOCK];
        let rows = &mut self.rows[index * learner.shape.channels * ROW..];
        fetch(learner.set, learner.texels(), learner.shape, uv, taps, rows);
    }

    /// Writes an input that is no feature, counted after these.
    #[inline(always)]
    pub(crate) fn input(&mut self, learner: &Learner, sample: usize, index: usize, value: f32) {
        let row = self.taps_per_sample * learner.shape.channels + index;
        self.rows[row * ROW + sample] = value;
    }

    pub(crate) fn forward(&mut self, learner: &Learner) {
        forward(learner.set, &learner.layers, &learner.state.network.values, &mut self.rows);
    }

    /// One output of one sample.
    #[inline(always)]
    pub(crate) fn output(&self, learner: &Learner, sample: usize, index: usize) -> f32 {
        self.rows[(learner.layers.first_output() + index) * ROW + sample]
    }

    /// Sets the gradient of one output of one sample; all of a block must be set before [`Shard::backward`].
    #[inline(always)]
    pub(crate) fn set_gradient(&mut self, learner: &Learner, sample: usize, index: usize, value: f32) {
        self.gradients[(learner.layers.first_output() + index) * ROW + sample] = value;
    }

    /// Empties the output gradients from a sample on, where the block has no more samples.
    pub(crate) fn clear_gradients_from(&mut self, learner: &Learner, sample: usize) {
        let first = learner.layers.first_output();
        for row in self.gradients[first * ROW..].chunks_exact_mut(ROW) {
            row[sample..].fill(0.0);
        }
    }

    /// Propagates the output gradients to weights and inputs.
    pub(crate) fn backward(&mut self, learner: &Learner) {
        backward(
            learner.set,
            &learner.layers,
            &learner.state.network.values,
            &self.rows,
            &mut self.gradients,
            &mut self.accumulators,
        );
    }

    /// The derivative of the loss by the place of a tap.
    pub(crate) fn slope(&self, learner: &Learner, sample: usize, index: usize) -> [f32; 2] {
        let channels = learner.shape.channels;
        let gradient: Vec<f32> =
            (0..channels).map(|c| self.gradients[(index * channels + c) * ROW + sample]).collect();
        self.taps[index * BLOCK + sample].slope(learner.texels(), learner.shape, &gradient)
    }

    /// Keeps the gradients of the features of the block's first `count` samples.
    pub(crate) fn scatter(&mut self, learner: &Learner, count: usize) {
        let channels = learner.shape.channels;
        for index in 0..self.taps_per_sample {
            let taps = &self.taps[index * BLOCK..][..count];
            self.footprints.extend(learner.shape, taps, &self.gradients[index * channels * ROW..]);
        }
    }

    /// Completes the gradient of the network.
    pub(crate) fn finish(&mut self, learner: &Learner) {
        drain(learner.set, &mut self.accumulators, &mut self.network);
    }
}

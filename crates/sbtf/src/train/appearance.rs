//! Learning the appearance: the offset, and the colour that is looked up where it leads.

use glam::{Vec2, Vec3};
use rayon::prelude::*;

use super::kernels::BLOCK;
use super::learner::{Learner, Update};
use super::options::{AppearanceLoss, ColourLoss, Supervision};
use super::shard::{SHARD, Shard};
use crate::model::{Architecture, CurvatureInput, OffsetForm, STEEPEST_RAY, azimuth};
use crate::random::Random;
use crate::samples::AppearanceBatch;

/// The offset and colour modules while they learn.
#[derive(Debug, Clone)]
pub(crate) struct AppearanceLearner {
    architecture: Architecture,
    loss: AppearanceLoss,
    supervision: Supervision,
    pub(crate) offset: Learner,
    pub(crate) colour: Learner,
    shards: Vec<[Shard; 2]>,
}

/// Sums over held-out samples.
#[derive(Debug, Clone, Copy, Default)]
pub(crate) struct AppearanceSums {
    /// Of squared differences of `ln(1 + rgb)`, over channels.
    pub(crate) colour: f64,
    /// Of lengths of differences of offsets.
    pub(crate) offset: f64,
    /// Samples counted.
    pub(crate) count: u64,
}

impl AppearanceLearner {
    /// Fresh modules.
    pub(crate) fn new(
        architecture: &Architecture,
        loss: AppearanceLoss,
        supervision: Supervision,
        random: &mut Random,
    ) -> Self {
        let form = architecture;
        let sizes = form.layer_sizes(form.offset_inputs(), form.offset_outputs());
        let offset = Learner::new(form.offset_texture, sizes, &[0.0, 0.0], random);
        // Most materials show a colour between 0.1 and 0.5 where they are lit.
        let sizes = form.layer_sizes(form.colour_inputs(), 3);
        let colour = Learner::new(form.colour_texture, sizes, &[0.2; 3], random);
        Self::with(form, loss, supervision, offset, colour)
    }

    fn with(
        architecture: &Architecture,
        loss: AppearanceLoss,
        supervision: Supervision,
        offset: Learner,
        colour: Learner,
    ) -> Self {
        let architecture = architecture.clone();
        Self { architecture, loss, supervision, offset, colour, shards: Vec::new() }
    }

    fn shard(&self) -> [Shard; 2] {
        [
            Shard::new(&self.offset.layers, self.architecture.offset_taps.len()),
            Shard::new(&self.colour.layers, 1),
        ]
    }

    fn look(&mut self, sigma: f64) {
        self.offset.look(sigma);
        self.colour.look(sigma);
    }

    /// The shards of a batch, to be given back.
    fn take_shards(&mut self, batch: &AppearanceBatch) -> Vec<[Shard; 2]> {
        let mut shards = std::mem::take(&mut self.shards);
        shards.resize_with(batch.len().div_ceil(SHARD), || self.shard());
        shards
    }

    /// Gradients of a batch, left in the shards. Returns the mean loss.
    #[cfg(test)]
    pub(crate) fn gradients(&mut self, batch: &AppearanceBatch, sigma: f64) -> f64 {
        self.look(sigma);
        let mut shards = self.take_shards(batch);
        let sum = self.part_gradients(batch, 0, &mut shards);
        self.shards = shards;
        sum / batch.len() as f64
    }

    /// Gradients of the part of a batch that begins with this row and has so many shards. Returns the sum of the losses.
    fn part_gradients(&self, batch: &AppearanceBatch, first: usize, shards: &mut [[Shard; 2]]) -> f64 {
        let scale = 1.0 / (batch.len() - first).min(shards.len() * SHARD).max(1) as f32;
        let losses: Vec<f64> = (shards.par_iter_mut().enumerate())
            .map(|(index, [offset, colour])| {
                offset.begin(&self.offset);
                colour.begin(&self.colour);
                let begin = first + index * SHARD;
                let end = (begin + SHARD).min(batch.len());
                let block = |first: usize| {
                    let count = BLOCK.min(end - first);
                    self.block_gradients(batch, first, count, scale, offset, colour)
                };
                let sum: f64 = (begin..end).step_by(BLOCK).map(block).sum();
                offset.finish(&self.offset);
                colour.finish(&self.colour);
                sum
            })
            .collect();
        losses.iter().sum()
    }

    /// Forward and backward for one block; returns the sum of the losses.
    fn block_gradients(
        &self,
        batch: &AppearanceBatch,
        first: usize,
        count: usize,
        scale: f32,
        offset: &mut Shard,
        colour: &mut Shard,
    ) -> f64 {
        let rays = Rays::new(&self.architecture, batch, first, count);
        let found = self.predict(batch, first, &rays, offset, colour);
        let mut sum = 0.0;
        for sample in 0..count {
            for channel in 0..3 {
                let target = batch.rgb[channel][first + sample];
                let (value, slope) =
                    self.loss.of_colour(colour.output(&self.colour, sample, channel), target);
                sum += f64::from(value) / 3.0;
                colour.set_gradient(&self.colour, sample, channel, slope * scale / 3.0);
            }
        }
        colour.clear_gradients_from(&self.colour, count);
        colour.backward(&self.colour);
        colour.scatter(&self.colour, count);
        for (sample, found) in found.iter().enumerate().take(count) {
            let mut gradient = colour.slope(&self.colour, sample, 0);
            if self.supervision == Supervision::Full {
                for axis in 0..2 {
                    let error = found[axis] - batch.offset[axis][first + sample];
                    sum += f64::from(self.loss.offset * error.abs());
                    gradient[axis] += self.loss.offset * scale * sign(error);
                }
            }
            match self.architecture.offset {
                OffsetForm::Free => {
                    offset.set_gradient(&self.offset, sample, 0, gradient[0]);
                    offset.set_gradient(&self.offset, sample, 1, gradient[1]);
                }
                OffsetForm::AlongRay | OffsetForm::AlongReach => {
                    let [u, v] = [0, 1].map(|axis: usize| rays.unit[axis][sample] * gradient[axis]);
                    offset.set_gradient(&self.offset, sample, 0, u + v);
                }
            }
        }
        offset.clear_gradients_from(&self.offset, count);
        offset.backward(&self.offset);
        offset.scatter(&self.offset, count);
        sum
    }

    /// Runs both networks; returns the offsets.
    fn predict(
        &self,
        batch: &AppearanceBatch,
        first: usize,
        rays: &Rays,
        offset: &mut Shard,
        colour: &mut Shard,
    ) -> [[f32; 2]; BLOCK] {
        let form = &self.architecture;
        for (index, &fraction) in form.offset_taps.iter().enumerate() {
            let at = |axis: usize| std::array::from_fn(|i| rays.uv[axis][i] + rays.step[axis][i] * fraction);
            offset.fetch(&self.offset, index, &[at(0), at(1)]);
        }
        let curvature = form.curvature == CurvatureInput::Given;
        for sample in 0..rays.count {
            let i = first + sample;
            for axis in 0..2 {
                offset.input(&self.offset, sample, axis, batch.wo[axis][i]);
                colour.input(&self.colour, sample, 3 + axis, batch.wo[axis][i]);
            }
            for axis in 0..3 {
                colour.input(&self.colour, sample, axis, batch.wi[axis][i]);
            }
            if curvature {
                offset.input(&self.offset, sample, 2, rays.curvature[sample]);
                colour.input(&self.colour, sample, 5, rays.curvature[sample]);
            }
        }
        offset.forward(&self.offset);
        let found: [[f32; 2]; BLOCK] = std::array::from_fn(|sample| {
            [0, 1].map(|axis: usize| match form.offset {
                OffsetForm::Free => offset.output(&self.offset, sample, axis),
                OffsetForm::AlongRay | OffsetForm::AlongReach => {
                    offset.output(&self.offset, sample, 0) * rays.unit[axis][sample]
                }
            })
        });
        let hit = [0, 1].map(|axis: usize| std::array::from_fn(|i| rays.uv[axis][i] + found[i][axis]));
        colour.fetch(&self.colour, 0, &hit);
        colour.forward(&self.colour);
        found
    }

    /// Learns from a batch; returns the mean loss before.
    pub(crate) fn step(&mut self, batch: &AppearanceBatch, update: Update) -> f64 {
        self.look(update.sigma);
        let mut shards = self.take_shards(batch);
        let (length, parts) = update.parts(batch.len());
        let mut sum = 0.0;
        for (part, shards) in (0..).zip(shards.chunks_mut(length)) {
            let first = usize::try_from(part).unwrap_or(0) * length * SHARD;
            sum += self.part_gradients(batch, first, shards);
            self.offset.step_network(shards.iter().map(|pair| &pair[0]), update, [part, parts]);
            self.colour.step_network(shards.iter().map(|pair| &pair[1]), update, [part, parts]);
        }
        for (which, learner) in [&mut self.offset, &mut self.colour].into_iter().enumerate() {
            let footprints: Vec<_> = shards.iter().map(|pair| &pair[which].footprints).collect();
            learner.step_texture(&footprints, update);
        }
        self.shards = shards;
        sum / batch.len().max(1) as f64
    }

    /// Gradients that [`Self::gradients`] left, of the offset and of the colour module: texture, then network.
    #[cfg(test)]
    pub(crate) fn gathered(&mut self, sigma: f64) -> [(Vec<f32>, Vec<f32>); 2] {
        [0, 1].map(|which| {
            let learner = if which == 0 { &mut self.offset } else { &mut self.colour };
            let footprints: Vec<_> = self.shards.iter().map(|pair| &pair[which].footprints).collect();
            let texture = learner.texture_gradient(&footprints, sigma).to_vec();
            (texture, learner.network_gradient(self.shards.iter().map(|pair| &pair[which])))
        })
    }

    /// Compares the outputs for a batch with the truth, features blurred as in training.
    pub(crate) fn score(&mut self, batch: &AppearanceBatch, sigma: f64) -> AppearanceSums {
        self.look(sigma);
        let this = &*self;
        let sums: Vec<AppearanceSums> = (0..batch.len().div_ceil(BLOCK))
            .into_par_iter()
            .map_init(
                || this.shard(),
                |[offset, colour], block| {
                    let first = block * BLOCK;
                    let count = BLOCK.min(batch.len() - first);
                    let rays = Rays::new(&this.architecture, batch, first, count);
                    let found = this.predict(batch, first, &rays, offset, colour);
                    let mut sums = AppearanceSums { count: count as u64, ..AppearanceSums::default() };
                    for (sample, found) in found.iter().enumerate().take(count) {
                        for channel in 0..3 {
                            let output = colour.output(&this.colour, sample, channel).max(0.0);
                            let error = output - batch.rgb[channel][first + sample].ln_1p();
                            sums.colour += f64::from(error * error);
                        }
                        let [u, v] =
                            [0, 1].map(|axis: usize| found[axis] - batch.offset[axis][first + sample]);
                        sums.offset += f64::from(u.hypot(v));
                    }
                    sums
                },
            )
            .collect();
        sums.into_iter().fold(AppearanceSums::default(), AppearanceSums::plus)
    }
}

impl AppearanceSums {
    pub(crate) fn plus(self, other: Self) -> Self {
        Self {
            colour: self.colour + other.colour,
            offset: self.offset + other.offset,
            count: self.count + other.count,
        }
    }
}

/// What both networks need to know of a block's rays.
struct Rays {
    count: usize,
    uv: [[f32; BLOCK]; 2],
    /// From offset tap 0 to offset tap 1.
    step: [[f32; BLOCK]; 2],
    /// What a single output of the offset network is counted in.
    unit: [[f32; BLOCK]; 2],
    /// As the networks see it.
    curvature: [f32; BLOCK],
}

impl Rays {
    fn new(form: &Architecture, batch: &AppearanceBatch, first: usize, count: usize) -> Self {
        let zeros = [[0.0; BLOCK]; 2];
        let mut rays = Self { count, uv: zeros, step: zeros, unit: zeros, curvature: [0.0; BLOCK] };
        for sample in 0..count {
            let i = first + sample;
            let wo = Vec3::new(batch.wo[0][i], batch.wo[1][i], batch.wo[2][i]);
            let kappa = form.clamp_curvature(batch.kappa_hat[i]);
            let step = azimuth(wo) * form.way_length(form.offset_way, wo, kappa);
            let unit = match form.offset {
                OffsetForm::AlongReach => step,
                _ => -Vec2::new(wo.x, wo.y) / wo.z.max(STEEPEST_RAY),
            };
            rays.curvature[sample] = form.encode_curvature(kappa);
            for axis in 0..2 {
                rays.uv[axis][sample] = batch.uv[axis][i];
                rays.step[axis][sample] = step[axis];
                rays.unit[axis][sample] = unit[axis];
            }
        }
        rays
    }
}

/// The sign, 0 for 0: what fits exactly is left alone.
fn sign(error: f32) -> f32 {
    if error == 0.0 { 0.0 } else { error.signum() }
}

impl AppearanceLoss {
    /// Loss of one channel and its derivative by the output, which predicts `ln(1 + target)`.
    fn of_colour(self, output: f32, target: f32) -> (f32, f32) {
        let error = output - target.ln_1p();
        // Outputs are clamped at 0 in use: below it nothing is darker.
        if output < 0.0 && target <= 0.0 {
            return (0.0, 0.0);
        }
        let (value, slope) = match self.colour {
            ColourLoss::Logarithmic => (error * error, 2.0 * error),
            ColourLoss::Unbiased => {
                // Beyond e^5 the loss goes on straight, so that one bright sample in the dark does not throw the network.
                let ratio = (-error).min(5.0).exp();
                let straight = (-error - 5.0).max(0.0);
                (2.0 * (error + ratio * (1.0 + straight) - 1.0), 2.0 * (1.0 - ratio))
            }
        };
        (value + self.l1 * error.abs(), slope + self.l1 * sign(error))
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    /// The output that minimises the mean over noisy samples is the logarithm of their mean, not the mean of logarithms.
    #[test]
    fn the_unbiased_loss_is_least_at_the_mean() {
        let samples = [0.1, 0.1, 0.1, 2.9];
        let slope_at = |colour, output: f32| {
            let loss = AppearanceLoss { colour, l1: 0.0, offset: 0.0 };
            samples.iter().map(|&target| loss.of_colour(output, target).1).sum::<f32>()
        };
        let mean = (1.0 + samples.iter().sum::<f32>() / 4.0).ln();
        assert!(slope_at(ColourLoss::Unbiased, mean).abs() < 1e-5);
        assert!(slope_at(ColourLoss::Logarithmic, mean) > 0.1);
    }

    #[test]
    fn slopes_of_the_losses_are_their_derivatives() {
        for colour in [ColourLoss::Logarithmic, ColourLoss::Unbiased] {
            let loss = AppearanceLoss { colour, l1: 0.1, offset: 1.0 };
            for (output, target) in [(0.3, 0.1), (0.1, 0.9), (0.2, 2000.0)] {
                let h = 1e-2;
                let (above, below) =
                    (loss.of_colour(output + h, target).0, loss.of_colour(output - h, target).0);
                let (slope, difference) = (loss.of_colour(output, target).1, (above - below) / (2.0 * h));
                assert!((slope - difference).abs() < 1e-3 * (1.0 + slope.abs()), "{slope} {difference}");
            }
        }
    }
}

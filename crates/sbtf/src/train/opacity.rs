//! Learning the opacity: the silhouette head with and without known silhouettes, and the direct head.

use glam::Vec3;
use rayon::prelude::*;

use super::kernels::BLOCK;
use super::learner::{Learner, Update};
use super::options::{OpacityLoss, Supervision};
use super::shard::{SHARD, Shard};
use crate::model::{Architecture, CurvatureInput, OpacityHead, azimuth};
use crate::random::Random;
use crate::samples::OpacityBatch;
use crate::silhouette::dip_of_cosine;

/// The opacity module while it learns.
#[derive(Debug, Clone)]
pub(crate) struct OpacityLearner {
    architecture: Architecture,
    loss: OpacityLoss,
    supervision: Supervision,
    pub(crate) learner: Learner,
    shards: Vec<Shard>,
}

/// What a sample teaches.
#[derive(Debug, Clone, Copy)]
enum Target {
    /// The output itself.
    Value(f32),
    /// Only on which side of the ray's own dip the output lies: at most that if the ray hits, at least that if it does not.
    Side { dip: f32, hits: bool },
}

/// Sums over held-out samples.
#[derive(Debug, Clone, Copy, Default)]
pub(crate) struct OpacitySums {
    /// Of the errors of the output.
    pub(crate) error: f64,
    /// Of what the base mesh has as an error: the dip, or the share of rays that pass.
    pub(crate) base: f64,
    /// Samples counted.
    pub(crate) count: u64,
}

impl OpacityLearner {
    /// A fresh module.
    pub(crate) fn new(
        architecture: &Architecture,
        loss: OpacityLoss,
        supervision: Supervision,
        random: &mut Random,
    ) -> Self {
        let sizes = architecture.layer_sizes(architecture.opacity_inputs(), 1);
        // A dip or an opacity: something between 0 and 1.
        let learner = Learner::new(architecture.opacity_texture, sizes, &[0.3], random);
        Self::with(architecture, loss, supervision, learner)
    }

    pub(crate) fn with(
        architecture: &Architecture,
        loss: OpacityLoss,
        supervision: Supervision,
        learner: Learner,
    ) -> Self {
        Self { architecture: architecture.clone(), loss, supervision, learner, shards: Vec::new() }
    }

    /// The samples that teach something, and what.
    fn targets(&self, batch: &OpacityBatch) -> Vec<(u32, Target)> {
        let silhouette = self.architecture.opacity == OpacityHead::Silhouette;
        let target = |i: usize| {
            if !silhouette {
                return Some(Target::Value(batch.alpha[i]));
            }
            let kappa = self.architecture.clamp_curvature(batch.kappa_hat[i]);
            // Every ray hits where the surface is flat or concave.
            if kappa <= 0.0 {
                return None;
            }
            let depth = self.architecture.depth;
            let cosine = batch.silhouette_cosine[i];
            if self.supervision == Supervision::Full && !cosine.is_nan() {
                return Some(Target::Value(dip_of_cosine(cosine, kappa, depth)));
            }
            let dip = dip_of_cosine(batch.wo[2][i], kappa, depth);
            Some(Target::Side { dip, hits: batch.alpha[i] > 0.5 })
        };
        (0..u32::MAX).zip(0..batch.len()).filter_map(|(id, i)| Some((id, target(i)?))).collect()
    }

    /// The shards of so many samples, to be given back.
    fn take_shards(&mut self, samples: usize) -> Vec<Shard> {
        let (form, layers) = (&self.architecture, &self.learner.layers);
        let mut shards = std::mem::take(&mut self.shards);
        shards.resize_with(samples.div_ceil(SHARD), || Shard::new(layers, form.opacity_taps.len()));
        shards
    }

    /// Gradients of a batch, left in the shards. Returns the mean loss, 0 for a batch without samples that teach.
    #[cfg(test)]
    pub(crate) fn gradients(&mut self, batch: &OpacityBatch, sigma: f64) -> f64 {
        self.learner.look(sigma);
        let targets = self.targets(batch);
        let mut shards = self.take_shards(targets.len());
        let sum = self.part_gradients(batch, &targets, &mut shards);
        self.shards = shards;
        sum / targets.len().max(1) as f64
    }

    /// Gradients of a part of a batch. Returns the sum of the losses.
    fn part_gradients(&self, batch: &OpacityBatch, targets: &[(u32, Target)], shards: &mut [Shard]) -> f64 {
        let (form, learner) = (&self.architecture, &self.learner);
        let scale = 1.0 / targets.len().max(1) as f32;
        let losses: Vec<f64> = (targets.par_chunks(SHARD).zip(shards))
            .map(|(targets, shard)| {
                shard.begin(learner);
                let mut sum = 0.0;
                for block in targets.chunks(BLOCK) {
                    predict(form, learner, shard, batch, block);
                    for (sample, (_, target)) in block.iter().enumerate() {
                        let (value, slope) = self.loss.of(*target, shard.output(learner, sample, 0));
                        sum += f64::from(value);
                        shard.set_gradient(learner, sample, 0, slope * scale);
                    }
                    shard.clear_gradients_from(learner, block.len());
                    shard.backward(learner);
                    shard.scatter(learner, block.len());
                }
                shard.finish(learner);
                sum
            })
            .collect();
        losses.iter().sum()
    }

    /// Gradients that [`Self::gradients`] left: of the texture, and of the network.
    #[cfg(test)]
    pub(crate) fn gathered(&mut self, sigma: f64) -> (Vec<f32>, Vec<f32>) {
        let footprints: Vec<_> = self.shards.iter().map(|shard| &shard.footprints).collect();
        let texture = self.learner.texture_gradient(&footprints, sigma).to_vec();
        (texture, self.learner.network_gradient(self.shards.iter()))
    }

    /// Learns from a batch; returns the mean loss before.
    pub(crate) fn step(&mut self, batch: &OpacityBatch, update: Update) -> f64 {
        self.learner.look(update.sigma);
        let targets = self.targets(batch);
        let mut shards = self.take_shards(targets.len());
        let (length, parts) = update.parts(batch.len());
        let mut sum = 0.0;
        for (part, (targets, shards)) in
            (0..).zip(targets.chunks(length * SHARD).zip(shards.chunks_mut(length)))
        {
            sum += self.part_gradients(batch, targets, shards);
            self.learner.step_network(shards.iter(), update, [part, parts]);
        }
        let footprints: Vec<_> = shards.iter().map(|shard| &shard.footprints).collect();
        self.learner.step_texture(&footprints, update);
        self.shards = shards;
        sum / targets.len().max(1) as f64
    }

    /// Compares the outputs for a batch with the truth, features blurred as in training.
    pub(crate) fn score(&mut self, batch: &OpacityBatch, sigma: f64) -> OpacitySums {
        self.learner.look(sigma);
        let supervised = Self { supervision: Supervision::Full, shards: Vec::new(), ..self.clone() };
        let targets = supervised.targets(batch);
        let (form, learner) = (&self.architecture, &self.learner);
        let sums: Vec<OpacitySums> = (targets.par_chunks(SHARD))
            .map(|targets| {
                let mut shard = Shard::new(&learner.layers, form.opacity_taps.len());
                let mut sums = OpacitySums::default();
                for block in targets.chunks(BLOCK) {
                    predict(form, learner, &mut shard, batch, block);
                    for (sample, (_, target)) in block.iter().enumerate() {
                        let output = shard.output(learner, sample, 0).clamp(0.0, 1.0);
                        sums.add(form.opacity, *target, output);
                    }
                }
                sums
            })
            .collect();
        sums.into_iter().fold(OpacitySums::default(), OpacitySums::plus)
    }
}

/// Runs the network for a block of samples.
fn predict(
    form: &Architecture,
    learner: &Learner,
    shard: &mut Shard,
    batch: &OpacityBatch,
    block: &[(u32, Target)],
) {
    let (mut start, mut step) = ([[0.0; BLOCK]; 2], [[0.0; BLOCK]; 2]);
    for (sample, (id, _)) in block.iter().enumerate() {
        let i = *id as usize;
        let wo = Vec3::new(batch.wo[0][i], batch.wo[1][i], batch.wo[2][i]);
        let kappa = form.clamp_curvature(batch.kappa_hat[i]);
        let along = azimuth(wo);
        let reach = form.way_length(form.opacity_way, wo, kappa);
        for axis in 0..2 {
            start[axis][sample] = batch.uv[axis][i];
            step[axis][sample] = along[axis] * reach;
        }
        let direction = if form.opacity == OpacityHead::Silhouette { along } else { wo.truncate() };
        shard.input(learner, sample, 0, direction.x);
        shard.input(learner, sample, 1, direction.y);
        if form.curvature == CurvatureInput::Given {
            shard.input(learner, sample, 2, form.encode_curvature(kappa));
        }
    }
    for (index, &fraction) in form.opacity_taps.iter().enumerate() {
        let at = |axis: usize| std::array::from_fn(|i| start[axis][i] + step[axis][i] * fraction);
        shard.fetch(learner, index, &[at(0), at(1)]);
    }
    shard.forward(learner);
}

impl OpacityLoss {
    /// Loss and its derivative by the output.
    fn of(self, target: Target, output: f32) -> (f32, f32) {
        match target {
            Target::Value(value) => {
                let error = output - value;
                // Outputs are clamped in use: what lies beyond an end is as good as the end.
                if (value <= 0.0 && output < 0.0) || (value >= 1.0 && output > 1.0) {
                    return (0.0, 0.0);
                }
                let (l1, l2) = (self.l1, self.l2);
                (l2 * error * error + l1 * error.abs(), 2.0 * l2 * error + l1 * error.signum())
            }
            // The distance by which the output is on the wrong side. For rays whose dips are spread evenly its mean is half
            // the squared error of the output, so that it has the same minimum as full supervision.
            Target::Side { dip, hits } => {
                let (distance, slope) = if hits { (output - dip, 1.0) } else { (dip - output, -1.0) };
                if distance > 0.0 { (distance, slope) } else { (0.0, 0.0) }
            }
        }
    }
}

impl OpacitySums {
    fn add(&mut self, head: OpacityHead, target: Target, output: f32) {
        let (error, base) = match (head, target) {
            (OpacityHead::Silhouette, Target::Value(dip)) => ((output - dip).abs(), dip),
            (_, Target::Value(alpha)) => ((output - alpha).abs(), 1.0 - alpha),
            // A silhouette that is not known counts by the rays that it takes for the wrong side.
            (_, Target::Side { dip, hits }) => {
                (f32::from(u8::from((dip >= output) != hits)), f32::from(u8::from(!hits)))
            }
        };
        self.error += f64::from(error);
        self.base += f64::from(base);
        self.count += 1;
    }

    pub(crate) fn plus(self, other: Self) -> Self {
        Self {
            error: self.error + other.error,
            base: self.base + other.base,
            count: self.count + other.count,
        }
    }
}

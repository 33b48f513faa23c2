//! [`Task`]: what the training loop needs of a learner.

use super::appearance::{AppearanceLearner, AppearanceSums};
use super::learner::{Learner, Update};
use super::opacity::{OpacityLearner, OpacitySums};
use super::options::TrainOptions;
use super::report::{Scores, Stage};
use crate::model::Architecture;
use crate::random::Random;
use crate::samples::{AppearanceBatch, Features, OpacityBatch, Rows, SampleSource};

/// Something that the training loop can train.
pub(super) trait Task {
    /// Samples for a step.
    type Batch: Rows;
    /// Which part of a run it is.
    const STAGE: Stage;
    fn fresh(form: &Architecture, options: &TrainOptions, random: &mut Random) -> Self;
    /// Lets the features begin with what the source knows of the material.
    fn inform(&mut self, source: &dyn SampleSource, seed: u64);
    /// Steps and samples in a step.
    fn amount(options: &TrainOptions) -> (u64, usize);
    /// How many steps a sample is used in.
    fn reuse(options: &TrainOptions) -> u32;
    fn fill(source: &dyn SampleSource, index: u64, batch: &mut Self::Batch);
    /// Learns from a batch; returns the mean loss before.
    fn step(&mut self, batch: &Self::Batch, update: Update) -> f64;
    /// Scores over several batches.
    fn score(&mut self, batches: &[Self::Batch], sigma: f64) -> Scores;
    /// All learners, with their names.
    fn learners(&mut self) -> Vec<(&'static str, &mut Learner)>;
}

impl Task for OpacityLearner {
    type Batch = OpacityBatch;
    const STAGE: Stage = Stage::Opacity;

    fn fresh(form: &Architecture, options: &TrainOptions, random: &mut Random) -> Self {
        Self::new(form, options.opacity_loss, options.supervision, random)
    }

    fn inform(&mut self, source: &dyn SampleSource, seed: u64) {
        self.learner.begin_with(|shape| source.first_features(Features::Rays, shape, seed));
    }

    fn amount(options: &TrainOptions) -> (u64, usize) {
        (options.opacity_steps, options.opacity_batch)
    }

    fn reuse(options: &TrainOptions) -> u32 {
        options.opacity_reuse
    }

    fn fill(source: &dyn SampleSource, index: u64, batch: &mut OpacityBatch) {
        source.fill_opacity(index, batch);
    }

    fn step(&mut self, batch: &OpacityBatch, update: Update) -> f64 {
        self.step(batch, update)
    }

    fn score(&mut self, batches: &[OpacityBatch], sigma: f64) -> Scores {
        let sums = batches.iter().map(|batch| self.score(batch, sigma));
        let OpacitySums { error, base, .. } = sums.fold(OpacitySums::default(), OpacitySums::plus);
        Scores { error: if error == 0.0 { 0.0 } else { error / base }, offset: None }
    }

    fn learners(&mut self) -> Vec<(&'static str, &mut Learner)> {
        vec![("opacity", &mut self.learner)]
    }
}

impl Task for AppearanceLearner {
    type Batch = AppearanceBatch;
    const STAGE: Stage = Stage::Appearance;

    fn fresh(form: &Architecture, options: &TrainOptions, random: &mut Random) -> Self {
        Self::new(form, options.appearance_loss, options.supervision, random)
    }

    fn inform(&mut self, source: &dyn SampleSource, seed: u64) {
        self.offset.begin_with(|shape| source.first_features(Features::Rays, shape, seed));
        self.colour.begin_with(|shape| source.first_features(Features::Colour, shape, seed));
    }

    fn amount(options: &TrainOptions) -> (u64, usize) {
        (options.appearance_steps, options.appearance_batch)
    }

    fn reuse(options: &TrainOptions) -> u32 {
        options.appearance_reuse
    }

    fn fill(source: &dyn SampleSource, index: u64, batch: &mut AppearanceBatch) {
        source.fill_appearance(index, batch);
    }

    fn step(&mut self, batch: &AppearanceBatch, update: Update) -> f64 {
        self.step(batch, update)
    }

    fn score(&mut self, batches: &[AppearanceBatch], sigma: f64) -> Scores {
        let sums = batches.iter().map(|batch| self.score(batch, sigma));
        let sums = sums.fold(AppearanceSums::default(), AppearanceSums::plus);
        let count = sums.count.max(1) as f64;
        Scores { error: (sums.colour / (3.0 * count)).sqrt(), offset: Some(sums.offset / count) }
    }

    fn learners(&mut self) -> Vec<(&'static str, &mut Learner)> {
        vec![("offset", &mut self.offset), ("colour", &mut self.colour)]
    }
}

//! From minutes to steps.

use std::time::Instant;

use super::appearance::AppearanceLearner;
use super::learner::Update;
use super::opacity::OpacityLearner;
use super::options::TrainOptions;
use super::replay::Replay;
use super::task::Task;
use crate::model::{Architecture, OpacityHead};
use crate::random::Random;
use crate::samples::SampleSource;

/// Batches of samples that are made while steps are timed, after one that is not counted.
const TIMED: u64 = 3;
/// Share of the time that goes to the opacity module.
const OPACITY_SHARE: f64 = 0.3;
/// Share of the time that is left for scores, checkpoints, and slower moments.
const RESERVE: f64 = 0.08;

impl TrainOptions {
    /// The same options with as many steps as fit into so many minutes at the speed of this machine just now. The steps
    /// decide the result, the minutes only them: keep the options that this returns, and the run can be repeated.
    #[must_use]
    #[allow(clippy::cast_possible_truncation, clippy::cast_sign_loss, reason = "a positive count of steps")]
    pub fn fitted(self, form: &Architecture, source: &dyn SampleSource, minutes: f64) -> Self {
        let began = Instant::now();
        let opaque = form.opacity == OpacityHead::Opaque;
        let opacity = if opaque { f64::INFINITY } else { seconds::<OpacityLearner>(form, &self, source) };
        let appearance = seconds::<AppearanceLearner>(form, &self, source);
        let left = (60.0 * minutes * (1.0 - RESERVE) - began.elapsed().as_secs_f64()).max(0.0);
        let share = if opaque { 0.0 } else { OPACITY_SHARE };
        // Fewer steps than scores would be no training at all.
        let steps = |seconds: f64| ((seconds) as u64).max(self.scores);
        Self {
            opacity_steps: steps(left * share / opacity),
            appearance_steps: steps(left * (1.0 - share) / appearance),
            ..self
        }
    }
}

/// Seconds that a step takes, its samples included.
fn seconds<T: Task + Send>(form: &Architecture, options: &TrainOptions, source: &dyn SampleSource) -> f64 {
    let mut task = T::fresh(form, options, &mut Random::new(options.seed, 0, 0));
    let (mut batch, mut next) = (T::Batch::default(), T::Batch::default());
    let (_, count) = T::amount(options);
    let reuse = T::reuse(options);
    let mut replay = Replay::<T>::new(source, count, reuse);
    replay.fill(0, &mut batch);
    let mut began = Instant::now();
    let timed = TIMED * u64::from(reuse);
    for step in 0..=timed {
        if step == 1 {
            began = Instant::now();
        }
        // Half of a run is blurred, mostly little.
        let sigma = if step.is_multiple_of(2) { 0.0 } else { 0.25 * options.blur };
        let (network, texture) = (options.network_rate, options.texture_rate);
        let update = Update { network, texture, sigma, network_batch: options.network_batch };
        let task = &mut task;
        rayon::join(|| task.step(&batch, update), || replay.fill(step + 1, &mut next));
        std::mem::swap(&mut batch, &mut next);
    }
    began.elapsed().as_secs_f64() / timed as f64
}

//! The training loop of one [`Task`]: starts that are pruned, steps, scores, recoveries.

use std::ops::ControlFlow;

use serde::{Deserialize, Serialize};

use super::learner::{LearnerState, Update};
use super::options::{Supervision, TrainOptions};
use super::replay::Replay;
use super::report::{CurvePoint, Recovery, Scores, TrainReport, Trial};
use super::task::Task;
use super::trainer::TrainError;
use crate::model::Architecture;
use crate::random::Random;
use crate::samples::{Rows, SampleSource};

/// Index of the first batch that is held out for scores; training never gets that far.
pub const HELD_OUT: u64 = 1 << 62;
/// Losses whose median a loss is compared with.
const MEMORY: usize = 64;
/// A loss this many times the median has exploded.
const EXPLOSION: f64 = 10.0;
/// Recoveries after which a run gives up: rates have shrunk 256-fold then.
const MOST_RECOVERIES: u32 = 8;

/// Where the loop is, beside the learners.
#[derive(Debug, Clone, Default, PartialEq, Serialize, Deserialize)]
pub(super) struct Position {
    /// Steps taken by this start.
    pub(super) step: u64,
    /// Factor on all rates.
    pub(super) rate_scale: f64,
    recoveries: u32,
    recent: Vec<f64>,
}

/// A state that training can go on from, bit for bit.
#[derive(Debug, Clone, PartialEq)]
pub(super) struct Saved {
    pub(super) position: Position,
    pub(super) learners: Vec<(String, LearnerState)>,
}

/// What the loop tells while it runs.
pub(super) struct Event<'a> {
    /// Steps taken in this stage, over all starts.
    pub(super) taken: u64,
    pub(super) loss: f64,
    pub(super) held_out: Option<Scores>,
    pub(super) recovery: Option<Recovery>,
    /// Given where training can be resumed from.
    pub(super) saved: Option<(&'a Saved, &'a TrainReport)>,
}

/// What the loop reads.
pub(super) struct Context<'a> {
    pub(super) form: &'a Architecture,
    pub(super) options: &'a TrainOptions,
    pub(super) source: &'a dyn SampleSource,
}

impl Context<'_> {
    /// A task as a start begins with it.
    fn fresh<T: Task>(&self, start: u32) -> T {
        let mut random = Random::new(self.options.seed, u64::from(start), u64::MAX);
        let mut task = T::fresh(self.form, self.options, &mut random);
        if self.options.informed && self.options.supervision == Supervision::Full {
            task.inform(self.source, random.bits());
        }
        task
    }
}

/// Steps of each trial, and of the start that is taken on.
fn steps(options: &TrainOptions, total: u64) -> (u64, u64) {
    if options.starts < 2 {
        return (0, total);
    }
    #[allow(clippy::cast_possible_truncation, clippy::cast_sign_loss, reason = "a share of a count of steps")]
    let trial = (options.trial.clamp(0.0, 1.0 / f64::from(options.starts)) * total as f64) as u64;
    (trial, total - trial * u64::from(options.starts - 1))
}

/// How the step at a share of a run is taken.
fn schedule(options: &TrainOptions, share: f64, rate_scale: f64) -> Update {
    let decay = 0.5 * (1.0 + (std::f64::consts::PI * share).cos()) * rate_scale;
    Update {
        network: options.network_rate * decay,
        texture: options.texture_rate * decay,
        sigma: options.blur * (-share * options.blur_halvings).exp2(),
        network_batch: options.network_batch,
    }
}

/// Standard deviation of the blur at the end of a run, in texels: what a model's features are made with.
pub(super) fn final_sigma(options: &TrainOptions) -> f64 {
    schedule(options, 1.0, 1.0).sigma
}

/// Trains a task to the end, from the beginning or from a saved state.
pub(super) fn run<T: Task + Send>(
    context: &Context,
    saved: Option<Saved>,
    report: &mut TrainReport,
    tell: &mut dyn FnMut(&Event) -> Result<ControlFlow<()>, TrainError>,
) -> Result<T, TrainError> {
    let mut course = Course::<T>::new(context, context.fresh(0));
    if let Some(saved) = saved {
        course.restore(&saved);
    } else {
        course.choose_start(report, tell)?;
    }
    course.advance(course.own, true, report, tell)?;
    Ok(course.task)
}

/// A task on its way.
struct Course<'a, T: Task> {
    context: &'a Context<'a>,
    task: T,
    position: Position,
    /// Steps of a trial.
    trial: u64,
    /// Steps of the start that is taken on.
    own: u64,
    /// Steps of starts that were given up.
    given_up: u64,
    held_out: Vec<T::Batch>,
}

impl<'a, T: Task + Send> Course<'a, T> {
    fn new(context: &'a Context<'a>, task: T) -> Self {
        let (total, _) = T::amount(context.options);
        let (trial, own) = steps(context.options, total);
        let mut course = Self {
            context,
            task,
            position: Position { rate_scale: 1.0, ..Position::default() },
            trial,
            own,
            given_up: total - own,
            held_out: Vec::new(),
        };
        course.held_out = (0..context.options.held_out.div_ceil(PIECE) as u64)
            .map(|index| {
                let mut batch = T::Batch::default();
                let left = context.options.held_out - PIECE * usize::try_from(index).unwrap_or(0);
                batch.resize(left.min(PIECE));
                T::fill(context.source, HELD_OUT + index, &mut batch);
                batch
            })
            .collect();
        course
    }

    /// Gives every start its trial and keeps the best.
    fn choose_start(
        &mut self,
        report: &mut TrainReport,
        tell: &mut dyn FnMut(&Event) -> Result<ControlFlow<()>, TrainError>,
    ) -> Result<(), TrainError> {
        if self.trial == 0 {
            return Ok(());
        }
        let mut best: Option<(f64, Saved)> = None;
        for start in 0..self.context.options.starts {
            self.task = self.context.fresh(start);
            self.position = Position { rate_scale: 1.0, ..Position::default() };
            self.given_up = u64::from(start) * self.trial;
            self.advance(self.trial, false, report, tell)?;
            let held_out = self.score();
            report.trials.push(Trial { stage: T::STAGE, start, held_out });
            if best.as_ref().is_none_or(|(error, _)| held_out.error < *error) {
                best = Some((held_out.error, self.save()));
            }
        }
        self.given_up = u64::from(self.context.options.starts - 1) * self.trial;
        if let Some((_, saved)) = best {
            self.restore(&saved);
        }
        Ok(())
    }

    /// Takes steps up to this one; `judged` ones are scored and saved on the way.
    fn advance(
        &mut self,
        end: u64,
        judged: bool,
        report: &mut TrainReport,
        tell: &mut dyn FnMut(&Event) -> Result<ControlFlow<()>, TrainError>,
    ) -> Result<(), TrainError> {
        let (_, count) = T::amount(self.context.options);
        let interval = self.own.div_ceil(self.context.options.scores.max(1)).max(1);
        let (mut batch, mut next) = (T::Batch::default(), T::Batch::default());
        let mut replay = Replay::<T>::new(self.context.source, count, T::reuse(self.context.options));
        let mut good = self.save();
        let mut good_report = report.clone();
        let (mut sum, mut summed) = (0.0, 0_u64);
        let mut filled = None;
        while self.position.step < end {
            let step = self.position.step;
            if filled != Some(step) {
                replay.fill(step, &mut batch);
            }
            let update = self.update(step);
            let task = &mut self.task;
            // The next samples are made while this step is taken; neither sees the other.
            let (loss, ()) = rayon::join(|| task.step(&batch, update), || replay.fill(step + 1, &mut next));
            std::mem::swap(&mut batch, &mut next);
            filled = Some(step + 1);
            if self.exploded(loss) {
                let recovery = self.recover(step, &good)?;
                // If a sample was the cause, it is made again.
                replay.forget();
                filled = None;
                *report = good_report.clone();
                report.recoveries.push(recovery);
                // Without this a second divergence would forget the first.
                good_report.recoveries.push(recovery);
                good.position = self.position.clone();
                (sum, summed) = (0.0, 0);
                self.tell(tell, loss, None, Some(recovery), None)?;
                continue;
            }
            self.position.step += 1;
            (sum, summed) = (sum + loss, summed + 1);
            let scored = judged && (self.position.step.is_multiple_of(interval) || self.position.step == end);
            let held_out = scored.then(|| self.score());
            if let Some(held_out) = held_out {
                let loss = sum / summed as f64;
                report.curve.push(CurvePoint { stage: T::STAGE, step: self.position.step, loss, held_out });
                (sum, summed) = (0.0, 0);
                good = self.save();
                good_report = report.clone();
            }
            self.tell(tell, loss, held_out, None, scored.then_some((&good, &good_report)))?;
        }
        Ok(())
    }

    fn tell(
        &self,
        tell: &mut dyn FnMut(&Event) -> Result<ControlFlow<()>, TrainError>,
        loss: f64,
        held_out: Option<Scores>,
        recovery: Option<Recovery>,
        saved: Option<(&Saved, &TrainReport)>,
    ) -> Result<(), TrainError> {
        let taken = self.given_up + self.position.step;
        match tell(&Event { taken, loss, held_out, recovery, saved })? {
            ControlFlow::Continue(()) => Ok(()),
            ControlFlow::Break(()) => Err(TrainError::Interrupted),
        }
    }

    fn update(&self, step: u64) -> Update {
        schedule(self.context.options, step as f64 / self.own as f64, self.position.rate_scale)
    }

    fn score(&mut self) -> Scores {
        let sigma = self.update(self.position.step).sigma;
        self.task.score(&self.held_out, sigma)
    }

    /// Remembers a loss, unless it is no number or far above those before.
    fn exploded(&mut self, loss: f64) -> bool {
        let recent = &mut self.position.recent;
        if !loss.is_finite() {
            return true;
        }
        if recent.len() >= MEMORY / 4 {
            let mut sorted = recent.clone();
            sorted.sort_by(f64::total_cmp);
            let median = sorted[sorted.len() / 2];
            if median > 0.0 && loss > EXPLOSION * median {
                return true;
            }
        }
        if recent.len() == MEMORY {
            recent.remove(0);
        }
        recent.push(loss);
        false
    }

    /// Goes back to a good state with half the rates.
    fn recover(&mut self, step: u64, good: &Saved) -> Result<Recovery, TrainError> {
        let recoveries = self.position.recoveries + 1;
        let rate_scale = 0.5 * self.position.rate_scale;
        if recoveries > MOST_RECOVERIES {
            return Err(TrainError::Diverged { stage: T::STAGE, step, times: recoveries });
        }
        self.restore(good);
        self.position.rate_scale = rate_scale;
        self.position.recoveries = recoveries;
        Ok(Recovery { stage: T::STAGE, step, back_to: good.position.step, rate_scale })
    }

    fn save(&mut self) -> Saved {
        let learners = self.task.learners().into_iter();
        let learners = learners.map(|(name, learner)| (name.to_owned(), learner.state.clone())).collect();
        Saved { position: self.position.clone(), learners }
    }

    fn restore(&mut self, saved: &Saved) {
        self.position = saved.position.clone();
        for ((_, learner), (_, state)) in self.task.learners().into_iter().zip(&saved.learners) {
            learner.state.clone_from(state);
        }
    }
}

/// Held-out samples in a batch.
const PIECE: usize = 1 << 14;

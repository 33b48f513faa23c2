//! [`train`] and [`resume`]: whole runs.

use std::ops::ControlFlow;
use std::path::{Path, PathBuf};
use std::time::Instant;

use super::appearance::AppearanceLearner;
use super::checkpoint::Checkpoint;
use super::learner::LearnerState;
use super::opacity::OpacityLearner;
use super::options::TrainOptions;
use super::report::{Progress, Scores, Stage, TrainReport};
use super::stage::{self, Context, Event, Saved};
use super::task::Task;
use crate::model::{Architecture, Model, OpacityHead};
use crate::random::Random;
use crate::samples::SampleSource;

/// Why a run gave no model.
#[derive(Debug, thiserror::Error)]
pub enum TrainError {
    /// The options contradict themselves.
    #[error("training options: {0}")]
    Options(String),
    /// The callback asked to stop. The last checkpoint stays.
    #[error("training was interrupted")]
    Interrupted,
    /// Smaller steps did not help.
    #[error(
        "training of the {stage:?} module diverged {times} times, last at step {step}; try smaller rates"
    )]
    Diverged {
        /// Which part of the run.
        stage: Stage,
        /// Where it last happened.
        step: u64,
        /// How often.
        times: u32,
    },
    /// A checkpoint cannot be read or written.
    #[error("{}: {message}", path.display())]
    Checkpoint {
        /// The file.
        path: PathBuf,
        /// What is wrong.
        message: String,
    },
}

/// How a run is watched and kept; none of it changes the result.
pub struct Control<'a> {
    /// Where to keep a state to go on from, at every score; the file stays at the end.
    pub checkpoint: Option<&'a Path>,
    /// Called after every step; `Break` ends the run with [`TrainError::Interrupted`].
    pub progress: &'a mut dyn FnMut(&Progress) -> ControlFlow<()>,
}

impl std::fmt::Debug for Control<'_> {
    fn fmt(&self, f: &mut std::fmt::Formatter<'_>) -> std::fmt::Result {
        f.debug_struct("Control").field("checkpoint", &self.checkpoint).finish_non_exhaustive()
    }
}

/// Trains a model on samples from `source`: first the opacity, then offset and colour.
///
/// The result depends on the arguments and on the machine's instruction set, not on the number of threads (`source` must not
/// either).
///
/// # Errors
///
/// [`TrainError`]: options that make no sense, a callback that said stop, divergence that smaller steps do not cure, a
/// checkpoint that cannot be written.
pub fn train(
    form: &Architecture,
    options: &TrainOptions,
    source: &dyn SampleSource,
    control: &mut Control,
) -> Result<(Model, TrainReport), TrainError> {
    options.check()?;
    Run::new(form, options, source, control).all(None)
}

/// What a checkpoint's run is of: its form and its options.
///
/// # Errors
///
/// If the file is no checkpoint.
pub fn of_checkpoint(path: &Path) -> Result<(Architecture, TrainOptions), TrainError> {
    let header = Checkpoint::read(path)?.header;
    Ok((header.architecture, header.options))
}

/// Goes on with a run from its checkpoint. The model is, bit for bit, what the run would have given uninterrupted, if the
/// source is the same.
///
/// # Errors
///
/// As [`train`], and if the file is no checkpoint.
pub fn resume(
    path: &Path,
    source: &dyn SampleSource,
    control: &mut Control,
) -> Result<(Model, TrainReport), TrainError> {
    let checkpoint = Checkpoint::read(path)?;
    let (form, options) = (checkpoint.header.architecture.clone(), checkpoint.header.options.clone());
    options.check()?;
    Run::new(&form, &options, source, control).all(Some(&(path, checkpoint)))
}

impl TrainOptions {
    /// Refuses what would train nothing.
    fn check(&self) -> Result<(), TrainError> {
        let refuse = |message: String| Err(TrainError::Options(message));
        if self.opacity_batch == 0 || self.appearance_batch == 0 || self.held_out == 0 {
            return refuse("batches and the held-out set need at least one sample".to_owned());
        }
        for (name, reuse) in
            [("opacity_reuse", self.opacity_reuse), ("appearance_reuse", self.appearance_reuse)]
        {
            if reuse == 0 {
                return refuse(format!("{name} is 0; every sample must be used"));
            }
        }
        for (name, value) in [
            ("network_rate", self.network_rate),
            ("texture_rate", self.texture_rate),
            ("blur", self.blur),
            ("blur_halvings", self.blur_halvings),
            ("trial", self.trial),
        ] {
            if !(value >= 0.0 && value.is_finite()) {
                return refuse(format!("{name} is {value}; it must be 0 or more"));
            }
        }
        Ok(())
    }
}

/// A run while it runs.
struct Run<'a, 'c> {
    form: &'a Architecture,
    options: &'a TrainOptions,
    source: &'a dyn SampleSource,
    control: &'a mut Control<'c>,
    began: Instant,
    /// Share of the run that was done when it began, set at the first event.
    begun_at: Option<f64>,
    latest: Option<Scores>,
}

impl<'a, 'c> Run<'a, 'c> {
    fn new(
        form: &'a Architecture,
        options: &'a TrainOptions,
        source: &'a dyn SampleSource,
        control: &'a mut Control<'c>,
    ) -> Self {
        Self { form, options, source, control, began: Instant::now(), begun_at: None, latest: None }
    }

    fn all(mut self, from: Option<&(&Path, Checkpoint)>) -> Result<(Model, TrainReport), TrainError> {
        let mut report = from.map_or_else(TrainReport::default, |(_, c)| c.header.report.clone());
        let stage = from.map(|(_, checkpoint)| checkpoint.header.stage);
        let mut done = Vec::new();
        let mut opacity = None;
        if self.form.opacity != OpacityHead::Opaque {
            let mut saved = self.saved::<OpacityLearner>(from)?;
            // A finished module comes back as one that has all its steps.
            if let (Some(saved), Some(Stage::Appearance)) = (&mut saved, stage) {
                saved.position.step = u64::MAX;
            }
            let mut task = self.stage::<OpacityLearner>(saved, &done, &mut report)?;
            done = states(&mut task);
            opacity = Some(task);
        }
        let saved = match stage {
            Some(Stage::Appearance) => self.saved::<AppearanceLearner>(from)?,
            _ => None,
        };
        let mut appearance = self.stage::<AppearanceLearner>(saved, &done, &mut report)?;
        let sigma = stage::final_sigma(self.options);
        let module = |learner: &mut super::learner::Learner| {
            learner.look(sigma);
            learner.module()
        };
        let model = Model {
            architecture: self.form.clone(),
            opacity: opacity.as_mut().map(|task| module(&mut task.learner)),
            offset: module(&mut appearance.offset),
            colour: module(&mut appearance.colour),
        };
        Ok((model, report))
    }

    /// The state of a task in a checkpoint.
    fn saved<T: Task>(&self, from: Option<&(&Path, Checkpoint)>) -> Result<Option<Saved>, TrainError> {
        let Some((path, checkpoint)) = from else { return Ok(None) };
        let mut like = T::fresh(self.form, self.options, &mut Random::new(0, 0, 0));
        let learners = like.learners();
        let expected: Vec<_> = learners.iter().map(|(name, learner)| (*name, &learner.state)).collect();
        checkpoint.take(path, &expected).map(Some)
    }

    fn stage<T: Task + Send>(
        &mut self,
        saved: Option<Saved>,
        done: &[(String, LearnerState)],
        report: &mut TrainReport,
    ) -> Result<T, TrainError> {
        let context = Context { form: self.form, options: self.options, source: self.source };
        self.latest = None;
        stage::run::<T>(&context, saved, report, &mut |event| self.tell::<T>(event, done))
    }

    /// Writes checkpoints and reports progress.
    fn tell<T: Task>(
        &mut self,
        event: &Event,
        done: &[(String, LearnerState)],
    ) -> Result<ControlFlow<()>, TrainError> {
        if let (Some(path), Some((saved, report))) = (self.control.checkpoint, event.saved) {
            Checkpoint::new(self.form, self.options, T::STAGE, done, saved, report).write(path)?;
        }
        self.latest = event.held_out.or(self.latest);
        let fraction = self.fraction(T::STAGE, event.taken);
        let begun_at = *self.begun_at.get_or_insert(fraction);
        let seconds = self.began.elapsed().as_secs_f64();
        let speed = (fraction - begun_at).max(f64::MIN_POSITIVE) / seconds;
        let progress = Progress {
            stage: T::STAGE,
            fraction,
            seconds,
            remaining: if fraction > begun_at { (1.0 - fraction) / speed } else { f64::INFINITY },
            loss: event.loss,
            held_out: self.latest,
            recovery: event.recovery,
        };
        Ok((self.control.progress)(&progress))
    }

    /// Share of the run that is done, by samples.
    fn fraction(&self, stage: Stage, taken: u64) -> f64 {
        let options = self.options;
        let opacity = match self.form.opacity {
            OpacityHead::Opaque => 0.0,
            _ => options.opacity_steps as f64 * options.opacity_batch as f64,
        };
        let all = opacity + options.appearance_steps as f64 * options.appearance_batch as f64;
        let taken = match stage {
            Stage::Opacity => taken as f64 * options.opacity_batch as f64,
            Stage::Appearance => opacity + taken as f64 * options.appearance_batch as f64,
        };
        (taken / all).min(1.0)
    }
}

fn states<T: Task>(task: &mut T) -> Vec<(String, LearnerState)> {
    let learners = task.learners().into_iter();
    learners.map(|(name, learner)| (name.to_owned(), learner.state.clone())).collect()
}

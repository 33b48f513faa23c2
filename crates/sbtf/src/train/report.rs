//! What a training run tells: progress while it goes on, a report at its end.

use serde::{Deserialize, Serialize};

/// The two parts of a run. They share nothing, and are trained one after the other.
#[derive(Debug, Clone, Copy, PartialEq, Eq, Serialize, Deserialize)]
#[serde(rename_all = "kebab-case")]
pub enum Stage {
    /// The opacity module.
    Opacity,
    /// Offset and colour.
    Appearance,
}

/// How a module does on samples that it was not trained with.
#[derive(Debug, Clone, Copy, PartialEq, Serialize, Deserialize)]
pub struct Scores {
    /// Opacity: the mean absolute error over the mean error of an opaque surface (of the dip for the silhouette head, of the opacity
    /// for the direct head), which is the share of the base mesh's error that is left.
    /// Appearance: the root of the mean squared difference of `ln(1 + rgb)`, noise of the samples included.
    pub error: f64,
    /// Appearance: mean distance between predicted and true hit, in UV units.
    pub offset: Option<f64>,
}

/// A point of the training curve.
#[derive(Debug, Clone, Copy, PartialEq, Serialize, Deserialize)]
pub struct CurvePoint {
    /// Which part of the run.
    pub stage: Stage,
    /// Steps taken in this part by the start that was taken on.
    pub step: u64,
    /// Mean training loss since the point before.
    pub loss: f64,
    /// Scores on held-out samples.
    pub held_out: Scores,
}

/// How one of several starts did when it was judged.
#[derive(Debug, Clone, Copy, PartialEq, Serialize, Deserialize)]
pub struct Trial {
    /// Which part of the run.
    pub stage: Stage,
    /// Number of the start.
    pub start: u32,
    /// Scores on held-out samples.
    pub held_out: Scores,
}

/// A divergence that was recovered from.
#[derive(Debug, Clone, Copy, PartialEq, Serialize, Deserialize)]
pub struct Recovery {
    /// Which part of the run.
    pub stage: Stage,
    /// Step at which the loss exploded or was no number.
    pub step: u64,
    /// Step that the run went back to.
    pub back_to: u64,
    /// Factor on all rates from there on.
    pub rate_scale: f64,
}

/// What is reported during a run.
#[derive(Debug, Clone, Copy, PartialEq)]
pub struct Progress {
    /// Which part of the run.
    pub stage: Stage,
    /// Share of the whole run that is done, by samples.
    pub fraction: f64,
    /// Seconds since the run began or went on.
    pub seconds: f64,
    /// Seconds that the rest will take if it goes on at this speed.
    pub remaining: f64,
    /// The latest loss.
    pub loss: f64,
    /// The latest scores.
    pub held_out: Option<Scores>,
    /// Set once for every divergence.
    pub recovery: Option<Recovery>,
}

/// What a run came to.
#[derive(Debug, Clone, Default, PartialEq, Serialize, Deserialize)]
pub struct TrainReport {
    /// Scores and losses along the way.
    pub curve: Vec<CurvePoint>,
    /// Starts that were compared.
    pub trials: Vec<Trial>,
    /// Divergences that were recovered from.
    pub recoveries: Vec<Recovery>,
}

impl TrainReport {
    /// The last scores of a part of the run.
    #[must_use]
    pub fn last(&self, stage: Stage) -> Option<Scores> {
        self.curve.iter().rev().find(|point| point.stage == stage).map(|point| point.held_out)
    }
}

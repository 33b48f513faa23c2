//! [`TrainOptions`]: what a training run does.

use serde::{Deserialize, Serialize};

/// What a training run does. The same options, source and architecture give the same model, bit for bit, on one machine.
#[derive(Debug, Clone, PartialEq, Serialize, Deserialize)]
#[serde(default)]
pub struct TrainOptions {
    /// Steps for the opacity module, the trials included.
    pub opacity_steps: u64,
    /// Steps for offset and colour, the trials included.
    pub appearance_steps: u64,
    /// Samples in a step of the opacity module.
    pub opacity_batch: usize,
    /// Samples in a step of offset and colour.
    pub appearance_batch: usize,
    /// Samples after which the networks are moved. Textures wait for the whole batch: a pass over all texels costs as much as
    /// thousands of samples, and few texels have seen one after so many.
    pub network_batch: usize,
    /// Steps that each sample of the opacity is used in.
    pub opacity_reuse: u32,
    /// Steps that each sample of offset and colour is used in. They cost a path each, far more than a step does per sample.
    pub appearance_reuse: u32,
    /// Adam's rate for networks at the start; it falls to 0 along half a cosine.
    pub network_rate: f64,
    /// Adam's rate for textures at the start. Texels are few samples' concern, and want larger steps.
    pub texture_rate: f64,
    /// Standard deviation of the blur at the start, in texels.
    pub blur: f64,
    /// The blur halves this many times during a run.
    pub blur_halvings: f64,
    /// Every random choice of the run.
    pub seed: u64,
    /// Starts from different random numbers, of which the best is taken on.
    pub starts: u32,
    /// Share of the steps that each start takes before it is judged.
    pub trial: f64,
    /// Whether feature textures begin with the material's own maps, where the source has them; never without the true silhouettes.
    pub informed: bool,
    /// Whether the true silhouettes and offsets are used.
    pub supervision: Supervision,
    /// How the opacity is judged.
    pub opacity_loss: OpacityLoss,
    /// How colour and offset are judged.
    pub appearance_loss: AppearanceLoss,
    /// Samples of each kind held out for scores.
    pub held_out: usize,
    /// Times that a module is scored during a run; a state to return to is kept as often.
    pub scores: u64,
}

/// Whether the true silhouettes and offsets are used.
#[derive(Debug, Clone, Copy, PartialEq, Eq, Serialize, Deserialize)]
#[serde(rename_all = "kebab-case")]
pub enum Supervision {
    /// They are, where they are known.
    Full,
    /// Only colour and opacity are, as for a material of which there are only pictures.
    ColourAndAlpha,
}

/// Weights of the opacity module's losses; both zero would teach nothing.
#[derive(Debug, Clone, Copy, PartialEq, Serialize, Deserialize)]
pub struct OpacityLoss {
    /// Of the absolute error.
    pub l1: f32,
    /// Of the squared error.
    pub l2: f32,
}

/// Weights of the losses of colour and offset.
#[derive(Debug, Clone, Copy, PartialEq, Serialize, Deserialize)]
pub struct AppearanceLoss {
    /// How the main error of the colour is measured.
    pub colour: ColourLoss,
    /// Of the absolute error of `ln(1 + rgb)`, beside the main error with weight 1 (the paper: a tenth).
    pub l1: f32,
    /// Of the absolute error of the offset in UV units, where it is supervised.
    pub offset: f32,
}

/// How the main error of the colour is measured; both are in `ln(1 + rgb)`, and agree where errors are small.
#[derive(Debug, Clone, Copy, PartialEq, Eq, Serialize, Deserialize)]
#[serde(rename_all = "kebab-case")]
pub enum ColourLoss {
    /// The square of the difference (NeuMIP). Noise in the samples darkens what is learned: the mean of logarithms is below
    /// the logarithm of the mean.
    Logarithmic,
    /// The deviance of the gamma distribution, which is smallest at the mean of the samples whatever their noise.
    Unbiased,
}

impl Default for TrainOptions {
    fn default() -> Self {
        Self {
            opacity_steps: 24_000,
            appearance_steps: 12_000,
            opacity_batch: 16_384,
            appearance_batch: 16_384,
            network_batch: 2048,
            opacity_reuse: 3,
            appearance_reuse: 8,
            network_rate: 6e-3,
            texture_rate: 6e-3,
            blur: 8.0,
            blur_halvings: 9.0,
            seed: 1,
            starts: 4,
            trial: 0.04,
            supervision: Supervision::Full,
            informed: true,
            opacity_loss: OpacityLoss::default(),
            appearance_loss: AppearanceLoss::default(),
            held_out: 65_536,
            scores: 50,
        }
    }
}

impl Default for OpacityLoss {
    fn default() -> Self {
        Self { l1: 0.1, l2: 1.0 }
    }
}

impl Default for AppearanceLoss {
    fn default() -> Self {
        Self { colour: ColourLoss::Unbiased, l1: 0.1, offset: 1.0 }
    }
}

//! Training: from samples to a [`Model`](crate::model::Model).
//!
//! [`train`] runs two stages that share nothing, first the opacity module, then offset and colour. A step makes a batch's
//! gradients in shards of fixed size, adds them in a fixed order, and moves textures and networks with Adam; the samples of
//! the next step are made meanwhile. Textures are seen through a Gaussian blur that shrinks (paper, section 4.4).

mod appearance;
mod bare_network;
mod blur;
mod budget;
mod checkpoint;
mod kernels;
mod learner;
mod opacity;
mod options;
#[cfg(test)]
mod reference;
mod replay;
mod report;
mod shard;
mod stage;
mod task;
#[cfg(test)]
mod tests;
mod texture;
#[cfg(test)]
mod torch;
mod trainer;

pub use bare_network::BareNetwork;
pub use options::{AppearanceLoss, ColourLoss, OpacityLoss, Supervision, TrainOptions};
pub use report::{CurvePoint, Progress, Recovery, Scores, Stage, TrainReport, Trial};
pub use stage::HELD_OUT;
pub use trainer::{Control, TrainError, of_checkpoint, resume, train};

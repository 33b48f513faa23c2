//! Models compiled for speed.
//!
//! [`Material`] answers single queries ([`eval`](crate::SilhouetteBtf::eval)), many ([`eval_batch`](crate::SilhouetteBtf::eval_batch),
//! [`Material::eval_rows`]), several lights at one hit ([`Material::begin`]), and parts of
//! many queries ([`alpha_batch`](crate::SilhouetteBtf::alpha_batch) and its like). It gives what
//! [`Model`](crate::model::Model) defines, but for the order of sums.

mod ahead;
mod aligned;
mod block;
mod kernels;
mod lane_math;
mod loss;
mod material;
mod one;
mod packed_mlp;
mod packed_texture;
mod prepared;
mod rows;
mod stages;
mod stored;
mod work;

pub use kernels::Instructions;
pub use loss::ExportLoss;
pub use material::{BatchReport, Hit, MOST_CHANNELS, MOST_INPUTS, MOST_WIDTH, Material};
pub use rows::{AnswerRows, QueryRows};
pub use stored::{Precision, StoredModel, StoredModule, StoredTexture, Texels};

#[cfg(test)]
mod tests;

//! Where light comes from that matters: directions drawn in proportion to what a material reflects, as nearly as a small
//! mixture of analytic lobes can.
//!
//! A [`Sampler`] is a mixture of [`Lobe`]s over the whole sphere, with weights per band of viewing angles and, if it pays, per range of
//! curvatures or cell of the texture (its [`Grid`]). [`fit`] makes it from the material itself, and keeps the form with the least
//! measured variance. The density that goes with a sample is the mixture's, so that estimates are unbiased whatever the fit; a uniform
//! part keeps it above zero everywhere. [`Spread`] says how much samples differ, and how far the rarest lie off.

#[cfg(test)]
mod chi_square;
mod fit;
mod grid;
mod lobe;
mod sampler;
mod spread;
mod views;

pub use fit::{Candidate, FitOptions, SamplingFit, fit};
pub use grid::Grid;
pub use lobe::Lobe;
pub use sampler::{Sampler, SamplerError};
pub use spread::{Spread, SpreadOptions};

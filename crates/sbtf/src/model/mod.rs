//! What a trained material consists of.
//!
//! Three modules, each a feature texture and a small network (paper, section 4.3): opacity, offset and colour. The paper's
//! form is one [`Architecture`] of several; see there.

mod architecture;
mod forward;
mod inputs;
mod parameters;
mod untrained;

pub use architecture::{
    Architecture, CurvatureInput, LONGEST_REACH, OffsetForm, OpacityHead, TextureShape, Way,
};
pub use forward::{LARGEST_LOG, bounded, inside_tile};
pub use inputs::{STEEPEST_RAY, azimuth};
pub use parameters::{FeatureTexture, Layer, Mlp, Model, Module};

//! Light sources, and how points on them are drawn for direct lighting.

mod environment;
mod irradiance;
mod rectangle;

pub use environment::{Environment, EnvironmentImage};
pub use rectangle::RectangleLight;

pub(crate) use environment::EnvironmentSampler;

use glam::Vec3;

/// A light source other than the environment.
#[derive(Debug, Clone, PartialEq)]
pub enum Light {
    /// A rectangle that emits on one side.
    Rectangle(RectangleLight),
    /// Parallel light from infinitely far.
    Directional {
        /// The way the light travels; need not be unit.
        direction: Vec3,
        /// Linear RGB irradiance on a surface that faces the light.
        irradiance: Vec3,
    },
}

/// A point drawn on a light, as seen from the point it lights.
#[derive(Debug, Clone, Copy)]
pub(crate) struct LightSample {
    /// Unit direction to the light.
    pub wi: Vec3,
    /// How far away it is.
    pub distance: f32,
    /// Radiance that arrives, divided by `pdf` if that is finite; irradiance for a directional light.
    pub radiance: Vec3,
    /// Density over solid angle. Infinite for a directional light, which no BSDF sample can hit.
    pub pdf: f32,
}

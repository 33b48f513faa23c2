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

/// What lights need to know of the point that they light.
#[derive(Debug, Clone, Copy)]
pub(crate) struct Receiver {
    pub origin: Vec3,
    pub normal: Vec3,
    /// Whether light from below the horizon counts too.
    pub sees: Sees,
}

/// From where a point can be lit.
#[derive(Debug, Clone, Copy, PartialEq, Eq)]
pub(crate) enum Sees {
    Hemisphere,
    Sphere,
}

impl Receiver {
    /// Least share of the light from a direction that a point is taken to reflect, where it can reflect any.
    ///
    /// Materials with silhouettes may reflect light from below the horizon, though mostly little. Smaller: more noise
    /// where they reflect much. Larger: fewer samples for the lights above.
    const LEAST_FACING: f32 = 0.1;

    /// Cosine between normal and direction (unit), or what stands for it in choosing among lights; 0 only if nothing
    /// from there is reflected.
    pub(crate) fn facing(&self, direction: Vec3) -> f32 {
        let cosine = direction.dot(self.normal);
        match self.sees {
            Sees::Hemisphere => cosine.max(0.0),
            Sees::Sphere => cosine.max(Self::LEAST_FACING),
        }
    }

    /// Whether light from there counts although it comes from below the horizon.
    pub(crate) fn is_below(&self, direction: Vec3) -> bool {
        self.sees == Sees::Sphere && direction.dot(self.normal) < 0.0
    }
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

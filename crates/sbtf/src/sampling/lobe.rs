//! [`Lobe`]: densities over the sphere that can be drawn from exactly.

use std::f32::consts::{PI, TAU};

use glam::{Vec2, Vec3};
use serde::{Deserialize, Serialize};

/// A density over all directions, given the direction to the viewer.
#[derive(Debug, Clone, Copy, PartialEq, Serialize, Deserialize)]
#[serde(rename_all = "kebab-case")]
pub enum Lobe {
    /// The same everywhere.
    Uniform,
    /// Cosine around the normal leant towards the viewer: `normalize((tilt wo.xy, 1))`.
    Cosine {
        /// 0 for the normal itself.
        tilt: f32,
    },
    /// Cosine around the inverse normal, for light from below the horizon.
    Below,
    /// Von Mises-Fisher density around the mirrored direction.
    Mirror {
        /// Inverse of the squared width in radians; over 0.
        sharpness: f32,
    },
    /// Von Mises-Fisher density around the direction to the viewer.
    Back {
        /// Inverse of the squared width in radians; over 0.
        sharpness: f32,
    },
}

impl Lobe {
    /// Whether its number is one it can be drawn with.
    #[must_use]
    pub fn is_valid(self) -> bool {
        match self {
            Self::Uniform | Self::Below => true,
            Self::Cosine { tilt } => tilt.abs() <= 100.0,
            Self::Mirror { sharpness } | Self::Back { sharpness } => (1e-3..=1e5).contains(&sharpness),
        }
    }

    /// A direction for two numbers in `[0, 1)`.
    #[must_use]
    pub fn sample(self, wo: Vec3, u: Vec2) -> Vec3 {
        let (axis, z) = match self {
            Self::Uniform => (Vec3::Z, 1.0 - 2.0 * u.x),
            Self::Cosine { .. } | Self::Below => (self.axis(wo), (1.0 - u.x).sqrt()),
            // Its cumulative density, inverted (Wood, "Simulation of the von Mises Fisher distribution", 1994).
            Self::Mirror { sharpness: s } | Self::Back { sharpness: s } => {
                (self.axis(wo), 1.0 + (1.0 - u.x * -(-2.0 * s).exp_m1()).ln() / s)
            }
        };
        let z = z.clamp(-1.0, 1.0);
        let radius = ((1.0 - z) * (1.0 + z)).sqrt();
        let (sine, cosine) = (TAU * u.y).sin_cos();
        let (t, b) = axis.any_orthonormal_pair();
        (t * (radius * cosine) + b * (radius * sine) + axis * z).normalize()
    }

    /// The density per steradian.
    #[must_use]
    pub fn pdf(self, wo: Vec3, wi: Vec3) -> f32 {
        match self {
            Self::Uniform => 0.5 / TAU,
            Self::Cosine { .. } | Self::Below => self.axis(wo).dot(wi).max(0.0) / PI,
            Self::Mirror { sharpness: s } | Self::Back { sharpness: s } => {
                // |a - b|^2 / 2 = 1 - cos, without cancellation.
                let less = self.axis(wo).distance_squared(wi) / 2.0;
                s / (TAU * -(-2.0 * s).exp_m1()) * (-s * less).exp()
            }
        }
    }

    fn axis(self, wo: Vec3) -> Vec3 {
        let axis = match self {
            Self::Uniform => Vec3::Z,
            Self::Below => -Vec3::Z,
            Self::Cosine { tilt } => Vec3::new(tilt * wo.x, tilt * wo.y, 1.0),
            Self::Mirror { .. } => Vec3::new(-wo.x, -wo.y, wo.z),
            Self::Back { .. } => wo,
        };
        axis.try_normalize().unwrap_or(Vec3::Z)
    }
}

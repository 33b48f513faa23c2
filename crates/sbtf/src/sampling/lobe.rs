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
    /// Von Mises-Fisher density around the direction that leads away from the viewer, in the plane of incidence, at a height of its own.
    ///
    /// At grazing views the mirrored direction lies on the horizon, but what is seen are slopes that face the viewer, and they
    /// reflect upwards: the highlights of rough reliefs stay at heights of 0.1 to 0.5 when the view sinks to 0. On convex surfaces
    /// rays meet the material behind where they enter, where it leans away, and highlights lie lower.
    Forward {
        /// Inverse of the squared width in radians; over 0.
        sharpness: f32,
        /// Cosine between its axis and the normal, in [-1, 1].
        height: f32,
    },
}

/// A direction to the viewer, as all lobes of a mixture want to know it.
#[derive(Debug, Clone, Copy)]
pub(super) struct View {
    wo: Vec3,
    /// Unit, away from the viewer; at normal incidence any direction will do.
    away: Vec2,
}

impl View {
    #[inline]
    pub fn new(wo: Vec3) -> Self {
        Self { wo, away: (-wo.truncate()).try_normalize().unwrap_or(Vec2::X) }
    }
}

/// A lobe with what does not depend on directions worked out.
#[derive(Debug, Clone, Copy, PartialEq)]
pub(super) struct ReadyLobe {
    pub lobe: Lobe,
    /// Sine between a forward lobe's axis and the normal.
    sine: f32,
    /// Of a von Mises-Fisher density, of others nothing: the share of an unbounded one that is inside the sphere.
    inside: f32,
    /// The same: the density along the axis.
    peak: f32,
}

impl Lobe {
    /// For many directions.
    pub(super) fn ready(self) -> ReadyLobe {
        let (sharpness, sine) = match self {
            Self::Uniform | Self::Cosine { .. } | Self::Below => {
                return ReadyLobe { lobe: self, sine: 0.0, inside: 0.0, peak: 0.0 };
            }
            Self::Mirror { sharpness } | Self::Back { sharpness } => (sharpness, 0.0),
            Self::Forward { sharpness, height } => (sharpness, (1.0 - height * height).sqrt()),
        };
        let inside = -(-2.0 * sharpness).exp_m1();
        ReadyLobe { lobe: self, sine, inside, peak: sharpness / (TAU * inside) }
    }

    /// Whether its number is one it can be drawn with.
    #[must_use]
    pub fn is_valid(self) -> bool {
        match self {
            Self::Uniform | Self::Below => true,
            Self::Cosine { tilt } => tilt.abs() <= 100.0,
            Self::Mirror { sharpness } | Self::Back { sharpness } => is_sharpness(sharpness),
            Self::Forward { sharpness, height } => is_sharpness(sharpness) && height.abs() <= 1.0,
        }
    }

    /// A direction for unit `wo` and two numbers in `[0, 1)`.
    #[must_use]
    pub fn sample(self, wo: Vec3, u: Vec2) -> Vec3 {
        self.ready().sample(&View::new(wo), u)
    }

    /// The density per steradian at unit directions.
    #[must_use]
    pub fn pdf(self, wo: Vec3, wi: Vec3) -> f32 {
        self.ready().pdf(&View::new(wo), wi)
    }
}

impl ReadyLobe {
    /// [`Lobe::sample`].
    pub fn sample(&self, view: &View, u: Vec2) -> Vec3 {
        let axis = self.axis(view);
        let z = match self.lobe {
            Lobe::Uniform => 1.0 - 2.0 * u.x,
            Lobe::Cosine { .. } | Lobe::Below => (1.0 - u.x).sqrt(),
            // Its cumulative density, inverted (Wood, "Simulation of the von Mises Fisher distribution", 1994).
            Lobe::Mirror { sharpness } | Lobe::Back { sharpness } | Lobe::Forward { sharpness, .. } => {
                1.0 + (1.0 - u.x * self.inside).ln() / sharpness
            }
        };
        let z = z.clamp(-1.0, 1.0);
        let radius = ((1.0 - z) * (1.0 + z)).sqrt();
        let (sine, cosine) = (TAU * u.y).sin_cos();
        let (t, b) = axis.any_orthonormal_pair();
        (t * (radius * cosine) + b * (radius * sine) + axis * z).normalize()
    }

    /// [`Lobe::pdf`].
    pub fn pdf(&self, view: &View, wi: Vec3) -> f32 {
        match self.lobe {
            Lobe::Uniform => 0.5 / TAU,
            Lobe::Cosine { .. } | Lobe::Below => self.axis(view).dot(wi).max(0.0) / PI,
            Lobe::Mirror { sharpness } | Lobe::Back { sharpness } | Lobe::Forward { sharpness, .. } => {
                // |a - b|^2 / 2 = 1 - cos, without cancellation.
                let less = self.axis(view).distance_squared(wi) / 2.0;
                self.peak * (-sharpness * less).exp()
            }
        }
    }

    #[inline]
    fn axis(&self, &View { wo, away }: &View) -> Vec3 {
        match self.lobe {
            Lobe::Uniform | Lobe::Cosine { tilt: 0.0 } => Vec3::Z,
            Lobe::Below => -Vec3::Z,
            Lobe::Cosine { tilt } => Vec3::new(tilt * wo.x, tilt * wo.y, 1.0).normalize(),
            Lobe::Mirror { .. } => Vec3::new(-wo.x, -wo.y, wo.z),
            Lobe::Back { .. } => wo,
            Lobe::Forward { height, .. } => (away * self.sine).extend(height),
        }
    }
}

/// Sharper lobes than 1e5 are narrower than the rounding of f32 directions allows, blunter ones than 1e-3 are uniform.
fn is_sharpness(sharpness: f32) -> bool {
    (1e-3..=1e5).contains(&sharpness)
}

//! [`Effects`]: the switches of the integrator.

use serde::{Deserialize, Serialize};

/// Which effects are simulated.
#[derive(Debug, Clone, Copy, PartialEq, Eq, Serialize, Deserialize)]
pub struct Effects {
    /// Light from infinitely far.
    pub environment: bool,
    /// Rectangle lights.
    pub area_lights: bool,
    /// Directional lights.
    pub directional_lights: bool,
    /// Light between surfaces.
    pub interreflection: bool,
    /// Colour textures.
    pub textures: bool,
    /// Surfaces that let light through.
    pub transparency: bool,
    /// Materials with silhouettes.
    pub silhouettes: bool,
    /// Blur outside the plane of focus.
    pub depth_of_field: bool,
}

impl Effects {
    /// All of them.
    pub const ALL: Self = Self {
        environment: true,
        area_lights: true,
        directional_lights: true,
        interreflection: true,
        textures: true,
        transparency: true,
        silhouettes: true,
        depth_of_field: true,
    };
}

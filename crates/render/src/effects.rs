//! [`Effects`]: the switches that the integrator is compiled for.

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

    /// The effects that change what happens along a path, as a number below 128.
    pub(crate) fn path_bits(self) -> usize {
        usize::from(self.environment)
            | usize::from(self.area_lights) << 1
            | usize::from(self.directional_lights) << 2
            | usize::from(self.interreflection) << 3
            | usize::from(self.textures) << 4
            | usize::from(self.transparency) << 5
            | usize::from(self.silhouettes) << 6
    }

    /// Undoes [`Self::path_bits`].
    pub(crate) const fn from_path_bits(bits: usize) -> Self {
        Self {
            environment: bits & 1 != 0,
            area_lights: bits & 2 != 0,
            directional_lights: bits & 4 != 0,
            interreflection: bits & 8 != 0,
            textures: bits & 16 != 0,
            transparency: bits & 32 != 0,
            silhouettes: bits & 64 != 0,
            depth_of_field: false,
        }
    }
}

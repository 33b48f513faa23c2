//! [`HeightField`]: one height over each point of the tile.

use glam::Vec2;

use super::{Grid, Maps};

/// A height map with reflectance. The surface is the bilinear interpolant of the grid.
#[derive(Debug, Clone, PartialEq)]
pub struct HeightField {
    /// In `[0, 1]`: 0 is `z = -depth`, 1 the bounding surface.
    heights: Grid<f32>,
    depth: f32,
    maps: Maps,
}

impl HeightField {
    /// Takes heights in `[0, 1]`, the depth that they span in UV units, and the reflectance.
    ///
    /// # Panics
    ///
    /// If a height is outside `[0, 1]` or the depth is not positive and finite.
    #[must_use]
    pub fn new(heights: Grid<f32>, depth: f32, maps: Maps) -> Self {
        assert!(depth > 0.0 && depth.is_finite(), "a positive depth, not {depth}");
        assert!(heights.texels().iter().all(|h| (0.0..=1.0).contains(h)), "heights in [0, 1]");
        Self { heights, depth, maps }
    }

    /// The heights in `[0, 1]`.
    #[must_use]
    pub fn heights(&self) -> &Grid<f32> {
        &self.heights
    }

    /// Depth that the heights span, in UV units.
    #[must_use]
    pub fn depth(&self) -> f32 {
        self.depth
    }

    /// Reflectance parameters.
    #[must_use]
    pub fn maps(&self) -> &Maps {
        &self.maps
    }

    /// The same material with another depth.
    ///
    /// # Panics
    ///
    /// If the depth is not positive and finite.
    #[must_use]
    pub fn with_depth(self, depth: f32) -> Self {
        Self::new(self.heights, depth, self.maps)
    }

    /// `z` in `[-depth, 0]` at a point.
    #[must_use]
    pub fn z(&self, uv: Vec2) -> f32 {
        self.depth * (self.heights.lookup(uv) - 1.0)
    }
}

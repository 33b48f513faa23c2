//! Positions and normals as the batched fits read them.

use crate::Vec3;
use crate::mesh::Oriented;

/// Position and unit normal of a vertex, in one cache line.
#[derive(Debug, Clone, Copy)]
#[repr(C, align(64))]
pub(crate) struct Site {
    position: [f64; 4],
    normal: [f64; 4],
}

impl Oriented for Site {
    fn new(position: &Vec3, normal: &Vec3) -> Self {
        Self {
            position: [position.x, position.y, position.z, 0.0],
            normal: [normal.x, normal.y, normal.z, 0.0],
        }
    }
}

impl Site {
    /// Coordinates and a zero.
    #[inline(always)]
    pub(super) fn position(&self) -> &[f64; 4] {
        &self.position
    }

    /// Components and a zero.
    #[inline(always)]
    pub(super) fn normal(&self) -> &[f64; 4] {
        &self.normal
    }

    /// The position as a vector.
    #[inline]
    pub(crate) fn position_vector(&self) -> Vec3 {
        let [x, y, z, _] = self.position;
        Vec3::new(x, y, z)
    }

    /// The normal as a vector.
    #[inline]
    pub(crate) fn normal_vector(&self) -> Vec3 {
        let [x, y, z, _] = self.normal;
        Vec3::new(x, y, z)
    }
}

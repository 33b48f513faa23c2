//! What is asked ([`Ray`]), what is answered ([`Hit`]), and the ray as the kernels want it.

use glam::Vec3;

/// A half line or a segment: `origin + t direction` for `0 < t <= t_max`.
#[derive(Debug, Clone, Copy, PartialEq)]
pub struct Ray {
    /// Where `t` is 0.
    pub origin: Vec3,
    /// Direction, not zero; `t` is in multiples of its length.
    pub direction: Vec3,
    /// Largest `t` of interest; `f32::INFINITY` for a half line.
    pub t_max: f32,
}

impl Ray {
    /// A half line.
    #[must_use]
    pub fn new(origin: Vec3, direction: Vec3) -> Self {
        Self { origin, direction, t_max: f32::INFINITY }
    }

    /// The part of a half line with `t <= t_max`.
    #[must_use]
    pub fn segment(origin: Vec3, direction: Vec3, t_max: f32) -> Self {
        Self { origin, direction, t_max }
    }

    /// The point at `t`.
    #[must_use]
    pub fn at(&self, t: f32) -> Vec3 {
        self.origin + t * self.direction
    }
}

/// Where a ray meets a triangle.
#[derive(Debug, Clone, Copy, PartialEq)]
pub struct Hit {
    /// Distance along the ray in multiples of its direction's length, positive.
    pub t: f32,
    /// Index of the triangle.
    pub triangle: u32,
    /// Weights of the triangle's three corners; each in `[0, 1]`, their sum is 1 within rounding.
    pub barycentrics: [f32; 3],
}

/// A ray with everything that does not depend on the node or triangle worked out.
#[derive(Debug, Clone, Copy)]
pub(super) struct PreparedRay {
    pub origin: [f32; 3],
    pub direction: [f32; 3],
    pub inverse_direction: [f32; 3],
    /// For each axis, which of a node's six rows (lower x, upper x, lower y, ...) the ray meets first.
    pub near_row: [usize; 3],
    /// Axes such that `axes[2]` is the direction's largest component.
    pub axes: [usize; 3],
    /// Shear along x and y, and scale along z, that turn the ray into the unit z axis.
    pub shear: [f32; 3],
    pub t_max: f32,
}

/// Without signs. Not `array::map`, which is not inlined into functions compiled for other instructions.
#[inline(always)]
pub(super) fn magnitudes([x, y, z]: [f32; 3]) -> [f32; 3] {
    [x.abs(), y.abs(), z.abs()]
}

/// Which of three numbers is the largest; of equal ones the last.
#[inline(always)]
pub(super) fn largest_component([x, y, z]: [f32; 3]) -> usize {
    if x > y {
        if x > z { 0 } else { 2 }
    } else if y > z {
        1
    } else {
        2
    }
}

impl PreparedRay {
    /// Share of a direction's largest component that counts for smaller ones: they do not move the ray by one ulp of any coordinate that it can
    /// reach, so replacing them changes no answer and keeps 0 * infinity out of the slab test.
    pub(super) const LEAST_COMPONENT: f32 = 1e-18;

    pub(super) fn new(ray: &Ray) -> Self {
        let direction = ray.direction.to_array();
        let magnitude = magnitudes(direction);
        let z = largest_component(magnitude);
        let (x, y) = ([1, 2, 0][z], [2, 0, 1][z]);
        let least = magnitude[z] * Self::LEAST_COMPONENT;
        let inverse_direction = direction.map(|d| 1.0 / if d.abs() < least { least.copysign(d) } else { d });
        let row = |axis: usize| 2 * axis + usize::from(direction[axis].is_sign_negative());
        Self {
            origin: ray.origin.to_array(),
            direction,
            inverse_direction,
            near_row: [row(0), row(1), row(2)],
            axes: [x, y, z],
            shear: [direction[x] / direction[z], direction[y] / direction[z], 1.0 / direction[z]],
            t_max: ray.t_max,
        }
    }
}

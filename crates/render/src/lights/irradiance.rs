//! How much light an environment sends to a surface, roughly.

use glam::Vec3;

use super::environment::{EnvironmentImage, direction_from_uv, turned};
use crate::math::luminance;

/// Irradiance as a function of the normal, in spherical harmonics up to the second order.
///
/// Ramamoorthi and Hanrahan, "An Efficient Representation for Irradiance Environment Maps", SIGGRAPH 2001: the error is
/// below 3 % of the total for any environment; it only affects how often lights are chosen.
#[derive(Debug)]
pub(super) struct Irradiance {
    /// Coefficients of 1, y, z, x, xy, yz, 3 z^2 - 1, xz, x^2 - y^2.
    coefficients: [f32; 9],
    /// Lower bound, so that the environment is never left out where a little of it arrives.
    least: f32,
}

impl Irradiance {
    pub(super) fn constant(luminance: f32) -> Self {
        let mut coefficients = [0.0; 9];
        coefficients[0] = std::f32::consts::PI * luminance;
        Self { coefficients, least: 0.0 }
    }

    pub(super) fn of(image: &EnvironmentImage, intensity: f32, sin_cos: [f32; 2]) -> Self {
        use std::f32::consts::PI;
        let mut sums = [0.0_f32; 9];
        let cell = 2.0 * PI * PI / (image.width * image.height) as f32;
        for y in 0..image.height {
            let v = (y as f32 + 0.5) / image.height as f32;
            for x in 0..image.width {
                let w = turned(direction_from_uv([(x as f32 + 0.5) / image.width as f32, v]), sin_cos);
                let light = intensity * luminance(image.pixels[y * image.width + x]) * cell * (PI * v).sin();
                for (sum, basis) in sums.iter_mut().zip(Self::basis(w)) {
                    *sum += light * basis;
                }
            }
        }
        // Squared normalisation of the basis functions times the cosine lobe's factors pi, 2 pi / 3, pi / 4.
        let scale = [0.25, 0.5, 0.5, 0.5, 0.9375, 0.9375, 0.078_125, 0.9375, 0.234_375];
        let mut coefficients = sums;
        for (c, s) in coefficients.iter_mut().zip(scale) {
            *c *= s;
        }
        Self { coefficients, least: 0.1 * coefficients[0] }
    }

    fn basis(n: Vec3) -> [f32; 9] {
        let Vec3 { x, y, z } = n;
        [1.0, y, z, x, x * y, y * z, 3.0 * z * z - 1.0, x * z, x * x - y * y]
    }

    pub(super) fn at(&self, normal: Vec3) -> f32 {
        let sum: f32 = Self::basis(normal).iter().zip(self.coefficients).map(|(b, c)| b * c).sum();
        sum.max(self.least)
    }
}

//! How much two pictures differ.
//!
//! All metrics take the reference first, and pictures of one size. [`psnr`] and [`ssim`] take any components in `[0, 1]`,
//! [`flip`] takes sRGB.

mod filter;
mod flicker;
mod flip;
mod ssim;

pub use flicker::{Flicker, flicker};
pub use flip::{FlipOptions, flip, flip_map};
pub use ssim::ssim;

use glam::Vec3;

/// A picture to compare: rows from the top, components in `[0, 1]`.
#[derive(Debug, Clone, PartialEq)]
pub struct Image {
    width: usize,
    height: usize,
    pixels: Vec<Vec3>,
}

impl Image {
    /// Takes pixels row by row; components are clamped to `[0, 1]`, and NaN becomes 0.
    ///
    /// # Panics
    ///
    /// If there are not `width * height` pixels, or none.
    #[must_use]
    pub fn new(width: usize, height: usize, pixels: impl IntoIterator<Item = Vec3>) -> Self {
        let pixels: Vec<Vec3> = pixels.into_iter().map(|p| Vec3::from(p.to_array().map(in_range))).collect();
        assert!(!pixels.is_empty() && pixels.len() == width * height, "one value per pixel");
        Self { width, height, pixels }
    }

    /// Encodes linear radiance as sRGB.
    ///
    /// # Panics
    ///
    /// As [`Self::new`].
    #[must_use]
    pub fn srgb_from_linear(width: usize, height: usize, pixels: impl IntoIterator<Item = Vec3>) -> Self {
        let encode = |c: f32| osculate_sbtf::colour::srgb_from_linear(in_range(c));
        Self::new(width, height, pixels.into_iter().map(|p| Vec3::from(p.to_array().map(encode))))
    }

    /// Width and height in pixels.
    #[must_use]
    pub fn size(&self) -> (usize, usize) {
        (self.width, self.height)
    }

    /// All pixels, row by row from the top.
    #[must_use]
    pub fn pixels(&self) -> &[Vec3] {
        &self.pixels
    }

    /// One component as a plane.
    fn plane(&self, value: impl Fn(Vec3) -> f32) -> filter::Plane {
        filter::Plane::new(self.width, self.pixels.iter().map(|&p| value(p)).collect())
    }
}

/// Clamps to `[0, 1]`; NaN becomes 0.
fn in_range(c: f32) -> f32 {
    if c.is_nan() { 0.0 } else { c.clamp(0.0, 1.0) }
}

/// Peak signal-to-noise ratio in decibels over all components, for a peak of 1; infinite for equal pictures.
///
/// # Panics
///
/// If the pictures differ in size.
#[must_use]
pub fn psnr(reference: &Image, test: &Image) -> f64 {
    assert_eq!(reference.size(), test.size(), "pictures of one size");
    let square = |(a, b): (&Vec3, &Vec3)| f64::from((*a - *b).length_squared());
    let sum: f64 = reference.pixels.iter().zip(&test.pixels).map(square).sum();
    -10.0 * (sum / (3.0 * reference.pixels.len() as f64)).log10()
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn psnr_of_a_constant_difference() {
        let a = Image::new(3, 2, [Vec3::splat(0.5); 6]);
        let b = Image::new(3, 2, [Vec3::splat(0.6); 6]);
        assert!((psnr(&a, &b) - 20.0).abs() < 1e-4);
        assert_eq!(psnr(&a, &a), f64::INFINITY);
    }

    #[test]
    fn pixels_are_brought_into_range() {
        let a = Image::new(1, 1, [Vec3::new(-1.0, 2.0, f32::NAN)]);
        assert_eq!(a.pixels(), [Vec3::new(0.0, 1.0, 0.0)]);
    }
}

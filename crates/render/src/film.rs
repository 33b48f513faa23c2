//! [`Film`]: sums of samples per pixel, and what they say about the noise.

use glam::Vec3;

use crate::math::luminance;
use crate::schedule::Tile;

/// What a pixel has received. Even and odd samples come from independently scrambled sequences, so the difference of their
/// means measures the error, which the spread of stratified samples would overstate.
#[derive(Debug, Clone, Copy, Default)]
pub(crate) struct PixelSum {
    sums: [Vec3; 2],
    counts: [u32; 2],
    /// Sum of squared luminances.
    squares: f32,
}

impl PixelSum {
    /// Of samples with their numbers.
    #[inline(always)]
    pub(crate) fn of(samples: impl Iterator<Item = (u32, Vec3)>) -> Self {
        let mut sum = Self::default();
        samples.for_each(|(index, value)| sum.add(index, value));
        sum
    }

    pub(crate) fn add(&mut self, sample_index: u32, value: Vec3) {
        let half = (sample_index & 1) as usize;
        self.sums[half] += value;
        self.counts[half] += 1;
        self.squares += luminance(value) * luminance(value);
    }

    fn merge(&mut self, other: &Self) {
        for half in 0..2 {
            self.sums[half] += other.sums[half];
            self.counts[half] += other.counts[half];
        }
        self.squares += other.squares;
    }

    fn count(&self) -> f32 {
        (self.counts[0] + self.counts[1]) as f32
    }

    fn mean(&self) -> Vec3 {
        (self.sums[0] + self.sums[1]) / self.count().max(1.0)
    }

    /// Variance of the mean luminance, as if samples were independent.
    fn variance(&self) -> f32 {
        let n = self.count();
        if n < 2.0 {
            return f32::INFINITY;
        }
        let mean = luminance(self.mean());
        ((self.squares / n - mean * mean) / (n - 1.0)).max(0.0)
    }

    /// Squared half difference of the two halves' means: an unbiased estimate of the mean's variance from two values.
    fn halves_variance(&self) -> Option<f32> {
        let [a, b] = self.counts;
        (a > 0 && b > 0).then(|| {
            let difference = luminance(self.sums[0] / a as f32) - luminance(self.sums[1] / b as f32);
            0.25 * difference * difference
        })
    }
}

/// A finished or growing picture: linear RGB radiance, top row first.
#[derive(Debug, Clone)]
pub struct Film {
    width: u32,
    height: u32,
    pixels: Vec<PixelSum>,
}

impl Film {
    pub(crate) fn new(width: u32, height: u32) -> Self {
        Self { width, height, pixels: vec![PixelSum::default(); width as usize * height as usize] }
    }

    pub(crate) fn merge_row(&mut self, x: u32, y: u32, row: &[PixelSum]) {
        let start = y as usize * self.width as usize + x as usize;
        for (pixel, sum) in self.pixels[start..start + row.len()].iter_mut().zip(row) {
            pixel.merge(sum);
        }
    }

    /// Width and height in pixels.
    #[must_use]
    pub fn size(&self) -> (u32, u32) {
        (self.width, self.height)
    }

    /// Mean radiance of each pixel.
    #[must_use]
    pub fn radiance(&self) -> Vec<Vec3> {
        self.pixels.iter().map(PixelSum::mean).collect()
    }

    /// Variance of each pixel's mean luminance, from the spread of its samples. With the Sobol sampler this is an upper
    /// estimate, with independent samples an unbiased one. Infinite with fewer than two samples.
    #[must_use]
    pub fn variance(&self) -> Vec<f32> {
        self.pixels.iter().map(PixelSum::variance).collect()
    }

    /// Sum over the pixels of a tile of the variance of their mean luminance, as [`Self::noise`] estimates it; without samples zero.
    pub(crate) fn variance_in(&self, tile: Tile) -> f64 {
        let row = |y: u32| {
            let start = (y * self.width + tile.corner[0]) as usize;
            &self.pixels[start..start + tile.size[0] as usize]
        };
        let rows = tile.corner[1]..tile.corner[1] + tile.size[1];
        rows.flat_map(row).filter_map(PixelSum::halves_variance).map(f64::from).sum()
    }

    /// Root mean square over the pixels of the standard error of their luminance, divided by the mean luminance.
    ///
    /// `None` before two samples a pixel, or for a black picture.
    #[must_use]
    pub fn noise(&self) -> Option<f64> {
        let mut variance = 0.0;
        let mut mean = 0.0;
        for pixel in &self.pixels {
            variance += f64::from(pixel.halves_variance()?);
            mean += f64::from(luminance(pixel.mean()));
        }
        let n = self.pixels.len() as f64;
        (mean > 0.0).then(|| (variance / n).sqrt() / (mean / n))
    }
}

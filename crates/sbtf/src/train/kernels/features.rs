//! Bilinear fetches from a wrapped feature texture, and the sums of their gradients, for a block of samples.
#![allow(unsafe_code, reason = "calling functions compiled for an instruction set requires it")]

use super::dispatch::dispatch;
use super::shape::{BLOCK, ROW};
use crate::model::TextureShape;

/// A place between four texels.
#[derive(Debug, Clone, Copy, Default, PartialEq)]
pub(crate) struct Tap {
    /// First of the two texel columns.
    pub(crate) column: u32,
    /// First of the two texel rows.
    pub(crate) row: u32,
    /// Position between this column and the next, in `[0, 1]`.
    x: f32,
    /// Position between this row and the next.
    y: f32,
}

#[inline(always)]
#[allow(clippy::cast_possible_truncation, clippy::cast_sign_loss, reason = "wrapped into the texture first")]
fn axis(x: f32, n: f32) -> (u32, f32) {
    let inside = if x.is_finite() { x - x.floor() } else { 0.0 };
    let position = inside * n - 0.5;
    let first = position.floor();
    // Positions left of the first centre lie between the last texel and the first.
    let low = if first < 0.0 { n - 1.0 } else { first.min(n - 1.0) };
    (low as i32 as u32, position - first)
}

impl Tap {
    /// The place of a point; UV that are not finite are at the corner.
    #[inline(always)]
    pub(crate) fn new(shape: TextureShape, u: f32, v: f32) -> Self {
        let (column, x) = axis(u, shape.width as f32);
        let (row, y) = axis(v, shape.height as f32);
        Self { column, row, x, y }
    }

    /// Where the four texels begin: `[00, 10, 01, 11]`.
    #[inline(always)]
    fn corners(self, shape: TextureShape) -> [usize; 4] {
        let (x0, y0) = (self.column as usize, self.row as usize);
        let x1 = if x0 + 1 == shape.width { 0 } else { x0 + 1 };
        let y1 = if y0 + 1 == shape.height { 0 } else { y0 + 1 };
        let (low, high) = (y0 * shape.width, y1 * shape.width);
        [low + x0, low + x1, high + x0, high + x1].map(|texel| texel * shape.channels)
    }

    #[inline(always)]
    fn weights(self) -> [f32; 4] {
        let (x, y) = (self.x, self.y);
        [(1.0 - x) * (1.0 - y), x * (1.0 - y), (1.0 - x) * y, x * y]
    }

    /// The derivative by (u, v) of the features here times their gradient.
    pub(crate) fn slope(self, texels: &[f32], shape: TextureShape, gradient: &[f32]) -> [f32; 2] {
        let dot = |at: usize| -> f32 {
            texels[at..at + shape.channels].iter().zip(gradient).map(|(a, b)| a * b).sum()
        };
        let [a, b, c, d] = self.corners(shape).map(dot);
        let du = (b - a) * (1.0 - self.y) + (d - c) * self.y;
        let dv = (c - a) * (1.0 - self.x) + (d - b) * self.x;
        [du * shape.width as f32, dv * shape.height as f32]
    }
}

dispatch!(
    /// Writes the places of a block's points, and their features into one row per channel.
    fetch = fetch_body(
        texels: &[f32], shape: TextureShape, uv: &[[f32; BLOCK]; 2], taps: &mut [Tap], rows: &mut [f32],
    )
);
dispatch!(
    /// Adds the gradients of the features at some of the taps, `shape.channels` each, to the part of a texture that begins at
    /// `start`; what falls outside is left out.
    add_footprints = add_body(
        shape: TextureShape, chosen: &[u32], taps: &[Tap], gradients: &[f32], start: usize, texels: &mut [f32],
    )
);

#[inline(always)]
fn fetch_body(
    texels: &[f32],
    shape: TextureShape,
    uv: &[[f32; BLOCK]; 2],
    taps: &mut [Tap],
    rows: &mut [f32],
) {
    for ((tap, &u), &v) in taps.iter_mut().zip(&uv[0]).zip(&uv[1]) {
        *tap = Tap::new(shape, u, v);
    }
    match shape.channels {
        4 => fetch_channels::<4>(texels, shape, taps, rows),
        8 => fetch_channels::<8>(texels, shape, taps, rows),
        16 => fetch_channels::<16>(texels, shape, taps, rows),
        _ => {
            for (sample, tap) in taps.iter().enumerate() {
                let (corners, weights) = (tap.corners(shape), tap.weights());
                for channel in 0..shape.channels {
                    let terms = corners.iter().zip(weights).map(|(at, weight)| weight * texels[at + channel]);
                    rows[channel * ROW + sample] = terms.sum();
                }
            }
        }
    }
}

/// A known number of channels lets a texel be one register.
#[inline(always)]
fn fetch_channels<const C: usize>(texels: &[f32], shape: TextureShape, taps: &[Tap], rows: &mut [f32]) {
    const GROUP: usize = 16;
    for (group, taps) in taps.chunks_exact(GROUP).enumerate() {
        let mut features = [[0.0; C]; GROUP];
        for (features, tap) in features.iter_mut().zip(taps) {
            let [a, b, c, d] = tap.corners(shape).map(|at| &texels[at..at + C]);
            let [wa, wb, wc, wd] = tap.weights();
            for i in 0..C {
                features[i] = (wa * a[i] + wb * b[i]) + (wc * c[i] + wd * d[i]);
            }
        }
        for c in 0..C {
            let row = &mut rows[c * ROW + group * GROUP..][..GROUP];
            for (value, features) in row.iter_mut().zip(&features) {
                *value = features[c];
            }
        }
    }
}

#[inline(always)]
fn add_body(
    shape: TextureShape,
    chosen: &[u32],
    taps: &[Tap],
    gradients: &[f32],
    start: usize,
    texels: &mut [f32],
) {
    // Known numbers, so that a texel is one register.
    match shape.channels {
        4 => add_channels(4, shape, chosen, taps, gradients, start, texels),
        8 => add_channels(8, shape, chosen, taps, gradients, start, texels),
        16 => add_channels(16, shape, chosen, taps, gradients, start, texels),
        channels => add_channels(channels, shape, chosen, taps, gradients, start, texels),
    }
}

#[inline(always)]
fn add_channels(
    channels: usize,
    shape: TextureShape,
    chosen: &[u32],
    taps: &[Tap],
    gradients: &[f32],
    start: usize,
    texels: &mut [f32],
) {
    for &index in chosen {
        let tap = taps[index as usize];
        let gradient = &gradients[index as usize * channels..][..channels];
        for (corner, weight) in tap.corners(shape).into_iter().zip(tap.weights()) {
            // Corners before the start wrap to huge numbers.
            let at = corner.wrapping_sub(start);
            if at < texels.len() {
                for (texel, g) in texels[at..at + channels].iter_mut().zip(gradient) {
                    *texel += weight * g;
                }
            }
        }
    }
}

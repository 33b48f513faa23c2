//! Gaussian blur of feature textures that repeat (paper, section 4.4; widths after NeuMIP).

use rayon::prelude::*;

use super::kernels::{InstructionSet, accumulate};
use crate::model::TextureShape;

/// Below this many texels the blur is left out: the weight of the neighbours together falls under 1 %.
pub(crate) const LEAST_SIGMA: f64 = 0.3;

/// Weights of the centre and of the neighbours on one side, which sum to 1 with both sides counted; cut at three sigma.
#[allow(clippy::cast_possible_truncation, clippy::cast_sign_loss, reason = "a few texels")]
fn weights(sigma: f64) -> Vec<f32> {
    let radius = (3.0 * sigma).ceil() as i32;
    let gauss = |k: i32| (-0.5 * (f64::from(k) / sigma).powi(2)).exp();
    let sum: f64 = (-radius..=radius).map(gauss).sum();
    (0..=radius).map(|k| (gauss(k) / sum) as f32).collect()
}

/// Blurs with wrap-around, in texels; `scratch` is of the same length. The filter is its own transpose, so that it carries
/// gradients back as well.
pub(crate) fn blur(
    set: InstructionSet,
    shape: TextureShape,
    sigma: f64,
    texture: &mut [f32],
    scratch: &mut [f32],
) {
    let weights = weights(sigma);
    let row = shape.width * shape.channels;
    scratch.par_chunks_mut(row).zip(texture.par_chunks(row)).for_each(|(to, from)| {
        // The row with as many texels of its neighbours on either side as the filter needs.
        let margin = (weights.len() - 1) * shape.channels;
        let padded: Vec<f32> =
            (0..row + 2 * margin).map(|i| from[(i + row * margin.div_ceil(row) - margin) % row]).collect();
        combine(set, &weights, to, |k| {
            let (left, right) = (margin - k * shape.channels, margin + k * shape.channels);
            (&padded[left..left + row], &padded[right..right + row])
        });
    });
    let blurred = &*scratch;
    texture.par_chunks_mut(row).enumerate().for_each(|(y, to)| {
        let line = |y: usize| &blurred[y * row..(y + 1) * row];
        combine(set, &weights, to, |k| {
            let below = (y + shape.height * k.div_ceil(shape.height) - k) % shape.height;
            (line(below), line((y + k) % shape.height))
        });
    });
}

/// Sets `to` to the weighted sum of pairs of lines at distance `k` on either side.
fn combine<'a>(
    set: InstructionSet,
    weights: &[f32],
    to: &mut [f32],
    pair: impl Fn(usize) -> (&'a [f32], &'a [f32]),
) {
    to.fill(0.0);
    for (k, &weight) in weights.iter().enumerate() {
        let (a, b) = pair(k);
        // The centre is both of its neighbours.
        accumulate(set, if k == 0 { 0.5 * weight } else { weight }, a, b, to);
    }
}

#[cfg(test)]
mod tests {
    use super::*;
    use crate::random::Random;

    fn blurred(shape: TextureShape, sigma: f64, mut texture: Vec<f32>) -> Vec<f32> {
        let mut scratch = vec![0.0; shape.len()];
        blur(InstructionSet::best(), shape, sigma, &mut texture, &mut scratch);
        texture
    }

    /// A cosine over the tile is an eigenfunction, with the Fourier transform of the Gaussian as its value.
    #[test]
    fn waves_shrink_by_the_transform_of_the_gaussian() {
        let shape = TextureShape { width: 64, height: 48, channels: 2 };
        let wave = |i: usize| {
            let (x, y) = ((i / 2) % 64, i / 128);
            (std::f64::consts::TAU * (2.0 * x as f64 / 64.0 + y as f64 / 48.0)).cos()
        };
        let sigma = 4.0;
        #[allow(clippy::cast_possible_truncation, reason = "a cosine")]
        let texture = (0..shape.len()).map(|i| wave(i) as f32).collect();
        let exponent = |n: f64| 0.5 * (std::f64::consts::TAU / n * sigma).powi(2);
        let factor = (-exponent(32.0) - exponent(48.0)).exp();
        for (i, value) in blurred(shape, sigma, texture).into_iter().enumerate() {
            // The tails beyond three sigma hold 0.3 % in each direction.
            assert!((f64::from(value) - factor * wave(i)).abs() < 6e-3, "{i}: {value} {}", factor * wave(i));
        }
    }

    /// Textures smaller than the filter wrap around several times: the mean stays, and the filter is its own transpose.
    #[test]
    fn small_textures_keep_their_mean_and_symmetry() {
        let shape = TextureShape { width: 5, height: 3, channels: 1 };
        let mut random = Random::new(1, 0, 0);
        let (a, b): (Vec<f32>, Vec<f32>) =
            ((0..15).map(|_| random.signed()).collect(), (0..15).map(|_| random.signed()).collect());
        let dot = |a: &[f32], b: &[f32]| a.iter().zip(b).map(|(a, b)| a * b).sum::<f32>();
        let (blurred_a, blurred_b) = (blurred(shape, 8.0, a.clone()), blurred(shape, 8.0, b.clone()));
        assert!((blurred_a.iter().sum::<f32>() - a.iter().sum::<f32>()).abs() < 1e-5);
        assert!((dot(&blurred_a, &b) - dot(&a, &blurred_b)).abs() < 1e-5);
    }
}

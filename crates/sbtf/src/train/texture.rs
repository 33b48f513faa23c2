//! Gradients of fetched features, gathered into the gradient of a texture in an order that no thread can change.

use rayon::prelude::*;

use super::kernels::{InstructionSet, ROW, Tap, add_footprints};
use crate::model::TextureShape;

/// Bands of texel rows that gradients are gathered in, each by one thread.
const BANDS: usize = 16;

/// Gradients of fetched features on their way to the texture, from one shard.
#[derive(Debug, Clone, Default)]
pub(crate) struct Footprints {
    taps: Vec<Tap>,
    /// One gradient per channel, tap by tap.
    gradients: Vec<f32>,
    /// For each band, the taps that touch it, in their order.
    bands: Vec<Vec<u32>>,
    /// The band of each texel row.
    band_of_row: Vec<usize>,
}

/// Texel rows in a band.
fn rows_per_band(shape: TextureShape) -> usize {
    shape.height.div_ceil(BANDS)
}

impl Footprints {
    pub(crate) fn clear(&mut self, shape: TextureShape) {
        self.taps.clear();
        self.gradients.clear();
        self.bands.resize(BANDS, Vec::new());
        self.bands.iter_mut().for_each(Vec::clear);
        self.band_of_row.clear();
        self.band_of_row.extend((0..shape.height).map(|row| row / rows_per_band(shape)));
    }

    /// Adds taps, whose gradients stand in one row per channel.
    #[allow(clippy::cast_possible_truncation, reason = "a shard has a few thousand taps")]
    pub(crate) fn extend(&mut self, shape: TextureShape, taps: &[Tap], rows: &[f32]) {
        let first = self.taps.len();
        self.taps.extend_from_slice(taps);
        self.gradients.resize(self.taps.len() * shape.channels, 0.0);
        let gradients = &mut self.gradients[first * shape.channels..];
        for (channel, row) in rows.chunks(ROW).take(shape.channels).enumerate() {
            let of_channel = gradients[channel..].iter_mut().step_by(shape.channels);
            of_channel.zip(row).for_each(|(to, &from)| *to = from);
        }
        for (index, tap) in (first as u32..).zip(taps) {
            let row = tap.row as usize;
            let next = if row + 1 == shape.height { 0 } else { row + 1 };
            let (band, other) = (self.band_of_row[row], self.band_of_row[next]);
            self.bands[band].push(index);
            if other != band {
                self.bands[other].push(index);
            }
        }
    }
}

/// Sets `gradient` to the sum of all footprints. The order of the sums depends on the shards, not on the threads.
pub(crate) fn gather(set: InstructionSet, shape: TextureShape, shards: &[&Footprints], gradient: &mut [f32]) {
    let length = rows_per_band(shape) * shape.width * shape.channels;
    gradient.par_chunks_mut(length).enumerate().for_each(|(band, texels)| {
        texels.fill(0.0);
        for shard in shards {
            add_footprints(
                set,
                shape,
                &shard.bands[band],
                &shard.taps,
                &shard.gradients,
                band * length,
                texels,
            );
        }
    });
}

#[cfg(test)]
mod tests {
    use super::*;
    use crate::random::Random;
    use crate::train::kernels::{BLOCK, fetch};

    /// A fetch is linear in the texels, so that the gathered gradient is its transpose: `<g, fetch(t)> = <gather(g), t>`.
    #[test]
    fn gathering_is_the_transpose_of_fetching() {
        let mut random = Random::new(3, 0, 0);
        for shape in [TextureShape { width: 5, height: 3, channels: 8 }, TextureShape::square(40, 3)] {
            let texels: Vec<f32> = (0..shape.len()).map(|_| random.signed()).collect();
            let mut shards = vec![Footprints::default(); 3];
            let mut fetched = 0.0_f64;
            for (index, shard) in shards.iter_mut().enumerate() {
                shard.clear(shape);
                let sets: Vec<_> = InstructionSet::present().collect();
                let set = sets[index % sets.len()];
                let uv = [0; 2].map(|_| [0; BLOCK].map(|_| 3.0 * random.signed()));
                let (mut taps, mut rows) = ([Tap::default(); BLOCK], vec![0.0; shape.channels * ROW]);
                fetch(set, &texels, shape, &uv, &mut taps, &mut rows);
                let gradients: Vec<f32> = rows.iter().map(|_| random.signed()).collect();
                for (row, gradient) in rows.chunks(ROW).zip(gradients.chunks(ROW)) {
                    let products = row.iter().zip(gradient).take(BLOCK).map(|(a, b)| f64::from(a * b));
                    fetched += products.sum::<f64>();
                }
                shard.extend(shape, &taps, &gradients);
            }
            let mut gathered = vec![f32::NAN; shape.len()];
            gather(InstructionSet::best(), shape, &shards.iter().collect::<Vec<_>>(), &mut gathered);
            let product: f64 = gathered.iter().zip(&texels).map(|(a, b)| f64::from(a * b)).sum();
            // 768 taps of a few terms of order 1, each rounded to 2^-24.
            assert!((product - fetched).abs() < 1e-3, "{product} {fetched}");
        }
    }

    /// Fetches agree with the definition of a bilinear, repeated grid, in every instruction set.
    #[test]
    fn fetches_are_bilinear_and_repeat() {
        let shape = TextureShape { width: 6, height: 4, channels: 8 };
        let mut random = Random::new(5, 0, 0);
        let texels: Vec<f32> = (0..shape.len()).map(|_| random.signed()).collect();
        let uv = [0; 2].map(|_| [0; BLOCK].map(|_| 2.0 * random.signed()));
        for set in InstructionSet::present() {
            let (mut taps, mut rows) = ([Tap::default(); BLOCK], vec![0.0; 8 * ROW]);
            fetch(set, &texels, shape, &uv, &mut taps, &mut rows);
            for channel in 0..8 {
                let values = texels[channel..].iter().step_by(8).copied().collect();
                let grid = crate::micro::Grid::new(6, 4, values);
                for sample in 0..BLOCK {
                    let expected = grid.lookup(glam::Vec2::new(uv[0][sample], uv[1][sample]));
                    let value = rows[channel * ROW + sample];
                    assert!((value - expected).abs() < 1e-5, "{set:?}: {value} {expected}");
                }
            }
        }
    }

    #[test]
    fn slopes_are_differences_of_fetches() {
        let shape = TextureShape { width: 6, height: 4, channels: 4 };
        let mut random = Random::new(4, 0, 0);
        let texels: Vec<f32> = (0..shape.len()).map(|_| random.signed()).collect();
        let gradient = [0.3, -1.0, 0.5, 2.0];
        let value = |u: f32, v: f32| {
            let (mut taps, mut rows) = ([Tap::default(); BLOCK], vec![0.0; 4 * ROW]);
            let uv = [[u; BLOCK], [v; BLOCK]];
            fetch(InstructionSet::best(), &texels, shape, &uv, &mut taps, &mut rows);
            (0..4).map(|c| gradient[c] * rows[c * ROW]).sum::<f32>()
        };
        // Inside one texel, and across the seam of the tile; features are bilinear there, differences exact.
        for (u, v) in [(0.37, 0.81), (0.99, 0.005)] {
            let [du, dv] = Tap::new(shape, u, v).slope(&texels, shape, &gradient);
            let h = 1e-3;
            let by_u = (value(u + h, v) - value(u - h, v)) / (2.0 * h);
            let by_v = (value(u, v + h) - value(u, v - h)) / (2.0 * h);
            assert!((du - by_u).abs() < 2e-3 * (1.0 + du.abs()), "{du} {by_u}");
            assert!((dv - by_v).abs() < 2e-3 * (1.0 + dv.abs()), "{dv} {by_v}");
        }
    }
}

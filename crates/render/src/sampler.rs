//! Sample points: Owen-scrambled Sobol sequences, padded to any number of dimensions.

use serde::{Deserialize, Serialize};

/// Which points the integrator uses.
#[derive(Debug, Clone, Copy, PartialEq, Eq, Default, Serialize, Deserialize)]
#[serde(rename_all = "snake_case")]
pub enum SamplerKind {
    /// Hash-based Owen-scrambled Sobol points (Burley, "Practical Hash-based Owen Scrambling", JCGT 2020).
    #[default]
    Sobol,
    /// Independent uniform numbers: noisier, but each sample's variance is the mean's times the count, which z-tests need.
    Independent,
}

/// The numbers for one sample of one pixel. They depend on the seed, the pixel, and the sample's index only.
#[derive(Debug, Clone)]
pub(crate) struct Sampler {
    kind: SamplerKind,
    hash: u64,
    index: u32,
    dimension: u64,
}

impl Sampler {
    /// `stream` numbers independent sequences, such as pixels and replicates.
    pub(crate) fn new(kind: SamplerKind, seed: u64, stream: u64, index: u32) -> Self {
        Self { kind, hash: mix(seed ^ mix(stream)), index, dimension: 0 }
    }

    /// Continues at a fixed dimension, so that what is drawn there does not depend on what was drawn before.
    pub(crate) fn seek(&mut self, dimension: u64) {
        self.dimension = dimension;
    }

    /// The next number in `[0, 1)`.
    pub(crate) fn next_1d(&mut self) -> f32 {
        let hash = self.next_hash();
        match self.kind {
            SamplerKind::Sobol => {
                let index = owen_scramble(self.index, low(hash));
                unit(owen_scramble(index.reverse_bits(), high(hash)))
            }
            SamplerKind::Independent => unit(high(mix(hash ^ u64::from(self.index)))),
        }
    }

    /// The next two numbers in `[0, 1)`, together a (0, 2)-sequence over the sample index.
    // Outlined: inlined into loops, it made what an effect costs those that do without it depend on the compiler's registers.
    #[inline(never)]
    pub(crate) fn next_2d(&mut self) -> [f32; 2] {
        let hash = self.next_hash();
        match self.kind {
            SamplerKind::Sobol => {
                let index = owen_scramble(self.index, low(hash));
                let second = high(hash.wrapping_mul(0xD6E8_FEB8_6659_FD93));
                [
                    unit(owen_scramble(index.reverse_bits(), high(hash))),
                    unit(owen_scramble(sobol_second(index), second)),
                ]
            }
            SamplerKind::Independent => {
                let bits = mix(hash ^ u64::from(self.index));
                [unit(high(bits)), unit(low(bits))]
            }
        }
    }

    fn next_hash(&mut self) -> u64 {
        self.dimension += 1;
        mix(self.hash.wrapping_add(self.dimension.wrapping_mul(0x9E37_79B9_7F4A_7C15)))
    }
}

/// The finaliser of `SplitMix64`.
fn mix(mut z: u64) -> u64 {
    z = z.wrapping_add(0x9E37_79B9_7F4A_7C15);
    z = (z ^ (z >> 30)).wrapping_mul(0xBF58_476D_1CE4_E5B9);
    z = (z ^ (z >> 27)).wrapping_mul(0x94D0_49BB_1331_11EB);
    z ^ (z >> 31)
}

#[allow(clippy::cast_possible_truncation, reason = "takes the lower half")]
fn low(x: u64) -> u32 {
    x as u32
}

fn high(x: u64) -> u32 {
    low(x >> 32)
}

/// The upper 24 bits as a number in `[0, 1)`.
fn unit(bits: u32) -> f32 {
    (bits >> 8) as f32 * (1.0 / 16_777_216.0)
}

/// A nested uniform scramble of the bits from the highest down (Laine and Karras's hash, Burley's constants).
fn owen_scramble(x: u32, seed: u32) -> u32 {
    let mut x = x.reverse_bits();
    x = x.wrapping_add(seed);
    x ^= x.wrapping_mul(0x6C50_B47C);
    x ^= x.wrapping_mul(0xB82F_1E52);
    x ^= x.wrapping_mul(0xC7AF_E638);
    x ^= x.wrapping_mul(0x8D22_F6E6);
    x.reverse_bits()
}

/// The second Sobol dimension.
///
/// Its direction numbers, bit-reversed, are the powers of `1 + x` mod 2, so the index as a polynomial `p(x)` becomes
/// `p(1 + x)`. As `(1 + x)^(2^k) = 1 + x^(2^k)`, halving the polynomial does that in five steps instead of 32.
fn sobol_second(index: u32) -> u32 {
    let mut x = index;
    x ^= x >> 16;
    x ^= (x >> 8) & 0x00FF_00FF;
    x ^= (x >> 4) & 0x0F0F_0F0F;
    x ^= (x >> 2) & 0x3333_3333;
    x ^= (x >> 1) & 0x5555_5555;
    x.reverse_bits()
}

#[cfg(test)]
mod tests {
    use super::*;

    /// Every elementary interval of area 2^-m holds one of the first 2^m points.
    #[test]
    fn pairs_are_a_zero_two_sequence() {
        for stream in 0..5 {
            let points: Vec<[f32; 2]> =
                (0..64).map(|i| Sampler::new(SamplerKind::Sobol, 7, stream, i).next_2d()).collect();
            for columns in [1_u8, 2, 4, 8, 16, 32, 64] {
                let rows = 64 / columns;
                let mut count = vec![0; 64];
                for [x, y] in &points {
                    let cell =
                        (x * f32::from(columns)).floor() * f32::from(rows) + (y * f32::from(rows)).floor();
                    let index = (0..64_u8).position(|i| f32::from(i) == cell).expect("inside the square");
                    count[index] += 1;
                }
                assert_eq!(count, vec![1; 64], "stream {stream}, {columns} columns");
            }
        }
    }

    #[test]
    fn all_bits_of_the_seed_count() {
        let first = |seed| Sampler::new(SamplerKind::Sobol, seed, 3, 5).next_2d();
        for bit in 0..64 {
            assert_ne!(first(0), first(1 << bit), "bit {bit}");
        }
    }
}

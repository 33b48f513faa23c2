//! [`Random`]: uniform numbers that depend on a seed and a place only, whatever thread draws them.

/// A sequence of numbers. Equal arguments of [`Self::new`] give equal sequences, different ones independent ones.
#[derive(Debug, Clone)]
pub struct Random {
    state: u64,
}

impl Random {
    /// The sequence of element `index` in a stream. All bits of the three numbers count.
    #[must_use]
    #[inline]
    pub fn new(seed: u64, stream: u64, index: u64) -> Self {
        Self { state: mix(mix(mix(seed) ^ stream) ^ index) }
    }

    /// The next 64 bits (`SplitMix64`: Steele, Lea, Flood, "Fast splittable pseudorandom number generators", OOPSLA 2014).
    #[inline]
    pub fn bits(&mut self) -> u64 {
        let bits = mix(self.state);
        self.state = self.state.wrapping_add(0x9E37_79B9_7F4A_7C15);
        bits
    }

    /// The next number, uniform in `[0, 1)`, a multiple of 2^-24.
    #[inline]
    pub fn unit(&mut self) -> f32 {
        (self.bits() >> 40) as f32 * (1.0 / 16_777_216.0)
    }

    /// The next number, uniform in `[-1, 1)`.
    #[inline]
    pub fn signed(&mut self) -> f32 {
        2.0 * self.unit() - 1.0
    }
}

/// The step and the finaliser of `SplitMix64`.
#[inline]
fn mix(z: u64) -> u64 {
    let z = z.wrapping_add(0x9E37_79B9_7F4A_7C15);
    let z = (z ^ (z >> 30)).wrapping_mul(0xBF58_476D_1CE4_E5B9);
    let z = (z ^ (z >> 27)).wrapping_mul(0x94D0_49BB_1331_11EB);
    z ^ (z >> 31)
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn all_bits_of_seed_stream_and_index_count() {
        let first = |seed, stream, index| Random::new(seed, stream, index).bits();
        for bit in 0..64 {
            let one = 1_u64 << bit;
            assert!(first(0, 0, 0) != first(one, 0, 0), "bit {bit} of the seed");
            assert!(first(0, 0, 0) != first(0, one, 0), "bit {bit} of the stream");
            assert!(first(0, 0, 0) != first(0, 0, one), "bit {bit} of the index");
        }
    }

    #[test]
    fn numbers_are_uniform() {
        let mut observed = vec![0.0; 64];
        let count = 64_000_u32;
        for i in 0..u64::from(count / 4) {
            let mut random = Random::new(3, 7, i);
            for _ in 0..4 {
                let x = f64::from(random.unit());
                let index = (0..64_usize).rfind(|&c| c as f64 / 64.0 <= x).expect("at least 0");
                observed[index] += 1.0;
            }
        }
        let expected = vec![f64::from(count) / 64.0; 64];
        let p = crate::chi_square::p_value(&observed, &expected);
        assert!(p > 1e-4, "{p}");
    }
}

//! Random numbers that stay the same in every version and on every machine.

use std::f64::consts::TAU;

/// `SplitMix64` (Steele, Lea and Flood, Fast splittable pseudorandom number generators, OOPSLA 2014).
#[derive(Debug, Clone)]
pub(super) struct Random(u64);

impl Random {
    pub(super) fn new(seed: u64) -> Self {
        Self(seed)
    }

    fn next(&mut self) -> u64 {
        self.0 = self.0.wrapping_add(0x9E37_79B9_7F4A_7C15);
        let mut z = self.0;
        z = (z ^ (z >> 30)).wrapping_mul(0xBF58_476D_1CE4_E5B9);
        z = (z ^ (z >> 27)).wrapping_mul(0x94D0_49BB_1331_11EB);
        z ^ (z >> 31)
    }

    /// Uniform in `[0, 1)`.
    pub(super) fn unit(&mut self) -> f64 {
        // The upper 53 bits, as many as an f64 holds.
        (self.next() >> 11) as f64 * (1.0 / (1_u64 << 53) as f64)
    }

    /// Uniform in `[-1, 1)`.
    pub(super) fn signed(&mut self) -> f64 {
        2.0 * self.unit() - 1.0
    }

    /// Two independent numbers of the standard normal distribution (Box and Muller 1958).
    pub(super) fn gaussian_pair(&mut self) -> [f64; 2] {
        // 1 - u is in (0, 1], so the logarithm is finite.
        let radius = (-2.0 * (1.0 - self.unit()).ln()).sqrt();
        let (sin, cos) = (TAU * self.unit()).sin_cos();
        [radius * cos, radius * sin]
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn moments_are_those_of_the_distributions() {
        let mut random = Random::new(1);
        let count = 40_000;
        let uniform: Vec<f64> = (0..count).map(|_| random.unit()).collect();
        let gaussian: Vec<f64> = (0..count / 2).flat_map(|_| random.gaussian_pair()).collect();
        let moment = |x: &[f64], n: i32| x.iter().map(|x| x.powi(n)).sum::<f64>() / x.len() as f64;
        // Five standard deviations of each mean: sqrt(variance / 40,000) is 0.0014, 0.0015, 0.005, 0.007, 0.049.
        for (found, exact, within) in [
            (moment(&uniform, 1), 0.5, 0.0075),
            (moment(&uniform, 2), 1.0 / 3.0, 0.0075),
            (moment(&gaussian, 1), 0.0, 0.025),
            (moment(&gaussian, 2), 1.0, 0.036),
            (moment(&gaussian, 4), 3.0, 0.25),
        ] {
            assert!((found - exact).abs() < within, "{found} for {exact}");
        }
    }
}

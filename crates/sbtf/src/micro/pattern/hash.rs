//! Random numbers that are a function of where they are asked for.

/// 64 bits from a seed and a lattice point: two rounds of the finaliser of `SplitMix64` (Steele, Lea, Flood, "Fast Splittable
/// Pseudorandom Number Generators", OOPSLA 2014).
#[must_use]
pub fn hash(seed: u64, x: u32, y: u32) -> u64 {
    scramble(scramble(seed) ^ (u64::from(x) << 32 | u64::from(y)))
}

/// A number in `[0, 1)` from hashed bits; `channel` tells several numbers of one hash apart.
#[must_use]
pub fn unit(bits: u64, channel: u32) -> f32 {
    // 24 bits: all that an f32 below 1 can hold.
    let bits = if channel == 0 { bits } else { scramble(bits ^ u64::from(channel)) };
    (bits >> 40) as f32 / 16_777_216.0
}

/// One of the values, by hashed bits.
///
/// # Panics
///
/// If there are none.
#[must_use]
pub fn pick<T: Copy>(values: &[T], bits: u64) -> T {
    // The bits of a channel that recipes do not use for anything else.
    let share = unit(bits, 0xC0_10);
    #[allow(clippy::cast_possible_truncation, clippy::cast_sign_loss, reason = "a share of a small count")]
    let index = (share * values.len() as f32) as usize;
    values[index.min(values.len() - 1)]
}

fn scramble(x: u64) -> u64 {
    let mut z = x.wrapping_add(0x9E37_79B9_7F4A_7C15);
    z = (z ^ (z >> 30)).wrapping_mul(0xBF58_476D_1CE4_E5B9);
    z = (z ^ (z >> 27)).wrapping_mul(0x94D0_49BB_1331_11EB);
    z ^ (z >> 31)
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn numbers_are_uniform_and_neighbours_do_not_correlate() {
        let (mut sum, mut squares, mut products) = (0.0_f64, 0.0_f64, 0.0_f64);
        let n = 100;
        for x in 0..n {
            for y in 0..n {
                let value = f64::from(unit(hash(7, x, y), 0)) - 0.5;
                let neighbour = f64::from(unit(hash(7, x + 1, y), 0)) - 0.5;
                sum += value;
                squares += value * value;
                products += value * neighbour;
            }
        }
        let count = f64::from(n * n);
        // Standard errors: 0.29 / 100 for the mean, 0.075 / 100 for the variance, 1 / 100 for the correlation; four each.
        assert!((sum / count).abs() < 0.012);
        assert!((squares / count - 1.0 / 12.0).abs() < 0.003);
        assert!((products / squares).abs() < 0.04);
    }

    #[test]
    fn every_bit_of_the_seed_counts() {
        let bits = |seed| unit(hash(seed, 3, 5), 1);
        assert!((0..64).all(|bit| bits(1 << bit) != bits(0)));
        assert_ne!(unit(9, 1), unit(9, 2));
    }
}

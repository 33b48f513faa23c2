//! [`flicker`]: how unsteady a sequence of pictures is.

/// Root mean square of the second difference over time, `L[t-1] - 2 L[t] + L[t+1]`, over all pixels and all frames but the
/// first and last: zero for what stays and for what changes steadily, `4 A` for what jumps up and down by `2 A`.
///
/// `a` and `b` are the same sequence rendered with independent noise, one plane of values per frame. The product of both
/// second differences stands for the square, so that noise averages out instead of counting as flicker; where it comes
/// out negative nothing but noise was seen, and the result is 0. `None` for fewer than three frames.
///
/// # Panics
///
/// If the sequences or their planes differ in length.
#[must_use]
pub fn flicker(a: &[Vec<f32>], b: &[Vec<f32>]) -> Option<f64> {
    assert_eq!(a.len(), b.len(), "two renderings of one sequence");
    let mut sum = 0.0;
    let mut count = 0_usize;
    for (x, y) in a.windows(3).zip(b.windows(3)) {
        let pixels = x[1].len();
        assert!(x.iter().chain(y).all(|plane| plane.len() == pixels), "planes of one size");
        let second =
            |w: &[Vec<f32>], i: usize| f64::from(w[0][i]) - 2.0 * f64::from(w[1][i]) + f64::from(w[2][i]);
        sum += (0..pixels).map(|i| second(x, i) * second(y, i)).sum::<f64>();
        count += pixels;
    }
    (count > 0).then(|| (sum / count as f64).max(0.0).sqrt())
}

#[cfg(test)]
mod tests {
    use super::*;

    /// Values by pixel and frame.
    fn sequence(value: impl Fn(usize, usize) -> f32) -> Vec<Vec<f32>> {
        (0..8).map(|t| (0..4000).map(|i| value(i, t)).collect()).collect()
    }

    /// Evenly distributed with deviation 1, from a hash.
    fn noise(i: usize, t: usize, seed: u64) -> f32 {
        let mut x = (i as u64).wrapping_mul(0x9E37_79B9_7F4A_7C15) ^ ((t as u64) << 40) ^ (seed << 50);
        for _ in 0..3 {
            x = (x ^ (x >> 31)).wrapping_mul(0xD6E8_FEB8_6659_FD93);
        }
        ((x >> 40) as f32 / (1_u64 << 24) as f32 - 0.5) * 12.0_f32.sqrt()
    }

    #[test]
    fn steady_change_is_none_and_jumps_have_a_closed_form() {
        let steady = sequence(|i, t| 0.25 * i as f32 + (i % 7) as f32 * t as f32);
        assert_eq!(flicker(&steady, &steady), Some(0.0));
        let jumping = sequence(|i, t| if t % 2 == 0 { i as f32 } else { i as f32 + 0.5 });
        assert_eq!(flicker(&jumping, &jumping), Some(1.0));
        // A sine of amplitude 1 and step s has second differences of amplitude 2 (1 - cos s), whatever its phase.
        let wave = sequence(|i, t| (0.3 * t as f32 + std::f32::consts::TAU * i as f32 / 4000.0).sin());
        let exact = 2.0 * (1.0 - 0.3_f64.cos()) * 0.5_f64.sqrt();
        assert!((flicker(&wave, &wave).unwrap() - exact).abs() < 1e-5);
        assert_eq!(flicker(&steady[..2], &steady[..2]), None);
    }

    /// Noise of deviation 1 alone would be a flicker of sqrt 6. The product's deviation is 6 / sqrt(24000), so that a flicker of 2,
    /// whose square is 4, is found within 5 deviations of its square: 0.05 of its root.
    #[test]
    fn independent_noise_does_not_count() {
        let seen = |seed| sequence(move |i, t| (t % 2) as f32 + noise(i, t, seed));
        let (a, b) = (seen(1), seen(2));
        let found = flicker(&a, &b).unwrap();
        assert!((found - 2.0).abs() < 0.05, "{found}");
        let biased = flicker(&a, &a).unwrap();
        assert!((biased - 10.0_f64.sqrt()).abs() < 0.1, "{biased}");
        let nothing = flicker(&sequence(|i, t| noise(i, t, 3)), &sequence(|i, t| noise(i, t, 4))).unwrap();
        assert!(nothing < 0.5, "{nothing}");
    }
}

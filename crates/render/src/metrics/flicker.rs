//! [`flicker`]: how unsteady a sequence of pictures is, and how sure that is.

use serde::Serialize;

/// Mean square of the second difference over time, `L[t-1] - 2 L[t] + L[t+1]`, with its standard error; see [`flicker`].
#[derive(Debug, Clone, Copy, PartialEq, Serialize)]
pub struct Flicker {
    /// The mean square. Noise can make it negative where there is little flicker.
    pub square: f64,
    /// One standard deviation of what noise does to `square`.
    pub square_error: f64,
}

impl Flicker {
    /// Root mean square of the second difference: zero for what stays and for what changes steadily, `4 A` for what jumps up and down
    /// by `2 A`. 0 where the mean square is negative.
    #[must_use]
    pub fn value(self) -> f64 {
        root(self.square, self.square_error).0
    }

    /// One standard deviation of [`Self::value`].
    #[must_use]
    pub fn error(self) -> f64 {
        root(self.square, self.square_error).1
    }

    /// The ratio of the values and its standard deviation, as if noise of both were independent. `None` where the divisor's mean
    /// square is within three deviations of nothing: any ratio could be read out of it.
    #[must_use]
    pub fn ratio_to(self, divisor: Self) -> Option<(f64, f64)> {
        if divisor.square <= 3.0 * divisor.square_error || divisor.square <= 0.0 {
            return None;
        }
        let ratio = self.square / divisor.square;
        Some(root(ratio, self.square_error.hypot(ratio * divisor.square_error) / divisor.square))
    }
}

/// The root of a square and half the width of the interval that the square's becomes, which stays finite at zero.
fn root(square: f64, error: f64) -> (f64, f64) {
    let root = |x: f64| x.max(0.0).sqrt();
    (root(square), 0.5 * (root(square + error) - root(square - error)))
}

/// Flicker of a sequence over all pixels and all frames but the first and last.
///
/// `a` and `b` are the same sequence rendered with independent noise, one plane of values per frame. The product `x y` of both
/// second differences stands for the square, so that noise averages out instead of counting as flicker. What is left of it is
/// stated: with noise that is Gaussian, a pixel's sum of products over the frames has the variance that its sum of
/// `(x^2 - y^2) / 2` has in the mean, frames that share pictures included, and pixels are independent. Noise with longer tails makes
/// the stated error larger than the true one.
///
/// `None` for fewer than three frames.
///
/// # Panics
///
/// If the sequences or their planes differ in length.
#[must_use]
pub fn flicker(a: &[Vec<f32>], b: &[Vec<f32>]) -> Option<Flicker> {
    assert_eq!(a.len(), b.len(), "two renderings of one sequence");
    let pixels = a.first()?.len();
    assert!(a.iter().chain(b).all(|plane| plane.len() == pixels), "planes of one size");
    let (mut sum, mut variance) = (0.0, 0.0);
    for pixel in 0..pixels {
        let second = |w: &[Vec<f32>]| {
            let [before, here, after] = [0, 1, 2].map(|t| f64::from(w[t][pixel]));
            before - 2.0 * here + after
        };
        let (mut product, mut difference) = (0.0, 0.0);
        for (x, y) in a.windows(3).map(second).zip(b.windows(3).map(second)) {
            product += x * y;
            difference += 0.5 * (x * x - y * y);
        }
        sum += product;
        variance += difference * difference;
    }
    let count = pixels * a.len().saturating_sub(2);
    (count > 0).then(|| Flicker { square: sum / count as f64, square_error: variance.sqrt() / count as f64 })
}

#[cfg(test)]
mod tests {
    use super::*;

    const PIXELS: usize = 4000;

    /// Values by pixel and frame.
    fn sequence(value: impl Fn(usize, usize) -> f32) -> Vec<Vec<f32>> {
        (0..8).map(|t| (0..PIXELS).map(|i| value(i, t)).collect()).collect()
    }

    /// Of deviation 1, nearly Gaussian: the sum of twelve even numbers from a hash.
    fn noise(i: usize, t: usize, seed: u64) -> f32 {
        let even = |k: u64| {
            let mut x = (i as u64).wrapping_mul(0x9E37_79B9_7F4A_7C15)
                ^ ((t as u64) << 40)
                ^ (seed << 44)
                ^ (k << 60);
            for _ in 0..3 {
                x = (x ^ (x >> 31)).wrapping_mul(0xD6E8_FEB8_6659_FD93);
            }
            (x >> 40) as f32 / (1_u64 << 24) as f32 - 0.5
        };
        (0..12).map(even).sum()
    }

    #[test]
    fn steady_change_is_none_and_jumps_have_a_closed_form() {
        let steady = sequence(|i, t| 0.25 * i as f32 + (i % 7) as f32 * t as f32);
        assert_eq!(flicker(&steady, &steady), Some(Flicker { square: 0.0, square_error: 0.0 }));
        let jumping = sequence(|i, t| if t % 2 == 0 { i as f32 } else { i as f32 + 0.5 });
        let found = flicker(&jumping, &jumping).unwrap();
        assert_eq!((found.value(), found.error()), (1.0, 0.0));
        // A sine of amplitude 1 and step s has second differences of amplitude 2 (1 - cos s), whatever its phase.
        let wave = sequence(|i, t| (0.3 * t as f32 + std::f32::consts::TAU * i as f32 / PIXELS as f32).sin());
        let exact = 2.0 * (1.0 - 0.3_f64.cos()) * 0.5_f64.sqrt();
        assert!((flicker(&wave, &wave).unwrap().value() - exact).abs() < 1e-5);
        assert_eq!(flicker(&steady[..2], &steady[..2]), None);
        assert_eq!(flicker(&[], &[]), None);
    }

    /// A flicker of 2 or of nothing under noise of deviation 1, which alone would be a flicker of sqrt 6. Over 40 seeds, found squares
    /// scatter as stated: their deviation is known to 11 %, three of which are allowed; so is their mean to 0.16 deviations.
    #[test]
    fn noise_does_not_count_and_its_rest_is_stated() {
        for jump in [0.0_f32, 1.0] {
            let seen = |seed| sequence(move |i, t| jump * (t % 2) as f32 + noise(i, t, seed));
            let found: Vec<Flicker> =
                (0..40).map(|seed| flicker(&seen(2 * seed), &seen(2 * seed + 1)).unwrap()).collect();
            let off = |f: &Flicker| f.square - f64::from(4.0 * jump * jump);
            let mean = |of: &dyn Fn(&Flicker) -> f64| found.iter().map(of).sum::<f64>() / found.len() as f64;
            let stated = mean(&|f| f.square_error.powi(2)).sqrt();
            let bias = mean(&off);
            let scatter = mean(&|f| off(f).powi(2)).sqrt();
            assert!(bias.abs() < 4.0 * 0.16 * stated, "{bias}, stated {stated}");
            assert!((scatter / stated - 1.0).abs() < 0.34, "{scatter}, stated {stated}");
        }
        let seen = sequence(|i, t| (t % 2) as f32 + noise(i, t, 1));
        let biased = flicker(&seen, &seen).unwrap().value();
        assert!((biased - 10.0_f64.sqrt()).abs() < 0.1, "the same noise twice does count: {biased}");
    }

    #[test]
    fn ratios_are_of_roots_and_refused_where_noise_decides() {
        let of = |square, square_error| Flicker { square, square_error };
        let (ratio, error) = of(9.0, 0.0).ratio_to(of(4.0, 0.0)).unwrap();
        assert!((ratio - 1.5).abs() < 1e-12 && error == 0.0);
        // Squares known to 2 % and 1.5 % have a ratio known to 2.5 %, its root to half of that.
        let (ratio, error) = of(9.0, 0.18).ratio_to(of(4.0, 0.06)).unwrap();
        assert!((error / ratio - 0.0125).abs() < 1e-5, "{error}");
        assert_eq!(of(9.0, 0.1).ratio_to(of(0.2, 0.1)), None);
        assert_eq!(of(9.0, 0.1).ratio_to(of(0.0, 0.0)), None);
        // Nothing found is at most the root of what noise could hide, half of which is the error.
        assert_eq!(of(-0.5, 1.0).ratio_to(of(4.0, 0.0)), Some((0.0, 0.5 * 0.125_f64.sqrt())));
    }
}

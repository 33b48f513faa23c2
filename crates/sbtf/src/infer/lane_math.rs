//! Functions that compile to vector instructions when they are called in a loop over lanes: no branches, no calls.
//!
//! Each has its definition elsewhere and is tested against it.

use crate::model::{LARGEST_LOG, LONGEST_REACH, bounded};

/// [`azimuth`](crate::model::azimuth) of a direction with this x and y.
#[inline(always)]
pub(super) fn azimuth(x: f32, y: f32) -> [f32; 2] {
    let length = (x * x + y * y).sqrt();
    if length > 0.0 { [-x / length, -y / length] } else { [1.0, 0.0] }
}

/// [`Architecture::opacity_reach`](crate::model::Architecture::opacity_reach), to a relative error of 3e-7.
#[inline(always)]
pub(super) fn opacity_reach(kappa: f32, depth: f32) -> f32 {
    // acos(1 - x) / sqrt(2 x) on [0, 1], fitted in Chebyshev nodes; off by 1.6e-8.
    const ARC: [f32; 8] = [
        1.0,
        0.083_334_97,
        0.018_717_123,
        0.005_829_509_3,
        0.000_989_266_9,
        0.002_444_651,
        -0.001_469_489_2,
        0.000_874_703_65,
    ];
    let x = bounded(kappa * depth, 0.0, 1.0);
    let ratio = polynomial(&ARC, x);
    let angle = (2.0 * x).sqrt() * ratio;
    if angle < kappa * LONGEST_REACH { angle / kappa } else { LONGEST_REACH }
}

/// `exp(x) - 1` with `x` clamped to `[0, LARGEST_LOG]`, to a relative error of 3e-7; 0 for NaN.
#[inline(always)]
#[allow(clippy::cast_possible_truncation, clippy::cast_sign_loss, reason = "between 0 and 127")]
pub(super) fn exp_less_one(x: f32) -> f32 {
    // ln 2 in two parts; the products with the first are exact.
    const LN_2: [f32; 2] = [0.693_359_4, -2.121_944_4e-4];
    let x = bounded(x, 0.0, LARGEST_LOG);
    let n = (x * std::f32::consts::LOG2_E + 0.5).floor();
    let r = (x - n * LN_2[0]) - n * LN_2[1];
    // exp(r) - 1 for |r| <= ln 2 / 2 by its series: the first term left out is 2e-8 of the sum.
    const SERIES: [f32; 7] = [1.0, 0.5, 1.0 / 6.0, 1.0 / 24.0, 1.0 / 120.0, 1.0 / 720.0, 1.0 / 5040.0];
    let part = r * polynomial(&SERIES, r);
    let power = f32::from_bits(((n as i32 + 127) as u32) << 23);
    power * part + (power - 1.0)
}

/// A polynomial with these coefficients, the constant first. Iterators would not be inlined into functions compiled for other
/// instructions.
#[inline(always)]
fn polynomial<const N: usize>(coefficients: &[f32; N], x: f32) -> f32 {
    let mut sum = coefficients[N - 1];
    let mut k = N - 1;
    while k > 0 {
        k -= 1;
        sum = sum * x + coefficients[k];
    }
    sum
}

/// A function of every lane. Not `array::map`, which is not inlined into functions compiled for other instructions.
#[inline(always)]
pub(super) fn per_lane<const N: usize>(row: &[f32; N], f: impl Fn(f32) -> f32) -> [f32; N] {
    let mut result = [0.0; N];
    for k in 0..N {
        result[k] = f(row[k]);
    }
    result
}

#[cfg(test)]
mod tests {
    use super::*;
    use crate::model::{self, Architecture};
    use glam::Vec3;

    fn relative(a: f32, b: f32) -> f32 {
        (a - b).abs() / b.abs().max(f32::MIN_POSITIVE)
    }

    #[test]
    #[allow(clippy::cast_possible_truncation, reason = "rounded on purpose")]
    fn they_agree_with_their_definitions() {
        for i in 0..=20_000 {
            let t = i as f32 / 20_000.0;
            let x = t * t * 88.0;
            let want = f64::from(x).exp_m1() as f32;
            assert!(relative(exp_less_one(x), want) < 3e-7, "{x}: {} {want}", exp_less_one(x));
            let (kappa, depth) = (t * t * t * 12.0 - 1.0, 0.1);
            let want = Architecture::paper(depth).opacity_reach(kappa);
            assert!(relative(opacity_reach(kappa, depth), want) < 4e-7, "{kappa}");
            let (x, y) = ((t * 9.0).sin() * t, (t * 7.0).cos() * t);
            let want = model::azimuth(Vec3::new(x, y, 0.5));
            let [a, b] = azimuth(x, y);
            assert!((a - want.x).abs() < 2e-7 && (b - want.y).abs() < 2e-7);
        }
    }

    #[test]
    fn odd_numbers_stay_finite() {
        assert_eq!(exp_less_one(f32::NAN), 0.0);
        assert_eq!(exp_less_one(-3.0), 0.0);
        assert!(exp_less_one(f32::INFINITY).is_finite());
        assert_eq!(opacity_reach(f32::NAN, 0.1), LONGEST_REACH);
        assert_eq!(opacity_reach(0.0, 0.1), LONGEST_REACH);
        assert_eq!(azimuth(0.0, 0.0), [1.0, 0.0]);
    }
}

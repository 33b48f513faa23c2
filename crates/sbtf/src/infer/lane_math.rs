//! Functions that compile to vector instructions when they are called in a loop over lanes: no branches, no calls.
//!
//! Each has its definition elsewhere and is tested against it.

use crate::model::{LARGEST_LOG, LONGEST_REACH, bounded};

/// The largest number that [`small_integer`] takes.
pub(super) const LARGEST_INTEGER: u32 = 1 << 22;

/// A whole number of at most [`LARGEST_INTEGER`] in size as an integer. `as` saturates, which compilers do lane by lane.
#[inline(always)]
#[allow(clippy::cast_possible_wrap, reason = "bits of numbers around 1.5 * 2^23")]
pub(super) fn small_integer(x: f32) -> i32 {
    // From 2^23 to 2^24 the last bit of a number stands for 1.
    const ZERO: f32 = 12_582_912.0;
    (x + ZERO).to_bits() as i32 - ZERO.to_bits() as i32
}

/// [`inside_tile`](crate::model::inside_tile) by the same operations: NaN and infinities have no part below 1 and compare as false.
#[inline(always)]
pub(super) fn inside_tile(x: f32) -> f32 {
    let inside = x - x.floor();
    if inside > 0.0 { inside } else { 0.0 }
}

/// [`azimuth`](crate::model::azimuth) of a direction with this x and y.
#[inline(always)]
pub(super) fn azimuth(x: f32, y: f32) -> [f32; 2] {
    let length = (x * x + y * y).sqrt();
    // Compilers make a branch of a division that is not always needed, and lanes cannot branch.
    let (divisor, upright) = if length > 0.0 { (length, 0.0) } else { (1.0, 1.0) };
    let along = [upright - x / divisor, 0.0 - y / divisor];
    if length > 0.0 { along } else { [1.0, 0.0] }
}

/// The length of [`Way::Graze`](crate::model::Way::Graze), to a relative error of 3e-7.
#[inline(always)]
pub(super) fn graze(kappa: f32, depth: f32) -> f32 {
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

/// The length of [`Way::Descend`](crate::model::Way::Descend), by the same operations.
#[inline(always)]
pub(super) fn descend([x, y, z]: [f32; 3], kappa: f32, depth: f32) -> f32 {
    let (sine, cosine) = ((x * x + y * y).sqrt(), z.max(f32::MIN_POSITIVE));
    let flat = (depth * sine / cosine).min(LONGEST_REACH);
    if kappa > 0.0 { flat.min(2.0 * cosine * sine / kappa) } else { flat }
}

/// The length of [`Way::Through`](crate::model::Way::Through), to a relative error of 6e-7. Which end of the layer the ray leaves
/// by is decided by the same operations, since the way is twice as long where it passes just above the floor.
#[inline(always)]
pub(super) fn through([x, y, z]: [f32; 3], kappa: f32, depth: f32) -> f32 {
    let (sine, cosine) = ((x * x + y * y).sqrt(), z.max(f32::MIN_POSITIVE));
    let x = (kappa * depth).min(1.0);
    let square = cosine * cosine - x * (2.0 - x);
    let to_floor = square >= 0.0;
    // Tangent of the angle of the way as seen from the axis, of half of it where the ray comes back up; and the tangent over
    // the curvature.
    let length = depth * (2.0 - x) / (cosine + square.max(0.0).sqrt());
    let floor = length * sine / (1.0 - kappa * length * cosine).max(f32::MIN_POSITIVE);
    let half = cosine / sine.max(f32::MIN_POSITIVE);
    let tangent = if to_floor { kappa * floor } else { half };
    let arc = if to_floor { floor } else { 2.0 * half / kappa };
    // atan(y) / y is atan(1 / y) taken from a right angle beyond 1.
    let size = tangent.abs();
    let inverse = 1.0 / size.max(1.0);
    let near = arc_ratio(size.min(1.0));
    let far = (std::f32::consts::FRAC_PI_2 - inverse * arc_ratio(inverse)) * inverse;
    bounded(arc * if size <= 1.0 { near } else { far }, 0.0, LONGEST_REACH)
}

/// `atan(x) / x` on `[0, 1]`, fitted in Chebyshev nodes of the square; off by 2.5e-8.
#[inline(always)]
fn arc_ratio(x: f32) -> f32 {
    const ARC: [f32; 10] = [
        1.0,
        -0.333_333_3,
        0.199_997_4,
        -0.142_785_68,
        0.110_337_645,
        -0.086_568_8,
        0.062_501_69,
        -0.035_871_54,
        0.013_507_771,
        -0.002_386_997_2,
    ];
    polynomial(&ARC, x * x)
}

/// `exp(x) - 1` with `x` clamped to `[0, LARGEST_LOG]`, to a relative error of 3e-7; 0 for NaN.
#[inline(always)]
#[allow(clippy::cast_sign_loss, reason = "between 0 and 127")]
pub(super) fn exp_less_one(x: f32) -> f32 {
    // ln 2 in two parts; the products with the first are exact.
    const LN_2: [f32; 2] = [0.693_359_4, -2.121_944_4e-4];
    let x = bounded(x, 0.0, LARGEST_LOG);
    let n = (x * std::f32::consts::LOG2_E + 0.5).floor();
    let r = (x - n * LN_2[0]) - n * LN_2[1];
    // exp(r) - 1 for |r| <= ln 2 / 2 by its series: the first term left out is 2e-8 of the sum.
    const SERIES: [f32; 7] = [1.0, 0.5, 1.0 / 6.0, 1.0 / 24.0, 1.0 / 120.0, 1.0 / 720.0, 1.0 / 5040.0];
    let part = r * polynomial(&SERIES, r);
    let power = f32::from_bits(((small_integer(n) + 127) as u32) << 23);
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
    use crate::model::{self, Architecture, Way};
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
            let length = |way, wo| Architecture::paper(depth).way_length(way, wo, kappa);
            assert!(relative(graze(kappa, depth), length(Way::Graze, Vec3::Z)) < 4e-7, "{kappa}");
            let (x, y) = ((t * 9.0).sin() * t, (t * 7.0).cos() * t);
            let want = model::azimuth(Vec3::new(x, y, 0.5));
            let [a, b] = azimuth(x, y);
            assert!((a - want.x).abs() < 2e-7 && (b - want.y).abs() < 2e-7);
            let cosine = (i as f32 * 0.618_034).fract();
            let wo = Vec3::new(0.6, 0.8, 0.0) * (1.0 - cosine * cosine).sqrt() + Vec3::new(0.0, 0.0, cosine);
            let far = (t - 0.5) * 4e6 * t;
            assert_eq!(inside_tile(far), model::inside_tile(far), "{far}");
            assert_eq!(descend(wo.to_array(), kappa, depth), length(Way::Descend, wo));
            let (found, want) = (through(wo.to_array(), kappa, depth), length(Way::Through, wo));
            assert!(relative(found, want) < 6e-7, "{kappa} {cosine}: {found} {want}");
        }
    }

    #[test]
    fn odd_numbers_stay_finite() {
        assert_eq!(exp_less_one(f32::NAN), 0.0);
        assert_eq!(exp_less_one(-3.0), 0.0);
        assert!(exp_less_one(f32::INFINITY).is_finite());
        assert_eq!(graze(f32::NAN, 0.1), LONGEST_REACH);
        assert_eq!(graze(0.0, 0.1), LONGEST_REACH);
        for kappa in [-1e9, -1.0, 0.0, 1e-30, 1.0, 1e9, f32::NAN] {
            for wo in [[0.0, 0.0, 1.0], [1.0, 0.0, 0.0], [0.0; 3], [1.0, 0.0, -1.0], [f32::NAN; 3]] {
                let length = through(wo, kappa, 0.1);
                assert!((0.0..=LONGEST_REACH).contains(&length), "{kappa} {wo:?}: {length}");
            }
        }
        assert_eq!(azimuth(0.0, 0.0), [1.0, 0.0]);
        for x in [f32::NAN, f32::INFINITY, f32::NEG_INFINITY, -0.0, -1e-9, f32::MAX, 1.0, -1.0, -1e-45] {
            assert_eq!(inside_tile(x).to_bits(), model::inside_tile(x).to_bits(), "{x}");
        }
    }
}

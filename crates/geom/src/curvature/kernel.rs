//! The accumulation loop of the fits: portable, and with AVX-512 intrinsics.
//!
//! Both do the same operations in the same order, without fused multiply-add, so they give the same bits. The 21 running
//! sums of eight lanes and the frame just fill the 32 registers of AVX-512; a fit on five rings takes about 0.6 of the time
//! that it takes with the portable copy alone.

use super::moments::{LANES, SUMS};
use super::shape_operator::Frame;
use crate::Vec3;

/// Lane-wise sums of all moments of the points `[x, y, z, weight]` in the frame; point `i` goes to lane `i % LANES`.
pub(super) fn accumulate(points: [&[f64]; 4], frame: &Frame) -> [[f64; LANES]; SUMS] {
    #[cfg(target_arch = "x86_64")]
    if std::arch::is_x86_feature_detected!("avx512f") {
        #[allow(unsafe_code, reason = "calling a function compiled for AVX-512 requires it")]
        // SAFETY: the processor has AVX-512F, as was just checked.
        return unsafe { avx512::accumulate(points, frame) };
    }
    accumulate_portable(points, frame)
}

fn accumulate_portable(points: [&[f64]; 4], frame: &Frame) -> [[f64; LANES]; SUMS] {
    type Lane = [f64; LANES];
    let mul = |a: Lane, b: Lane| -> Lane { std::array::from_fn(|i| a[i] * b[i]) };
    let mut sums = [[0.0; LANES]; SUMS];
    for start in (0..points[0].len()).step_by(LANES) {
        let [x, y, z, w] = points.map(|row| {
            let mut lane = [0.0; LANES];
            let end = row.len().min(start + LANES);
            lane[..end - start].copy_from_slice(&row[start..end]);
            lane
        });
        let dot =
            |axis: &Vec3| -> Lane { std::array::from_fn(|i| x[i] * axis.x + y[i] * axis.y + z[i] * axis.z) };
        let (u, v, h) = (dot(&frame.t), dot(&frame.s), dot(&frame.n));
        for (sum, term) in sums.iter_mut().zip(moments(u, v, h, w, mul)) {
            for lane in 0..LANES {
                sum[lane] += term[lane];
            }
        }
    }
    sums
}

/// All terms of one group of points, in the order of [`Moments`](super::moments::Moments).
#[inline(always)]
pub(super) fn moments<T: Copy>(u: T, v: T, h: T, w: T, mul: impl Fn(T, T) -> T) -> [T; SUMS] {
    let (wu, wv) = (mul(w, u), mul(w, v));
    let (wu2, wuv, wv2) = (mul(wu, u), mul(wu, v), mul(wv, v));
    let (wu3, wu2v, wuv2, wv3) = (mul(wu2, u), mul(wu2, v), mul(wv2, u), mul(wv2, v));
    [
        mul(wu3, u),
        mul(wu3, v),
        mul(wu2v, v),
        mul(wv3, u),
        mul(wv3, v),
        wu3,
        wu2v,
        wuv2,
        wv3,
        wu2,
        wuv,
        wv2,
        mul(wu2, h),
        mul(wuv, h),
        mul(wv2, h),
        mul(wu, h),
        mul(wv, h),
        mul(mul(w, h), h),
        w,
        wu,
        wv,
    ]
}

#[cfg(target_arch = "x86_64")]
mod avx512 {
    use std::arch::x86_64::{
        __m512d, _mm512_add_pd, _mm512_maskz_loadu_pd, _mm512_mul_pd, _mm512_set1_pd, _mm512_setzero_pd,
        _mm512_storeu_pd,
    };

    use super::{Frame, LANES, SUMS, moments};

    #[target_feature(enable = "avx512f")]
    #[allow(unsafe_code, reason = "masked loads and stores take pointers")]
    pub(super) fn accumulate(points: [&[f64]; 4], frame: &Frame) -> [[f64; LANES]; SUMS] {
        let count = points[0].len();
        assert!(points.iter().all(|row| row.len() == count), "four rows of one length");
        let axes = [&frame.t, &frame.s, &frame.n].map(|a| [a.x, a.y, a.z].map(|c| _mm512_set1_pd(c)));
        let mut sums = [_mm512_setzero_pd(); SUMS];
        for start in (0..count).step_by(LANES) {
            let mask = if count - start < LANES { (1_u8 << (count - start)) - 1 } else { u8::MAX };
            // SAFETY: the mask selects lanes below `count` only, and all rows have that length.
            let [x, y, z, w] =
                points.map(|row| unsafe { _mm512_maskz_loadu_pd(mask, row.as_ptr().add(start)) });
            let dot = |axis: &[__m512d; 3]| {
                let xy = _mm512_add_pd(_mm512_mul_pd(x, axis[0]), _mm512_mul_pd(y, axis[1]));
                _mm512_add_pd(xy, _mm512_mul_pd(z, axis[2]))
            };
            let (u, v, h) = (dot(&axes[0]), dot(&axes[1]), dot(&axes[2]));
            let terms = moments(u, v, h, w, |a, b| _mm512_mul_pd(a, b));
            for (sum, term) in sums.iter_mut().zip(terms) {
                *sum = _mm512_add_pd(*sum, term);
            }
        }
        let mut lanes = [[0.0; LANES]; SUMS];
        for (lane, sum) in lanes.iter_mut().zip(sums) {
            // SAFETY: a lane array holds exactly one register.
            unsafe { _mm512_storeu_pd(lane.as_mut_ptr(), sum) };
        }
        lanes
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn instruction_sets_give_the_same_bits() {
        let frame = Frame::around(Vec3::new(0.3, -0.5, 0.8).normalize());
        let mut rows: [Vec<f64>; 4] = Default::default();
        for i in 0..37 {
            let t = f64::from(i);
            let point = [t.sin(), (1.7 * t).cos(), (0.3 * t).sin() * 0.2, 1.0 / (1.0 + t)];
            for (row, value) in rows.iter_mut().zip(point) {
                row.push(value);
            }
            let points = rows.each_ref().map(Vec::as_slice);
            assert_eq!(accumulate(points, &frame), accumulate_portable(points, &frame), "{i}");
        }
    }
}

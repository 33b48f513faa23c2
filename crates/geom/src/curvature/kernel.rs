//! The accumulation loop of the fits, compiled for AVX2 where the processor has it.
//!
//! Both copies are the same safe code and do the same operations in the same order, without fused multiply-add, so they
//! give the same bits. Sixteen two-lane registers cannot hold the 21 running sums of four lanes each: with four-lane
//! registers a fit on five rings takes two thirds of the time (`cargo bench -p osculate-geom --bench curvature`).

use super::moments::{Points, accumulate_points};
use super::shape_operator::Frame;

/// Lane-wise sums of all moments of the points in the frame.
pub(super) fn accumulate(points: &Points, frame: &Frame) -> [[f64; 4]; 21] {
    #[cfg(target_arch = "x86_64")]
    if std::arch::is_x86_feature_detected!("avx2") {
        #[allow(unsafe_code, reason = "calling a function compiled for AVX2 requires it")]
        // SAFETY: the processor has AVX2, as was just checked.
        return unsafe { accumulate_avx2(points, frame) };
    }
    accumulate_points(points, frame)
}

#[cfg(target_arch = "x86_64")]
#[target_feature(enable = "avx2")]
fn accumulate_avx2(points: &Points, frame: &Frame) -> [[f64; 4]; 21] {
    accumulate_points(points, frame)
}

#[cfg(test)]
mod tests {
    use super::*;
    use crate::Vec3;

    #[test]
    fn instruction_sets_give_the_same_bits() {
        let frame = Frame::around(Vec3::new(0.3, -0.5, 0.8).normalize());
        let mut points = Points::default();
        for i in 0..37 {
            let t = f64::from(i);
            points.push(&Vec3::new(t.sin(), (1.7 * t).cos(), (0.3 * t).sin() * 0.2), 1.0 / (1.0 + t));
            assert_eq!(accumulate(&points, &frame), accumulate_points(&points, &frame), "{i}");
        }
    }
}

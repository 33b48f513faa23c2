//! The one place where geometry leaves `f64`: what a file's float type can hold, and the two values that mean
//! something else than a number.

use crate::Vec3;

/// A float type that a bake stores its vertex rows in.
pub(super) trait FileFloat: Copy + PartialEq + std::fmt::Debug {
    /// Stored as the error of a vertex without an estimate: the largest finite value, because glTF forbids infinities.
    const UNDETERMINED: Self;
    /// Stored as the error of an estimate whose error is unknown or too large: the value just below.
    const UNBOUNDED: Self;
    /// Relative spacing of the type.
    const EPSILON: f64;

    /// The nearest value, or `None` where that is not finite.
    fn narrow(x: f64) -> Option<Self>;
    /// The same value in `f64`.
    fn widen(self) -> f64;
    /// Appends the little-endian bytes.
    fn put(self, bytes: &mut Vec<u8>);
}

impl FileFloat for f32 {
    const UNDETERMINED: Self = f32::MAX;
    const UNBOUNDED: Self = f32::MAX.next_down();
    const EPSILON: f64 = f32::EPSILON as f64;

    #[expect(clippy::cast_possible_truncation, reason = "this is the named place where f64 becomes f32")]
    fn narrow(x: f64) -> Option<Self> {
        Some(x as f32).filter(|y| y.is_finite())
    }

    fn widen(self) -> f64 {
        f64::from(self)
    }

    fn put(self, bytes: &mut Vec<u8>) {
        bytes.extend_from_slice(&self.to_le_bytes());
    }
}

impl FileFloat for f64 {
    const UNDETERMINED: Self = f64::MAX;
    const UNBOUNDED: Self = f64::MAX.next_down();
    const EPSILON: f64 = f64::EPSILON;

    fn narrow(x: f64) -> Option<Self> {
        Some(x).filter(|y| y.is_finite())
    }

    fn widen(self) -> f64 {
        self
    }

    fn put(self, bytes: &mut Vec<u8>) {
        bytes.extend_from_slice(&self.to_le_bytes());
    }
}

/// The nearest finite `f32`: what is too large becomes the largest.
#[expect(clippy::cast_possible_truncation, reason = "this is the named place where f64 becomes f32")]
pub(crate) fn nearest_f32(x: f64) -> f32 {
    (x as f32).clamp(f32::MIN, f32::MAX)
}

/// The components in `F`, or the first one that does not fit.
pub(super) fn narrow_all<F: FileFloat, const N: usize>(row: [f64; N]) -> Result<[F; N], f64> {
    if let Some(&too_large) = row.iter().find(|&&x| F::narrow(x).is_none()) {
        return Err(too_large);
    }
    Ok(row.map(|x| F::narrow(x).expect("checked above")))
}

/// The direction of `v` as a unit vector in `F`, or `None` for a zero vector.
///
/// A vector that is unit already in `F` is passed on bit by bit, so that writing what was read changes nothing.
pub(super) fn unit_row<F: FileFloat>(v: Vec3) -> Option<[F; 3]> {
    // Rounding to nearest moves each component by at most EPSILON / 2 of itself and so the squared length by EPSILON.
    // Twice that and more is accepted, so that a rounded unit vector always is; validators allow far more.
    let is_unit =
        |row: &[F; 3]| (row.iter().map(|x| x.widen().powi(2)).sum::<f64>() - 1.0).abs() <= 4.0 * F::EPSILON;
    if let Ok(row) = narrow_all::<F, 3>(v.into())
        && is_unit(&row)
    {
        return Some(row);
    }
    // Scaling by the largest component first keeps the squares from overflowing and from vanishing.
    let largest = v.amax();
    if largest == 0.0 {
        return None;
    }
    narrow_all((v / largest).normalize().into()).ok()
}

/// The stored form of an error estimate.
pub(super) fn error_row<F: FileFloat>(error: f64) -> F {
    match F::narrow(error) {
        Some(stored) if stored != F::UNDETERMINED => stored,
        _ => F::UNBOUNDED,
    }
}

/// The error estimate that [`error_row`] stored: what was unbounded is infinite again.
pub(super) fn error_from_row<F: FileFloat>(stored: F) -> f64 {
    if stored == F::UNBOUNDED || stored == F::UNDETERMINED { f64::INFINITY } else { stored.widen() }
}

#[cfg(test)]
mod tests {
    use super::*;
    use proptest::prelude::*;

    proptest! {
        #[test]
        fn unit_rows_are_unit_and_stay(x in -1e3..1e3f64, y in -1.0..1.0f64, z in -1e-6..1e-6f64, e in -300..300i32) {
            let v = Vec3::new(x, y, z) * 10f64.powi(e);
            prop_assume!(v.amax() > 0.0);
            let once = unit_row::<f32>(v).unwrap();
            let length = Vec3::from(once.map(f64::from)).norm();
            prop_assert!((length - 1.0).abs() < 1.3e-7, "length {length}");
            prop_assert_eq!(unit_row::<f32>(Vec3::from(once.map(f64::from))), Some(once));
        }

        #[test]
        fn errors_come_back(error in proptest::num::f32::POSITIVE) {
            let stored: f32 = error_row(f64::from(error));
            prop_assert_ne!(stored, f32::UNDETERMINED);
            let back: f32 = error_row(error_from_row(stored));
            prop_assert_eq!(back.to_bits(), stored.to_bits());
        }
    }

    #[test]
    fn zero_has_no_direction_and_infinity_is_kept() {
        assert_eq!(unit_row::<f32>(Vec3::zeros()), None);
        let stored: f32 = error_row(f64::INFINITY);
        assert_eq!(stored, f32::UNBOUNDED);
        assert!(error_from_row(stored).is_infinite());
    }
}

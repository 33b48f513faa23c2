//! Curvature of a surface along a direction in space.

use crate::Vec3;
use crate::curvature::Principal;

/// Sine of the angle to the normal below which curvature along a direction is blended towards the mean curvature.
///
/// Above it the paper's equation holds to the bit. A larger value would bend the result where a direction is still well
/// defined; a smaller one makes the blend so steep (slope 1 / sine) that f32 directions see a jump.
pub(super) const NORMAL_INCIDENCE_SINE: f64 = 0.02;

/// The unit vector of a direction of any length; `None` for a vector that has none.
#[inline]
pub(super) fn unit(w: &Vec3) -> Option<Vec3> {
    let squared = w.norm_squared();
    if squared.is_normal() { Some(w / squared.sqrt()) } else { unit_of_extreme(w) }
}

/// The same where squares are beyond the range of numbers: the largest coordinate comes first.
#[cold]
fn unit_of_extreme(w: &Vec3) -> Option<Vec3> {
    (w / w.amax()).try_normalize(0.0).filter(|w| w.iter().all(|x| x.is_finite()))
}

/// Curvature along a world-space direction `w` of unit length: `x^T T x / x^T x` with `x = w - n (n . w)`, `T` the
/// curvature tensor (Kuznetsov et al., "Rendering Neural Materials on Curved Surfaces", SIGGRAPH 2022, Sec. 4.2, eqs. 1
/// and 4).
///
/// As `w` turns into the normal the quotient has no limit. Within about one degree of it the value is blended into the mean
/// curvature, the average over all directions, so it is continuous there and equals the mean at the normal itself.
pub(super) fn kappa_along(principal: &Principal, w: &Vec3) -> f64 {
    let (x1, x2) = (principal.d1.dot(w), principal.d2.dot(w));
    let squared = x1 * x1 + x2 * x2;
    let blend = (1.0 - squared / (NORMAL_INCIDENCE_SINE * NORMAL_INCIDENCE_SINE)).max(0.0).powi(2);
    if squared == 0.0 {
        return principal.mean();
    }
    let along = (principal.kappa_max * x1 * x1 + principal.kappa_min * x2 * x2) / squared;
    if blend == 0.0 { along } else { along + blend * (principal.mean() - along) }
}

/// Curvature of a plane section: that of the surface in the direction in which the plane cuts its tangent plane. `normal` is
/// the plane's; the mean curvature where the plane is the tangent plane.
pub(super) fn section_curvature(principal: &Principal, normal: &Vec3) -> f64 {
    let (x1, x2) = (principal.d2.dot(normal), principal.d1.dot(normal));
    let squared = x1 * x1 + x2 * x2;
    if squared == 0.0 {
        principal.mean()
    } else {
        (principal.kappa_max * x1 * x1 + principal.kappa_min * x2 * x2) / squared
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    const CYLINDER: Principal = Principal {
        kappa_max: 2.0,
        kappa_min: 0.0,
        d1: Vec3::new(1.0, 0.0, 0.0),
        d2: Vec3::new(0.0, 1.0, 0.0),
    };

    #[test]
    fn directions_of_any_length_have_a_unit_vector() {
        let w = Vec3::new(0.6, 0.0, -0.8);
        for length in [5e-324, 1e-310, 1e-200, 1.0, 1e200, 1e308] {
            // The smallest numbers have one bit.
            let tolerance = if length < 1e-300 { 0.5 } else { 1e-15 };
            let found = unit(&(w * length)).unwrap();
            assert!(
                (found - w).norm() < tolerance && (found.norm() - 1.0).abs() < 1e-15,
                "{length}: {found}"
            );
        }
        for w in [Vec3::zeros(), Vec3::repeat(f64::NAN), Vec3::x() * f64::INFINITY, -w * f64::INFINITY] {
            assert_eq!(unit(&w), None, "{w}");
        }
    }

    #[test]
    fn euler_and_its_limit_at_normal_incidence() {
        for degrees in [0.0_f64, 30.0, 45.0, 90.0] {
            let (sin, cos) = degrees.to_radians().sin_cos();
            for elevation in [0.0_f64, 0.5, 1.5] {
                let w = Vec3::new(cos * elevation.cos(), sin * elevation.cos(), elevation.sin());
                let found = kappa_along(&CYLINDER, &w);
                assert!((found - 2.0 * cos * cos).abs() < 1e-14, "{degrees} {elevation}: {found}");
            }
            // Towards the normal: continuous, and the mean in the limit.
            let mut last = kappa_along(&CYLINDER, &Vec3::new(cos * 0.03, sin * 0.03, 1.0));
            for step in 1..=300 {
                let sine = 0.03 * (1.0 - f64::from(step) / 300.0);
                let found =
                    kappa_along(&CYLINDER, &Vec3::new(cos * sine, sin * sine, (1.0 - sine * sine).sqrt()));
                assert!((found - last).abs() < 0.02, "jump of {} at {sine}", found - last);
                last = found;
            }
            assert_eq!(last, 1.0);
        }
    }
}

//! [`Bend`]: a flat layer mapped onto a cylinder of signed curvature.
//!
//! A point `(s, r, z)` has the arc length `s` across the cylinder, `r` along its axis, and the height `z` on the outward
//! normal of the bounding surface. It goes to `X = (1/k + z) sin(k s)`, `Y = r`, `Z = (1/k + z) cos(k s) - 1/k`: the bounding
//! surface passes through the origin with normal +Z, and the axis is at `Z = -1/k`. Written without `1/k` the map is smooth
//! through `k = 0`, where it is the identity, and holds for concave surfaces, `k < 0`.
//!
//! All in `f64`; rounding is a few units in the last place of the largest coordinate.

use glam::DVec3;

/// Least of `1 + k z`, the distance from the axis in radii. What lies deeper, also beyond the axis, is moved up to there, so
/// that the map stays one to one in arc length.
pub const LEAST_CORE: f64 = 1e-3;

/// The map for one curvature.
#[derive(Debug, Clone, Copy, PartialEq)]
pub struct Bend {
    /// Curvature across the axis, 1/UV units; positive where the bounding surface is convex.
    pub kappa: f64,
}

impl Bend {
    /// `(X, Y, Z)` of a point `(s, r, z)`.
    #[must_use]
    #[inline]
    pub fn point(&self, p: DVec3) -> DVec3 {
        let angle = self.kappa * p.x;
        let z = self.height(p.z);
        // (1 - cos ks) / k without cancellation.
        let (half, cos) = ((0.5 * angle).sin(), angle.cos());
        let sagitta = p.x * half * sinc(0.5 * angle);
        DVec3::new(self.core(p.z) * sinc(angle) * p.x, p.y, z * cos - sagitta)
    }

    /// `(s, r, z)` of a point `(X, Y, Z)`, with `|k s| <= pi`. On the axis `s` is 0.
    #[must_use]
    pub fn unbend(&self, p: DVec3) -> DVec3 {
        let k = self.kappa;
        let (sine, cosine) = (k * p.x, 1.0 + k * p.z);
        let core = sine.hypot(cosine);
        // (core^2 - 1) / (k (core + 1)) with the division by k carried out.
        let z = (sine * p.x + p.z * (1.0 + cosine)) / (core + 1.0);
        DVec3::new(self.travel(DVec3::ZERO, p), p.y, z)
    }

    /// Arc length between the feet of two points, signed, taken the short way around.
    #[must_use]
    #[inline]
    pub fn travel(&self, from: DVec3, to: DVec3) -> f64 {
        let k = self.kappa;
        // Sine over k, and cosine, of the angle between them as seen from the axis, times both distances.
        let sine = (to.x - from.x) + k * (to.x * from.z - from.x * to.z);
        let cosine = (1.0 + k * from.z) * (1.0 + k * to.z) + (k * from.x) * (k * to.x);
        // The arc's next term is a third of the square of the angle.
        if cosine > 0.0 && (k * sine).abs() < 1e-9 * cosine {
            return sine / cosine;
        }
        (k * sine).atan2(cosine) / k
    }

    /// `1 + k z`, the distance from the axis in radii, and how much longer than its arc a stretch at height `z` is; at least
    /// [`LEAST_CORE`].
    #[must_use]
    #[inline]
    pub fn core(&self, z: f64) -> f64 {
        (1.0 + self.kappa * z).max(LEAST_CORE)
    }

    /// `z`, or the height of [`LEAST_CORE`] if that is higher.
    #[must_use]
    #[inline]
    pub fn height(&self, z: f64) -> f64 {
        if 1.0 + self.kappa * z < LEAST_CORE { (LEAST_CORE - 1.0) / self.kappa } else { z }
    }

    /// A vector given by its components along the arc, the axis and the outward normal above the arc length `s`.
    #[must_use]
    #[inline]
    pub fn vector(&self, s: f64, v: DVec3) -> DVec3 {
        let (sin, cos) = (self.kappa * s).sin_cos();
        DVec3::new(v.x * cos + v.z * sin, v.y, v.z * cos - v.x * sin)
    }

    /// The unit normal at `(s, r, z)` of a surface whose normal before bending, in `(s, r, z)`, was `n` (any length).
    ///
    /// Normals go with the inverse transpose of the Jacobian, which is a rotation after a stretch by [`Self::core`] along the
    /// arc.
    #[must_use]
    #[inline]
    pub fn normal(&self, s: f64, z: f64, n: DVec3) -> DVec3 {
        self.vector(s, DVec3::new(n.x / self.core(z), n.y, n.z)).normalize()
    }

    /// The point in coordinates whose origin is the point of the bounding surface at arc length `s` and position `r`, with +Z its
    /// normal: the screw motion that takes one copy of a tile to another.
    #[must_use]
    #[inline]
    pub fn seen_from(&self, s: f64, r: f64, p: DVec3) -> DVec3 {
        let angle = self.kappa * s;
        let (sin, cos) = angle.sin_cos();
        let sagitta = s * (0.5 * angle).sin() * sinc(0.5 * angle);
        DVec3::new(p.x * cos - p.z * sin - s * sinc(angle), p.y - r, p.x * sin + p.z * cos - sagitta)
    }

    /// As [`Self::seen_from`] for a direction.
    #[must_use]
    #[inline]
    pub fn direction_seen_from(&self, s: f64, d: DVec3) -> DVec3 {
        self.vector(-s, d)
    }
}

/// `sin x / x`, 1 at 0.
#[inline]
fn sinc(x: f64) -> f64 {
    if x == 0.0 { 1.0 } else { x.sin() / x }
}

#[cfg(test)]
mod tests {
    use super::*;
    use proptest::prelude::*;

    #[test]
    fn closed_forms_of_both_signs() {
        for kappa in [-3.0, -0.5, 0.5, 3.0_f64] {
            let bend = Bend { kappa };
            for (s, z) in [(0.2, -0.1), (-0.7, 0.0), (1.0, -0.3)] {
                let radius = 1.0 / kappa + z;
                let expected =
                    DVec3::new(radius * (s * kappa).sin(), 4.0, radius * (s * kappa).cos() - 1.0 / kappa);
                let found = bend.point(DVec3::new(s, 4.0, z));
                assert!((found - expected).length() < 1e-14, "{kappa}: {found} {expected}");
            }
        }
    }

    #[test]
    fn flat_is_the_limit() {
        let p = DVec3::new(1.5, -2.0, -0.2);
        assert_eq!(Bend { kappa: 0.0 }.point(p), p);
        assert_eq!(Bend { kappa: 0.0 }.unbend(p), p);
        for kappa in [1e-6, -1e-6, 1e-12, -1e-12, 1e-300, f64::MIN_POSITIVE] {
            let bend = Bend { kappa };
            // To first order the point moves by k (s z, 0, -s^2 / 2).
            let linear = p + kappa * DVec3::new(p.x * p.z, 0.0, -0.5 * p.x * p.x);
            assert!((bend.point(p) - linear).length() < 1e-12 + kappa * kappa * 10.0, "{kappa}");
            assert!((bend.unbend(bend.point(p)) - p).length() < 1e-14, "{kappa}");
        }
    }

    #[test]
    fn normals_are_those_of_the_bent_surface() {
        let surface = |s: f64, r: f64| DVec3::new(s, r, -0.1 + 0.05 * (3.0 * s).sin() * (2.0 * r).cos());
        for kappa in [-2.0, 0.0, 1e-9, 2.0] {
            let bend = Bend { kappa };
            let (s, r, step) = (0.3, 0.4, 1e-5);
            let slope =
                |ds: f64, dr: f64| bend.point(surface(s + ds, r + dr)) - bend.point(surface(s - ds, r - dr));
            let expected = slope(step, 0.0).cross(slope(0.0, step)).normalize();
            let gradient =
                (0.15 * (3.0 * s).cos() * (2.0 * r).cos(), -0.1 * (3.0 * s).sin() * (2.0 * r).sin());
            let found = bend.normal(s, surface(s, r).z, DVec3::new(-gradient.0, -gradient.1, 1.0));
            // The differences' error is the square of the step, over the slope's own rounding.
            assert!((found - expected).length() < 1e-8, "{kappa}: {found} {expected}");
        }
    }

    #[test]
    fn what_is_below_the_axis_is_lifted_above_it() {
        let bend = Bend { kappa: 4.0 };
        let p = bend.point(DVec3::new(0.1, 0.0, -0.9));
        assert!((p.x - LEAST_CORE / 4.0 * 0.4_f64.sin()).abs() < 1e-15 && p.is_finite(), "{p}");
    }

    proptest! {
        #[test]
        fn unbending_inverts(
            exponent in -12.0_f64..0.5, sign in prop::bool::ANY,
            angle in -3.0_f64..3.0, depth in 0.0_f64..0.9, r in -2.0_f64..2.0,
        ) {
            let magnitude = 10.0_f64.powf(exponent);
            let bend = Bend { kappa: if sign { magnitude } else { -magnitude } };
            let p = DVec3::new((angle / magnitude).clamp(-5.0, 5.0), r, -depth * (1.0 / magnitude).min(1.0));
            let back = bend.unbend(bend.point(p));
            prop_assert!((back - p).length() < 1e-13, "{p} {back}");
        }

        /// A screw motion takes the bent layer to itself.
        #[test]
        fn copies_are_congruent(kappa in -2.0_f64..2.0, s in -0.5_f64..0.5, r in -1.0_f64..1.0, shift in -0.5_f64..0.5) {
            let bend = Bend { kappa };
            let seen = bend.seen_from(shift, 0.7, bend.point(DVec3::new(s, r, -0.1)));
            let direct = bend.point(DVec3::new(s - shift, r - 0.7, -0.1));
            prop_assert!((seen - direct).length() < 1e-14, "{seen} {direct}");
        }
    }
}

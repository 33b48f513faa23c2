//! Polynomial fits of degree 2 to 4 over a tangent plane, with heights bent so that spheres and cylinders are quadrics.
//!
//! A height function of degree `d` gives curvature with an error of order `h^(d-1)` (Cazals and Pouget, "Estimating
//! Differential Quantities Using Polynomial Fitting of Osculating Jets", CAGD 2005). What limits it in practice is that
//! even a sphere has terms of every even degree: its height is `1 - sqrt(1 - r^2)`. So the points are first bent. Along
//! a circle of curvature `kappa` that touches the plane, a chord of length `c` ends at the height `h = kappa c^2 / 2`, and at
//! the abscissa `u` with `u^2 = c^2 - h^2`; so `h (1 - kappa^2 c^2 / 4) = kappa u^2 / 2`, a parabola. With the third
//! fundamental form `III` (the square of the shape operator, known from a smaller or coarser fit) in place of `kappa^2`,
//!
//! `h' = h (1 - III(p, p) / 4)`, the form taken along the tangential direction of `p` over the length of its chord,
//!
//! turns spheres and cylinders of any size into exact quadrics, takes most of the terms of degree 4 and more out of other
//! surfaces, and leaves second derivatives at the origin as they are. On a torus of 10,000 random points it divides the
//! error of a fit of degree 4 by four, and of one of degree 3 by eight. An error of `III` only matters in the product with
//! the height, so a rough one will do.

mod cloud;
mod elimination;
mod kernel;

pub(super) use cloud::Cloud;

use self::elimination::Polynomial;
use self::kernel::View;
use super::Principal;
use super::moments::Height;
use super::shape_operator::{Frame, principal_of_height};
use crate::{Mat3, Vec3};

/// As in the quadric fit: below this share of unexplained column the points do not determine a coefficient.
const LEAST_PIVOT: f64 = 1e-7;

/// Largest `kappa^2` times squared radius that heights are bent by: a quarter turn. Beyond it the surface would turn away
/// from the fit plane, and what says so is an error of the curvature that is bent by.
const LARGEST_BEND: f64 = 3.0;

/// What is known about the surface before a fit.
#[derive(Debug, Clone, Copy)]
pub(super) struct Guess {
    /// Fit plane: its normal is the direction of heights.
    pub(super) frame: Frame,
    /// A point of the surface, as an offset from the vertex.
    pub(super) origin: Vec3,
    /// Curvature tensor to bend by; zero if unknown.
    pub(super) tensor: Mat3,
}

/// Fits of one set of points.
#[derive(Debug, Clone, Copy)]
pub(super) struct LocalFit {
    guess: Guess,
    /// World length of one unit of the fit.
    pub(super) length: f64,
    third: [f64; 3],
    /// Polynomials of degree 2, 3 and 4; `None` where the points do not determine one or it was not asked for.
    polynomials: [Option<Polynomial>; 3],
}

impl Guess {
    /// Nothing is known but a normal.
    pub(super) fn from_normal(normal: Vec3) -> Self {
        Self { frame: Frame::around(normal), origin: Vec3::zeros(), tensor: Mat3::zeros() }
    }
}

impl LocalFit {
    /// Fits the first `count` points of a cloud up to a degree of 2 to 4. Weights fall from 1 at the vertex to 0.1 at
    /// the squared distance `farthest`. `None` if the points have no extent.
    pub(super) fn new(
        cloud: &Cloud,
        count: usize,
        farthest: f64,
        degree: usize,
        guess: &Guess,
    ) -> Option<Self> {
        let length = cloud.extent(count)?;
        let third = third_form(guess, length);
        let view =
            View { frame: guess.frame, origin: guess.origin, length, third, inverse_squared: 1.0 / farthest };
        let moments = match degree {
            2 => kernel::accumulate::<2>(cloud, count, &view),
            3 => kernel::accumulate::<3>(cloud, count, &view),
            _ => kernel::accumulate::<4>(cloud, count, &view),
        };
        let polynomials = elimination::solve(&moments, degree, LEAST_PIVOT);
        Some(Self { guess: *guess, length, third, polynomials })
    }

    /// Coefficients of a polynomial in two variables.
    pub(super) fn unknowns(degree: usize) -> usize {
        (degree + 1) * (degree + 2) / 2
    }

    /// Frobenius norm of a degree's second fundamental form, 1/length: about the curvature, since fits are made over a plane
    /// that is nearly tangent.
    pub(super) fn curvature(&self, degree: usize) -> Option<f64> {
        let Height { a, b, c, .. } = self.polynomial(degree)?.height;
        Some((4.0 * a * a + 2.0 * b * b + 4.0 * c * c).sqrt() / self.length)
    }

    /// Frobenius norm of the curvature tensor that heights were bent by, 1/length.
    pub(super) fn bent_by(&self) -> f64 {
        self.guess.tensor.norm()
    }

    /// The polynomial of a degree.
    fn polynomial(&self, degree: usize) -> Option<&Polynomial> {
        self.polynomials[degree - 2].as_ref()
    }

    /// Curvature of the polynomial of a degree, above the origin of the fit; `None` if there is none, or it overflows.
    pub(super) fn principal(&self, degree: usize) -> Option<Principal> {
        let polynomial = self.polynomial(degree)?;
        let principal = principal_of_height(&self.unbent(polynomial), self.length, &self.guess.frame);
        (principal.kappa_max.is_finite() && principal.kappa_min.is_finite()).then_some(principal)
    }

    /// Part of a degree's unit normal along a direction; `None` without a polynomial.
    pub(super) fn facing(&self, degree: usize, outward: &Vec3) -> Option<f64> {
        let Frame { t, s, n } = self.guess.frame;
        let Height { d, e, .. } = self.polynomial(degree)?.height;
        Some((n - t * d - s * e).normalize().dot(outward))
    }

    /// The height function before bending, to second order.
    fn unbent(&self, polynomial: &Polynomial) -> Height {
        let Polynomial { shift, height, .. } = *polynomial;
        let [uu, uv, vv] = self.third.map(|x| 0.25 * shift * x);
        Height { a: height.a + uu, b: height.b + uv, c: height.c + vv, ..height }
    }

    /// Frobenius norm of the difference of two degrees' second fundamental forms, 1/length; `None` unless both are there.
    pub(super) fn change(&self, lower: usize, higher: usize) -> Option<f64> {
        let (one, two) = (&self.polynomial(lower)?.height, &self.polynomial(higher)?.height);
        let (a, b, c) = (one.a - two.a, one.b - two.b, one.c - two.c);
        Some((4.0 * a * a + 2.0 * b * b + 4.0 * c * c).sqrt() / self.length)
    }

    /// Standard error of a degree's second fundamental form in the Frobenius norm, 1/length, for heights with independent noise of
    /// the size of the residuals. It does not depend on the axes of the fit; a curvature's own standard error is 0.6 to 1 of it.
    pub(super) fn standard_error(&self, degree: usize) -> Option<f64> {
        let Polynomial { variances: [aa, bb, cc], variance, .. } = self.polynomial(degree)?;
        Some((variance * (4.0 * aa + 2.0 * bb + 4.0 * cc)).sqrt() / self.length)
    }

    /// What a degree's polynomial says about the surface, for the next fit; `trust` scales the curvature to bend by.
    pub(super) fn guess(&self, degree: usize, trust: f64) -> Option<Guess> {
        let polynomial = self.polynomial(degree)?;
        let principal = self.principal(degree)?;
        let origin = self.guess.origin + self.guess.frame.n * (polynomial.shift * self.length);
        let tensor = principal.tensor() * trust;
        Some(Guess { frame: Frame::around(principal.normal()), origin, tensor })
    }
}

/// The third fundamental form `[uu, uv, vv]` in the fit plane, in units of `length`, at most [`LARGEST_BEND`].
fn third_form(guess: &Guess, length: f64) -> [f64; 3] {
    let tensor = guess.tensor * length;
    let (x, y) = (tensor * guess.frame.t, tensor * guess.frame.s);
    let (xx, xy, yy) = (x.dot(&x), x.dot(&y), y.dot(&y));
    let trace = xx + yy;
    let scale = if trace > LARGEST_BEND { LARGEST_BEND / trace } else { 1.0 };
    if trace.is_finite() { [xx * scale, 2.0 * xy * scale, yy * scale] } else { [0.0; 3] }
}

#[cfg(test)]
mod tests {
    use super::*;

    /// Points of a cap of the unit sphere around the z axis, as offsets from the point `lift` above its pole.
    fn cap(lift: f64) -> Cloud {
        let mut cloud = Cloud::default();
        cloud.reserve(60);
        for i in 0..60 {
            let t = f64::from(i);
            let (polar, azimuth) = (0.3 * (t / 60.0).sqrt(), 2.4 * t);
            let p = Vec3::new(polar.sin() * azimuth.cos(), polar.sin() * azimuth.sin(), polar.cos());
            cloud.push(&(p - Vec3::z() * (1.0 + lift)), &p, polar * polar);
        }
        cloud
    }

    fn fit(cloud: &Cloud, guess: &Guess) -> LocalFit {
        LocalFit::new(cloud, cloud.len(), 0.09, 4, guess).unwrap()
    }

    fn along_z() -> Guess {
        Guess { tensor: Mat3::from_diagonal(&Vec3::new(1.0, 1.0, 0.0)), ..Guess::from_normal(Vec3::z()) }
    }

    #[test]
    fn a_sphere_is_a_quadric_from_on_it_and_from_beside_it() {
        for lift in [0.0, 0.02, -0.02] {
            let fit = fit(&cap(lift), &along_z());
            for degree in [2, 3, 4] {
                let found = fit.principal(degree).unwrap();
                // Undoing the bend of a height of 0.02 is worth 0.01; what is left of it is of fourth order.
                let bound = if lift == 0.0 { 1e-5 } else { 2e-3 };
                let off = (found.kappa_max - 1.0).abs().max((found.kappa_min - 1.0).abs());
                assert!(off < bound, "lift {lift}, degree {degree}: {found:?}");
            }
        }
    }

    #[test]
    fn the_next_fit_starts_on_the_surface() {
        let lift = 0.02;
        let next = fit(&cap(lift), &along_z()).guess(2, 1.0).unwrap();
        let origin = next.origin + Vec3::z() * (1.0 + lift);
        assert!((origin.norm() - 1.0).abs() < 1e-4, "{origin}");
        let again = fit(&cap(lift), &next).principal(2).unwrap();
        // Heights are bent by the first fit's curvature, which is not exact.
        assert!((again.kappa_max - 1.0).abs() < 1e-4, "{again:?}");
    }

    #[test]
    fn facing_is_of_the_fitted_normal() {
        let normal = Vec3::new(-0.5, 0.25, 1.0).normalize();
        let frame = Frame::around(normal);
        let mut cloud = Cloud::default();
        cloud.reserve(40);
        for i in 0..40 {
            let t = f64::from(i);
            let p = frame.t * (1.3 * t).sin() + frame.s * (2.1 * t).cos();
            cloud.push(&p, &normal, 0.0);
        }
        let fit = fit(&cloud, &Guess::from_normal(Vec3::z()));
        assert!((fit.facing(2, &normal).unwrap() - 1.0).abs() < 1e-12);
        assert!(fit.facing(2, &Vec3::z()).unwrap() < 0.9);
    }
}

//! Principal curvatures of a fitted height function.

use super::Principal;
use super::moments::Height;
use crate::Vec3;

/// An orthonormal frame at a vertex: `t`, `s`, `n` right-handed, heights along `n`.
#[derive(Debug, Clone, Copy)]
pub(crate) struct Frame {
    pub(crate) t: Vec3,
    pub(crate) s: Vec3,
    pub(crate) n: Vec3,
}

impl Frame {
    /// A frame around a unit normal, continuous except at `n = -z` (Duff et al., "Building an Orthonormal Basis,
    /// Revisited", JCGT 2017).
    pub(crate) fn around(n: Vec3) -> Self {
        let sign = 1.0_f64.copysign(n.z);
        let a = -1.0 / (sign + n.z);
        let b = n.x * n.y * a;
        Self {
            t: Vec3::new(1.0 + sign * n.x * n.x * a, sign * b, -sign * n.x),
            s: Vec3::new(b, sign + n.y * n.y * a, -n.y),
            n,
        }
    }
}

/// Principal curvatures and directions at the origin of a height function with coordinates in units of `length`, where
/// `n` points out of the material.
///
/// This is the generalised problem `II x = kappa I x`. With the first tangent along the gradient of length `g`, `I` is
/// `diag(1 + g^2, 1)`, so it is solved in closed form on the orthonormal basis of the tangent plane, without the
/// cancellation of `H^2 - K`. Curvatures are exact for any tilt of the frame against the surface.
pub(crate) fn principal_of_height(height: &Height, length: f64, frame: &Frame) -> Principal {
    let (cos, sin, slope) = gradient(height);
    let stretch = (1.0 + slope * slope).sqrt();
    let x = ((frame.t * cos + frame.s * sin) + frame.n * slope) / stretch;
    let y = frame.s * cos - frame.t * sin;
    shape_operator(height, length).lift(x, y)
}

/// The curvatures alone, `(kappa_max, kappa_min)`.
pub(crate) fn curvatures_of_height(height: &Height, length: f64) -> (f64, f64) {
    let Symmetric { xx, xy, yy } = shape_operator(height, length);
    let (mean, radius) = (0.5 * (xx + yy), half_spread(xx, xy, yy));
    (mean + radius, mean - radius)
}

/// Unit direction and length of the gradient; the first axis where it vanishes.
fn gradient(height: &Height) -> (f64, f64, f64) {
    let slope = (height.d * height.d + height.e * height.e).sqrt();
    if slope > 0.0 { (height.d / slope, height.e / slope, slope) } else { (1.0, 0.0, 0.0) }
}

/// The shape operator on the orthonormal basis (up the gradient, along the level line) of the tangent plane.
fn shape_operator(height: &Height, length: f64) -> Symmetric {
    let &Height { a, b, c, .. } = height;
    let (cos, sin, slope) = gradient(height);
    // Second derivatives in that basis, over the length of the unnormalised normal.
    let along = 2.0 * (a * cos * cos + b * cos * sin + c * sin * sin);
    let across = 2.0 * (a * sin * sin - b * cos * sin + c * cos * cos);
    let mixed = 2.0 * (c - a) * cos * sin + b * (cos * cos - sin * sin);
    let stretch = (1.0 + slope * slope).sqrt();
    let factor = -1.0 / (stretch * length);
    Symmetric { xx: along / (stretch * stretch) * factor, xy: mixed / stretch * factor, yy: across * factor }
}

/// A symmetric 2x2 matrix `[[xx, xy], [xy, yy]]`.
#[derive(Debug, Clone, Copy)]
pub(crate) struct Symmetric {
    pub(crate) xx: f64,
    pub(crate) xy: f64,
    pub(crate) yy: f64,
}

/// Half the difference of the eigenvalues. `hypot`'s scaling, without its call: the larger term is taken out.
fn half_spread(xx: f64, xy: f64, yy: f64) -> f64 {
    let half = 0.5 * (xx - yy);
    let (large, small) = if half.abs() > xy.abs() { (half.abs(), xy.abs()) } else { (xy.abs(), half.abs()) };
    if large == 0.0 { 0.0 } else { large * (1.0 + (small / large) * (small / large)).sqrt() }
}

impl Symmetric {
    /// Eigenvalues, and eigenvectors in the plane of two orthonormal vectors. At an umbilic the first is `x`.
    pub(crate) fn lift(&self, x: Vec3, y: Vec3) -> Principal {
        let &Self { xx, xy, yy } = self;
        let (mean, radius) = (0.5 * (xx + yy), half_spread(xx, xy, yy));
        // Half-angle formulas on the branch that does not cancel: the eigenvector of the maximum is
        // (cos, sin) with cos(2 angle) = (xx - yy) / 2 radius and sin(2 angle) = xy / radius.
        let (mut cos, mut sin) = (1.0, 0.0);
        if radius > 0.0 {
            let (cos2, sin2) = (0.5 * (xx - yy) / radius, xy / radius);
            let half = (0.5 * (1.0 + cos2.abs())).sqrt();
            (cos, sin) = if cos2 >= 0.0 { (half, 0.5 * sin2 / half) } else { (0.5 * sin2 / half, half) };
        }
        // Renormalised, so that the directions are unit to the last bit or two.
        let d1 = (x * cos + y * sin).normalize();
        let d2 = (y * cos - x * sin).normalize();
        Principal { kappa_max: mean + radius, kappa_min: mean - radius, d1, d2 }
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    fn frame(n: Vec3) -> Frame {
        let frame = Frame::around(n.normalize());
        assert!((frame.t.cross(&frame.s) - frame.n).norm() < 1e-15);
        frame
    }

    /// Coefficients of the sphere, cylinder or other surface `F = 0` at a point, seen from a tilted frame.
    fn tilted_cylinder(tilt: f64) -> (Height, Frame) {
        // The unit cylinder around y at its top, z = sqrt(1 - x^2), in a frame turned by `tilt` around y and 0.3
        // around n: the implicit quadratic is x^2 + z^2 = 1, solved for height over the frame to second order.
        let n = Vec3::new(tilt.sin(), 0.0, tilt.cos());
        let f = frame(n);
        let gradient = Vec3::z();
        let hessian = crate::Mat3::from_diagonal(&Vec3::new(1.0, 0.0, 1.0));
        // F(p) = (x^2 + z^2 - 1) / 2; implicit differentiation of F(u t + v s + w n) = 0.
        let fn_ = gradient.dot(&f.n);
        let slope = |x: &Vec3| -gradient.dot(x) / fn_;
        let second = |x: &Vec3, y: &Vec3| {
            let (lx, ly) = (x + f.n * slope(x), y + f.n * slope(y));
            -(lx.transpose() * hessian * ly)[0] / fn_
        };
        let height = Height {
            a: 0.5 * second(&f.t, &f.t),
            b: second(&f.t, &f.s),
            c: 0.5 * second(&f.s, &f.s),
            d: slope(&f.t),
            e: slope(&f.s),
        };
        (height, f)
    }

    #[test]
    fn tilt_of_the_frame_changes_nothing() {
        for tilt in [0.0, 0.1, 0.5, 1.2] {
            let (height, frame) = tilted_cylinder(tilt);
            let found = principal_of_height(&height, 1.0, &frame);
            assert!((found.kappa_max - 1.0).abs() < 1e-14, "tilt {tilt}: {found:?}");
            assert!(found.kappa_min.abs() < 1e-14, "tilt {tilt}: {found:?}");
            assert!(found.d1.cross(&Vec3::x()).norm() < 1e-14, "tilt {tilt}: {found:?}");
            assert!((found.normal() - Vec3::z()).norm() < 1e-14, "tilt {tilt}: {found:?}");
        }
    }

    #[test]
    fn umbilic_has_orthogonal_directions_and_length_scales() {
        let sphere = Height { a: -0.5, b: 0.0, c: -0.5, d: 0.0, e: 0.0 };
        let found = principal_of_height(&sphere, 4.0, &frame(Vec3::new(1.0, -2.0, -0.5)));
        assert_eq!((found.kappa_max, found.kappa_min), (0.25, 0.25));
        assert!(found.d1.dot(&found.d2).abs() < 1e-15);
    }

    #[test]
    fn eigenvectors_of_all_quadrants() {
        for degrees in (0..360).step_by(7) {
            let (sin, cos) = f64::from(degrees).to_radians().sin_cos();
            for (max, min) in [(3.0, 1.0), (1e-3, -5.0), (2.0, 2.0 - 1e-9)] {
                let xx = max * cos * cos + min * sin * sin;
                let yy = max * sin * sin + min * cos * cos;
                let xy = (max - min) * cos * sin;
                let found = Symmetric { xx, xy, yy }.lift(Vec3::x(), Vec3::y());
                assert!((found.kappa_max - max).abs() < 1e-14 && (found.kappa_min - min).abs() < 1e-14);
                // The direction of two curvatures 1e-9 apart is known to about 1e-15 / 1e-9.
                let off = found.d1.x * sin - found.d1.y * cos;
                assert!(off.abs() < 2e-15 / (max - min).min(1.0) + 1e-15, "{degrees} {max} {min}: {off:e}");
                assert!((found.d1.cross(&found.d2) - Vec3::z()).norm() < 1e-15);
            }
        }
    }
}

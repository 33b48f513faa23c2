//! Principal curvatures of a fitted height function.

use super::Principal;
use super::moments::Coefficients;
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

/// Principal curvatures and directions at the origin of `z = a u^2 + b uv + c v^2 + d u + e v`, coordinates in units of
/// `length`, with `n` pointing out of the material.
///
/// This is the generalised problem `II x = kappa I x`. With the first tangent along the gradient of length `g`, `I` is
/// `diag(1 + g^2, 1)`, so it is solved in closed form on the orthonormal basis of the tangent plane, without the
/// cancellation of `H^2 - K`. Curvatures are exact for any tilt of the frame against the surface.
pub(crate) fn principal_of_height(coefficients: &Coefficients, length: f64, frame: &Frame) -> Principal {
    let [a, b, c, d, e]: [f64; 5] = (*coefficients).into();
    let slope = d.hypot(e);
    let (cos, sin) = if slope > 0.0 { (d / slope, e / slope) } else { (1.0, 0.0) };
    let stretch = 1.0_f64.hypot(slope);
    // Second derivatives along (gradient, level line), over the length of the unnormalised normal.
    let along = 2.0 * (a * cos * cos + b * cos * sin + c * sin * sin);
    let across = 2.0 * (a * sin * sin - b * cos * sin + c * cos * cos);
    let mixed = 2.0 * (c - a) * cos * sin + b * (cos * cos - sin * sin);
    let [xx, xy, yy] =
        [along / (stretch * stretch), mixed / stretch, across].map(|second| -second / (stretch * length));

    let x = ((frame.t * cos + frame.s * sin) + frame.n * slope) / stretch;
    let y = frame.s * cos - frame.t * sin;
    symmetric_2x2(xx, xy, yy).lift(x, y)
}

/// Eigenvalues of a symmetric 2x2 matrix and the angle of the larger one's eigenvector.
#[derive(Debug, Clone, Copy)]
pub(crate) struct Eigen2 {
    pub(crate) max: f64,
    pub(crate) min: f64,
    cos: f64,
    sin: f64,
}

/// Eigenvalues and eigenvectors of `[[xx, xy], [xy, yy]]`; at an umbilic the eigenvector is the first axis.
pub(crate) fn symmetric_2x2(xx: f64, xy: f64, yy: f64) -> Eigen2 {
    let mean = 0.5 * (xx + yy);
    let half = 0.5 * (xx - yy);
    let radius = half.hypot(xy);
    let angle = if radius > 0.0 { 0.5 * xy.atan2(half) } else { 0.0 };
    Eigen2 { max: mean + radius, min: mean - radius, cos: angle.cos(), sin: angle.sin() }
}

impl Eigen2 {
    /// The eigenvectors in the plane of two orthonormal vectors.
    pub(crate) fn lift(&self, x: Vec3, y: Vec3) -> Principal {
        // Renormalised, so that the directions are unit to the last bit or two.
        let d1 = (x * self.cos + y * self.sin).normalize();
        let d2 = (y * self.cos - x * self.sin).normalize();
        Principal { kappa_max: self.max, kappa_min: self.min, d1, d2 }
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
    fn tilted_cylinder(tilt: f64) -> (Coefficients, Frame) {
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
        let c = Coefficients::new(
            0.5 * second(&f.t, &f.t),
            second(&f.t, &f.s),
            0.5 * second(&f.s, &f.s),
            slope(&f.t),
            slope(&f.s),
        );
        (c, f)
    }

    #[test]
    fn tilt_of_the_frame_changes_nothing() {
        for tilt in [0.0, 0.1, 0.5, 1.2] {
            let (coefficients, frame) = tilted_cylinder(tilt);
            let found = principal_of_height(&coefficients, 1.0, &frame);
            assert!((found.kappa_max - 1.0).abs() < 1e-14, "tilt {tilt}: {found:?}");
            assert!(found.kappa_min.abs() < 1e-14, "tilt {tilt}: {found:?}");
            assert!(found.d1.cross(&Vec3::x()).norm() < 1e-14, "tilt {tilt}: {found:?}");
            assert!((found.normal() - Vec3::z()).norm() < 1e-14, "tilt {tilt}: {found:?}");
        }
    }

    #[test]
    fn umbilic_has_orthogonal_directions_and_length_scales() {
        let sphere = Coefficients::new(-0.5, 0.0, -0.5, 0.0, 0.0);
        let found = principal_of_height(&sphere, 4.0, &frame(Vec3::new(1.0, -2.0, -0.5)));
        assert_eq!((found.kappa_max, found.kappa_min), (0.25, 0.25));
        assert!(found.d1.dot(&found.d2).abs() < 1e-15);
    }
}

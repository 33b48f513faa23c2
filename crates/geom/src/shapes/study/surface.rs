//! The surfaces as level sets `F = 0`, `F` growing outward, with their points by parameters.

use super::StudyShape;
use crate::curvature::Principal;
use crate::reference::level_set_curvature;
use crate::{Mat3, Vec3};

/// Half-axes of the ellipsoid.
pub(super) const HALF_AXES: [f64; 3] = [1.0, 0.7, 0.5];
/// Radius of the circle in the middle of the torus's tube.
pub(super) const MAJOR: f64 = 1.0;
/// Radius of the torus's tube.
pub(super) const MINOR: f64 = 0.4;
/// Height of the bump.
pub(super) const BUMP_HEIGHT: f64 = 0.4;
/// Standard deviation of the bump's profile.
pub(super) const BUMP_WIDTH: f64 = 0.4;

/// Curvature of the level set through a point.
pub(super) fn exact(shape: StudyShape, p: &Vec3) -> Principal {
    let (_, gradient, hessian) = level_set(shape, p);
    let (kappa_max, kappa_min, d1) = level_set_curvature(&gradient, &hessian);
    Principal { kappa_max, kappa_min, d1, d2: gradient.normalize().cross(&d1) }
}

/// `F`, its gradient and its Hessian.
pub(super) fn level_set(shape: StudyShape, p: &Vec3) -> (f64, Vec3, Mat3) {
    match shape {
        StudyShape::Sphere => quadric(p, Vec3::repeat(1.0), 1.0),
        StudyShape::Ellipsoid => quadric(p, Vec3::from(HALF_AXES).map(|a| 1.0 / (a * a)), 1.0),
        StudyShape::Torus => torus(p),
        StudyShape::Catenoid => {
            let (cosh, sinh) = (p.y.cosh(), p.y.sinh());
            let (value, mut gradient, mut hessian) = quadric(p, Vec3::new(1.0, 0.0, 1.0), cosh * cosh);
            gradient.y = -2.0 * cosh * sinh;
            hessian[(1, 1)] = -2.0 * (cosh * cosh + sinh * sinh);
            (value, gradient, hessian)
        }
        StudyShape::Cylinder => quadric(p, Vec3::new(1.0, 0.0, 1.0), 1.0),
        StudyShape::Bump => {
            let s2 = BUMP_WIDTH * BUMP_WIDTH;
            let f = BUMP_HEIGHT * (-(p.x * p.x + p.y * p.y) / (2.0 * s2)).exp();
            let second = |a: f64, b: f64| f * a * b / (s2 * s2);
            let (fxx, fyy) = (second(p.x, p.x) - f / s2, second(p.y, p.y) - f / s2);
            height_field(p, f, [-f * p.x / s2, -f * p.y / s2], [fxx, second(p.x, p.y), fyy])
        }
        StudyShape::MonkeySaddle => {
            let (x, y) = (p.x, p.y);
            let f = x * (x * x - 3.0 * y * y) / 3.0;
            height_field(p, f, [x * x - y * y, -2.0 * x * y], [2.0 * x, -2.0 * y, -2.0 * x])
        }
    }
}

/// `F = p^T diag(a) p - c`.
fn quadric(p: &Vec3, a: Vec3, c: f64) -> (f64, Vec3, Mat3) {
    let half_gradient = p.component_mul(&a);
    (p.dot(&half_gradient) - c, 2.0 * half_gradient, Mat3::from_diagonal(&(2.0 * a)))
}

/// `F = (rho - MAJOR)^2 + y^2 - MINOR^2` with the distance `rho` from the y axis.
fn torus(p: &Vec3) -> (f64, Vec3, Mat3) {
    let rho = p.x.hypot(p.z);
    let radial = Vec3::new(p.x, 0.0, p.z) / rho;
    let around = Vec3::new(p.z, 0.0, -p.x) / rho;
    let beyond = rho - MAJOR;
    let gradient = 2.0 * (radial * beyond + Vec3::y() * p.y);
    let hessian = radial * radial.transpose()
        + around * around.transpose() * (beyond / rho)
        + Vec3::y() * Vec3::y().transpose();
    (beyond * beyond + p.y * p.y - MINOR * MINOR, gradient, 2.0 * hessian)
}

/// `F = z - f(x, y)` from `f`, its first and its second derivatives (xx, xy, yy).
fn height_field(p: &Vec3, f: f64, [fx, fy]: [f64; 2], [fxx, fxy, fyy]: [f64; 3]) -> (f64, Vec3, Mat3) {
    let hessian = -Mat3::new(fxx, fxy, 0.0, fxy, fyy, 0.0, 0.0, 0.0, 0.0);
    (p.z - f, Vec3::new(-fx, -fy, 1.0), hessian)
}

/// The point at parameters `(u, v)`; `dP/du x dP/dv` points outward.
///
/// For the surfaces of revolution `u` is the angle around the y axis and `v` the angle in the tube or the height; for the
/// height fields they are x and y; for sphere and ellipsoid the longitude and the latitude.
pub(super) fn point(shape: StudyShape, u: f64, v: f64) -> Vec3 {
    let revolve = |radius: f64, y: f64| Vec3::new(radius * u.sin(), y, radius * u.cos());
    match shape {
        StudyShape::Sphere => revolve(v.cos(), v.sin()),
        StudyShape::Ellipsoid => revolve(v.cos(), v.sin()).component_mul(&Vec3::from(HALF_AXES)),
        StudyShape::Torus => revolve(MAJOR + MINOR * v.cos(), MINOR * v.sin()),
        StudyShape::Catenoid => revolve(v.cosh(), v),
        StudyShape::Cylinder => revolve(1.0, v),
        StudyShape::Bump => {
            Vec3::new(u, v, BUMP_HEIGHT * (-(u * u + v * v) / (2.0 * BUMP_WIDTH * BUMP_WIDTH)).exp())
        }
        StudyShape::MonkeySaddle => Vec3::new(u, v, u * (u * u - 3.0 * v * v) / 3.0),
    }
}

#[cfg(test)]
mod tests {
    use nalgebra::Matrix2;

    use super::*;

    /// The tensor of a parametrised surface from central differences: `S = I^-1 II` with `II = -n . d2P`, mapped to space.
    fn tensor_by_differences(shape: StudyShape, u: f64, v: f64) -> (Vec3, Mat3) {
        // The second difference loses eps / h^2 = 2e-8 to rounding and h^2 = 1e-8 to truncation.
        let h = 1e-4;
        let at = |i: f64, j: f64| point(shape, u + i * h, v + j * h);
        let (pu, pv) =
            ((at(1.0, 0.0) - at(-1.0, 0.0)) / (2.0 * h), (at(0.0, 1.0) - at(0.0, -1.0)) / (2.0 * h));
        let puu = (at(1.0, 0.0) - 2.0 * at(0.0, 0.0) + at(-1.0, 0.0)) / (h * h);
        let pvv = (at(0.0, 1.0) - 2.0 * at(0.0, 0.0) + at(0.0, -1.0)) / (h * h);
        let puv = (at(1.0, 1.0) - at(1.0, -1.0) - at(-1.0, 1.0) + at(-1.0, -1.0)) / (4.0 * h * h);
        let n = pu.cross(&pv).normalize();
        let first = Matrix2::new(pu.dot(&pu), pu.dot(&pv), pu.dot(&pv), pv.dot(&pv)).try_inverse().unwrap();
        let second = -Matrix2::new(puu.dot(&n), puv.dot(&n), puv.dot(&n), pvv.dot(&n));
        let inner = first * second * first;
        let basis = nalgebra::Matrix3x2::from_columns(&[pu, pv]);
        (n, basis * inner * basis.transpose())
    }

    #[test]
    fn closed_forms_agree_with_differences_of_the_parametrisation() {
        for shape in StudyShape::ALL {
            for (u, v) in [(0.3, 0.2), (-0.7, 0.9), (0.9, -0.55), (-0.1, -0.95), (2.8, 1.2)] {
                let p = point(shape, u, v);
                assert!(level_set(shape, &p).0.abs() < 1e-14, "{} contains its points", shape.name());
                let (normal, tensor) = tensor_by_differences(shape, u, v);
                let found = exact(shape, &p);
                let name = shape.name();
                assert!((found.normal() - normal).norm() < 1e-6, "{name}: {} {normal}", found.normal());
                assert!(found.kappa_min <= found.kappa_max, "{name}");
                let off = (found.tensor() - tensor).amax() * shape.radius();
                assert!(off < 1e-6, "{name} at {u}, {v}: {off:e}");
            }
        }
    }

    #[test]
    fn signs_are_those_of_convex_bodies() {
        let at = |shape: StudyShape, u, v| exact(shape, &point(shape, u, v));
        let sphere = at(StudyShape::Sphere, 0.3, 0.4);
        assert!((sphere.kappa_min - 1.0).abs() < 1e-14 && (sphere.kappa_max - 1.0).abs() < 1e-14);
        let torus = at(StudyShape::Torus, 1.0, 0.0);
        assert!((torus.kappa_max - 2.5).abs() < 1e-14 && (torus.kappa_min - 1.0 / 1.4).abs() < 1e-14);
        let waist = at(StudyShape::Catenoid, 1.0, 0.0);
        assert!((waist.kappa_max - 1.0).abs() < 1e-14 && (waist.kappa_min + 1.0).abs() < 1e-14);
        assert!(waist.d2.y.abs() > 1.0 - 1e-14, "the catenary is the concave one: {}", waist.d2);
        let top = at(StudyShape::Bump, 0.0, 0.0);
        let expected = 1.0 / StudyShape::Bump.radius();
        assert!((top.kappa_min - expected).abs() < 1e-13 && (top.kappa_max - expected).abs() < 1e-13);
        let flat = at(StudyShape::MonkeySaddle, 0.0, 0.0);
        assert_eq!((flat.kappa_min, flat.kappa_max), (0.0, 0.0));
        let cylinder = at(StudyShape::Cylinder, 1.0, 0.4);
        assert!((cylinder.kappa_max - 1.0).abs() < 1e-14 && cylinder.kappa_min.abs() < 1e-14);
    }
}

//! Surfaces whose curvature is known in closed form.

use nalgebra::{Matrix2, SymmetricEigen};
use thiserror::Error;

use super::Expected;
use crate::{Mat3, Vec3};

/// A surface with closed-form curvature, centred at the origin, its normal outward (for the open ones: see the variant).
#[derive(Debug, Clone, Copy, PartialEq)]
pub enum Shape {
    /// `|p| = radius`.
    Sphere {
        /// Radius.
        radius: f64,
    },
    /// Tube of radius `minor` around the circle of radius `major` in the plane through the origin across `axis`.
    Torus {
        /// Distance from the axis to the middle of the tube.
        major: f64,
        /// Radius of the tube, less than `major`.
        minor: f64,
        /// Axis of revolution.
        axis: Axis,
    },
    /// Infinite cylinder around an axis through the origin.
    Cylinder {
        /// Radius.
        radius: f64,
        /// Its axis.
        axis: Axis,
    },
    /// `(x/a)^2 + (y/b)^2 + (z/c)^2 = 1`.
    Ellipsoid {
        /// Half-axes along x, y and z.
        axes: Vec3,
    },
    /// `axis` coordinate constant: any plane across a coordinate axis.
    Plane {
        /// Direction of the normal, up to sign.
        axis: Axis,
    },
    /// `z = x y` or, the same surface turned by 45 degrees, `z = (x^2 - y^2) / 2`; normal towards +z.
    Saddle {
        /// Which of the two.
        form: SaddleForm,
    },
}

/// How a saddle is turned.
#[derive(Debug, Clone, Copy, PartialEq, Eq, Default)]
pub enum SaddleForm {
    /// As fits the vertices better.
    #[default]
    Fitted,
    /// `z = x y`.
    Product,
    /// `z = (x^2 - y^2) / 2`.
    Squares,
}

/// A coordinate axis, or the one that fits the vertices best.
#[derive(Debug, Clone, Copy, PartialEq, Eq, Default)]
pub enum Axis {
    /// The axis with the smallest largest distance of a vertex.
    #[default]
    Fitted,
    /// x.
    X,
    /// y.
    Y,
    /// z.
    Z,
}

/// A vertex that is not on the shape.
#[derive(Debug, Clone, PartialEq, Error)]
#[error(
    "vertex {vertex} is {distance:e} away from the {shape}, allowed are {allowed:e}; check the shape's size, axis and position"
)]
pub struct NotOnShape {
    /// Index of the vertex farthest away.
    pub vertex: usize,
    /// Its distance.
    pub distance: f64,
    /// Largest distance that counts as on the shape.
    pub allowed: f64,
    /// The shape, in the words that its [`FromStr`](std::str::FromStr) reads.
    pub shape: String,
}

/// Distance from the shape that is allowed, relative to its size. File formats with six digits stay below.
const ON_SHAPE: f64 = 1e-5;

/// Exact curvature at a point of a shape.
struct Exact {
    kappa_max: f64,
    kappa_min: f64,
    d1: Vec3,
}

impl Exact {
    fn of_level_set(gradient: &Vec3, hessian: &Mat3) -> Self {
        let (kappa_max, kappa_min, d1) = level_set_curvature(gradient, hessian);
        Self { kappa_max, kappa_min, d1 }
    }
}

impl Shape {
    /// What vertices at these positions should have.
    ///
    /// # Errors
    ///
    /// The vertex farthest from the shape, when it is farther than 1e-5 of the shape's size.
    pub fn expected(&self, positions: &[Vec3]) -> Result<Vec<Expected>, NotOnShape> {
        let shape = self.fitted(positions);
        let offset = shape.plane_offset(positions);
        let reach = positions.iter().map(|p| (p - offset).amax()).fold(0.0, f64::max);
        let allowed = ON_SHAPE * reach.max(shape.size());
        if let Some((vertex, distance)) = shape.farthest(positions, offset)
            && (distance.is_nan() || distance > allowed)
        {
            return Err(NotOnShape { vertex, distance, allowed, shape: shape.to_string() });
        }
        let expected = positions.iter().map(|p| {
            let Exact { kappa_max, kappa_min, d1 } = shape.curvature_at(&(p - offset));
            Expected::Known { kappa_max, kappa_min, d1: Some(d1), condition: None }
        });
        Ok(expected.collect())
    }

    /// The shape with what was left to be fitted decided by the vertices.
    fn fitted(self, positions: &[Vec3]) -> Self {
        // y first, so that it wins a tie.
        let axes = [Axis::Y, Axis::Z, Axis::X];
        let candidates: Vec<Self> = match self {
            Self::Torus { major, minor, axis: Axis::Fitted } => {
                axes.map(|axis| Self::Torus { major, minor, axis }).to_vec()
            }
            Self::Cylinder { radius, axis: Axis::Fitted } => {
                axes.map(|axis| Self::Cylinder { radius, axis }).to_vec()
            }
            Self::Plane { axis: Axis::Fitted } => axes.map(|axis| Self::Plane { axis }).to_vec(),
            Self::Saddle { form: SaddleForm::Fitted } => {
                [SaddleForm::Product, SaddleForm::Squares].map(|form| Self::Saddle { form }).to_vec()
            }
            _ => return self,
        };
        let worst =
            |shape: &Self| shape.farthest(positions, shape.plane_offset(positions)).map_or(0.0, |(_, d)| d);
        candidates.into_iter().min_by(|a, b| worst(a).total_cmp(&worst(b))).unwrap_or(self)
    }

    /// For a plane a point on it; zero for the shapes that are centred at the origin.
    fn plane_offset(&self, positions: &[Vec3]) -> Vec3 {
        let (Self::Plane { axis }, Some(first)) = (self, positions.first()) else {
            return Vec3::zeros();
        };
        let n = axis.unit();
        n * n.dot(first)
    }

    fn farthest(&self, positions: &[Vec3], offset: Vec3) -> Option<(usize, f64)> {
        let distances = positions.iter().map(|p| self.distance(&(p - offset)));
        distances.enumerate().max_by(|a, b| a.1.total_cmp(&b.1))
    }

    /// A length that the shape is made of.
    fn size(&self) -> f64 {
        match *self {
            Self::Sphere { radius } | Self::Cylinder { radius, .. } => radius,
            Self::Torus { major, .. } => major,
            Self::Ellipsoid { axes } => axes.amax(),
            Self::Plane { .. } => 0.0,
            Self::Saddle { .. } => 1.0,
        }
    }

    /// Distance of a point from the shape: exact, or for ellipsoid and saddle to first order, `|F| / |grad F|`.
    fn distance(&self, p: &Vec3) -> f64 {
        match *self {
            Self::Sphere { radius } => (p.norm() - radius).abs(),
            Self::Torus { major, minor, axis } => {
                let (height, around) = axis.split(p);
                ((around.norm() - major).hypot(height) - minor).abs()
            }
            Self::Cylinder { radius, axis } => (axis.split(p).1.norm() - radius).abs(),
            Self::Ellipsoid { axes } => {
                let (value, gradient, _) = ellipsoid(&axes, p);
                value.abs() / gradient.norm()
            }
            Self::Plane { axis } => axis.split(p).0.abs(),
            Self::Saddle { form } => {
                let (value, gradient, _) = saddle(form, p);
                value.abs() / gradient.norm()
            }
        }
    }

    fn curvature_at(&self, p: &Vec3) -> Exact {
        match *self {
            Self::Sphere { radius } => {
                Exact { kappa_max: 1.0 / radius, kappa_min: 1.0 / radius, d1: any_tangent(p) }
            }
            Self::Torus { major, minor, axis } => {
                let (height, around) = axis.split(p);
                let outward = around.normalize();
                let tube = (around - outward * major) + axis.unit() * height;
                let cos = tube.dot(&outward) / tube.norm();
                // d1 runs around the tube, across its circle's tangent.
                let d1 = axis.unit().cross(&outward).cross(&tube).normalize();
                Exact { kappa_max: 1.0 / minor, kappa_min: cos / (major + minor * cos), d1 }
            }
            Self::Cylinder { radius, axis } => {
                let (_, around) = axis.split(p);
                let d1 = axis.unit().cross(&around).normalize();
                Exact { kappa_max: 1.0 / radius, kappa_min: 0.0, d1 }
            }
            Self::Ellipsoid { axes } => {
                let (_, gradient, hessian) = ellipsoid(&axes, p);
                Exact::of_level_set(&gradient, &hessian)
            }
            Self::Plane { axis } => Exact { kappa_max: 0.0, kappa_min: 0.0, d1: any_tangent(&axis.unit()) },
            Self::Saddle { form } => {
                let (_, gradient, hessian) = saddle(form, p);
                Exact::of_level_set(&gradient, &hessian)
            }
        }
    }
}

impl Axis {
    fn unit(self) -> Vec3 {
        match self {
            Self::X => Vec3::x(),
            Self::Fitted | Self::Y => Vec3::y(),
            Self::Z => Vec3::z(),
        }
    }

    /// Height along the axis, and the vector from the axis to `p`.
    fn split(self, p: &Vec3) -> (f64, Vec3) {
        let axis = self.unit();
        let height = p.dot(&axis);
        (height, p - axis * height)
    }
}

/// `F`, its gradient and its Hessian; `F` grows outward.
fn ellipsoid(axes: &Vec3, p: &Vec3) -> (f64, Vec3, Mat3) {
    let inverse_squares = axes.map(|a| 1.0 / (a * a));
    let gradient = 2.0 * p.component_mul(&inverse_squares);
    (0.5 * p.dot(&gradient) - 1.0, gradient, Mat3::from_diagonal(&(2.0 * inverse_squares)))
}

/// `F = z - f(x, y)`, which grows towards +z.
fn saddle(form: SaddleForm, p: &Vec3) -> (f64, Vec3, Mat3) {
    match form {
        SaddleForm::Fitted | SaddleForm::Product => {
            let hessian = Mat3::new(0.0, -1.0, 0.0, -1.0, 0.0, 0.0, 0.0, 0.0, 0.0);
            (p.z - p.x * p.y, Vec3::new(-p.y, -p.x, 1.0), hessian)
        }
        SaddleForm::Squares => {
            let hessian = Mat3::from_diagonal(&Vec3::new(-1.0, 1.0, 0.0));
            (p.z - 0.5 * (p.x + p.y) * (p.x - p.y), Vec3::new(-p.x, p.y, 1.0), hessian)
        }
    }
}

/// `(kappa_max, kappa_min, d1)` of a level set with outward normal `grad F / |grad F|`: the eigenvalues of `H / |grad F|`
/// restricted to the tangent plane (R. Goldman, Curvature formulas for implicit curves and surfaces, CAGD 22(7), 2005).
pub(crate) fn level_set_curvature(gradient: &Vec3, hessian: &Mat3) -> (f64, f64, Vec3) {
    let n = gradient.normalize();
    let t = any_tangent(&n);
    let b = n.cross(&t);
    let entry = |u: &Vec3, v: &Vec3| u.dot(&(hessian * v)) / gradient.norm();
    let off_diagonal = entry(&t, &b);
    let eigen = SymmetricEigen::new(Matrix2::new(entry(&t, &t), off_diagonal, off_diagonal, entry(&b, &b)));
    let larger = eigen.eigenvalues.imax();
    let v = eigen.eigenvectors.column(larger);
    let d1 = t * v[0] + b * v[1];
    (eigen.eigenvalues[larger], eigen.eigenvalues[1 - larger], d1)
}

/// A unit vector across `v`: the axis that `v` has least of, projected.
fn any_tangent(v: &Vec3) -> Vec3 {
    let n = v.normalize();
    let axis = Vec3::ith(n.iamin(), 1.0);
    (axis - n * n.dot(&axis)).normalize()
}

#[cfg(test)]
mod tests {
    use super::*;
    use crate::shapes;

    fn known(shape: &str, positions: &[Vec3]) -> Vec<(f64, f64, Vec3)> {
        let expected = shape.parse::<Shape>().unwrap().expected(positions).unwrap();
        expected
            .into_iter()
            .map(|e| match e {
                Expected::Known { kappa_max, kappa_min, d1, .. } => (kappa_max, kappa_min, d1.unwrap()),
                Expected::Skip(reason) => panic!("{reason:?}"),
            })
            .collect()
    }

    #[test]
    fn textbook_values() {
        let (max, min, d1) = known("torus:2,0.5,z", &[Vec3::new(2.5, 0.0, 0.0)])[0];
        assert_eq!((max, min), (2.0, 0.4));
        assert!(d1.z.abs() > 1.0 - 1e-15, "around the tube: {d1}");
        let (max, min, _) = known("torus:2,0.5,z", &[Vec3::new(0.0, 1.5, 0.0)])[0];
        assert_eq!((max, min), (2.0, -1.0 / 1.5));
        let (max, min, _) = known("saddle", &[Vec3::zeros()])[0];
        assert!((max - 1.0).abs() < 1e-15 && (min + 1.0).abs() < 1e-15, "{max} {min}");
        let (x, y) = (0.3, 0.7);
        let squares = known("saddle", &[Vec3::new(x, y, 0.5 * (x * x - y * y))])[0];
        let turned = Vec3::new((x + y) / 2f64.sqrt(), (x - y) / 2f64.sqrt(), 0.0);
        let product = known("saddle", &[turned + Vec3::z() * (turned.x * turned.y)])[0];
        assert!((squares.0 - product.0).abs() < 1e-14 && (squares.1 - product.1).abs() < 1e-14);
        // At the end of half-axis a the curvatures are a/b^2 and a/c^2.
        let (max, min, d1) = known("ellipsoid:3,2,1", &[Vec3::x() * 3.0])[0];
        assert!((max - 3.0).abs() < 1e-14 && (min - 0.75).abs() < 1e-14, "{max} {min}");
        assert!(d1.z.abs() > 1.0 - 1e-14);
        let (max, min, d1) = known("cylinder:4,y", &[Vec3::new(0.0, 7.0, 4.0)])[0];
        assert_eq!((max, min), (0.25, 0.0));
        assert!(d1.x.abs() > 1.0 - 1e-15);
    }

    #[test]
    fn an_ellipsoid_of_equal_axes_is_a_sphere() {
        let mesh = shapes::icosphere(2.0, 2);
        let sphere = known("sphere:2", mesh.positions());
        for (a, b) in known("ellipsoid:2,2,2", mesh.positions()).iter().zip(&sphere) {
            assert!((a.0 - b.0).abs() < 1e-14 && (a.1 - b.1).abs() < 1e-14, "{a:?} {b:?}");
        }
    }

    #[test]
    fn the_axis_is_found_and_strays_are_named() {
        let torus = shapes::torus(1.0, 0.45, 12, 8);
        assert_eq!(known("torus:1,0.45", torus.positions()), known("torus:1,0.45,y", torus.positions()));
        let cylinder = shapes::cylinder(1.0, 2.0, 12, 3);
        assert_eq!(known("cylinder:1", cylinder.positions())[0].0, 1.0);
        assert!(known("plane", shapes::plane(3, 3).positions()).iter().all(|k| k.0 == 0.0 && k.1 == 0.0));
        let mut positions = torus.positions().to_vec();
        positions[7] *= 1.01;
        let error = "torus:1,0.45".parse::<Shape>().unwrap().expected(&positions).unwrap_err();
        assert_eq!(error.vertex, 7);
        assert!(error.distance > 1e-3 && error.to_string().contains("torus:1,0.45"), "{error}");
    }
}

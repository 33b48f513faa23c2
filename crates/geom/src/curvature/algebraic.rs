//! Algebraic spheres with the exact derivative of the fit: for noise.
//!
//! A sphere `u_c + u_l . x + u_q |x|^2 = 0` is fitted to the positions and normals of the neighbours (Guennebaud and Gross,
//! "Algebraic Point Set Surfaces", SIGGRAPH 2007, section 4), weighted by `w = (1 - |p|^2 / t^2)^2`. Where the sphere
//! is fitted somewhat further along the surface, it is another one, since the weights are others. The gradient field of
//! these spheres is a smooth field of normals, and its differential in space is the shape operator: a sphere is the model,
//! but any curvature comes out (Lejemble, Coeurjolly, Barthe and Mellado, "Stable and Efficient Differential Estimators
//! on Oriented Point Clouds", SGP 2021, section 4). Curvature is a *first* derivative of averaged normals, where a height
//! fit takes a second derivative of positions; that is why noise does less harm.
//!
//! Two things differ from the paper. The sums run over rings, which do not fill a ball, and over irregular points: then the
//! mean position `S_p / S_w` does not follow the point of evaluation one to one, and the differential of `u_l` comes out too
//! small. So it is taken by the mean position instead: times the inverse of `d(S_p / S_w)` in the tangent plane. For a normal field
//! that is linear in the plane that is exact where neighbours lie symmetrically, and where the field is that of a sphere, whatever the points. A
//! saddle seen from one side, as at a boundary, comes out a fifth off. And the point of evaluation is the vertex itself, not its
//! projection onto the sphere.
//!
//! The neighbourhood is one on the surface, and neighbours that face away weigh nothing, so that sheets that lie on each
//! other do not mix. (They still count as members of a neighbourhood by number, which then sees fewer on this side.)

use super::estimate::{Prepared, Scratch};
use super::local_fit::Cloud;
use super::shape_operator::{Frame, Symmetric};
use super::support::{Attempt, NEAREST, Reach, enlarging_cloud, reference_normal, shorten};
use super::{Neighbourhood, Principal, VertexCurvature};
use crate::{Mat3, Vec3};

/// As for a quadric: fewer points than this say nothing about the quality of the fit.
const LEAST_POINTS: usize = 7;

/// Squared support of the weights over the squared distance of the farthest neighbour. At 1 that neighbour would weigh nothing;
/// much above 1, weights end in a step where the neighbourhood does, and its derivative is missed.
const SUPPORT: f64 = 1.1;

/// Least ratio of the two principal variances of the neighbours in the tangent plane. Below it they lie on a line as far
/// as rounding can tell, and nothing is known across it.
const LEAST_SPREAD: f64 = 1e-9;

/// Stated error over the change from the inner half of the neighbourhood. Bias falls with the area, so half of it shows; noise
/// is larger in the inner half, and shows whole. Smaller: the bar fails at shapes that bend fast. Measured by
/// `cargo test --release -p osculate-tests --test estimators -- --nocapture`: the bar holds at 84 to 99.6 % of the vertices of
/// a study shape without noise (the least on the cylinder), and at 98 to 99 % with 20 % noise.
const OF_CHANGE: f64 = 3.0;

pub(super) fn estimate_vertex(
    prepared: &Prepared<'_>,
    vertex: u32,
    neighbourhood: Neighbourhood,
    scratch: &mut Scratch<'_>,
) -> VertexCurvature {
    enlarging_cloud(prepared, vertex, neighbourhood, LEAST_POINTS, scratch, |scratch, whole| {
        fit(scratch, whole)
    })
}

fn fit(scratch: &Scratch<'_>, whole: Reach) -> Option<Attempt> {
    let cloud = &scratch.cloud;
    let normal = reference_normal(cloud, whole.count.min(NEAREST));
    let length = cloud.extent(whole.count)?;
    let operator = shape_operator(cloud, whole.count, &normal, length)?;
    let (tensor, principal) = operator.principal()?;
    let half = shorten(scratch, whole, whole.count.div_ceil(2).max(LEAST_POINTS));
    let inner = shape_operator(cloud, half.count, &normal, length).and_then(|inner| inner.principal());
    // Without an inner fit nothing is known but the size of the curvature itself.
    let change = inner.map_or(tensor.norm(), |(inner, _)| (tensor - inner).norm());
    let scaled = |kappa: f64| kappa / length;
    let principal = Principal {
        kappa_max: scaled(principal.kappa_max),
        kappa_min: scaled(principal.kappa_min),
        ..principal
    };
    let error = OF_CHANGE * change / length;
    let finite = principal.kappa_max.is_finite() && principal.kappa_min.is_finite() && error.is_finite();
    finite.then_some(Attempt::Fitted { principal, error, length })
}

/// Differential of the field of gradients, and the gradient, at the point of evaluation; in units of the neighbourhood.
#[derive(Debug, Clone, Copy)]
struct Operator {
    gradient: Vec3,
    differential: Mat3,
}

impl Operator {
    /// The curvature tensor and its principal values. `None` without a normal.
    fn principal(&self) -> Option<(Mat3, Principal)> {
        let size = self.gradient.norm();
        let frame = Frame::around(self.gradient.try_normalize(0.0)?);
        let (t, s) = (self.differential * frame.t / size, self.differential * frame.s / size);
        let symmetric = Symmetric {
            xx: frame.t.dot(&t),
            xy: 0.5 * (frame.s.dot(&t) + frame.t.dot(&s)),
            yy: frame.s.dot(&s),
        };
        let principal = symmetric.lift(frame.t, frame.s);
        let tensor = principal.tensor();
        tensor.iter().all(|x| x.is_finite()).then_some((tensor, principal))
    }
}

/// The fit at the vertex. (Once more at the vertex's foot point on the sphere changes errors by less than 1 %, clean and noisy,
/// and costs as much again.)
fn shape_operator(cloud: &Cloud, count: usize, normal: &Vec3, length: f64) -> Option<Operator> {
    let facing = |i: &usize| cloud.normal(*i).dot(normal) > 0.0;
    let scale = 1.0 / length;
    let farthest =
        (0..count).filter(facing).map(|i| (cloud.offset(i) * scale).norm_squared()).fold(0.0, f64::max);
    let support = SUPPORT * farthest;
    let sums = Sums::new(cloud, count, normal, length, support);
    let sphere = sums.sphere()?;
    sums.operator(&sphere)
}

/// The gradient of the sphere's equation is `linear + 2 quadratic x`.
#[derive(Debug, Clone, Copy)]
struct Sphere {
    linear: Vec3,
    quadratic: f64,
    /// `S_pp - S_p . S_p / S_w`.
    variance: f64,
}

/// Weighted sums over the neighbours, and their derivatives by the point of evaluation (rows of a matrix: what is summed).
#[derive(Debug, Clone, Copy)]
struct Sums {
    w: f64,
    p: Vec3,
    n: Vec3,
    pn: f64,
    pp: f64,
    dw: Vec3,
    dp: Mat3,
    dn: Mat3,
    dpn: Vec3,
    dpp: Vec3,
}

impl Sums {
    fn new(cloud: &Cloud, count: usize, normal: &Vec3, length: f64, support: f64) -> Self {
        let (zero, none) = (Vec3::zeros(), Mat3::zeros());
        let mut s = Self {
            w: 0.0,
            p: zero,
            n: zero,
            pn: 0.0,
            pp: 0.0,
            dw: zero,
            dp: none,
            dn: none,
            dpn: zero,
            dpp: zero,
        };
        let (scale, inverse) = (1.0 / length, 1.0 / support);
        for i in 0..count {
            let n = cloud.normal(i);
            let p = cloud.offset(i) * scale;
            let pp = p.norm_squared();
            let fall = 1.0 - pp * inverse;
            if fall <= 0.0 || n.dot(normal) <= 0.0 {
                continue;
            }
            let (w, pn) = (fall * fall, p.dot(&n));
            // The weight of a fixed neighbour grows as the point of evaluation comes nearer.
            let g = p * (4.0 * fall * inverse);
            s.w += w;
            s.p += p * w;
            s.n += n * w;
            s.pn += pn * w;
            s.pp += pp * w;
            s.dw += g;
            s.dp += p * g.transpose();
            s.dn += n * g.transpose();
            s.dpn += g * pn;
            s.dpp += g * pp;
        }
        s
    }

    /// The fitted sphere; `None` if the points do not extend.
    fn sphere(&self) -> Option<Sphere> {
        let variance = self.pp - self.p.norm_squared() / self.w;
        if variance.is_nan() || variance <= f64::EPSILON * self.pp {
            return None;
        }
        let quadratic = 0.5 * (self.pn - self.p.dot(&self.n) / self.w) / variance;
        let linear = (self.n - self.p * (2.0 * quadratic)) / self.w;
        Some(Sphere { linear, quadratic, variance })
    }

    /// The differential of the gradient field `u_l + 2 u_q x` at `x = 0`; `None` if the points lie on a line.
    fn operator(&self, sphere: &Sphere) -> Option<Operator> {
        let &Sphere { linear, quadratic, variance, .. } = sphere;
        let frame = Frame::around(linear.try_normalize(0.0)?);
        let (tt, ts, ss) = (
            frame.t.dot(&(self.dp * frame.t)),
            frame.t.dot(&(self.dp * frame.s)),
            frame.s.dot(&(self.dp * frame.s)),
        );
        let determinant = tt * ss - ts * ts;
        if determinant.is_nan() || determinant <= LEAST_SPREAD * (tt + ss) * (tt + ss) {
            return None;
        }
        let dot = self.p.dot(&self.n) / (self.w * self.w);
        let d_numerator =
            self.dpn - (self.dp.tr_mul(&self.n) + self.dn.tr_mul(&self.p)) / self.w + self.dw * dot;
        let squared = self.p.norm_squared() / (self.w * self.w);
        let d_variance = self.dpp - self.dp.tr_mul(&self.p) * (2.0 / self.w) + self.dw * squared;
        let d_quadratic = (0.5 * d_numerator - d_variance * quadratic) / variance;
        let d_linear = (self.dn
            - self.p * d_quadratic.transpose() * 2.0
            - self.dp * (2.0 * quadratic)
            - linear * self.dw.transpose())
            / self.w;
        // How the mean position follows the point of evaluation. It would be the identity for a disc that is filled evenly
        // and a weight that ends at its rim.
        let d_mean = (self.dp - self.p * self.dw.transpose() / self.w) / self.w;
        let m = |x: &Vec3, y: &Vec3| x.dot(&(d_mean * y));
        let (t, s) = (frame.t, frame.s);
        let (a, b, c, d) = (m(&t, &t), m(&t, &s), m(&s, &t), m(&s, &s));
        let det = a * d - b * c;
        // Columns of d_linear times the inverse.
        let (lt, ls) = (d_linear * t, d_linear * s);
        let (ct, cs) = ((lt * d - ls * c) / det, (ls * a - lt * b) / det);
        let differential = ct * t.transpose() + cs * s.transpose() + Mat3::identity() * (2.0 * quadratic);
        Some(Operator { gradient: linear, differential })
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    /// Irregular points of the plane `z = 0` whose normals are `z + A p`; how far the operator is from `A`.
    fn off(a: [f64; 3], points: impl Fn(f64, f64) -> Vec<Vec3>) -> f64 {
        let [xx, xy, yy] = a;
        let field = |p: &Vec3| Vec3::new(xx * p.x + xy * p.y, xy * p.x + yy * p.y, 1.0);
        let mut cloud = Cloud::default();
        cloud.reserve(100);
        cloud.push(&Vec3::zeros(), &Vec3::z(), 0.0);
        for i in 0..40 {
            let t = f64::from(i);
            for p in points((12.9898 * t).sin(), (78.233 * t).cos()) {
                cloud.push(&p, &field(&p), p.norm_squared());
            }
        }
        let found = shape_operator(&cloud, cloud.len(), &Vec3::z(), 1.0).unwrap();
        let tensor = found.differential / found.gradient.z;
        let expected = [[xx, xy], [xy, yy]];
        let entries = (0..2).flat_map(|i| (0..2).map(move |j| (i, j)));
        entries.map(|(i, j)| (tensor[(i, j)] - expected[i][j]).abs()).fold(0.0, f64::max)
    }

    #[test]
    fn linear_fields_of_normals_are_exact_where_the_document_says_so() {
        let one_sided = |x: f64, y: f64| vec![Vec3::new(x.abs(), y, 0.0)];
        let symmetric = |x: f64, y: f64| vec![Vec3::new(x, y, 0.0), Vec3::new(-x, -y, 0.0)];
        assert!(off([0.3, 0.0, 0.3], one_sided) < 1e-12);
        assert!(off([0.3, 0.1, -0.2], symmetric) < 1e-12);
        // A saddle seen from its side: the sphere in the middle bends with the point of evaluation.
        let side = off([0.3, 0.0, -0.2], one_sided);
        assert!(side > 1e-3 && side < 0.1, "{side}");
    }
}

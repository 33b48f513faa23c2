//! Solution of the normal equations for all degrees at once.
//!
//! With the unknowns in order of degree, the equations of degree 2 are the leading block of those of degree 3, and so on.
//! One elimination `N = L D L^T` serves them all: with `y = L^-1 r` and `W = L^-1 E`, where `E` picks the unknowns of
//! interest, the solution of the leading `m` equations is `sum_{k<m} W_k y_k / D_k`, its covariance for unit noise
//! `sum_{k<m} W_k W_k^T / D_k`, and the squared residual that it leaves `r_zz - sum_{k<m} y_k^2 / D_k`. So a degree
//! costs a few more terms of three sums, and what one degree adds to another is at hand for the error estimate.

use super::kernel::Moments;
use crate::curvature::moments::Height;

/// Unknowns of a polynomial of degree 4.
const UNKNOWNS: usize = 15;
/// Columns: the unknowns, the right-hand side, and the six picked unknowns, padded to whole registers.
const COLUMNS: usize = 24;
/// Column of the right-hand side.
const RIGHT: usize = UNKNOWNS;
/// First column of the picked unknowns: height, slopes, second derivatives.
const PICKED: usize = UNKNOWNS + 1;

/// Exponents `(p, q)` of the monomials `u^p v^q` in order of degree.
const MONOMIALS: [(usize, usize); UNKNOWNS] = [
    (0, 0),
    (1, 0),
    (0, 1),
    (2, 0),
    (1, 1),
    (0, 2),
    (3, 0),
    (2, 1),
    (1, 2),
    (0, 3),
    (4, 0),
    (3, 1),
    (2, 2),
    (1, 3),
    (0, 4),
];

/// A polynomial of one degree, as far as curvature needs it.
#[derive(Debug, Clone, Copy, PartialEq)]
pub(crate) struct Polynomial {
    /// Height at the origin of the fit.
    pub(crate) shift: f64,
    /// Slopes and second-order coefficients.
    pub(crate) height: Height,
    /// Variances of the coefficients `(a, b, c)` for weights that are inverse variances.
    pub(crate) variances: [f64; 3],
    /// Mean squared residual, corrected for the number of coefficients and for few points; infinite where there are as many
    /// coefficients as points.
    pub(crate) variance: f64,
}

/// Polynomials of degree 2 and up to the degree asked for; `None` from the first that the points do not determine.
pub(super) fn solve(moments: &Moments, degree: usize, least_pivot: f64) -> [Option<Polynomial>; 3] {
    #[cfg(target_arch = "x86_64")]
    if std::arch::is_x86_feature_detected!("avx512f") {
        #[allow(unsafe_code, reason = "calling a function compiled for AVX-512 requires it")]
        // SAFETY: the processor has AVX-512F, as was just checked.
        return unsafe { avx512::solve(moments, degree, least_pivot) };
    }
    portable::solve(moments, degree, least_pivot)
}

/// The elimination for one set of lanes.
macro_rules! elimination {
    ($name:ident $(, $feature:literal)?) => {
        mod $name {
            use crate::curvature::lanes::$name::{load, mul, splat, store, sub};
            use super::{Moments, Polynomial, Sums, UNKNOWNS, assemble};

            $(#[target_feature(enable = $feature)])?
            pub(super) fn solve(
                moments: &Moments,
                degree: usize,
                least_pivot: f64,
            ) -> [Option<Polynomial>; 3] {
                let unknowns = (degree + 1) * (degree + 2) / 2;
                let mut a = assemble(moments, unknowns);
                let diagonal: [f64; UNKNOWNS] = std::array::from_fn(|i| a[i].0[i]);
                let mut found = [None; 3];
                let mut sums = Sums { left: moments.squares, ..Sums::default() };
                for k in 0..unknowns {
                    let pivot = a[k].0[k];
                    // A pivot over its diagonal is the share of a column that the columns before do not explain.
                    if !(pivot > least_pivot * diagonal[k] && pivot < f64::INFINITY) {
                        break;
                    }
                    let inverse = 1.0 / pivot;
                    sums.add(&a[k].0, inverse);
                    let row = [load(a[k].part(0)), load(a[k].part(1)), load(a[k].part(2))];
                    let first_part = (k + 1) / 8;
                    for i in k + 1..unknowns {
                        let factor = splat(a[k].0[i] * inverse);
                        for part in first_part..3 {
                            let value = sub(load(a[i].part(part)), mul(factor, row[part]));
                            store(value, a[i].part_mut(part));
                        }
                    }
                    if let Some(index) = [6, 10, 15].iter().position(|&end| end == k + 1) {
                        found[index] = Some(sums.polynomial(moments, k + 1));
                    }
                }
                found
            }
        }
    };
}

elimination!(portable);
#[cfg(target_arch = "x86_64")]
elimination!(avx512, "avx512f");

/// A row of the equations.
#[derive(Clone, Copy)]
#[repr(align(64))]
struct Row([f64; COLUMNS]);

impl Row {
    #[inline(always)]
    fn part(&self, part: usize) -> &[f64; 8] {
        self.0[8 * part..8 * part + 8].first_chunk().expect("eight numbers")
    }

    #[inline(always)]
    fn part_mut(&mut self, part: usize) -> &mut [f64; 8] {
        self.0[8 * part..8 * part + 8].first_chunk_mut().expect("eight numbers")
    }
}

#[inline(always)]
fn assemble(moments: &Moments, unknowns: usize) -> [Row; UNKNOWNS] {
    let mut a = [Row([0.0; COLUMNS]); UNKNOWNS];
    for (i, &(p, q)) in MONOMIALS[..unknowns].iter().enumerate() {
        // Upper triangle only: elimination never reads below the diagonal.
        for (j, &(r, s)) in MONOMIALS[..unknowns].iter().enumerate().skip(i) {
            a[i].0[j] = match (p + r, q + s) {
                (0, 0) => moments.weight,
                (p, 0) => moments.rows[0][p - 1],
                (p, q) => moments.rows[q][p],
            };
        }
        a[i].0[RIGHT] = moments.heights[q][p];
        if i < 6 {
            a[i].0[PICKED + i] = 1.0;
        }
    }
    a
}

/// The running sums over eliminated rows.
#[derive(Default)]
struct Sums {
    /// Solution, six picked unknowns.
    x: [f64; 6],
    variances: [f64; 3],
    left: f64,
}

impl Sums {
    #[inline(always)]
    fn add(&mut self, row: &[f64; COLUMNS], inverse: f64) {
        let y = row[RIGHT] * inverse;
        for (x, w) in self.x.iter_mut().zip(&row[PICKED..]) {
            *x += w * y;
        }
        self.left -= row[RIGHT] * y;
        let [a, b, c] = [row[PICKED + 3], row[PICKED + 4], row[PICKED + 5]];
        for (sum, term) in self.variances.iter_mut().zip([a * a, b * b, c * c]) {
            *sum += term * inverse;
        }
    }

    #[inline(always)]
    fn polynomial(&self, moments: &Moments, unknowns: usize) -> Polynomial {
        let [shift, d, e, a, b, c] = self.x;
        let spare = moments.count - unknowns as f64;
        // Where the residual drowns in the rounding of the squares it is that rounding.
        let left = self.left.max(moments.squares * f64::EPSILON) * moments.count / moments.weight;
        // A variance from few residuals may be small by luck; this is what Student's distribution adds at 95 %.
        let variance = if spare > 0.0 { left / spare * (1.0 + 4.0 / spare) } else { f64::INFINITY };
        Polynomial { shift, height: Height { a, b, c, d, e }, variances: self.variances, variance }
    }
}

#[cfg(test)]
mod tests {
    use nalgebra::{DMatrix, DVector};

    use super::super::kernel::{HEIGHT_ROWS, MOMENT_ROWS};
    use super::*;

    /// Weights, places and heights that no polynomial of degree 4 goes through.
    fn points() -> Vec<[f64; 4]> {
        let point = |i: u32| {
            let t = f64::from(i);
            let (u, v) = ((1.3 * t).sin(), (2.1 * t + 0.4).cos());
            [
                1.0 - 0.02 * t,
                u,
                v,
                0.3 + 0.1 * u - 0.2 * v + 0.7 * u * u - 0.4 * u * v + 0.05 * (7.0 * t).sin(),
            ]
        };
        (0..22).map(point).collect()
    }

    fn moments(points: &[[f64; 4]]) -> Moments {
        let mut m = Moments { count: points.len() as f64, ..Moments::default() };
        for &[w, u, v, h] in points {
            (m.weight, m.squares) = (m.weight + w, m.squares + w * h * h);
            let power = |x: f64, n: usize| x.powi(i32::try_from(n).unwrap());
            for q in 0..MOMENT_ROWS {
                for p in 0..8 {
                    m.rows[q][p] += w * power(u, p + usize::from(q == 0)) * power(v, q);
                    if q < HEIGHT_ROWS {
                        m.heights[q][p] += w * h * power(u, p) * power(v, q);
                    }
                }
            }
        }
        m
    }

    #[test]
    fn equals_least_squares_by_orthogonal_factors() {
        let points = points();
        let found = solve(&moments(&points), 4, 1e-7);
        for (degree, unknowns) in [(2, 6), (3, 10), (4, 15)] {
            let root = |i: usize| points[i][0].sqrt();
            let power = |i: usize, j: usize| {
                let (p, q) = MONOMIALS[j];
                points[i][1].powf(p as f64) * points[i][2].powf(q as f64)
            };
            // `powf` of a negative number and a whole exponent is exact about the sign.
            let matrix = DMatrix::from_fn(points.len(), unknowns, |i, j| root(i) * power(i, j));
            let right = DVector::from_fn(points.len(), |i, _| root(i) * points[i][3]);
            let svd = matrix.clone().svd(true, true);
            let x = svd.solve(&right, 0.0).unwrap();
            let pseudo = svd.pseudo_inverse(0.0).unwrap();
            let covariance = &pseudo * pseudo.transpose();
            let left = (&matrix * &x - &right).norm_squared();
            let weight: f64 = points.iter().map(|p| p[0]).sum();
            let (count, spare) = (points.len() as f64, (points.len() - unknowns) as f64);
            let variance = left * count / weight / spare * (1.0 + 4.0 / spare);
            let Polynomial { shift, height: Height { a, b, c, d, e }, variances, variance: own } =
                found[degree - 2].unwrap();
            let pairs = [shift, d, e, a, b, c].into_iter().zip(x.iter().copied());
            let pairs = pairs.chain((3..6).map(|k| (variances[k - 3], covariance[(k, k)])));
            for (one, two) in pairs.chain([(own, variance)]) {
                assert!((one - two).abs() < 1e-9 * (1.0 + two.abs()), "degree {degree}: {one} {two}");
            }
        }
    }

    #[test]
    fn what_the_points_do_not_determine_is_none() {
        // On a line nothing is known across it; six points leave nothing to tell an error from.
        let line: Vec<[f64; 4]> = points().iter().map(|&[w, u, _, h]| [w, u, 0.5 * u, h]).collect();
        assert_eq!(solve(&moments(&line), 4, 1e-7), [None; 3]);
        let six = solve(&moments(&points()[..6]), 2, 1e-7)[0].unwrap();
        assert_eq!(six.variance, f64::INFINITY);
    }
}

//! Normal equations of a quadric fit, accumulated as moments.
//!
//! A height function `z = a u^2 + b uv + c v^2 + d u + e v` through the origin has the normal equations `N x = r`, where
//! all 15 entries of `N` are among the 12 moments `sum w u^p v^q` of degree 2 to 4.

use nalgebra::{SMatrix, SVector};

/// Coefficients `a, b, c, d, e`.
pub(crate) type Coefficients = SVector<f64, 5>;
type Matrix5 = SMatrix<f64, 5, 5>;

/// Neighbours as structure of arrays in the fit frame, scaled to order one.
#[derive(Debug, Default)]
pub(crate) struct Points {
    pub(crate) u: Vec<f64>,
    pub(crate) v: Vec<f64>,
    pub(crate) z: Vec<f64>,
    pub(crate) weight: Vec<f64>,
}

impl Points {
    pub(crate) fn clear(&mut self) {
        for row in [&mut self.u, &mut self.v, &mut self.z, &mut self.weight] {
            row.clear();
        }
    }

    pub(crate) fn push(&mut self, u: f64, v: f64, z: f64, weight: f64) {
        self.u.push(u);
        self.v.push(v);
        self.z.push(z);
        self.weight.push(weight);
    }

    pub(crate) fn len(&self) -> usize {
        self.u.len()
    }
}

/// The normal equations of the fit.
#[derive(Debug, Clone, Copy)]
pub(crate) struct NormalEquations {
    matrix: Matrix5,
    right: Coefficients,
    /// `sum w z^2`.
    squares: f64,
    /// `sum w`.
    weight: f64,
    /// `sum w u` and `sum w v`.
    first: [f64; 2],
}

/// Lanes that are summed side by side; the compiler turns them into vector registers.
const LANES: usize = 4;
/// 12 moments of `u, v` of degree 2 to 4, 5 with `z`, `z^2`, and 3 of degree 0 and 1.
const SUMS: usize = 21;

impl NormalEquations {
    /// Sums over all points, in an order that depends on their number only.
    pub(crate) fn accumulate(points: &Points) -> Self {
        let mut sums = [[0.0; LANES]; SUMS];
        let rows = [&points.u, &points.v, &points.z, &points.weight];
        let full = points.len() / LANES * LANES;
        for start in (0..full).step_by(LANES) {
            let lanes =
                rows.map(|row| <[f64; LANES]>::try_from(&row[start..start + LANES]).expect("LANES long"));
            add(&mut sums, &lanes);
        }
        if full < points.len() {
            let mut lanes = [[0.0; LANES]; 4];
            for (lane, row) in lanes.iter_mut().zip(rows) {
                lane[..row.len() - full].copy_from_slice(&row[full..]);
            }
            add(&mut sums, &lanes);
        }
        Self::from_sums(&sums.map(|s| (s[0] + s[1]) + (s[2] + s[3])))
    }

    fn from_sums(s: &[f64; SUMS]) -> Self {
        let &[
            u4,
            u3v,
            u2v2,
            uv3,
            v4,
            u3,
            u2v,
            uv2,
            v3,
            u2,
            uv,
            v2,
            zu2,
            zuv,
            zv2,
            zu,
            zv,
            squares,
            weight,
            u1,
            v1,
        ] = s;
        #[rustfmt::skip]
        let matrix = Matrix5::new(
            u4,   u3v,  u2v2, u3,  u2v,
            u3v,  u2v2, uv3,  u2v, uv2,
            u2v2, uv3,  v4,   uv2, v3,
            u3,   u2v,  uv2,  u2,  uv,
            u2v,  uv2,  v3,   uv,  v2,
        );
        Self { matrix, right: Coefficients::new(zu2, zuv, zv2, zu, zv), squares, weight, first: [u1, v1] }
    }

    /// The equations of both sets of points.
    pub(crate) fn plus(&self, other: &Self) -> Self {
        Self {
            matrix: self.matrix + other.matrix,
            right: self.right + other.right,
            squares: self.squares + other.squares,
            weight: self.weight + other.weight,
            first: [self.first[0] + other.first[0], self.first[1] + other.first[1]],
        }
    }

    /// Sum of all weights.
    pub(crate) fn weight(&self) -> f64 {
        self.weight
    }

    /// The right-hand side that a height of one at every point gives.
    pub(crate) fn constant(&self) -> Coefficients {
        let m = &self.matrix;
        Coefficients::new(m[(3, 3)], m[(3, 4)], m[(4, 4)], self.first[0], self.first[1])
    }

    /// Squared distance to the points that determine second derivatives: `sum w r^4 / sum w r^2`. The error that the
    /// surface's fourth derivatives cause is proportional to it.
    pub(crate) fn reach_squared(&self) -> f64 {
        let m = &self.matrix;
        (m[(0, 0)] + 2.0 * m[(0, 2)] + m[(2, 2)]) / (m[(3, 3)] + m[(4, 4)])
    }

    /// Solves by Cholesky after scaling the diagonal to one. `None` when a pivot falls below `least_pivot`: then the
    /// points do not determine the coefficients, or not to the accuracy that the caller needs.
    ///
    /// A pivot is the share of a column that the columns before it do not explain, so it lies in `(0, 1]` and does not
    /// depend on scale. The solution's relative error is about `f64::EPSILON` over the least pivot.
    pub(crate) fn solve(&self, least_pivot: f64) -> Option<Solution> {
        let diagonal = self.matrix.diagonal();
        if !diagonal.iter().all(|d| d.is_finite() && *d > 0.0) {
            return None;
        }
        let scale = diagonal.map(|d| 1.0 / d.sqrt());
        let mut factor = self.matrix;
        for column in 0..5 {
            for row in column..5 {
                factor[(row, column)] *= scale[row] * scale[column];
            }
        }
        for column in 0..5 {
            for earlier in 0..column {
                let f = factor[(column, earlier)];
                for row in column..5 {
                    factor[(row, column)] -= factor[(row, earlier)] * f;
                }
            }
            let pivot = factor[(column, column)];
            if pivot.is_nan() || pivot < least_pivot {
                return None;
            }
            let inverse = 1.0 / pivot.sqrt();
            for row in column..5 {
                factor[(row, column)] *= inverse;
            }
        }
        let mut coefficients = self.right.component_mul(&scale);
        factor.solve_lower_triangular_mut(&mut coefficients);
        factor.tr_solve_lower_triangular_mut(&mut coefficients);
        coefficients.component_mul_assign(&scale);
        Some(Solution { coefficients, factor, scale, squares_left: self.squares_left(&coefficients) })
    }

    /// `sum w (z - fit)^2`, clamped at zero where it drowns in rounding.
    fn squares_left(&self, coefficients: &Coefficients) -> f64 {
        (self.squares - coefficients.dot(&self.right)).max(0.0)
    }
}

/// A solved fit.
#[derive(Debug, Clone, Copy)]
pub(crate) struct Solution {
    pub(crate) coefficients: Coefficients,
    /// Weighted sum of squared residuals.
    pub(crate) squares_left: f64,
    factor: Matrix5,
    scale: Coefficients,
}

impl Solution {
    /// Variance of `direction . coefficients` for residuals of unit variance: `direction^T N^-1 direction`.
    pub(crate) fn variance_along(&self, direction: &Coefficients) -> f64 {
        let mut x = direction.component_mul(&self.scale);
        self.factor.solve_lower_triangular_mut(&mut x);
        x.norm_squared()
    }

    /// `direction . N^-1 right`: what a change of the right-hand side does to `direction . coefficients`.
    pub(crate) fn response(&self, direction: &Coefficients, right: &Coefficients) -> f64 {
        let solve = |x: &Coefficients| {
            let mut x = x.component_mul(&self.scale);
            self.factor.solve_lower_triangular_mut(&mut x);
            x
        };
        solve(direction).dot(&solve(right))
    }
}

#[inline(always)]
fn add(sums: &mut [[f64; LANES]; SUMS], &[u, v, z, w]: &[[f64; LANES]; 4]) {
    let mul = |a: [f64; LANES], b: [f64; LANES]| -> [f64; LANES] { std::array::from_fn(|i| a[i] * b[i]) };
    let (wu, wv) = (mul(w, u), mul(w, v));
    let (wu2, wuv, wv2) = (mul(wu, u), mul(wu, v), mul(wv, v));
    let (wu3, wu2v, wuv2, wv3) = (mul(wu2, u), mul(wu2, v), mul(wv2, u), mul(wv2, v));
    let terms = [
        mul(wu3, u),
        mul(wu3, v),
        mul(wu2v, v),
        mul(wv3, u),
        mul(wv3, v),
        wu3,
        wu2v,
        wuv2,
        wv3,
        wu2,
        wuv,
        wv2,
        mul(wu2, z),
        mul(wuv, z),
        mul(wv2, z),
        mul(wu, z),
        mul(wv, z),
        mul(mul(w, z), z),
        w,
        wu,
        wv,
    ];
    for (sum, term) in sums.iter_mut().zip(terms) {
        for lane in 0..LANES {
            sum[lane] += term[lane];
        }
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    fn points(f: impl Fn(f64, f64) -> f64) -> Points {
        let mut points = Points::default();
        for i in 0..23 {
            let (angle, radius) = (f64::from(i) * 2.4, f64::from(i + 1) / 23.0);
            let (u, v) = (radius * angle.cos(), radius * angle.sin());
            points.push(u, v, f(u, v), 1.0 - 0.5 * radius);
        }
        points
    }

    #[test]
    fn recovers_a_quadric_to_rounding() {
        let exact = Coefficients::new(0.3, -0.7, 0.2, 0.05, -0.4);
        let fit = |u: f64, v: f64| exact.dot(&Coefficients::new(u * u, u * v, v * v, u, v));
        let solution = NormalEquations::accumulate(&points(fit)).solve(1e-7).unwrap();
        let error = (solution.coefficients - exact).norm();
        // Pivots are over 1e-2 here, so the error stays within 1e2 roundings.
        assert!(error < 1e2 * f64::EPSILON, "{error:e}");
        assert!(solution.squares_left < 1e-14, "{:e}", solution.squares_left);
    }

    #[test]
    fn variance_matches_the_inverse() {
        let equations = NormalEquations::accumulate(&points(|u, _| u));
        let solution = equations.solve(1e-7).unwrap();
        let inverse = equations.matrix.try_inverse().unwrap();
        let direction = Coefficients::new(1.0, -2.0, 0.5, 0.0, 3.0);
        let expected = (direction.transpose() * inverse * direction)[0];
        let found = solution.variance_along(&direction);
        assert!((found / expected - 1.0).abs() < 1e-12, "{found} {expected}");
        let right = equations.constant();
        let expected = (direction.transpose() * inverse * right)[0];
        let found = solution.response(&direction, &right);
        assert!((found / expected - 1.0).abs() < 1e-12, "{found} {expected}");
    }

    #[test]
    fn points_on_two_lines_have_no_solution() {
        let mut points = points(|u, _| u * u);
        for v in &mut points.v {
            *v = if *v > 0.0 { 0.5 } else { 0.0 };
        }
        // v^2 = v / 2 on both lines.
        assert!(NormalEquations::accumulate(&points).solve(1e-10).is_none());
    }
}

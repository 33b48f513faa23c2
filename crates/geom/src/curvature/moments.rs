//! Normal equations of a quadric fit, accumulated as moments.
//!
//! A height function `z = a u^2 + b uv + c v^2 + d u + e v` through the origin has the normal equations `N x = r`, where
//! all 15 entries of `N` are among the 12 moments `sum w u^p v^q` of degree 2 to 4. Points are streamed once, several at
//! a time, and nothing but the sums is kept.

use std::ops::Range;

use super::kernel;
use super::shape_operator::Frame;
use crate::Vec3;

/// A height function over the fit frame.
#[derive(Debug, Clone, Copy, PartialEq)]
pub(crate) struct Height {
    /// Coefficient of `u^2`.
    pub(crate) a: f64,
    /// Coefficient of `u v`.
    pub(crate) b: f64,
    /// Coefficient of `v^2`.
    pub(crate) c: f64,
    /// Slope along `u`.
    pub(crate) d: f64,
    /// Slope along `v`.
    pub(crate) e: f64,
}

/// Neighbours as a structure of arrays: offsets from the vertex in world axes, and weights.
#[derive(Debug, Default)]
pub(crate) struct Points {
    /// `x`, `y`, `z` and weight. Only the first `len` entries of each count: the rows never shrink, so that writing one
    /// more point does not look for memory.
    rows: [Vec<f64>; 4],
    len: usize,
}

impl Points {
    /// Removes all points and makes room for this many.
    pub(crate) fn clear(&mut self, room: usize) {
        self.len = 0;
        if self.rows[0].len() < room {
            self.rows.iter_mut().for_each(|row| row.resize(2 * room, 0.0));
        }
    }

    /// Adds a point.
    ///
    /// # Panics
    ///
    /// If there is no room.
    #[inline]
    pub(crate) fn push(&mut self, offset: &Vec3, weight: f64) {
        let point = [offset.x, offset.y, offset.z, weight];
        for (row, value) in self.rows.iter_mut().zip(point) {
            row[self.len] = value;
        }
        self.len += 1;
    }

    pub(crate) fn len(&self) -> usize {
        self.len
    }

    pub(crate) fn offset(&self, index: usize) -> Vec3 {
        Vec3::new(self.rows[0][index], self.rows[1][index], self.rows[2][index])
    }

    pub(crate) fn weight(&self, index: usize) -> f64 {
        self.rows[3][index]
    }

    pub(crate) fn weights_mut(&mut self) -> &mut [f64] {
        &mut self.rows[3][..self.len]
    }

    /// The largest coordinate difference of any point, or `None` when all coincide or one is not finite.
    pub(crate) fn extent(&self) -> Option<f64> {
        let mut largest = 0.0_f64;
        for row in &self.rows[..3] {
            for x in &row[..self.len] {
                largest = if x.abs() > largest { x.abs() } else { largest };
            }
        }
        (largest > 0.0 && largest.is_finite()).then_some(largest)
    }

    fn slices(&self, range: Range<usize>) -> [&[f64]; 4] {
        self.rows.each_ref().map(|row| &row[range.clone()])
    }
}

/// Lanes that are summed side by side: one AVX-512 register.
pub(super) const LANES: usize = 8;
/// 12 moments of `u, v` of degree 2 to 4, 5 with `z`, `z^2`, and 3 of degree 0 and 1.
pub(in crate::curvature) const SUMS: usize = 21;

/// The normal equations of the fit, in units of a length that the caller chose.
#[derive(Debug, Clone, Copy)]
pub(crate) struct Moments {
    sums: [f64; SUMS],
}

impl Moments {
    /// Sums over a range of points in the frame, lengths divided by `length`. The order of the sums depends on the number
    /// of points only, so every instruction set gives the same bits.
    pub(crate) fn accumulate(points: &Points, range: Range<usize>, frame: &Frame, length: f64) -> Self {
        let inverse = 1.0 / length;
        let scaled = Frame { t: frame.t * inverse, s: frame.s * inverse, n: frame.n * inverse };
        let lanes = kernel::accumulate(points.slices(range), &scaled);
        Self { sums: lanes.map(|s| ((s[0] + s[4]) + (s[2] + s[6])) + ((s[1] + s[5]) + (s[3] + s[7]))) }
    }

    /// The equations of both sets of points.
    pub(crate) fn plus(&self, other: &Self) -> Self {
        Self { sums: std::array::from_fn(|i| self.sums[i] + other.sums[i]) }
    }

    /// Sum of all weights.
    pub(crate) fn weight(&self) -> f64 {
        self.sums[18]
    }

    /// Squared distance to the points that determine second derivatives: `sum w r^4 / sum w r^2`. The error that the
    /// surface's fourth derivatives cause is proportional to it.
    pub(crate) fn reach_squared(&self) -> f64 {
        let [u4, _, u2v2, _, v4, .., u2, _, v2] = self.sums.first_chunk::<12>().expect("12 moments");
        (u4 + 2.0 * u2v2 + v4) / (u2 + v2)
    }

    /// The right-hand side that a height of one at every point gives.
    fn constant(&self) -> [f64; 5] {
        let s = &self.sums;
        [s[19], s[20], s[9], s[10], s[11]]
    }

    /// Solves by Cholesky after scaling the diagonal to one. `None` when a pivot falls below `least_pivot`: then the
    /// points do not determine the coefficients, or not to the accuracy that the caller needs.
    ///
    /// A pivot is the share of a column that the columns before it do not explain, so it lies in `(0, 1]` and does not
    /// depend on scale. The solution's relative error is about `f64::EPSILON` over the least pivot.
    pub(crate) fn solve(&self, least_pivot: f64) -> Option<Solution> {
        let &[u4, u3v, u2v2, uv3, v4, u3, u2v, uv2, v3, u2, uv, v2, zu2, zuv, zv2, zu, zv, squares, ..] =
            &self.sums;
        // Unknowns in the order d, e, a, b, c: the second derivatives come last, so that their covariance is the
        // inverse of the factor's last block.
        #[rustfmt::skip]
        let mut factor = [
            [u2,  uv,  u3,   u2v,  uv2 ],
            [uv,  v2,  u2v,  uv2,  v3  ],
            [u3,  u2v, u4,   u3v,  u2v2],
            [u2v, uv2, u3v,  u2v2, uv3 ],
            [uv2, v3,  u2v2, uv3,  v4  ],
        ];
        let diagonal: [f64; 5] = std::array::from_fn(|i| factor[i][i]);
        if !diagonal.iter().all(|d| d.is_finite() && *d > 0.0) {
            return None;
        }
        let scale = diagonal.map(|d| 1.0 / d.sqrt());
        for row in 0..5 {
            for column in 0..=row {
                factor[row][column] *= scale[row] * scale[column];
            }
        }
        let inverse_pivots = cholesky(&mut factor, least_pivot)?;
        let factor = Factor { lower: factor, inverse_pivots, scale };
        let right = [zu, zv, zu2, zuv, zv2];
        let x = factor.solve(right);
        let explained: f64 = std::iter::zip(x, right).map(|(x, r)| x * r).sum();
        let [d, e, a, b, c] = x;
        // Clamped at zero where it drowns in rounding.
        Some(Solution {
            height: Height { a, b, c, d, e },
            squares_left: (squares - explained).max(0.0),
            factor,
        })
    }

    /// What a common shift of all heights does to the second derivatives `(a, b, c)` of a solution.
    pub(crate) fn response_to_shift(&self, solution: &Solution) -> [f64; 3] {
        let [_, _, a, b, c] = solution.factor.solve(self.constant());
        [a, b, c]
    }
}

/// A solved fit.
#[derive(Debug, Clone, Copy)]
pub(crate) struct Solution {
    pub(crate) height: Height,
    /// Weighted sum of squared residuals.
    pub(crate) squares_left: f64,
    factor: Factor,
}

impl Solution {
    /// Variance of `direction . (a, b, c)` for residuals of unit variance: `direction^T N^-1 direction`.
    pub(crate) fn variance_along(&self, direction: [f64; 3]) -> f64 {
        let Factor { lower, inverse_pivots, scale } = &self.factor;
        let mut x = [0.0; 3];
        for row in 0..3 {
            let mut sum = direction[row] * scale[row + 2];
            for column in 0..row {
                sum -= lower[row + 2][column + 2] * x[column];
            }
            x[row] = sum * inverse_pivots[row + 2];
        }
        x.iter().map(|x| x * x).sum()
    }
}

/// A lower Cholesky factor of the scaled equations.
#[derive(Debug, Clone, Copy)]
struct Factor {
    lower: [[f64; 5]; 5],
    inverse_pivots: [f64; 5],
    scale: [f64; 5],
}

impl Factor {
    fn solve(&self, right: [f64; 5]) -> [f64; 5] {
        let mut x = right;
        for row in 0..5 {
            let known: f64 = std::iter::zip(&self.lower[row][..row], &x).map(|(l, x)| l * x).sum();
            x[row] = (x[row] * self.scale[row] - known) * self.inverse_pivots[row];
        }
        for row in (0..5).rev() {
            let known: f64 =
                (row + 1..5).zip(&x[row + 1..]).map(|(below, x)| self.lower[below][row] * x).sum();
            x[row] = (x[row] - known) * self.inverse_pivots[row];
        }
        std::array::from_fn(|i| x[i] * self.scale[i])
    }
}

/// Factors the lower triangle in place; the inverses of the factor's diagonal, or `None` at a pivot below the least.
fn cholesky(a: &mut [[f64; 5]; 5], least_pivot: f64) -> Option<[f64; 5]> {
    let mut inverse_pivots = [0.0; 5];
    for column in 0..5 {
        for row in column..5 {
            for earlier in 0..column {
                a[row][column] -= a[row][earlier] * a[column][earlier];
            }
        }
        let pivot = a[column][column];
        if pivot.is_nan() || pivot < least_pivot {
            return None;
        }
        inverse_pivots[column] = 1.0 / pivot.sqrt();
        for row in a.iter_mut().skip(column) {
            row[column] *= inverse_pivots[column];
        }
    }
    Some(inverse_pivots)
}

#[cfg(test)]
mod tests {
    use nalgebra::{SMatrix, SVector};

    use super::*;

    const FRAME: Frame =
        Frame { t: Vec3::new(1.0, 0.0, 0.0), s: Vec3::new(0.0, 1.0, 0.0), n: Vec3::new(0.0, 0.0, 1.0) };

    fn points(f: impl Fn(f64, f64) -> f64) -> Points {
        let mut points = Points::default();
        points.clear(23);
        for i in 0..23 {
            let (angle, radius) = (f64::from(i) * 2.4, f64::from(i + 1) / 23.0);
            let (u, v) = (radius * angle.cos(), radius * angle.sin());
            points.push(&Vec3::new(u, v, f(u, v)), 1.0 - 0.5 * radius);
        }
        points
    }

    #[test]
    fn recovers_a_quadric_to_rounding() {
        let exact = Height { a: 0.3, b: -0.7, c: 0.2, d: 0.05, e: -0.4 };
        let fit =
            |u: f64, v: f64| exact.a * u * u + exact.b * u * v + exact.c * v * v + exact.d * u + exact.e * v;
        let Solution { height, squares_left, .. } =
            Moments::accumulate(&points(fit), 0..23, &FRAME, 1.0).solve(1e-7).unwrap();
        let pairs = [(height.a, 0.3), (height.b, -0.7), (height.c, 0.2), (height.d, 0.05), (height.e, -0.4)];
        for (found, expected) in pairs {
            // Pivots are over 1e-2 here, so the error stays within 1e2 roundings.
            assert!((found - expected).abs() < 1e2 * f64::EPSILON, "{height:?}");
        }
        assert!(squares_left < 1e-14, "{squares_left:e}");
        // In units of half the length, second derivatives are half and slopes the same.
        let halved = Moments::accumulate(&points(fit), 0..23, &FRAME, 0.5).solve(1e-7).unwrap().height;
        assert!((halved.a - 0.15).abs() + (halved.d - 0.05).abs() < 1e2 * f64::EPSILON, "{halved:?}");
    }

    #[test]
    fn agrees_with_the_inverse_of_the_normal_matrix() {
        let points = points(|u, v| u + (7.0 * v).sin());
        let rows = SMatrix::<f64, 23, 5>::from_fn(|i, j| {
            let (u, v) = (points.rows[0][i], points.rows[1][i]);
            [u * u, u * v, v * v, u, v][j]
        });
        let weights = SMatrix::<f64, 23, 23>::from_diagonal(&SVector::from_fn(|i, _| points.weight(i)));
        let heights = SVector::<f64, 23>::from_fn(|i, _| points.rows[2][i]);
        let inverse = (rows.transpose() * weights * rows).try_inverse().unwrap();
        let expected = inverse * rows.transpose() * weights * heights;
        let moments = Moments::accumulate(&points, 0..23, &FRAME, 1.0);
        let solution = moments.solve(1e-7).unwrap();
        assert!((solution.height.b - expected[1]).abs() < 1e-12);
        let left = (weights * (heights - rows * expected).component_mul(&(heights - rows * expected))).sum();
        assert!((solution.squares_left / left - 1.0).abs() < 1e-12);
        let direction = SVector::<f64, 5>::new(1.0, -2.0, 0.5, 0.0, 0.0);
        let variance = (direction.transpose() * inverse * direction)[0];
        assert!((solution.variance_along([1.0, -2.0, 0.5]) / variance - 1.0).abs() < 1e-12);
        let shift = inverse * rows.transpose() * weights * SVector::<f64, 23>::repeat(1.0);
        let found = moments.response_to_shift(&solution);
        assert!((found[0] - shift[0]).abs() + (found[2] - shift[2]).abs() < 1e-12, "{found:?} {shift}");
    }

    #[test]
    fn points_on_two_lines_have_no_solution() {
        let mut points = points(|u, _| u * u);
        for v in &mut points.rows[1] {
            *v = if *v > 0.0 { 0.5 } else { 0.0 };
        }
        // v^2 = v / 2 on both lines.
        assert!(Moments::accumulate(&points, 0..23, &FRAME, 1.0).solve(1e-10).is_none());
    }
}

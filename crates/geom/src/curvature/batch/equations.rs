//! Eight systems of normal equations side by side; see [`Moments`](super::super::moments::Moments) for what they are.

/// The elimination for one set of lanes.
macro_rules! equations {
    ($name:ident $(, $feature:literal)?) => {
        pub(super) mod $name {
            use crate::curvature::lanes::$name::{Lane, Mask, add, and, div, less, max, mul, splat, sqrt, sub};
            use crate::curvature::moments::SUMS;

            /// Column of the heights on the right-hand side, and that of heights of one.
            const HEIGHTS: usize = 5;
            const SHIFT: usize = 6;

            /// Solved equations `N x = r` with `N = L D L^T`.
            pub(in super::super) struct Equations {
                /// Where the points determine the coefficients.
                pub(in super::super) sound: Mask,
                /// `a`, `b`, `c`, `d`, `e`.
                pub(in super::super) height: [Lane; 5],
                /// Second derivatives that a common shift of all heights by one gives.
                shift: [Lane; 3],
                /// Weighted sum of squared residuals.
                left: Lane,
                /// Last block of the factor `L` below its diagonal (`ba`, `ca`, `cb`), and of `1 / D`.
                lower: [Lane; 3],
                inverse: [Lane; 3],
            }

            /// Solves by elimination; sound where every pivot is at least this share of its diagonal entry.
            #[inline]
            $(#[target_feature(enable = $feature)])?
            pub(in super::super) fn solve(sums: &[Lane; SUMS], least_pivot: Lane) -> Equations {
                let &[u4, u3v, u2v2, uv3, v4, u3, u2v, uv2, v3, u2, uv, v2, zu2, zuv, zv2, zu, zv, squares, _, su, sv] =
                    sums;
                let zero = splat(0.0);
                // Unknowns in the order d, e, a, b, c; upper triangle.
                let mut m = [
                    [u2, uv, u3, u2v, uv2, zu, su],
                    [zero, v2, u2v, uv2, v3, zv, sv],
                    [zero, zero, u4, u3v, u2v2, zu2, u2],
                    [zero, zero, zero, u2v2, uv3, zuv, uv],
                    [zero, zero, zero, zero, v4, zv2, v2],
                ];
                let diagonal = [u2, v2, u4, u2v2, v4];
                let mut sound = less(zero, u2);
                let mut inverse = [zero; 5];
                let mut lower = [[zero; 5]; 5];
                let mut left = squares;
                for k in 0..5 {
                    let pivot = m[k][k];
                    // Written so that what is not a number is not sound.
                    sound = and(sound, and(less(mul(least_pivot, diagonal[k]), pivot), less(zero, diagonal[k])));
                    inverse[k] = div(splat(1.0), pivot);
                    for i in k + 1..5 {
                        let factor = mul(m[k][i], inverse[k]);
                        lower[i][k] = factor;
                        for j in i..=SHIFT {
                            m[i][j] = sub(m[i][j], mul(factor, m[k][j]));
                        }
                    }
                    left = sub(left, mul(m[k][HEIGHTS], mul(m[k][HEIGHTS], inverse[k])));
                }
                let (mut x, mut shift) = ([zero; 5], [zero; 5]);
                for k in (0..5).rev() {
                    x[k] = mul(m[k][HEIGHTS], inverse[k]);
                    shift[k] = mul(m[k][SHIFT], inverse[k]);
                    for j in k + 1..5 {
                        x[k] = sub(x[k], mul(lower[j][k], x[j]));
                        shift[k] = sub(shift[k], mul(lower[j][k], shift[j]));
                    }
                }
                Equations {
                    sound,
                    height: [x[2], x[3], x[4], x[0], x[1]],
                    shift: [shift[2], shift[3], shift[4]],
                    // Zero where it drowns in rounding.
                    left: max(left, zero),
                    lower: [lower[3][2], lower[4][2], lower[4][3]],
                    inverse: [inverse[2], inverse[3], inverse[4]],
                }
            }

            impl Equations {
                /// One standard error of the worse curvature of a fit to `count` points, as the scalar fit states it.
                #[inline]
                $(#[target_feature(enable = $feature)])?
                pub(in super::super) fn standard_error(&self, sums: &[Lane; SUMS], count: Lane) -> Lane {
                    let (one, two) = (splat(1.0), splat(2.0));
                    let freedom = sub(one, div(splat(5.0), count));
                    let variance = div(self.left, mul(sums[18], freedom));
                    let [a, b, c] = self.shift;
                    let sum = add(a, c);
                    let worst = max(
                        max(self.variance([two, splat(0.0), splat(0.0)], mul(two, a)),
                            self.variance([splat(0.0), splat(0.0), two], mul(two, c))),
                        max(self.variance([one, one, one], add(sum, b)),
                            self.variance([one, splat(-1.0), one], sub(sum, b))),
                    );
                    sqrt(mul(variance, worst))
                }

                /// Variance of `direction . (a, b, c)` for residuals of unit variance, and what a common shift adds.
                #[inline]
                $(#[target_feature(enable = $feature)])?
                fn variance(&self, direction: [Lane; 3], common: Lane) -> Lane {
                    let [ba, ca, cb] = self.lower;
                    let x = direction[0];
                    let y = sub(direction[1], mul(ba, x));
                    let z = sub(sub(direction[2], mul(ca, x)), mul(cb, y));
                    let [a, b, c] = self.inverse;
                    let squares = add(add(mul(mul(x, x), a), mul(mul(y, y), b)), mul(mul(z, z), c));
                    add(squares, mul(common, common))
                }

                /// `sum w r^4 / sum w r^2`.
                #[inline]
                $(#[target_feature(enable = $feature)])?
                pub(in super::super) fn reach_squared(sums: &[Lane; SUMS]) -> Lane {
                    let fourth = add(add(sums[0], mul(splat(2.0), sums[2])), sums[4]);
                    div(fourth, add(sums[9], sums[11]))
                }
            }
        }
    };
}

equations!(portable);
#[cfg(target_arch = "x86_64")]
equations!(avx512, "avx512f");

//! Order statistics of differences.

use serde::Serialize;

/// Order statistics of a set of non-negative numbers; all zero for the empty set.
#[derive(Debug, Clone, Copy, PartialEq, Default, Serialize)]
pub struct Quantiles {
    /// How many numbers there are.
    pub count: usize,
    /// The largest.
    pub max: f64,
    /// At most this in 99 % of the cases (nearest rank).
    pub p99: f64,
    /// At most this in 95 %.
    pub p95: f64,
    /// At most this in half.
    pub median: f64,
}

impl Quantiles {
    /// Sorts the numbers and picks the ranks. NaN counts as larger than everything.
    #[must_use]
    pub fn new(mut values: Vec<f64>) -> Self {
        values.sort_unstable_by(f64::total_cmp);
        let count = values.len();
        // Nearest rank in integers: the smallest value with at least `percent` of the values at or below it.
        let at = |percent: usize| match (count * percent).div_ceil(100) {
            0 => 0.0,
            rank => values[rank - 1],
        };
        Self { count, max: at(100), p99: at(99), p95: at(95), median: at(50) }
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn nearest_ranks() {
        let q = Quantiles::new((1..=200).rev().map(f64::from).collect());
        assert_eq!((q.count, q.max, q.p99, q.p95, q.median), (200, 200.0, 198.0, 190.0, 100.0));
        assert_eq!(Quantiles::new(vec![7.0]).median, 7.0);
        assert_eq!(Quantiles::new(vec![]), Quantiles::default());
        assert!(Quantiles::new(vec![1.0, f64::NAN]).max.is_nan(), "a NaN must not hide");
    }
}

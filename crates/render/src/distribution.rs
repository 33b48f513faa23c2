//! Sampling in proportion to tabulated weights.

/// A piecewise constant density on `[0, 1)`.
#[derive(Debug, Clone)]
pub(crate) struct Distribution1d {
    /// Cumulative sums, first 0, last the total.
    cumulative: Vec<f64>,
    /// How many sums are at most `k / n` of the total, for `k` from 0 to the number `n` of intervals: where to look for what lies between.
    guide: Vec<u32>,
}

/// What was drawn.
#[derive(Debug, Clone, Copy, PartialEq)]
pub(crate) struct Draw {
    pub index: usize,
    /// Position in `[0, 1)`.
    pub x: f32,
    /// Density at `x`.
    pub pdf: f32,
}

#[allow(clippy::cast_possible_truncation, reason = "densities are handed out in f32")]
impl Distribution1d {
    /// Weights must be finite and not negative; if all are zero, the density is uniform.
    pub(crate) fn new(weights: impl IntoIterator<Item = f64>) -> Self {
        let mut cumulative = vec![0.0];
        let mut total = 0.0;
        for weight in weights {
            total += weight;
            cumulative.push(total);
        }
        if total <= 0.0 {
            for (i, c) in cumulative.iter_mut().enumerate() {
                *c = i as f64;
            }
        }
        let (count, total) = (cumulative.len() - 1, cumulative[cumulative.len() - 1]);
        let mut below = 0;
        let guide = (0..=count).map(|k| {
            let part = k as f64 / count as f64 * total;
            below += cumulative[below..].iter().take_while(|&&c| c <= part).count();
            u32::try_from(below).expect("fewer than 2^32 intervals")
        });
        Self { guide: guide.collect(), cumulative }
    }

    pub(crate) fn len(&self) -> usize {
        self.cumulative.len() - 1
    }

    pub(crate) fn total(&self) -> f64 {
        self.cumulative[self.len()]
    }

    pub(crate) fn sample(&self, u: f32) -> Draw {
        let target = f64::from(u) * self.total();
        // The last interval that starts at or before the target and is not empty.
        let index = self.at_most(u, target).clamp(1, self.len()) - 1;
        let weight = self.cumulative[index + 1] - self.cumulative[index];
        let within = if weight > 0.0 { (target - self.cumulative[index]) / weight } else { 0.5 };
        let x = ((index as f64 + within) / self.len() as f64) as f32;
        Draw { index, x: x.min(1.0 - f32::EPSILON / 2.0), pdf: self.pdf(index) }
    }

    /// How many sums are at most `target`, which is about `u` of the total.
    fn at_most(&self, u: f32, target: f64) -> usize {
        let part = cell(u, self.len());
        let (low, high) = (self.guide[part] as usize, self.guide[part + 1] as usize);
        let mut count = low + self.cumulative[low..high].partition_point(|&c| c <= target);
        // Where the part's number or the target was rounded across the part's beginning. Its end is farther away than rounding goes.
        while count > 0 && self.cumulative[count - 1] > target {
            count -= 1;
        }
        count
    }

    pub(crate) fn pdf(&self, index: usize) -> f32 {
        ((self.cumulative[index + 1] - self.cumulative[index]) * self.len() as f64 / self.total()) as f32
    }
}

/// A piecewise constant density on the unit square.
#[derive(Debug, Clone)]
pub(crate) struct Distribution2d {
    rows: Vec<Distribution1d>,
    marginal: Distribution1d,
}

impl Distribution2d {
    /// Weights row by row.
    pub(crate) fn new(width: usize, weights: &[f64]) -> Self {
        let rows: Vec<_> =
            weights.chunks(width).map(|row| Distribution1d::new(row.iter().copied())).collect();
        let marginal = Distribution1d::new(weights.chunks(width).map(|row| row.iter().sum()));
        Self { rows, marginal }
    }

    /// A point `(x, y)` and its density.
    pub(crate) fn sample(&self, u: [f32; 2]) -> ([f32; 2], f32) {
        let row = self.marginal.sample(u[1]);
        let column = self.rows[row.index].sample(u[0]);
        ([column.x, row.x], column.pdf * row.pdf)
    }

    pub(crate) fn pdf(&self, [x, y]: [f32; 2]) -> f32 {
        let row = cell(y, self.rows.len());
        let line = &self.rows[row];
        line.pdf(cell(x, line.len())) * self.marginal.pdf(row)
    }
}

#[allow(clippy::cast_possible_truncation, clippy::cast_sign_loss, reason = "clamped into range")]
fn cell(x: f32, count: usize) -> usize {
    ((x * count as f32) as usize).min(count - 1)
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn the_guide_finds_what_searching_everywhere_finds() {
        let spike = |k: usize| if k == 700 { 1e9 } else { (k % 7) as f64 };
        let halves = |k: usize| if k < 300 { 0.0 } else { 1.0 / (k as f64) };
        let weights: [Vec<f64>; 6] = [
            (0..1000).map(spike).collect(),
            (0..777).map(halves).collect(),
            vec![0.0; 33],
            vec![3.0],
            vec![0.1; 3000],
            (0..500).map(|k| 1.3_f64.powi(k - 250)).collect(),
        ];
        for weights in weights {
            let distribution = Distribution1d::new(weights.iter().copied());
            let count = weights.len() as f32;
            let ends = (0..=weights.len()).map(|k| k as f32 / count);
            let beside = ends.flat_map(|u| [u.next_down(), u, u.next_up()]);
            let spread = (0..20_000).map(|k| (k as f32 * 0.618_034).fract());
            for u in beside.chain(spread).filter(|u| (0.0..1.0).contains(u)) {
                let target = f64::from(u) * distribution.total();
                let expected = distribution.cumulative.partition_point(|&c| c <= target);
                assert_eq!(distribution.at_most(u, target), expected, "{u} of {} weights", weights.len());
            }
        }
    }
}

//! Sampling in proportion to tabulated weights.

/// A piecewise constant density on `[0, 1)`.
#[derive(Debug, Clone)]
pub(crate) struct Distribution1d {
    /// Cumulative sums, first 0, last the total.
    cumulative: Vec<f64>,
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
        Self { cumulative }
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
        let index = self.cumulative.partition_point(|&c| c <= target).clamp(1, self.len()) - 1;
        let weight = self.cumulative[index + 1] - self.cumulative[index];
        let within = if weight > 0.0 { (target - self.cumulative[index]) / weight } else { 0.5 };
        let x = ((index as f64 + within) / self.len() as f64) as f32;
        Draw { index, x: x.min(1.0 - f32::EPSILON / 2.0), pdf: self.pdf(index) }
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

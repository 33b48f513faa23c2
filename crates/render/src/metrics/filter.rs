//! Separable filters over a picture's planes; pixels beyond the border repeat those on it.

/// Numbers of one component.
#[derive(Debug, Clone)]
pub(super) struct Plane {
    width: usize,
    values: Vec<f32>,
}

impl Plane {
    pub(super) fn new(width: usize, values: Vec<f32>) -> Self {
        Self { width, values }
    }

    pub(super) fn width(&self) -> usize {
        self.width
    }

    pub(super) fn values(&self) -> &[f32] {
        &self.values
    }

    /// Correlates rows with one odd kernel and columns with another.
    pub(super) fn filtered(&self, along_x: &[f32], along_y: &[f32]) -> Self {
        let height = self.values.len() / self.width;
        let clamped = |i: usize, k: usize, radius: usize, n: usize| (i + k).saturating_sub(radius).min(n - 1);
        let pass = |kernel: &[f32], n: usize, i: usize, at: &dyn Fn(usize) -> f32| -> f32 {
            let radius = kernel.len() / 2;
            kernel.iter().enumerate().map(|(k, weight)| weight * at(clamped(i, k, radius, n))).sum()
        };
        let mut rows = Vec::with_capacity(self.values.len());
        for row in self.values.chunks(self.width) {
            rows.extend((0..self.width).map(|x| pass(along_x, self.width, x, &|x| row[x])));
        }
        let column = |x: usize, y: usize| pass(along_y, height, y, &|y| rows[y * self.width + x]);
        let values = (0..self.values.len()).map(|i| column(i % self.width, i / self.width)).collect();
        Self { width: self.width, values }
    }
}

/// `exp(-x^2 / (2 sigma^2))` at the pixels `-radius..=radius`.
pub(super) fn gaussian(sigma: f32, radius: usize) -> Vec<f32> {
    offsets(radius).map(|x| (-0.5 * (x / sigma).powi(2)).exp()).collect()
}

/// The distances of a kernel's entries from its middle.
pub(super) fn offsets(radius: usize) -> impl Iterator<Item = f32> {
    (0..=2 * radius).map(move |i| i as f32 - radius as f32)
}

/// Divides by the sum.
pub(super) fn normalised(mut kernel: Vec<f32>) -> Vec<f32> {
    let sum: f32 = kernel.iter().sum();
    kernel.iter_mut().for_each(|k| *k /= sum);
    kernel
}

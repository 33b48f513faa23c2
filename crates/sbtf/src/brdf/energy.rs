//! [`EnergyTable`]: the directional albedo of the GGX layer, split so that any Fresnel reflectance can be put in.

use glam::Vec3;

use super::ggx;

/// Grid points in the cosine and in the roughness.
const SIZE: usize = 32;

/// `E(cos_o, roughness) = f0 A + f90 B`, with `A` and `B` tabulated. A made table differs from the integral by less than
/// 0.003.
#[derive(Debug, Clone)]
pub struct EnergyTable {
    /// `[roughness][cosine]`.
    split: Vec<[[f32; 2]; SIZE]>,
    /// `2 * integral of E cos d cos`, per roughness.
    average: Vec<[f32; 2]>,
}

impl Default for EnergyTable {
    fn default() -> Self {
        Self::new()
    }
}

impl EnergyTable {
    /// Integrates the table, which takes some milliseconds; make one and share it.
    #[must_use]
    pub fn new() -> Self {
        let grid = |i: usize| i as f32 / (SIZE - 1) as f32;
        // The albedo changes fastest at grazing angles, so the grid is even in the root of the cosine.
        let row = |j: usize| std::array::from_fn(|i| integrate((grid(i) * grid(i)).max(1e-4), grid(j)));
        let split: Vec<[[f32; 2]; SIZE]> = (0..SIZE).map(row).collect();
        let average = split.iter().map(average_over_cosine).collect();
        Self { split, average }
    }

    /// `[A, B]`, bilinear in the table.
    #[must_use]
    pub fn split(&self, cosine: f32, roughness: f32) -> [f32; 2] {
        let (i, fi) = position(cosine.max(0.0).sqrt());
        let (j, fj) = position(roughness);
        let at = |k: usize| {
            let row = |j: usize| self.split[j][i][k] + fi * (self.split[j][i + 1][k] - self.split[j][i][k]);
            row(j) + fj * (row(j + 1) - row(j))
        };
        [at(0), at(1)]
    }

    /// `[A, B]` averaged over the cosine-weighted hemisphere.
    #[must_use]
    pub fn average(&self, roughness: f32) -> [f32; 2] {
        let (j, fj) = position(roughness);
        let at = |k: usize| self.average[j][k] + fj * (self.average[j + 1][k] - self.average[j][k]);
        [at(0), at(1)]
    }
}

/// Cell and position within it of a number in `[0, 1]`.
#[allow(clippy::cast_possible_truncation, clippy::cast_sign_loss, reason = "clamped into the table")]
fn position(x: f32) -> (usize, f32) {
    let scaled = x.clamp(0.0, 1.0) * (SIZE - 1) as f32;
    let cell = (scaled as usize).min(SIZE - 2);
    (cell, scaled - cell as f32)
}

/// `A` and `B` by a midpoint rule over visible normals.
fn integrate(cosine: f32, roughness: f32) -> [f32; 2] {
    const STEPS: usize = 24;
    let alpha = ggx::alpha(roughness);
    let wo = Vec3::new((1.0 - cosine * cosine).max(0.0).sqrt(), 0.0, cosine);
    let mut sum = [0.0_f64; 2];
    for k in 0..STEPS * STEPS {
        let u = [(k / STEPS) as f32, (k % STEPS) as f32].map(|x| (x + 0.5) / STEPS as f32);
        let h = ggx::sample_visible_normal(alpha, wo, u);
        let wi = 2.0 * wo.dot(h) * h - wo;
        if wi.z <= 0.0 {
            continue;
        }
        let reflection = ggx::reflect(alpha, wo, wi, h);
        let weight = f64::from(reflection.value_cos / reflection.pdf);
        let schlick = f64::from(1.0 - wo.dot(h)).clamp(0.0, 1.0).powi(5);
        sum[0] += weight * (1.0 - schlick);
        sum[1] += weight * schlick;
    }
    #[allow(clippy::cast_possible_truncation, reason = "the table is f32")]
    sum.map(|s| (s / (STEPS * STEPS) as f64) as f32)
}

/// `2 * integral of E(c) c dc`, which is `4 * integral of E(s^2) s^3 ds`, exact for the interpolant linear in `s`.
fn average_over_cosine(row: &[[f32; 2]; SIZE]) -> [f32; 2] {
    // Gauss's three points are exact up to degree 5; the integrand has 4.
    const NODES: [(f32, f32); 3] =
        [(0.112_701_67, 0.277_777_8), (0.5, 0.444_444_45), (0.887_298_35, 0.277_777_8)];
    let step = 1.0 / (SIZE - 1) as f32;
    std::array::from_fn(|k| {
        let cell = |(i, pair): (usize, &[[f32; 2]])| -> f32 {
            let term = |&(f, weight): &(f32, f32)| {
                weight * (pair[0][k] + f * (pair[1][k] - pair[0][k])) * ((i as f32 + f) * step).powi(3)
            };
            step * NODES.iter().map(term).sum::<f32>()
        };
        4.0 * row.windows(2).enumerate().map(cell).sum::<f32>()
    })
}

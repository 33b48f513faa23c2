//! [`ExportLoss`]: what rounding the textures costs.

use glam::{Vec2, Vec3};
use serde::Serialize;

use super::{Material, Precision, StoredModel};
use crate::model::Model;
use crate::query::{Answer, Query, SilhouetteBtf};
use crate::random::Random;

/// How far a model with rounded textures is from the one with those of f32, over random queries.
#[derive(Debug, Clone, Copy, PartialEq, Serialize)]
pub struct ExportLoss {
    /// Of the textures.
    pub precision: Precision,
    /// Bytes of textures and networks.
    pub bytes: usize,
    /// Queries compared.
    pub queries: usize,
    /// Root mean square of `ln(1 + rgb)` differences over queries that both hit.
    pub colour_rms: f64,
    /// The largest of them.
    pub colour_max: f64,
    /// Mean difference in opacity: with the silhouette head the share of queries that hit with one and miss with the other.
    pub opacity: f64,
}

impl ExportLoss {
    /// Measures on `queries` random queries, half of them within a tenth of grazing.
    #[must_use]
    pub fn measure(model: &Model, precision: Precision, queries: usize, seed: u64) -> Self {
        let rounded = StoredModel::new(model, precision);
        let questions = questions(model.architecture.kappa_range, queries, seed);
        let answers = |stored: &StoredModel| {
            let mut answers = vec![Answer::default(); queries];
            Material::new(stored).eval_batch(&questions, &mut answers);
            answers
        };
        let (exact, others) = (answers(&StoredModel::new(model, Precision::F32)), answers(&rounded));
        let (mut squares, mut largest, mut hits, mut opacity) = (0.0, 0.0_f64, 0_usize, 0.0);
        for (a, b) in exact.iter().zip(&others) {
            opacity += f64::from((a.alpha - b.alpha).abs());
            if a.alpha > 0.0 && b.alpha > 0.0 {
                let log = |answer: &Answer| answer.rgb.map(f32::ln_1p);
                let difference = log(a) - log(b);
                squares += f64::from(difference.length_squared()) / 3.0;
                largest = largest.max(f64::from(difference.abs().max_element()));
                hits += 1;
            }
        }
        Self {
            precision,
            bytes: rounded.bytes(),
            queries,
            colour_rms: (squares / hits.max(1) as f64).sqrt(),
            colour_max: largest,
            opacity: opacity / queries.max(1) as f64,
        }
    }
}

impl std::fmt::Display for ExportLoss {
    fn fmt(&self, f: &mut std::fmt::Formatter<'_>) -> std::fmt::Result {
        let Self { precision, bytes, colour_rms, colour_max, opacity, .. } = self;
        let (name, megabytes, percent) = (precision.name(), *bytes as f64 / 1e6, 100.0 * opacity);
        write!(
            f,
            "{name}: {megabytes:.2} MB; ln(1 + rgb) off by {colour_rms:.2e} (rms), {colour_max:.2e} (worst); "
        )?;
        write!(f, "opacity off by {percent:.3} %")
    }
}

fn questions(kappa_range: [f32; 2], count: usize, seed: u64) -> Vec<Query> {
    let mut random = Random::new(seed, 0, 0);
    let mut direction = |z: f32| {
        let (radius, angle) = ((1.0 - z * z).max(0.0).sqrt(), std::f32::consts::TAU * random.unit());
        (
            Vec3::new(radius * angle.cos(), radius * angle.sin(), z),
            [random.unit(), random.unit(), random.unit()],
        )
    };
    let mut z = Random::new(seed, 1, 0);
    (0..count)
        .map(|k| {
            let (wo, [u, v, t]) = direction(z.unit() * if k % 2 == 0 { 1.0 } else { 0.1 });
            let (wi, _) = direction(2.0 * z.unit() - 1.0);
            let kappa_hat = kappa_range[0] + t * (kappa_range[1] - kappa_range[0]);
            Query { uv: Vec2::new(u, v), wo, wi, kappa_hat }
        })
        .collect()
}

#[cfg(test)]
mod tests {
    use super::*;
    use crate::model::{Architecture, TextureShape};

    #[test]
    fn less_precision_loses_more_and_saves_bytes() {
        // Coarse, as noise in fine textures makes much of small errors in the offset.
        let coarse = TextureShape::square(8, 8);
        let form =
            Architecture { offset_texture: coarse, colour_texture: coarse, ..Architecture::paper(0.1) };
        let model = Model::untrained(form, 4);
        let loss = Precision::ALL.map(|precision| ExportLoss::measure(&model, precision, 4096, 1));
        assert_eq!((loss[0].colour_rms, loss[0].colour_max, loss[0].opacity), (0.0, 0.0, 0.0));
        assert!(loss[0].bytes > loss[1].bytes && loss[1].bytes > loss[2].bytes);
        // Features in [-1, 1]: codes are off by 1/255, four to eight times what halves are.
        assert!(loss[1].colour_rms > 1e-6 && 3.0 * loss[1].colour_rms < loss[2].colour_rms, "{loss:?}");
        assert!(loss[2].colour_rms < 0.02, "{loss:?}");
        assert!(loss[2].opacity < 0.02, "{loss:?}");
    }
}

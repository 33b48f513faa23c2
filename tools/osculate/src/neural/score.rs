//! PSNR and FLIP of pictures from `evaluate`.

use glam::Vec3;
use osculate_render::metrics::{FlipOptions, Image, flip, psnr};
use osculate_sbtf::evaluate::Pair;
use serde::Serialize;

/// Pictures at one curvature.
#[derive(Debug, Clone, Copy, Serialize)]
pub struct AppearanceScore {
    /// Curvature, 1/UV units.
    pub kappa: f32,
    /// Over all pictures together, decibels.
    pub psnr: f64,
    /// Mean over pictures.
    pub flip: f64,
}

/// One score per curvature, of pictures with `size` pixels a side; encoded as sRGB first.
pub fn appearance_scores(pairs: &[Pair], size: usize) -> Vec<AppearanceScore> {
    let picture = |pixels: &[Vec3]| Image::srgb_from_linear(size, size, pixels.iter().copied());
    pairs
        .chunk_by(|a, b| a.kappa == b.kappa)
        .map(|pairs| {
            let pictures: Vec<_> = pairs.iter().map(|p| [picture(&p.truth), picture(&p.test)]).collect();
            let noise = |[a, b]: &[Image; 2]| 10.0_f64.powf(-0.1 * psnr(a, b));
            let mean = pictures.iter().map(noise).sum::<f64>() / pairs.len() as f64;
            let flips = pictures.iter().map(|[a, b]| flip(a, b, &FlipOptions::default()));
            AppearanceScore {
                kappa: pairs[0].kappa,
                psnr: -10.0 * mean.log10(),
                flip: flips.sum::<f64>() / pairs.len() as f64,
            }
        })
        .collect()
}

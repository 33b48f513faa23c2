//! Roughness from what the matt model leaves over.

use glam::Vec3;

use crate::micro::Grid;

/// Bins over the half vector's angle to the normal.
const BINS: usize = 45;
/// Candidates for the roughness between 0 and 1.
const STEPS: u32 = 50;
/// Highlights weaker than this share of the mean albedo are noise.
const FAINTEST: f32 = 0.01;

/// Perceptual roughness of the GGX lobe that fits the mean excess brightness over the angle between normal and half vector best; `None`
/// where there is no highlight.
///
/// One value for the whole tile: few lights sample a lobe at one texel, but all normals together sample it well.
pub(super) fn from_highlights(
    observations: &[Vec<Vec3>],
    directions: &[Vec3],
    normals: &Grid<Vec3>,
    albedo: &Grid<Vec3>,
) -> Option<f32> {
    let mut bins = [(0.0_f64, 0_u32); BINS];
    for (image, &light) in observations.iter().zip(directions) {
        // The camera looks straight down.
        let half = (light + Vec3::Z).normalize();
        for ((&seen, &n), &base) in image.iter().zip(normals.texels()).zip(albedo.texels()) {
            let cosine = n.dot(light);
            let excess = (seen - base * cosine).element_sum() / 3.0;
            // Shadows lie below the matt model; they say nothing of highlights.
            if cosine < 0.1 || excess < -0.2 * base.element_sum() / 3.0 * cosine {
                continue;
            }
            #[allow(
                clippy::cast_possible_truncation,
                clippy::cast_sign_loss,
                reason = "an angle below pi / 2"
            )]
            let bin =
                ((n.dot(half).clamp(0.0, 1.0).acos() / std::f32::consts::FRAC_PI_2) * BINS as f32) as usize;
            let (sum, count) = &mut bins[bin.min(BINS - 1)];
            // Brightness carries the cosine of the light and 1 / (4 cos cos); the rest is the lobe.
            *sum += f64::from(excess * n.z.max(0.1));
            *count += 1;
        }
    }
    let mean_albedo =
        albedo.texels().iter().map(|c| c.element_sum() / 3.0).sum::<f32>() / albedo.texels().len() as f32;
    let curve: Vec<(f64, f64, f64)> = bins
        .iter()
        .enumerate()
        .filter(|(_, (_, count))| *count > 16)
        .map(|(i, (sum, count))| {
            let angle = (i as f64 + 0.5) / BINS as f64 * std::f64::consts::FRAC_PI_2;
            (angle, sum / f64::from(*count), f64::from(*count).sqrt())
        })
        .collect();
    best_lobe(&curve, f64::from(FAINTEST * mean_albedo))
}

/// The roughness whose lobe, scaled at will, leaves the least squares of `(angle, excess, weight)`.
fn best_lobe(curve: &[(f64, f64, f64)], faintest: f64) -> Option<f32> {
    let mut best = (f64::MAX, None);
    for step in 5..=STEPS {
        let roughness = f64::from(step) / f64::from(STEPS);
        let alpha_squared = roughness.powi(4);
        let lobe = |angle: f64| {
            let c = angle.cos();
            let spread = c * c * (alpha_squared - 1.0) + 1.0;
            alpha_squared * alpha_squared / (spread * spread)
        };
        let sum = |f: &dyn Fn(f64, f64) -> f64| curve.iter().map(|&(a, e, w)| w * f(lobe(a), e)).sum::<f64>();
        let amplitude = sum(&|l, e| l * e) / sum(&|l, _| l * l).max(f64::MIN_POSITIVE);
        let left = sum(&|l, e| (e - amplitude * l).powi(2));
        if amplitude > faintest && left < best.0 {
            best = (left, Some(roughness));
        }
    }
    #[allow(clippy::cast_possible_truncation, reason = "a multiple of a fiftieth")]
    best.1.map(|roughness| roughness as f32)
}

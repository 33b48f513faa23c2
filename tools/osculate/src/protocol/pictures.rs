//! Shaded pictures: the truth, the model and the baseline under the same light.

use std::time::Instant;

use anyhow::Result;
use glam::Vec3;
use osculate_geom::field::FilterKind;
use osculate_render::metrics::{FlipOptions, Image, flip, psnr, ssim};
use osculate_render::{RenderOptions, StopRule};
use osculate_sbtf::micro::HeightField;
use serde::Serialize;

use super::subject::{Cost, Entry, Form, Subject, Truth};
use crate::commands::render::trace;
use crate::console::Console;

/// How pictures are made.
#[derive(Debug, Clone, Copy)]
pub struct PictureOptions {
    /// Pixels a side.
    pub pixels: u32,
    /// Samples per pixel.
    pub spp: u32,
    /// Seed of all of them but the truth's, which takes the next one.
    pub seed: u64,
}

/// A form's pictures.
pub struct Shown {
    /// `displaced`, `neural` or `neumip`.
    pub form: &'static str,
    /// Linear radiance from each camera.
    pub radiance: Vec<Vec<Vec3>>,
    /// How they compare with the truth.
    pub score: PictureScore,
}

/// How a form's pictures compare with the truth, means over the cameras, and what they took.
#[derive(Debug, Clone, Serialize)]
pub struct PictureScore {
    /// `displaced` (the truth with another seed: its noise), `neural` or `neumip`.
    pub form: &'static str,
    /// Decibels, of sRGB pictures.
    pub psnr: f64,
    /// Structural similarity.
    pub ssim: f64,
    /// FLIP.
    pub flip: f64,
    /// Seconds of tracing over all cameras.
    pub tracing_seconds: f64,
    /// Seconds to prepare the scene once: hierarchy, tables; for `displaced` the triangles too.
    pub preparation_seconds: f64,
    /// Geometry.
    pub cost: Cost,
    /// What the material itself takes beside it.
    pub material_bytes: usize,
}

/// Renders the truth and the forms beside it. The truth's own row compares two seeds from the first camera.
pub fn pictures(
    subject: &Subject,
    (truth, heights): (&Truth, &HeightField),
    model: (&Entry, usize),
    baseline: Option<(&Entry, usize)>,
    options: &PictureOptions,
    console: &Console,
) -> Result<Vec<Shown>> {
    let displaced = Form::Displaced(truth);
    let again = PictureOptions { seed: options.seed.wrapping_add(1), ..*options };
    let exact = render(subject, &displaced, &again, usize::MAX, console)?;
    let noise = render(subject, &displaced, options, 1, console)?.radiance;
    let texels = heights.heights().texels().len();
    // Height, three colours, roughness and metalness, a float each, and the normals that are made of them.
    let maps = texels * 4 * (1 + 3 + 1 + 1 + 3);
    let asked = Form::Asked { entry: model.0.clone(), filter: FilterKind::Chord, exact_curvature: false };
    let mut forms = vec![("neural", asked, model.1)];
    if let Some((entry, bytes)) = baseline {
        forms.push(("neumip", Form::Blind(entry.clone()), bytes));
    }
    let side = options.pixels as usize;
    let mut score = score("displaced", &exact, &noise, side);
    score.material_bytes = maps;
    score.preparation_seconds += truth.seconds;
    let mut shown = vec![Shown { form: "displaced", radiance: exact.radiance.clone(), score }];
    for (form, what, material_bytes) in forms {
        let made = render(subject, &what, options, usize::MAX, console)?;
        let score = PictureScore {
            tracing_seconds: made.tracing_seconds,
            preparation_seconds: made.preparation_seconds,
            cost: made.cost,
            material_bytes,
            ..self::score(form, &exact, &made.radiance, side)
        };
        shown.push(Shown { form, radiance: made.radiance, score });
    }
    Ok(shown)
}

/// Compares pictures with the truth, and takes over what the truth took.
fn score(form: &'static str, exact: &Made, test: &[Vec<Vec3>], side: usize) -> PictureScore {
    let image = |pixels: &[Vec3]| Image::srgb_from_linear(side, side, pixels.iter().copied());
    let pairs: Vec<[Image; 2]> = exact.radiance.iter().zip(test).map(|(a, b)| [image(a), image(b)]).collect();
    let mean = |of: &dyn Fn(&Image, &Image) -> f64| {
        pairs.iter().map(|[a, b]| of(a, b)).sum::<f64>() / pairs.len() as f64
    };
    PictureScore {
        form,
        psnr: mean(&psnr),
        ssim: mean(&ssim),
        flip: mean(&|a, b| flip(a, b, &FlipOptions::default())),
        tracing_seconds: exact.tracing_seconds,
        preparation_seconds: exact.preparation_seconds,
        cost: exact.cost,
        material_bytes: 0,
    }
}

struct Made {
    radiance: Vec<Vec<Vec3>>,
    tracing_seconds: f64,
    preparation_seconds: f64,
    cost: Cost,
}

/// From the first so many cameras.
fn render(
    subject: &Subject,
    form: &Form<'_>,
    options: &PictureOptions,
    cameras: usize,
    console: &Console,
) -> Result<Made> {
    let start = Instant::now();
    let (mut scene, cost) = subject.scene(form, options.pixels)?;
    let building = start.elapsed().as_secs_f64();
    let stop = StopRule::Samples(options.spp);
    let settings = RenderOptions { stop, seed: options.seed, ..RenderOptions::default() };
    let mut made = Made { radiance: Vec::new(), tracing_seconds: 0.0, preparation_seconds: 0.0, cost };
    for (_, camera) in subject.cameras.iter().take(cameras) {
        scene.camera = *camera;
        let rendering = trace(&scene, &settings, console)?;
        made.radiance.push(rendering.film.radiance());
        made.tracing_seconds += rendering.tracing.as_secs_f64();
        made.preparation_seconds = building + rendering.preparation.as_secs_f64();
    }
    Ok(made)
}

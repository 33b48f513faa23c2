//! Renders every setting and compares it with a long rendering of the truth.

use std::sync::Arc;
use std::time::Instant;

use anyhow::{Context, Result};
use glam::Vec3;
use osculate_geom::field::FilterKind;
use osculate_render::metrics::{FlipOptions, Image, flip};
use osculate_render::scene::QueryForm;
use osculate_render::{Frame, RenderOptions, Rendering, Scene, StopRule, render_frames};
use osculate_sbtf::march::HeightMarch;
use osculate_sbtf::micro::{HeightField, Microstructure};
use osculate_sbtf::oracle::{Oracle, OracleOptions};
use osculate_sbtf::sampling::Sampler;
use serde::Serialize;

use super::settings::{FINE, FINEST, Setting, Shown};
use crate::protocol::{Cost, Entry, Form, Subject, Truth};

/// How much is measured.
#[derive(Debug, Clone, Copy, Serialize)]
pub struct Effort {
    /// Pixels a side.
    pub pixels: u32,
    /// Samples per pixel of the reference.
    pub reference_spp: u32,
    /// Renderings of each setting, each with its own noise.
    pub runs: u32,
    /// Of all random choices.
    pub seed: u64,
}

/// What came of a setting.
#[derive(Debug, Clone, Serialize)]
pub struct Row {
    /// What was rendered.
    #[serde(flatten)]
    pub setting: Setting,
    /// Root mean square error of the pixels, relative to the reference's mean; of noise and of all else.
    pub error: f64,
    /// FLIP against the reference, mean over the runs.
    pub flip: f64,
    /// Median seconds of tracing.
    pub seconds: f64,
    /// The fastest and the slowest run.
    pub range: [f64; 2],
    /// Seconds to make the geometry and the hierarchy over it, once.
    pub preparation_seconds: f64,
    /// Triangles that rays are traced against.
    pub triangles: usize,
    /// Of the triangles, without the hierarchy, and of the material.
    pub bytes: usize,
}

/// All rows, and how noisy the reference is, relative.
#[derive(Debug, Clone, Serialize)]
pub struct Results {
    /// Relative noise of the reference.
    pub reference_noise: f64,
    /// In the order of the settings.
    pub rows: Vec<Row>,
}

/// The material under study.
#[derive(Clone, Copy)]
pub struct Material<'a> {
    /// The model.
    pub model: &'a Entry,
    /// Its size.
    pub model_bytes: usize,
    /// What it was trained on.
    pub micro: &'a Microstructure,
    /// Its heights.
    pub heights: &'a HeightField,
}

/// Renders the reference and all settings. `tick` is called with the share of work that is done.
pub fn measure(
    subject: &Subject,
    material: &Material<'_>,
    settings: &[Setting],
    effort: &Effort,
    tick: &mut dyn FnMut(f64),
) -> Result<Results> {
    let truth = subject.truth_within(material.heights, FINE)?;
    let scene = subject.scene(&Form::Displaced(&truth), effort.pixels)?.0;
    // A seed that no run has.
    let reference = trace(&scene, effort.reference_spp, effort.seed.wrapping_sub(1), 1, subject)?.remove(0);
    let samples = |s: &Setting| f64::from(s.spp * effort.runs);
    let total = f64::from(effort.reference_spp) + settings.iter().map(samples).sum::<f64>();
    let mut done = f64::from(effort.reference_spp);
    tick(done / total);
    let exact = reference.film.radiance();
    let mut rows = Vec::with_capacity(settings.len());
    for setting in settings {
        rows.push(row(subject, material, &truth, setting, effort, &exact)?);
        done += samples(setting);
        tick(done / total);
    }
    Ok(Results {
        reference_noise: reference.film.noise().context("a reference of two samples or more")?,
        rows,
    })
}

fn row(
    subject: &Subject,
    material: &Material<'_>,
    fine: &Truth,
    setting: &Setting,
    effort: &Effort,
    exact: &[Vec3],
) -> Result<Row> {
    let start = Instant::now();
    let (scene, cost, material_bytes) = scene(subject, material, fine, setting.shown, effort.pixels)?;
    let mut preparation_seconds = start.elapsed().as_secs_f64();
    if setting.shown == FINEST {
        preparation_seconds += fine.seconds;
    }
    let made = trace(&scene, setting.spp, effort.seed, effort.runs, subject)?;
    preparation_seconds += made[0].preparation.as_secs_f64();
    let mut seconds: Vec<f64> = made.iter().map(|r| r.tracing.as_secs_f64()).collect();
    seconds.sort_by(f64::total_cmp);
    let pictures: Vec<Vec<Vec3>> = made.iter().map(|r| r.film.radiance()).collect();
    let squares = pictures.iter().map(|p| error(exact, p).powi(2)).sum::<f64>() / pictures.len() as f64;
    let side = effort.pixels as usize;
    let image = |p: &[Vec3]| Image::srgb_from_linear(side, side, p.iter().copied());
    let of = image(exact);
    let flips = pictures.iter().map(|p| flip(&of, &image(p), &FlipOptions::default())).sum::<f64>();
    Ok(Row {
        setting: *setting,
        error: squares.sqrt(),
        flip: flips / pictures.len() as f64,
        seconds: seconds[seconds.len() / 2],
        range: [seconds[0], seconds[seconds.len() - 1]],
        preparation_seconds,
        triangles: cost.triangles,
        bytes: cost.geometry_bytes + material_bytes,
    })
}

/// Root mean square difference over the mean of the exact values.
fn error(exact: &[Vec3], test: &[Vec3]) -> f64 {
    let square = |(a, b): (&Vec3, &Vec3)| f64::from((*a - *b).length_squared());
    let squares: f64 = exact.iter().zip(test).map(square).sum();
    let mean: f64 = exact.iter().map(|c| f64::from(c.element_sum())).sum::<f64>() / (3 * exact.len()) as f64;
    (squares / (3 * exact.len()) as f64).sqrt() / mean
}

/// The scene, what its geometry takes, and the material's bytes.
fn scene(
    subject: &Subject,
    material: &Material<'_>,
    fine: &Truth,
    shown: Shown,
    pixels: u32,
) -> Result<(Scene, Cost, usize)> {
    let Material { model, model_bytes, micro, heights } = *material;
    let texels = heights.heights().texels().len();
    // Height, three colours, roughness and metalness, a float each, and the normals that are made of them.
    let maps = texels * 4 * (1 + 3 + 1 + 1 + 3);
    let entry = |btf| Entry { btf, sampler: Arc::new(Sampler::cosine()), depth: heights.depth() };
    let asked = |entry| Form::Asked { entry, query: QueryForm::Chord, exact_curvature: false };
    let coarse;
    let (form, bytes) = match shown {
        Shown::Neural { filter: FilterKind::Point } => (Form::Unfiltered(model.clone()), model_bytes),
        Shown::Neural { filter } => {
            let query = if filter == FilterKind::Chord { QueryForm::Chord } else { QueryForm::Paper };
            (Form::Asked { entry: model.clone(), query, exact_curvature: false }, model_bytes)
        }
        Shown::Oracle { samples } => {
            let options = OracleOptions { samples, ..OracleOptions::default() };
            (asked(entry(Arc::new(Oracle::new(micro, options)))), maps)
        }
        Shown::March { steps } => (asked(entry(Arc::new(HeightMarch::new(heights, steps)))), maps),
        _ if shown == FINEST => (Form::Displaced(fine), maps),
        Shown::Displaced { tolerance } => {
            coarse = subject.truth_within(heights, tolerance)?;
            (Form::Displaced(&coarse), maps)
        }
        Shown::Flat => (Form::Flat(heights), maps),
    };
    let (scene, cost) = subject.scene(&form, pixels)?;
    Ok((scene, cost, bytes))
}

/// From the camera at 35 degrees, with so many seeds one after the other.
fn trace(scene: &Scene, spp: u32, seed: u64, runs: u32, subject: &Subject) -> Result<Vec<Rendering>> {
    let camera = subject.camera_turned(0.0);
    let frame = |run| Frame { camera, light_turn: 0.0, seed: seed.wrapping_add(run) };
    let options = RenderOptions { stop: StopRule::Samples(spp), ..RenderOptions::default() };
    let frames: Vec<Frame> = (0..u64::from(runs)).map(frame).collect();
    Ok(render_frames(scene, &frames, &options, &mut || {})?)
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn errors_are_relative_to_the_mean() {
        let exact = [Vec3::new(1.0, 2.0, 3.0), Vec3::new(3.0, 2.0, 1.0)];
        assert_eq!(error(&exact, &exact), 0.0);
        // All channels 5 % too bright in the mean, which is 2.
        let brighter = exact.map(|c| c + 0.1);
        assert!((error(&exact, &brighter) - 0.05).abs() < 1e-6);
        // One of six numbers off by 0.6: 0.6 / sqrt 6 / 2.
        let spot = [exact[0], exact[1] + Vec3::new(0.0, 0.6, 0.0)];
        assert!((error(&exact, &spot) - 0.3 / 6.0_f64.sqrt()).abs() < 1e-6);
        // Brightness of both does not matter.
        let (double, doubled) = (exact.map(|c| 2.0 * c), brighter.map(|c| 2.0 * c));
        assert!((error(&double, &doubled) - 0.05).abs() < 1e-6);
    }
}

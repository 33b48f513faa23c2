//! Flicker: how unsteady sequences are, beside the truth's.

use anyhow::{Context, Result};
use glam::Vec3;
use osculate_render::metrics::flicker;
use osculate_render::{Frame, RenderOptions, StopRule, render_frames};
use osculate_sbtf::brdf::luminance;
use serde::Serialize;

use super::pictures::PictureOptions;
use super::subject::{Entry, Form, Subject, Truth};
use osculate_render::scene::QueryForm;

/// Turn of the camera from one frame to the next, degrees: about a pixel at the default size.
const CAMERA_STEP: f32 = 1.0;

/// Turn of the sun from one frame to the next, degrees.
const LIGHT_STEP: f32 = 4.0;

/// What moves, one thing at a time.
#[derive(Debug, Clone, Copy, PartialEq, Eq, Serialize)]
#[serde(rename_all = "snake_case")]
pub enum Motion {
    /// The camera, around the subject.
    Camera,
    /// The sun.
    Light,
}

/// Flicker of one form under one motion.
#[derive(Debug, Clone, Copy, Serialize)]
pub struct FlickerRow {
    /// What moves.
    pub motion: Motion,
    /// `displaced`, `neural` or `neumip`.
    pub form: &'static str,
    /// Root mean square of the second difference of luminance over time; see [`flicker`].
    pub flicker: f64,
    /// Over the truth's.
    pub ratio: f64,
}

/// Renders `frames` frames of the truth and the forms beside it, from the camera at 35 degrees, each twice with other noise.
pub fn flicker_rows(
    subject: &Subject,
    truth: &Truth,
    model: &Entry,
    baseline: Option<&Entry>,
    frames: u32,
    options: &PictureOptions,
    tick: &mut dyn FnMut(f64),
) -> Result<Vec<FlickerRow>> {
    let asked = Form::Asked { entry: model.clone(), query: QueryForm::default(), exact_curvature: false };
    let mut forms = vec![("displaced", Form::Displaced(truth)), ("neural", asked)];
    forms.extend(baseline.map(|entry| ("neumip", Form::Blind(entry.clone()))));
    let motions = [Motion::Camera, Motion::Light];
    let total = f64::from(frames) * (motions.len() * forms.len() * 2) as f64;
    let mut done = 0.0;
    let mut by_form = Vec::new();
    for (name, form) in &forms {
        let scene = subject.scene(form, options.pixels)?.0;
        let settings = RenderOptions { stop: StopRule::Samples(options.spp), ..RenderOptions::default() };
        let seeds = [options.seed, options.seed.wrapping_add(1)];
        let sequence =
            |motion| seeds.map(|seed| (0..frames).map(move |t| (motion, t, seed))).into_iter().flatten();
        let all: Vec<Frame> =
            motions.into_iter().flat_map(sequence).map(|(m, t, s)| frame(subject, m, t, s)).collect();
        let made = render_frames(&scene, &all, &settings, &mut || {
            done += 1.0;
            tick(done / total);
        })?;
        let seen: Vec<Vec<f32>> =
            made.iter().map(|r| r.film.radiance().into_iter().map(luminance).collect()).collect();
        let found: Vec<f64> = seen
            .chunks(2 * frames as usize)
            .map(|twice| twice.split_at(frames as usize))
            .map(|(a, b)| flicker(a, b))
            .collect::<Option<_>>()
            .context("at least three frames")?;
        by_form.push((*name, found));
    }
    let truth = by_form[0].1.clone();
    let rows = by_form.iter().flat_map(|(form, found)| {
        let truth = truth.clone();
        motions.into_iter().enumerate().map(move |(i, motion)| FlickerRow {
            motion,
            form,
            flicker: found[i],
            ratio: found[i] / truth[i],
        })
    });
    Ok(rows.collect())
}

fn frame(subject: &Subject, motion: Motion, index: u32, seed: u64) -> Frame {
    let steps = index as f32;
    let camera =
        subject.camera_turned(if motion == Motion::Camera { steps * CAMERA_STEP.to_radians() } else { 0.0 });
    let light_turn = if motion == Motion::Light { steps * LIGHT_STEP.to_radians() } else { 0.0 };
    Frame { camera, light_turn, seed }
}

/// Direction from the subject to a camera at this elevation and turn about +Y, radians.
pub(super) fn direction(elevation: f32, turn: f32) -> Vec3 {
    let ((sin, cos), (sin_turn, cos_turn)) = (elevation.sin_cos(), turn.sin_cos());
    Vec3::new(cos * sin_turn, sin, cos * cos_turn)
}

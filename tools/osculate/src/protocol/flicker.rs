//! Flicker: how unsteady sequences are, beside the truth's.

use anyhow::{Context, Result};
use glam::Vec3;
use osculate_geom::field::FilterKind;
use osculate_render::metrics::{Flicker, flicker};
use osculate_render::{Frame, RenderOptions, StopRule, render_frames};
use osculate_sbtf::brdf::luminance;
use serde::Serialize;

use super::pictures::PictureOptions;
use super::subject::{Entry, Form, Subject, Truth};

/// Frames of each motion, and how far things move from one to the next.
#[derive(Debug, Clone, Copy, PartialEq)]
pub struct FlickerOptions {
    /// Of each motion, at least three.
    pub frames: u32,
    /// Turn of the camera, degrees.
    pub camera_step: f32,
    /// Turn of the sun, degrees.
    pub sun_step: f32,
}

impl FlickerOptions {
    /// The camera's step moves the surface by about a pixel at the default size. The sun's has to be larger: shading changes by
    /// its square, noise does not.
    pub const CAMERA_STEP: f32 = 1.0;
    /// See [`Self::CAMERA_STEP`].
    pub const SUN_STEP: f32 = 12.0;
}

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
    /// Degrees from one frame to the next.
    pub step: f32,
    /// `displaced`, `neural` or `neumip`.
    pub form: &'static str,
    /// Root mean square of the second difference of luminance over time; see [`flicker`].
    pub flicker: f64,
    /// What noise does to it, one standard deviation.
    pub error: f64,
    /// Over the truth's; absent where noise drowns the truth's.
    pub ratio: Option<f64>,
    /// One standard deviation of the ratio.
    pub ratio_error: Option<f64>,
}

/// Renders frames of the truth and the forms beside it, from the camera at 35 degrees, each twice with other noise.
pub fn flicker_rows(
    subject: &Subject,
    truth: &Truth,
    model: &Entry,
    baseline: Option<&Entry>,
    (options, of_pictures): (&FlickerOptions, &PictureOptions),
    tick: &mut dyn FnMut(f64),
) -> Result<Vec<FlickerRow>> {
    let asked = Form::Asked { entry: model.clone(), filter: FilterKind::Chord, exact_curvature: false };
    let mut forms = vec![("displaced", Form::Displaced(truth)), ("neural", asked)];
    forms.extend(baseline.map(|entry| ("neumip", Form::Blind(entry.clone()))));
    let mut done = 0.0;
    let mut by_form = Vec::new();
    for (name, form) in &forms {
        let share = 1.0 / forms.len() as f64;
        let found = both_motions(subject, form, options, of_pictures, &mut |part| tick(done + share * part))?;
        done += share;
        by_form.push((*name, found));
    }
    let truth = by_form[0].1;
    let rows = by_form.into_iter().flat_map(|(form, found)| {
        [(Motion::Camera, options.camera_step), (Motion::Light, options.sun_step)]
            .into_iter()
            .enumerate()
            .map(move |(i, (motion, step))| {
                let ratio = found[i].ratio_to(truth[i]);
                let ratio = ratio.map(|both| if form == "displaced" { (1.0, 0.0) } else { both });
                FlickerRow {
                    motion,
                    step,
                    form,
                    flicker: found[i].value(),
                    error: found[i].error(),
                    ratio: ratio.map(|r| r.0),
                    ratio_error: ratio.map(|r| r.1),
                }
            })
    });
    Ok(rows.collect())
}

/// Flicker of one form under the turning camera, and under the turning sun.
fn both_motions(
    subject: &Subject,
    form: &Form<'_>,
    options: &FlickerOptions,
    of_pictures: &PictureOptions,
    tick: &mut dyn FnMut(f64),
) -> Result<[Flicker; 2]> {
    let scene = subject.scene(form, of_pictures.pixels)?.0;
    let settings = RenderOptions { stop: StopRule::Samples(of_pictures.spp), ..RenderOptions::default() };
    let seeds = [of_pictures.seed, of_pictures.seed.wrapping_add(1)];
    let mut done = 0.0;
    let mut of = |motion: Motion| -> Result<Flicker> {
        let [a, b] = seeds.map(|seed| {
            let frames: Vec<Frame> =
                (0..options.frames).map(|t| frame(subject, motion, t, options, seed)).collect();
            let made = render_frames(&scene, &frames, &settings, &mut || {
                done += 1.0;
                tick(done / (4.0 * f64::from(options.frames)));
            })?;
            let luminances = |r: osculate_render::Rendering| -> Vec<f32> {
                r.film.radiance().into_iter().map(luminance).collect()
            };
            anyhow::Ok(made.into_iter().map(luminances).collect::<Vec<_>>())
        });
        flicker(&a?, &b?).context("at least three frames")
    };
    Ok([of(Motion::Camera)?, of(Motion::Light)?])
}

fn frame(subject: &Subject, motion: Motion, index: u32, options: &FlickerOptions, seed: u64) -> Frame {
    let turned = |step: f32| index as f32 * step.to_radians();
    let (camera_turn, light_turn) = match motion {
        Motion::Camera => (turned(options.camera_step), 0.0),
        Motion::Light => (0.0, turned(options.sun_step)),
    };
    Frame { camera: subject.camera_turned(camera_turn), light_turn, seed }
}

/// Direction from the subject to a camera at this elevation and turn about +Y, radians.
pub(super) fn direction(elevation: f32, turn: f32) -> Vec3 {
    let ((sin, cos), (sin_turn, cos_turn)) = (elevation.sin_cos(), turn.sin_cos());
    Vec3::new(cos * sin_turn, sin, cos * cos_turn)
}

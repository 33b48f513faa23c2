//! Whole runs on a material whose truth is a formula.

use std::ops::ControlFlow;
use std::sync::atomic::{AtomicBool, Ordering};

use glam::{Vec2, Vec3};
use rayon::prelude::*;

use super::{Control, Scores, Stage, Supervision, TrainError, TrainOptions, TrainReport, resume, train};
use crate::model::{Architecture, Model, OpacityHead, TextureShape};
use crate::random::Random;
use crate::samples::{AppearanceBatch, OpacityBatch, SampleSource};

/// Bumps in two directions; the hit is straight below the ray's way down to the mean height, the colour a pattern under a cosine.
struct Bumps {
    depth: f32,
    /// Index of an appearance batch that is broken, once or always.
    broken: Option<(u64, AtomicBool)>,
    always: bool,
}

impl Bumps {
    fn new() -> Self {
        Self { depth: 0.1, broken: None, always: false }
    }

    fn height(&self, uv: Vec2) -> f32 {
        let wave = |x: f32| 0.5 + 0.5 * (std::f32::consts::TAU * x).cos();
        self.depth * (wave(2.0 * uv.x) * wave(3.0 * uv.y) - 1.0)
    }

    /// The least cosine under which a ray from the origin of the circle meets one of its points.
    fn silhouette(&self, uv: Vec2, along: Vec2, kappa: f32) -> f32 {
        const STEP: f32 = 1.0 / 80.0;
        let mut least = 1.0_f32;
        for i in 1.. {
            let s = STEP * i as f32;
            // A point of the bounding surface itself, and anything below it, is met under at least this.
            if (0.5 * kappa * s).sin() >= least || kappa * s > 3.0 {
                break;
            }
            let (z, angle) = (self.height(uv + along * s), kappa * s);
            let x = (1.0 / kappa + z) * angle.sin();
            let down = z * angle.cos() - 2.0 * (0.5 * angle).sin().powi(2) / kappa;
            least = least.min(-down / x.hypot(down));
        }
        least
    }
}

fn upper(random: &mut Random) -> Vec3 {
    let (angle, z) = (std::f32::consts::TAU * random.unit(), random.unit().max(0.02));
    (Vec2::from_angle(angle) * (1.0 - z * z).sqrt()).extend(z)
}

impl SampleSource for Bumps {
    fn fill_opacity(&self, index: u64, batch: &mut OpacityBatch) {
        let samples: Vec<_> = (0..batch.len() as u64)
            .into_par_iter()
            .map(|i| {
                let mut random = Random::new(index, i, 0);
                let uv = Vec2::new(random.unit(), random.unit());
                let along = Vec2::from_angle(std::f32::consts::TAU * random.unit());
                let kappa = 0.1 + 2.4 * random.unit();
                let silhouette = self.silhouette(uv, along, kappa);
                let z = random.unit() * (2.0 * kappa * self.depth).sqrt().min(1.0);
                (uv, (-along * (1.0 - z * z).sqrt()).extend(z), kappa, silhouette)
            })
            .collect();
        for (i, (uv, wo, kappa, silhouette)) in samples.into_iter().enumerate() {
            (0..2).for_each(|axis| batch.uv[axis][i] = uv[axis]);
            (0..3).for_each(|axis| batch.wo[axis][i] = wo[axis]);
            batch.kappa_hat[i] = kappa;
            batch.silhouette_cosine[i] = silhouette;
            batch.alpha[i] = f32::from(u8::from(wo.z >= silhouette));
        }
    }

    fn fill_appearance(&self, index: u64, batch: &mut AppearanceBatch) {
        for i in 0..batch.len() {
            let mut random = Random::new(index, i as u64, 0);
            let uv = Vec2::new(random.unit(), random.unit());
            let (mut wo, wi) = (upper(&mut random), upper(&mut random));
            wo = (wo + Vec3::Z).normalize();
            let offset = -wo.truncate() / wo.z * 0.5 * self.depth;
            let hit = uv + offset;
            let pattern = Vec3::new(
                0.5 + 0.4 * (std::f32::consts::TAU * 4.0 * hit.x).sin(),
                0.5 + 0.4 * (std::f32::consts::TAU * 5.0 * hit.y).sin(),
                0.3,
            );
            (0..2).for_each(|axis| batch.uv[axis][i] = uv[axis]);
            (0..3).for_each(|axis| batch.wo[axis][i] = wo[axis]);
            (0..3).for_each(|axis| batch.wi[axis][i] = wi[axis]);
            batch.kappa_hat[i] = 2.5 * random.signed();
            (0..2).for_each(|axis| batch.offset[axis][i] = offset[axis]);
            (0..3).for_each(|axis| batch.rgb[axis][i] = pattern[axis] * wi.z);
        }
        if let Some((broken, armed)) = &self.broken
            && *broken == index
            && (self.always || armed.swap(false, Ordering::Relaxed))
        {
            batch.rgb[0][3] = f32::NAN;
        }
    }
}

fn form() -> Architecture {
    let texture = TextureShape::square(32, 8);
    Architecture {
        opacity_texture: texture,
        offset_texture: TextureShape::square(16, 4),
        colour_texture: texture,
        ..Architecture::taps(0.1)
    }
}

/// Too few steps to learn much; enough for starts, scores and checkpoints.
fn short() -> TrainOptions {
    TrainOptions {
        opacity_steps: 40,
        appearance_steps: 40,
        texture_rate: 3e-2,
        opacity_batch: 3000,
        appearance_batch: 2500,
        held_out: 2000,
        starts: 2,
        trial: 0.1,
        scores: 6,
        ..TrainOptions::default()
    }
}

fn quietly(
    form: &Architecture,
    options: &TrainOptions,
    source: &Bumps,
) -> Result<(Model, TrainReport), TrainError> {
    let mut progress = |_: &_| ControlFlow::Continue(());
    train(form, options, source, &mut Control { checkpoint: None, progress: &mut progress })
}

fn scores(report: &TrainReport, stage: Stage) -> Scores {
    report.last(stage).expect("the stage was scored")
}

#[test]
fn a_short_run_learns_silhouettes_offsets_and_colours() {
    let options = TrainOptions { opacity_steps: 250, appearance_steps: 250, ..short() };
    let (model, report) = quietly(&form(), &options, &Bumps::new()).unwrap();
    let (opacity, appearance) = (scores(&report, Stage::Opacity), scores(&report, Stage::Appearance));
    // An opaque surface leaves 1.
    assert!(opacity.error < 0.17, "share of the base error left: {}", opacity.error);
    // Grey at the mean is at 0.21; an offset of 0 at 0.025.
    assert!(appearance.error < 0.08, "root mean square of the colour: {}", appearance.error);
    assert!(appearance.offset.unwrap() < 0.006, "offset {:?}", appearance.offset);
    assert_eq!(report.trials.len(), 4);
    assert!(model.opacity.is_some() && report.recoveries.is_empty());
}

#[test]
fn colour_and_alpha_alone_teach_both() {
    let options = TrainOptions {
        opacity_steps: 250,
        appearance_steps: 250,
        supervision: Supervision::ColourAndAlpha,
        ..short()
    };
    let (_, report) = quietly(&form(), &options, &Bumps::new()).unwrap();
    let (opacity, appearance) = (scores(&report, Stage::Opacity), scores(&report, Stage::Appearance));
    assert!(opacity.error < 0.2, "share of the base error left: {}", opacity.error);
    assert!(appearance.error < 0.1, "root mean square of the colour: {}", appearance.error);
}

#[test]
fn threads_do_not_change_the_bits() {
    let with = |threads: usize| {
        let pool = rayon::ThreadPoolBuilder::new().num_threads(threads).build().unwrap();
        pool.install(|| quietly(&form(), &short(), &Bumps::new()).unwrap())
    };
    let (one, three) = (with(1), with(3));
    assert!(one == three, "models or reports differ");
}

#[test]
fn resumed_runs_give_the_same_bits() {
    let whole = quietly(&form(), &short(), &Bumps::new()).unwrap();
    let folder = tempfile::tempdir().unwrap();
    let path = folder.path().join("run.checkpoint");
    // Once in the middle of each stage.
    for stop in [Stage::Opacity, Stage::Appearance] {
        let mut progress = |progress: &super::Progress| {
            let middle =
                progress.stage == stop && progress.fraction > if stop == Stage::Opacity { 0.35 } else { 0.8 };
            if middle { ControlFlow::Break(()) } else { ControlFlow::Continue(()) }
        };
        let mut control = Control { checkpoint: Some(&path), progress: &mut progress };
        let stopped = train(&form(), &short(), &Bumps::new(), &mut control);
        assert!(matches!(stopped, Err(TrainError::Interrupted)), "{stopped:?}");
        let mut onward = |_: &_| ControlFlow::Continue(());
        let mut control = Control { checkpoint: Some(&path), progress: &mut onward };
        let resumed = resume(&path, &Bumps::new(), &mut control).unwrap();
        assert!(resumed == whole, "models or reports differ after {stop:?}");
    }
}

#[test]
fn a_broken_batch_is_recovered_from_and_told() {
    // Its parts are first used in the 17th step.
    let broken = Some((2, AtomicBool::new(true)));
    let mut told = 0;
    let mut progress = |progress: &super::Progress| {
        told += u32::from(progress.recovery.is_some());
        ControlFlow::Continue(())
    };
    let mut control = Control { checkpoint: None, progress: &mut progress };
    let source = Bumps { broken, ..Bumps::new() };
    let (model, report) = train(&form(), &short(), &source, &mut control).unwrap();
    assert_eq!(report.recoveries.len(), 1);
    assert_eq!(told, 1);
    let recovery = report.recoveries[0];
    assert_eq!((recovery.stage, recovery.step, recovery.rate_scale), (Stage::Appearance, 16, 0.5));
    assert!(recovery.back_to < 16);
    assert!(model.colour.texture.texels.iter().all(|x| x.is_finite()));
}

#[test]
fn lasting_divergence_is_an_error() {
    let source = Bumps { broken: Some((2, AtomicBool::new(true))), always: true, ..Bumps::new() };
    let failed = quietly(&form(), &short(), &source);
    assert!(matches!(failed, Err(TrainError::Diverged { stage: Stage::Appearance, step: 16, .. })));
}

#[test]
fn neumip_trains_with_the_same_code() {
    let base = Architecture::neumip(0.1);
    let form = Architecture { colour_texture: TextureShape::square(32, 8), ..base };
    let options = TrainOptions { appearance_steps: 150, ..short() };
    let (model, report) = quietly(&form, &options, &Bumps::new()).unwrap();
    assert!(form.opacity == OpacityHead::Opaque && model.opacity.is_none());
    assert!(report.curve.iter().all(|point| point.stage == Stage::Appearance));
    // The material's offset is along the ray, so that this form has no excuse.
    assert!(scores(&report, Stage::Appearance).offset.unwrap() < 0.006);
}

#[test]
fn nonsense_is_refused_by_name() {
    let options = TrainOptions { network_rate: f64::NAN, ..short() };
    let message = quietly(&form(), &options, &Bumps::new()).unwrap_err().to_string();
    assert!(message.contains("network_rate is NaN"), "{message}");
    let folder = tempfile::tempdir().unwrap();
    let path = folder.path().join("no.checkpoint");
    std::fs::write(&path, b"{}").unwrap();
    let mut progress = |_: &_| ControlFlow::Continue(());
    let mut control = Control { checkpoint: None, progress: &mut progress };
    let message = resume(&path, &Bumps::new(), &mut control).unwrap_err().to_string();
    assert!(message.contains("no.checkpoint") && message.contains("safetensors"), "{message}");
}

//! Training and judging one model.

use std::ops::ControlFlow;
use std::time::Instant;

use anyhow::Result;
use osculate_sbtf::evaluate::{AppearanceOptions, SilhouetteOptions, appearance_pairs, silhouettes, total};
use osculate_sbtf::infer::{Material, Precision, StoredModel};
use osculate_sbtf::model::Model;
use osculate_sbtf::oracle::Oracle;
use osculate_sbtf::patch::PatchDataset;
use osculate_sbtf::random::Random;
use osculate_sbtf::train::{Control, Progress, TrainOptions, train};
use osculate_sbtf::{Answer, Query, SilhouetteBtf};

use super::settings::{Knob, PRECISIONS, Setting};
use crate::neural::score::appearance_scores;

/// What is known of one model.
#[derive(Debug, Clone, serde::Serialize)]
pub struct Row {
    /// What was turned.
    pub knob: Knob,
    /// Its value; empty for the default.
    pub value: String,
    /// Share of the silhouette's base error left.
    pub left: f64,
    /// Mean over curvatures, decibels.
    pub psnr: f64,
    /// Mean over curvatures.
    pub flip: f64,
    /// Of a query that hits, in batches, one thread.
    pub batched_nanoseconds: f64,
    /// Of a query on its own.
    pub single_nanoseconds: f64,
    /// Of textures and networks.
    pub bytes: usize,
    /// Of the training, on all threads, samples included.
    pub training_seconds: f64,
    /// Steps of each part of the training.
    pub steps: u64,
}

/// How much work goes into a study.
#[derive(Debug, Clone, Copy)]
pub struct Effort {
    /// Steps of each part of the training.
    pub steps: u64,
    /// Samples in a step.
    pub batch: usize,
    /// Rays per curvature.
    pub rays: u32,
    /// Pixels along a side of the pictures.
    pub size: u32,
    /// Pictures per curvature.
    pub pairs: u32,
    /// Where all random choices come from.
    pub seed: u64,
}

/// Trains a setting and judges it; the default also in other precisions.
pub fn measure(
    setting: &Setting,
    source: &PatchDataset,
    oracle: &Oracle,
    effort: &Effort,
    tick: &mut dyn FnMut(f64),
) -> Result<Vec<Row>> {
    #[expect(clippy::cast_possible_truncation, clippy::cast_sign_loss, reason = "a count of steps")]
    let steps = ((effort.steps as f64 * setting.effort) as u64).max(1);
    let options = TrainOptions {
        opacity_steps: steps,
        appearance_steps: steps,
        seed: effort.seed,
        opacity_batch: effort.batch,
        appearance_batch: effort.batch,
        starts: 1,
        ..TrainOptions::default()
    };
    let began = Instant::now();
    let mut watch = |progress: &Progress| {
        tick(progress.fraction);
        ControlFlow::Continue(())
    };
    let mut control = Control { checkpoint: None, progress: &mut watch };
    let (model, _) = train(&setting.form, &options, source, &mut control)?;
    let training_seconds = began.elapsed().as_secs_f64();
    let judged = |knob, value: String, precision| {
        let row = judge(&model, precision, oracle, effort);
        Row { knob, value, training_seconds, steps, ..row }
    };
    let mut rows = vec![judged(setting.knob, setting.value.clone(), setting.precision)];
    if setting.knob == Knob::Default {
        rows.extend(PRECISIONS.map(|p| judged(Knob::Bits, p.name().to_owned(), p)));
    }
    Ok(rows)
}

fn judge(model: &Model, precision: Precision, oracle: &Oracle, effort: &Effort) -> Row {
    let stored = StoredModel::new(model, precision);
    let material = Material::new(&stored);
    let rays = SilhouetteOptions { rays: effort.rays, ..SilhouetteOptions::default() };
    let left = total(&silhouettes(oracle, &material, model.architecture.depth, &rays)).left();
    let pictures =
        AppearanceOptions { size: effort.size, pairs: effort.pairs, ..AppearanceOptions::default() };
    let pairs = appearance_pairs(oracle, &[&material], &pictures).concat();
    let scores = appearance_scores(&pairs, effort.size as usize);
    let count = scores.len().max(1) as f64;
    let (batched, single) = nanoseconds(&material, model.architecture.kappa_range);
    Row {
        knob: Knob::Default,
        value: String::new(),
        left,
        psnr: scores.iter().map(|s| s.psnr).sum::<f64>() / count,
        flip: scores.iter().map(|s| s.flip).sum::<f64>() / count,
        batched_nanoseconds: batched,
        single_nanoseconds: single,
        bytes: stored.bytes(),
        training_seconds: 0.0,
        steps: 0,
    }
}

/// Median times of a query in a batch and on its own, of random queries from well above the silhouette.
fn nanoseconds(material: &Material, kappa_range: [f32; 2]) -> (f64, f64) {
    const QUERIES: usize = 4096;
    const RUNS: usize = 15;
    let mut random = Random::new(7, 0, 0);
    let direction = |random: &mut Random, least: f32| {
        let z = least + (1.0 - least) * random.unit();
        let (y, x) = (std::f32::consts::TAU * random.unit()).sin_cos();
        let sine = (1.0 - z * z).sqrt();
        glam::Vec3::new(sine * x, sine * y, z)
    };
    let queries: Vec<Query> = (0..QUERIES)
        .map(|_| Query {
            uv: glam::Vec2::new(random.unit(), random.unit()),
            wo: direction(&mut random, 0.3),
            wi: direction(&mut random, -0.5),
            kappa_hat: random.unit() * kappa_range[1],
        })
        .collect();
    let mut answers = vec![Answer::default(); QUERIES];
    let mut time = |ask: &mut dyn FnMut(&mut [Answer])| {
        let mut times: Vec<f64> = (0..RUNS)
            .map(|_| {
                let began = Instant::now();
                ask(&mut answers);
                began.elapsed().as_secs_f64() * 1e9 / QUERIES as f64
            })
            .collect();
        times.sort_by(f64::total_cmp);
        times[RUNS / 2]
    };
    let batched = time(&mut |answers| material.eval_batch(&queries, answers));
    let single = time(&mut |answers| {
        for (query, answer) in queries.iter().zip(answers) {
            *answer = material.eval(query);
        }
    });
    (batched, single)
}

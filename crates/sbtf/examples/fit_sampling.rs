//! Measures the samplers in model files beside what a fit makes of them now, and with `--write` puts the new ones in. Nothing else in the
//! files changes, and nothing is trained:
//!
//! `cargo run --release -p osculate-sbtf --example fit_sampling -- [--write] MODEL.sbtf...`
//!
//! Rows of a table: variance of a sample over the square of its mean; the weight (brightness over density) that one sample in ten
//! thousand exceeds, for all views and for grazing ones; the largest grazing one of some half a million; lobes of a mixture with a
//! weight; nanoseconds to draw a sample with its density.

#![allow(clippy::print_stdout, reason = "an example reports on standard output")]

use std::error::Error;
use std::hint::black_box;
use std::path::{Path, PathBuf};
use std::time::Instant;

use glam::{Vec2, Vec3};
use osculate_sbtf::Incidence;
use osculate_sbtf::file::ModelFile;
use osculate_sbtf::infer::Material;
use osculate_sbtf::random::Random;
use osculate_sbtf::sampling::{FitOptions, Sampler, Spread, SpreadOptions, fit};

/// Views from there on are grazing: 8.6 degrees.
const GRAZING: f32 = 0.15;

fn main() -> Result<(), Box<dyn Error>> {
    let mut arguments: Vec<String> = std::env::args().skip(1).collect();
    let write = arguments.first().is_some_and(|first| first == "--write");
    arguments.drain(..usize::from(write));
    if arguments.is_empty() {
        return Err("usage: fit_sampling [--write] MODEL.sbtf...".into());
    }
    println!("| material | sampler | variance | rare | rare, grazing | largest, grazing | lobes | ns |");
    println!("|---|---|---|---|---|---|---|---|");
    for path in arguments.iter().map(PathBuf::from) {
        refit(&path, write)?;
    }
    Ok(())
}

fn refit(path: &Path, write: bool) -> Result<(), Box<dyn Error>> {
    let file = ModelFile::read(path)?;
    let material = Material::new(&file.model);
    let kappa_range = file.model.architecture.kappa_range;
    let stored = file.sampler.clone().unwrap_or_else(Sampler::cosine);
    let fitted = fit(&material, &FitOptions::new(kappa_range)).sampler;
    let name = path.file_stem().unwrap_or_default().to_string_lossy();
    print_row(&name, "stored", &material, &stored, kappa_range)?;
    if fitted == stored {
        println!("| {name} | fitted: the same | | | | | | |");
    } else {
        print_row(&name, "fitted", &material, &fitted, kappa_range)?;
    }
    if write {
        ModelFile { sampler: Some(fitted), ..file }.write(path)?;
    }
    Ok(())
}

fn print_row(
    name: &str,
    which: &str,
    material: &Material,
    sampler: &Sampler,
    kappa_range: [f32; 2],
) -> Result<(), Box<dyn Error>> {
    let nothing = || format!("{name}: no view hits");
    let options = SpreadOptions::new(kappa_range);
    let all = Spread::measure(material, sampler, &options).ok_or_else(nothing)?;
    let options = SpreadOptions { cosines: [0.0, GRAZING], ..options };
    let grazing = Spread::measure(material, sampler, &options).ok_or_else(nothing)?;
    println!(
        "| {name} | {which} | {:.3} | {:.2} | {:.2} | {:.1} | {:.1} | {:.0} |",
        all.variance,
        all.rare,
        grazing.rare,
        grazing.largest,
        sampler.lobes_in_use(),
        nanoseconds(sampler, kappa_range),
    );
    Ok(())
}

/// To draw a direction with its density: the fastest of 25 rounds, which is the one that other programs disturbed least.
fn nanoseconds(sampler: &Sampler, [low, high]: [f32; 2]) -> f64 {
    const SAMPLES: usize = 20_000;
    let mut random = Random::new(1, 0, 0);
    let queries: Vec<(Incidence, f32, Vec2)> = (0..SAMPLES)
        .map(|_| {
            let wo = Vec3::new(random.signed(), random.signed(), 1e-3 + random.unit()).normalize();
            let uv = Vec2::new(random.unit(), random.unit());
            let kappa_hat = low + (high - low) * random.unit();
            (Incidence { uv, wo, kappa_hat }, random.unit(), Vec2::new(random.unit(), random.unit()))
        })
        .collect();
    let rounds = (0..25).map(|_| {
        let began = Instant::now();
        for (query, pick, u) in &queries {
            black_box(sampler.sample(query, *pick, *u));
        }
        began.elapsed().as_secs_f64() / SAMPLES as f64 * 1e9
    });
    rounds.fold(f64::INFINITY, f64::min)
}

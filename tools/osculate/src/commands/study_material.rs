//! `osculate study material`

use std::path::PathBuf;

use anyhow::{Context, Result, bail};
use clap::Args;
use osculate_sbtf::oracle::{Oracle, OracleOptions};
use osculate_sbtf::patch::{DatasetOptions, PatchDataset};
use serde::Serialize;

use crate::cli::Outcome;
use crate::console::{Console, count};
use crate::neural::load_micro;
use crate::report::Reporter;
use crate::study::material::measure::{Effort, Row, measure};
use crate::study::material::report::{Context as PageContext, csv, page, plots};
use crate::study::material::settings::settings;
use crate::study::run::{command_line, processor, write_files};

/// What taps, width, textures, bits and training time buy in a neural material.
#[derive(Debug, Args)]
#[command(after_help = "\
Examples:
  osculate study material stone-1 -o out/study --quick
  osculate study material wool-1 -o out/study --steps 3000

DIR gets index.html (start there), material.csv, and every plot as SVG.")]
pub struct MaterialArgs {
    /// A procedural material by name, or a .toml that describes one; a height field
    #[arg(value_name = "MICRO")]
    micro: String,
    /// Directory for the results; made if need be
    #[arg(short, long, value_name = "DIR")]
    output: PathBuf,
    /// Small models and little training, in about a minute: to see what the study shows
    #[arg(long)]
    quick: bool,
    /// Steps of each part of every training [default: 1500; with --quick 50]
    #[arg(long, value_name = "N", value_parser = clap::value_parser!(u64).range(1..))]
    steps: Option<u64>,
    /// Where all random choices come from
    #[arg(long, value_name = "S", default_value_t = 1)]
    seed: u64,
}

#[derive(Serialize)]
struct Report<'a> {
    microstructure: &'a str,
    output: String,
    files: Vec<String>,
    quick: bool,
    rows: &'a [Row],
}

/// Runs the command.
pub fn run(args: &MaterialArgs, console: &Console, reporter: &Reporter) -> Result<Outcome> {
    let folder = &args.output;
    if folder.exists() && !folder.is_dir() {
        bail!("{}: is a file; name a directory", folder.display());
    }
    let micro = load_micro(&args.micro, console)?;
    let data = DatasetOptions { seed: args.seed, ..DatasetOptions::default() };
    let source = PatchDataset::new(&micro, data).with_context(|| args.micro.clone())?;
    let oracle = Oracle::new(&micro, OracleOptions::default());
    let effort = Effort {
        steps: args.steps.unwrap_or(if args.quick { 50 } else { 1500 }),
        batch: if args.quick { 2048 } else { 16_384 },
        rays: if args.quick { 2_000 } else { 30_000 },
        size: if args.quick { 24 } else { 64 },
        pairs: if args.quick { 2 } else { 16 },
        seed: args.seed,
    };
    std::fs::create_dir_all(folder).with_context(|| folder.display().to_string())?;
    let all = settings(micro.geometry.depth(), args.quick);
    let mut rows = Vec::new();
    let bar = console.steps("training models", 1000);
    let whole: f64 = all.iter().map(|setting| setting.effort).sum();
    let mut done = 0.0;
    for setting in &all {
        let mut tick = |share: f64| bar.set_share((done + share * setting.effort) / whole);
        rows.extend(measure(setting, &source, &oracle, &effort, &mut tick)?);
        done += setting.effort;
    }
    drop(bar);
    let context =
        PageContext { command: command_line(), machine: processor(), micro: micro.name.clone(), effort };
    let plots = plots(&rows);
    let mut files = vec![
        ("index.html".to_owned(), page(&rows, &plots, &context)),
        ("material.csv".to_owned(), csv(&rows)),
    ];
    files.extend(plots);
    let files = write_files(folder, files)?;
    console.result(format_args!(
        "Trained {} on {}; start with {}",
        count(all.len(), "model"),
        context.machine,
        folder.join("index.html").display()
    ));
    let output = folder.display().to_string();
    let report = Report { microstructure: &micro.name, output, files, quick: args.quick, rows: &rows };
    reporter.write("study.material", 1, &report)?;
    Ok(Outcome::Done)
}

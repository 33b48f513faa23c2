//! `osculate study render`

use std::path::{Path, PathBuf};

use anyhow::{Context, Result, bail};
use clap::Args;
use osculate_sbtf::file::ModelFile;
use osculate_sbtf::micro::{Geometry, Microstructure};
use serde::Serialize;

use super::eval::microstructure_of;
use super::eval_scenes::entry;
use crate::cli::Outcome;
use crate::console::{Console, count};
use crate::protocol::Subject;
use crate::report::Reporter;
use crate::study::render::measure::{Effort, Material, Network, NetworkSize, Results, measure};
use crate::study::render::report::{Context as PageContext, csv, page, plots};
use crate::study::render::settings::{FULL, QUICK};
use crate::study::run::{command_line, processor, write_files};

/// One material on the torus in every form: its error against displaced truth, time and memory.
#[derive(Debug, Args)]
#[command(after_help = "\
Examples:
  osculate study render assets/materials/stone-1.sbtf -o out/study --quick
  osculate study render assets/materials/stone-1.sbtf -o out/study
  osculate study render stone.sbtf -o out/study --also narrow.sbtf --also wide.sbtf

DIR gets index.html (start there), render.csv, and every plot as SVG.")]
pub struct RenderStudyArgs {
    /// A trained model of a height field
    #[arg(value_name = "MODEL.sbtf")]
    model: PathBuf,
    /// Another model of the same microstructure, smaller or larger, to show what size buys; repeatable
    #[arg(long, value_name = "MODEL.sbtf")]
    also: Vec<PathBuf>,
    /// Directory for the results; made if need be
    #[arg(short, long, value_name = "DIR")]
    output: PathBuf,
    /// A small part of the study, in seconds: a coarser torus, a reference of coarse triangles, no oracle
    #[arg(long)]
    quick: bool,
    /// Pixels along each side [default: 192; with --quick 24]
    #[arg(long, value_name = "N", value_parser = clap::value_parser!(u32).range(16..=4096))]
    pixels: Option<u32>,
    /// Samples per pixel of the reference [default: 2048; with --quick 16]
    #[arg(long, value_name = "N", value_parser = clap::value_parser!(u32).range(2..=1_000_000))]
    reference_spp: Option<u32>,
    /// Renderings of every setting [default: 3; with --quick 2]
    #[arg(long, value_name = "N", value_parser = clap::value_parser!(u32).range(2..=100))]
    runs: Option<u32>,
    /// Where all random choices come from
    #[arg(long, value_name = "S", default_value_t = 1)]
    seed: u64,
}

#[derive(Serialize)]
struct Report<'a> {
    output: String,
    files: Vec<String>,
    quick: bool,
    material: &'a str,
    effort: Effort,
    #[serde(flatten)]
    results: &'a Results,
}

/// Runs the command.
pub fn run(args: &RenderStudyArgs, console: &Console, reporter: &Reporter) -> Result<Outcome> {
    let folder = &args.output;
    if folder.exists() && !folder.is_dir() {
        bail!("{}: is a file; name a directory", folder.display());
    }
    let path = &args.model;
    let file = ModelFile::read(path)?;
    let micro = microstructure_of(path, &file, console)?;
    let Geometry::HeightField(heights) = &micro.geometry else {
        bail!("{}: {} is a see-through mesh, which cannot be displaced", path.display(), micro.name)
    };
    let mut networks = vec![network(path, &file)];
    for other in &args.also {
        networks.push(other_network(other, &micro, path)?);
    }
    std::fs::create_dir_all(folder).with_context(|| folder.display().to_string())?;
    let or = |given: Option<u32>, quick, full| given.unwrap_or(if args.quick { quick } else { full });
    let effort = Effort {
        pixels: or(args.pixels, 24, 192),
        reference_spp: or(args.reference_spp, 16, 2048),
        runs: or(args.runs, 2, 3),
        seed: args.seed,
        extent: if args.quick { QUICK } else { FULL },
    };
    let subject = if args.quick { Subject::coarse_torus(console) } else { Subject::torus(console) }?;
    let material = Material { networks: &networks, micro: &micro, heights };
    let results = {
        let bar = console.steps("rendering", 1000);
        measure(&subject, &material, &effort, &mut |share| bar.set_share(share))
            .with_context(|| path.display().to_string())?
    };
    let context = PageContext {
        command: command_line(),
        machine: processor(),
        threads: rayon::current_num_threads(),
        micro: micro.name.clone(),
        effort,
    };
    let plots = plots(&results, &effort);
    let mut files = vec![
        ("index.html".to_owned(), page(&results, &plots, &context)),
        ("render.csv".to_owned(), csv(&results)),
    ];
    files.extend(plots);
    let files = write_files(folder, files)?;
    console.result(format_args!(
        "Measured {} on {}; start with {}",
        count(results.rows.len(), "rendering"),
        context.machine,
        folder.join("index.html").display()
    ));
    let report = Report {
        output: folder.display().to_string(),
        files,
        quick: args.quick,
        material: &micro.name,
        effort,
        results: &results,
    };
    reporter.write("study.render", 2, &report)?;
    Ok(Outcome::Done)
}

/// A model, named by its file.
fn network(path: &Path, file: &ModelFile) -> Network {
    let name = path.file_stem().unwrap_or_default().to_string_lossy().into_owned();
    Network { entry: entry(file), size: NetworkSize::of(&name, &file.model), name }
}

fn other_network(path: &Path, micro: &Microstructure, first: &Path) -> Result<Network> {
    let file = ModelFile::read(path)?;
    if file.provenance.microstructure.as_ref().is_none_or(|of| of.sha256 != micro.hash()) {
        bail!("--also {}: is a model of another microstructure than {}", path.display(), first.display());
    }
    Ok(network(path, &file))
}

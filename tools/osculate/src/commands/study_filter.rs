//! `osculate study filter`

use std::path::{Path, PathBuf};

use anyhow::{Context, Result, bail};
use clap::Args;
use osculate_geom::io::{no_files, read_obj};
use osculate_geom::{Mesh, shapes};
use serde::Serialize;

use super::demo::SPOT;
use crate::cli::Outcome;
use crate::console::{Console, count};
use crate::input;
use crate::report::Reporter;
use crate::study::filter::measure::{Effort, MeshResult, Subject, bumpy_sphere, measure};
use crate::study::filter::report::{Context as PageContext, csv, page, plots};
use crate::study::run::{command_line, processor, write_files};

/// Every curvature filter: its error against slicing the whole mesh, and its time against a ray cast.
#[derive(Debug, Args)]
#[command(after_help = "\
Examples:
  osculate study filter -o out/study --quick
  osculate study filter -o out/study --mesh bunny.obj

DIR gets index.html (start there), filter.csv, and every plot as SVG. Times are of one thread.")]
pub struct FilterArgs {
    /// Directory for the results; made if need be
    #[arg(short, long, value_name = "DIR")]
    output: PathBuf,
    /// A small part of the study, in seconds
    #[arg(long)]
    quick: bool,
    /// Study this mesh too; repeatable
    #[arg(long, value_name = "FILE")]
    mesh: Vec<PathBuf>,
    /// Timed runs of every filter; the median counts [default: 41; with --quick 3]
    #[arg(long, value_name = "N", value_parser = clap::value_parser!(u16).range(1..=1000))]
    runs: Option<u16>,
}

#[derive(Serialize)]
struct Report<'a> {
    output: String,
    files: Vec<String>,
    quick: bool,
    results: &'a [MeshResult],
}

/// Runs the command.
pub fn run(args: &FilterArgs, console: &Console, reporter: &Reporter) -> Result<Outcome> {
    let folder = &args.output;
    if folder.exists() && !folder.is_dir() {
        bail!("{}: is a file; name a directory", folder.display());
    }
    let subjects = subjects(args, console)?;
    std::fs::create_dir_all(folder).with_context(|| folder.display().to_string())?;
    let runs = args.runs.map_or(if args.quick { 3 } else { 41 }, usize::from);
    let effort = Effort { queries: if args.quick { 500 } else { 4000 }, runs };
    let results = {
        let steps = 2 * subjects.len();
        let bar = console.steps("measuring filters", steps as u64);
        let mut done = 0;
        let mut tick = || {
            done += 1;
            bar.set_share(f64::from(done) / steps as f64);
        };
        let measured = subjects.iter().map(|subject| measure(subject, effort, &mut tick));
        measured.collect::<Result<Vec<_>>>()?
    };
    let context = PageContext { command: command_line(), machine: processor(), effort };
    let files = write(folder, &results, &context)?;
    console.result(format_args!(
        "Measured {} on {}; start with {}",
        count(results.len(), "surface"),
        context.machine,
        folder.join("index.html").display()
    ));
    let report = Report { output: folder.display().to_string(), files, quick: args.quick, results: &results };
    reporter.write("study.filter", 1, &report)?;
    Ok(Outcome::Done)
}

fn subjects(args: &FilterArgs, console: &Console) -> Result<Vec<Subject>> {
    let spot = read_obj(SPOT, &no_files).context("Spot")?.mesh;
    let (rings, levels) = if args.quick { (48, 4) } else { (128, 5) };
    let mut all = vec![
        subject("Spot", spot.clone()),
        Subject { depth_share: 0.1 * DEPTH_SHARE, ..subject("Spot (thin material)", spot) },
        subject("torus", shapes::torus_with_uv(1.0, 0.45, rings, rings / 2)),
        subject("bumpy sphere", bumpy_sphere(levels)),
    ];
    for path in &args.mesh {
        let name = path.file_stem().unwrap_or_default().to_string_lossy().into_owned();
        all.push(subject(&name, input::read_mesh(path, console)?));
    }
    Ok(all)
}

/// Depth of the material as a share of the diagonal: what a microstructure of visible depth has.
const DEPTH_SHARE: f64 = 0.01;

fn subject(name: &str, mesh: Mesh) -> Subject {
    Subject { name: name.to_owned(), mesh, depth_share: DEPTH_SHARE }
}

fn write(folder: &Path, results: &[MeshResult], context: &PageContext) -> Result<Vec<String>> {
    let plots = plots(results);
    let mut files = vec![
        ("index.html".to_owned(), page(results, &plots, context)),
        ("filter.csv".to_owned(), csv(results)),
    ];
    files.extend(plots.into_iter().map(|plot| (plot.file, plot.svg)));
    write_files(folder, files)
}

//! `osculate study`

use std::path::{Path, PathBuf};

use anyhow::{Context, Result, bail};
use clap::{Args, Subcommand};
use osculate_geom::Mesh;
use osculate_geom::io::{no_files, read_obj};
use serde::Serialize;

use super::demo::SPOT;
use super::study_filter::{self, FilterArgs};
use super::study_material::{self, MaterialArgs};
use super::study_render::{self, RenderStudyArgs};
use crate::cli::Outcome;
use crate::console::{Console, count};
use crate::input;
use crate::report::Reporter;
use crate::study::curvature::peers::{Export, PeersRun, read_peers};
use crate::study::curvature::{
    self, Effort, Exponents, Part, PeersOrigin, Plan, ReportContext, Row, Setting, Subject, settings,
};
use crate::study::run::{command_line, processor, write_files};

/// Measure error against time: CSV, SVG, and one self-contained HTML page.
#[derive(Debug, Args)]
pub struct StudyArgs {
    #[command(subcommand)]
    study: Study,
}

#[derive(Debug, Subcommand)]
enum Study {
    Curvature(CurvatureArgs),
    Filter(FilterArgs),
    Material(MaterialArgs),
    Render(RenderStudyArgs),
}

/// Every estimator, knob and noise level on surfaces of known curvature, beside other programs if they are here.
#[derive(Debug, Args)]
#[command(after_help = "\
Examples:
  osculate study curvature -o out/study --quick
  osculate study curvature -o out/study
  osculate study curvature -o out/study --mesh bunny.obj
  osculate study curvature -o out/study --python venv/bin/python --cgal /usr/include --ponca ~/ponca

  osculate study curvature -o out/growth --part growth --threads 1

DIR gets index.html (start there), curvature.csv, growth.csv, and every plot as SVG.")]
pub struct CurvatureArgs {
    /// Directory for the results; made if need be
    #[arg(short, long, value_name = "DIR")]
    output: PathBuf,
    /// A small part of the study, in seconds
    #[arg(long)]
    quick: bool,
    /// Error against time, growth of time and memory with the mesh (to two million vertices), or both
    #[arg(long, value_enum, default_value = "all")]
    part: Part,
    /// Vertices of the analytic shapes [default: 10000; with --quick 1000]
    #[arg(long, value_name = "N", value_parser = clap::value_parser!(u32).range(200..=2_000_000))]
    vertices: Option<u32>,
    /// Study the limit surface of this closed mesh too, besides Spot's; repeatable
    #[arg(long, value_name = "FILE")]
    mesh: Vec<PathBuf>,
    /// Timed runs of every setting; the median counts [default: 3; with --quick 1]
    #[arg(long, value_name = "N", value_parser = clap::value_parser!(u16).range(1..=100))]
    runs: Option<u16>,
    /// Where all random choices come from
    #[arg(long, value_name = "S", default_value_t = 1)]
    seed: u64,
    /// Write the meshes with their exact curvature to DIR/meshes, for other programs
    #[arg(long)]
    export: bool,
    #[command(flatten)]
    peers: PeersArgs,
}

/// Other programs.
#[derive(Debug, Args)]
#[command(next_help_heading = "Other programs")]
struct PeersArgs {
    /// Take their rows from a file that tools/reference/peers.py wrote
    #[arg(long, value_name = "FILE.csv", conflicts_with = "python")]
    peers: Option<PathBuf>,
    /// Measure them in this run with this Python: libigl and pymeshlab as far as it can import them
    #[arg(long, value_name = "PYTHON")]
    python: Option<PathBuf>,
    /// Measure CGAL 6 too: its include directory
    #[arg(long, value_name = "DIR", requires = "python")]
    cgal: Option<PathBuf>,
    /// Measure Ponca too: its checkout
    #[arg(long, value_name = "DIR", requires = "python")]
    ponca: Option<PathBuf>,
    /// Measure trimesh2 too: its checkout
    #[arg(long, value_name = "DIR", requires = "python")]
    trimesh2: Option<PathBuf>,
    /// Include directory of Eigen, for CGAL and Ponca
    #[arg(long, value_name = "DIR", requires = "python")]
    eigen: Option<PathBuf>,
    /// The script that measures them
    #[arg(long, value_name = "FILE", default_value = "tools/reference/peers.py", requires = "python")]
    peers_script: PathBuf,
}

#[derive(Serialize)]
struct Report<'a> {
    output: String,
    files: Vec<String>,
    quick: bool,
    seed: u64,
    rows: &'a [Row],
    growth: Vec<Exponents>,
}

/// Runs the command.
pub fn run(args: &StudyArgs, console: &Console, reporter: &Reporter) -> Result<Outcome> {
    match &args.study {
        Study::Curvature(args) => run_curvature(args, console, reporter),
        Study::Filter(args) => study_filter::run(args, console, reporter),
        Study::Material(args) => study_material::run(args, console, reporter),
        Study::Render(args) => study_render::run(args, console, reporter),
    }
}

fn run_curvature(args: &CurvatureArgs, console: &Console, reporter: &Reporter) -> Result<Outcome> {
    let folder = &args.output;
    if folder.exists() && !folder.is_dir() {
        bail!("{}: is a file; name a directory", folder.display());
    }
    let peers_run = args.peers.run(args.runs());
    if let Some(run) = &peers_run {
        run.check()?;
    }
    let given = args.peers.peers.as_deref().map(read_rows).transpose()?;
    let plan = Plan::new(args.vertices(), args.part, args.quick, args.seed, &everyday(args, console)?);
    plan.check()?;
    std::fs::create_dir_all(folder).with_context(|| folder.display().to_string())?;

    let settings = settings(args.quick);
    let (mut rows, meshes) = measure(args, &plan, &settings, peers_run.is_some(), console)?;
    let origin = match (&peers_run, &given) {
        (Some(_), _) => PeersOrigin::ThisRun,
        (None, Some(_)) => PeersOrigin::File,
        (None, None) => PeersOrigin::None,
    };
    if let (Some(run), Some(meshes)) = (&peers_run, meshes) {
        let step = console.steps("measuring other programs", 1000);
        rows.extend(run.run(&meshes, |share| step.set_share(share))?);
    }
    rows.extend(given.into_iter().flatten());

    let threads = count(rayon::current_num_threads(), "thread");
    let machine = format!("{}, {threads}", processor());
    let context = ReportContext { command: command_line(), machine, peers: origin, settings };
    let files = write(folder, &rows, &context)?;
    console.result(format_args!(
        "Measured {} on {}; start with {}",
        count(rows.len(), "setting and mesh pair"),
        context.machine,
        folder.join("index.html").display()
    ));
    let report = Report {
        output: folder.display().to_string(),
        files,
        quick: args.quick,
        seed: args.seed,
        rows: &rows,
        growth: curvature::exponents(&rows),
    };
    reporter.write("study_curvature", 1, &report)?;
    Ok(Outcome::Done)
}

impl CurvatureArgs {
    fn vertices(&self) -> usize {
        self.vertices.map_or(if self.quick { 1_000 } else { 10_000 }, |n| n as usize)
    }

    fn runs(&self) -> usize {
        self.runs.map_or(if self.quick { 1 } else { 3 }, usize::from)
    }
}

impl PeersArgs {
    fn run(&self, runs: usize) -> Option<PeersRun> {
        let python = self.python.clone()?;
        let given = [
            ("--cgal", &self.cgal),
            ("--ponca", &self.ponca),
            ("--trimesh2", &self.trimesh2),
            ("--eigen", &self.eigen),
        ];
        let arguments = given
            .into_iter()
            .filter_map(|(name, path)| Some([name.to_owned(), path.as_ref()?.display().to_string()]))
            .flatten()
            .chain(["--runs".to_owned(), runs.to_string()]);
        Some(PeersRun { python, script: self.peers_script.clone(), arguments: arguments.collect() })
    }
}

fn read_rows(path: &Path) -> Result<Vec<Row>> {
    let text = std::fs::read_to_string(path).with_context(|| path.display().to_string())?;
    read_peers(&text).with_context(|| path.display().to_string())
}

/// Spot, and what `--mesh` names.
fn everyday(args: &CurvatureArgs, console: &Console) -> Result<Vec<(String, Mesh)>> {
    let mut meshes = vec![("spot".to_owned(), read_obj(SPOT, &no_files).context("spot.obj")?.mesh)];
    for path in &args.mesh {
        let stem = path.file_stem().unwrap_or_default().to_string_lossy();
        // The name becomes a file's and a CSV cell.
        let name = stem.replace(|c: char| !c.is_ascii_alphanumeric(), "_");
        meshes.push((name, input::read_mesh(path, console)?));
    }
    Ok(meshes)
}

/// Our own rows, and the folder of exported meshes if there is one.
fn measure(
    args: &CurvatureArgs,
    plan: &Plan,
    settings: &[Setting],
    peers: bool,
    console: &Console,
) -> Result<(Vec<Row>, Option<PathBuf>)> {
    let effort = Effort::new(rayon::current_num_threads(), args.runs())?;
    let mut export = (args.export || peers).then(|| Export::new(args.output.join("meshes"))).transpose()?;
    let work: Vec<f64> = plan.work().collect();
    let total: f64 = work.iter().sum();
    let step = console.steps("measuring", 10_000);
    let mut rows = Vec::new();
    let mut done = 0.0;
    for (subject, work) in plan.subjects().zip(work) {
        let subject: Subject = subject?;
        if let Some(export) = &mut export {
            export.add(&subject)?;
        }
        let wanted: Vec<&Setting> = settings.iter().filter(|s| subject.wants(s)).collect();
        for (i, setting) in wanted.iter().enumerate() {
            rows.push(curvature::measure(&subject, setting, &effort)?);
            step.set_share((done + work * (i + 1) as f64 / wanted.len() as f64) / total);
        }
        done += work;
    }
    Ok((rows, export.map(Export::finish).transpose()?))
}

fn write(folder: &Path, rows: &[Row], context: &ReportContext) -> Result<Vec<String>> {
    let mut files = vec![
        ("index.html".to_owned(), curvature::page(rows, context).html()),
        ("curvature.csv".to_owned(), curvature::csv(rows)),
    ];
    let growth = curvature::exponents(rows);
    if !growth.is_empty() {
        files.push(("growth.csv".to_owned(), curvature::exponents_csv(&growth)));
    }
    files.extend(curvature::plots(rows));
    write_files(folder, files)
}

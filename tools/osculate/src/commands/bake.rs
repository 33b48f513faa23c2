//! `osculate bake`

use std::path::PathBuf;

use anyhow::{Context, Result, bail};
use clap::{Args, ValueEnum};
use osculate_geom::bake::{self, BakeOptions, BakedMesh, FilterOptions, Precision, Provenance, Source};
use osculate_geom::curvature::{Status, VertexCurvature};
use osculate_geom::field::BakedMinimum;
use osculate_geom::inspect::{CurvatureReport, MeshReport, Range};
use serde::Serialize;

use crate::cli::Outcome;
use crate::console::{Console, bytes, count, number};
use crate::estimate::{EstimateArgs, describe};
use crate::filter::LengthArgs;
use crate::report::Reporter;
use crate::{commands::inspect, input, output};

/// Estimate principal curvature at every vertex and write it into the mesh.
#[derive(Debug, Args)]
#[command(after_help = "\
Examples:
  osculate bake cow.obj -o cow.glb
  osculate bake scan.ply -o scan.ply.glb --method libigl --rings 5
  osculate bake part.stl -o part.ply --precision f64 --radius 0.02
  osculate bake cow.obj -o cow.glb --filter-azimuths 8 --filter-depth 0.05

A .glb opens in any viewer; the curvature is in vertex attributes that viewers skip. Rows keep the input's vertex
order. Vertices whose data determines no curvature are flagged, not guessed.")]
pub struct BakeArgs {
    /// Mesh: .obj, .ply, .stl, .gltf or .glb
    #[arg(value_name = "IN")]
    input: PathBuf,
    /// Baked mesh: .glb or .ply
    #[arg(short, long, value_name = "OUT")]
    output: PathBuf,
    #[command(flatten)]
    estimate: EstimateArgs,
    /// Bake the minimum filter too, in N directions per vertex: 4, 8, 16 or 32
    #[arg(long, value_name = "N", value_parser = azimuths)]
    filter_azimuths: Option<usize>,
    #[command(flatten)]
    length: LengthArgs,
    /// Width of the floats; f64 needs .ply
    #[arg(long, value_enum, default_value = "f32")]
    precision: PrecisionArg,
}

#[derive(Debug, Clone, Copy, PartialEq, Eq, ValueEnum)]
enum PrecisionArg {
    F32,
    F64,
}

fn azimuths(text: &str) -> Result<usize, String> {
    let known = |n: &usize| BakedMinimum::AZIMUTHS.contains(n);
    text.parse().ok().filter(known).ok_or_else(|| "must be 4, 8, 16 or 32".to_owned())
}

#[derive(Serialize)]
struct Report<'a> {
    input: String,
    output: String,
    output_bytes: u64,
    provenance: &'a Provenance,
    mesh: MeshReport,
    curvature: CurvatureReport,
    over_tolerance: Option<OverTolerance>,
    seconds: Seconds,
}

/// The vertices at which `auto` did not reach its tolerance.
#[derive(Debug, Serialize)]
struct OverTolerance {
    vertices: usize,
    /// Median of the stated error over the curvature there.
    error_over_curvature: f64,
}

impl OverTolerance {
    /// `None` if there are none.
    fn new(curvature: &[VertexCurvature]) -> Option<Self> {
        let over = curvature.iter().filter(|c| c.status == Status::OverTolerance);
        let relative = over.filter_map(|c| Some((c.error, c.principal?)));
        // As the tolerance is meant: over the norm of the curvature tensor. On a plane that is nothing.
        let relative = relative.map(|(error, p)| error / p.kappa_max.hypot(p.kappa_min));
        let relative: Vec<f64> = relative.map(|share| share.min(f64::MAX)).collect();
        let vertices = relative.len();
        Range::new(relative).map(|range| Self { vertices, error_over_curvature: range.median })
    }
}

#[derive(Serialize)]
struct Seconds {
    read: f64,
    estimate: f64,
    write: f64,
}

/// Runs the command.
pub fn run(args: &BakeArgs, console: &Console, reporter: &Reporter) -> Result<Outcome> {
    output::check(&args.output)?;
    output::check_distinct(&args.input, &args.output)?;
    let write = writer(args)?;
    let walk = args.length.walk();
    if walk.is_some() && args.filter_azimuths.is_none() {
        bail!("--filter-depth and --filter-length say how far --filter-azimuths looks; name that too");
    }
    let options = BakeOptions {
        filter: args.filter_azimuths.map(|azimuths| FilterOptions { azimuths, walk }),
        ..args.estimate.options(&BakeOptions::default())?
    };
    let mut clock = reporter.cost().seconds;
    let mut lap = || {
        let start = std::mem::replace(&mut clock, reporter.cost().seconds);
        clock - start
    };

    let mesh = input::read_mesh(&args.input, console)?;
    let input = args.input.display().to_string();
    let source = Source::read(&args.input).with_context(|| input.clone())?;
    let read = lap();
    let baked = {
        let _step = console.step("estimating curvature");
        bake::bake(mesh, source, &options).context(input.clone())?
    };
    let estimate = lap();
    let shown = args.output.display().to_string();
    {
        let _step = console.step(&format!("writing {shown}"));
        write(&baked).map_err(|error| name_file(error, &input, &shown))?;
    }
    let report = Report {
        input,
        output_bytes: std::fs::metadata(&args.output).map_or(0, |m| m.len()),
        output: shown,
        provenance: &baked.provenance,
        mesh: MeshReport::new(baked.mesh()),
        curvature: CurvatureReport::new(baked.curvature()),
        over_tolerance: OverTolerance::new(baked.curvature()),
        seconds: Seconds { read, estimate, write: lap() },
    };
    print(&report, console, reporter);
    reporter.write("bake", 1, &report)?;
    Ok(Outcome::Done)
}

type Writer<'a> = Box<dyn Fn(&BakedMesh) -> Result<(), bake::WriteError> + 'a>;

fn writer(args: &BakeArgs) -> Result<Writer<'_>> {
    let path = &args.output;
    match (output::extension(path).as_str(), args.precision) {
        ("glb", PrecisionArg::F32) => Ok(Box::new(|baked| bake::write_glb(path, baked))),
        ("glb", PrecisionArg::F64) => {
            bail!(
                "{}: a .glb has 32-bit floats only; write a .ply, or leave out --precision f64",
                path.display()
            )
        }
        ("ply", PrecisionArg::F32) => Ok(Box::new(|baked| bake::write_ply(path, baked, Precision::F32))),
        ("ply", PrecisionArg::F64) => Ok(Box::new(|baked| bake::write_ply(path, baked, Precision::F64))),
        (other, _) => bail!("{}: the extension {other:?} is not one of .glb and .ply", path.display()),
    }
}

/// A value that does not fit is the input's fault, all else the output's.
fn name_file(error: bake::WriteError, input: &str, output: &str) -> anyhow::Error {
    let file = match &error {
        bake::WriteError::Io(_) | bake::WriteError::TooLarge { .. } => output,
        bake::WriteError::DoesNotFit { .. } | bake::WriteError::Empty => input,
    };
    anyhow::Error::new(error).context(file.to_owned())
}

/// What to make of vertices over the tolerance.
fn print_over_tolerance(report: &Report<'_>, console: &Console) {
    let Some(over) = &report.over_tolerance else { return };
    console.result(format_args!(
        "  tolerance  {} of the curvature is not reached at {} of {} vertices: there the stated error is {} of it (median). The estimates are the best found; a finer mesh has better ones, a larger --tolerance accepts these",
        format_args!("{} %", number(100.0 * report.provenance.curvature.tolerance)),
        over.vertices,
        report.mesh.vertices,
        percent(over.error_over_curvature)
    ));
}

/// `0.0132` as `1.3 %`; what is over the whole in times.
fn percent(share: f64) -> String {
    match share {
        s if s >= 1e3 => "over 1000 times".to_owned(),
        s if s > 1.0 => format!("{s:.1} times"),
        s => format!("{:.1} %", 100.0 * s),
    }
}

fn print(report: &Report<'_>, console: &Console, reporter: &Reporter) {
    let mesh = &report.mesh;
    console.result(format_args!(
        "{}: {} ({} merged), {}",
        report.input,
        count(mesh.vertices, "vertex"),
        mesh.vertices - mesh.positions,
        count(mesh.triangles, "triangle"),
    ));
    console.result(format_args!("  method     {}", describe(&report.provenance.curvature)));
    inspect::print_curvature(&report.curvature, console);
    print_over_tolerance(report, console);
    inspect::print_filter(report.provenance, console);
    let cost = reporter.cost();
    let memory = cost.peak_memory_bytes.map_or_else(String::new, |n| format!(", {} at most", bytes(n)));
    let threads = count(cost.threads, "thread");
    console.result(format_args!(
        "  cost       {:.3} s (read {:.3}, estimate {:.3}, write {:.3}) on {threads}{memory}",
        cost.seconds, report.seconds.read, report.seconds.estimate, report.seconds.write
    ));
    console.result(format_args!("  wrote      {} ({})", report.output, bytes(report.output_bytes)));
}

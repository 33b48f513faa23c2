//! `osculate verify`

use std::path::{Path, PathBuf};
use std::sync::Arc;

use anyhow::{Context, Result, bail};
use clap::Args;
use osculate_geom::Mesh;
use osculate_geom::bake::{self, BakeOptions, BakedMesh, Provenance, Source};
use osculate_geom::curvature::{CurvatureOptions, Method, VertexCurvature};
use osculate_geom::mesh::Weld;
use osculate_geom::reference::{
    Bounds, CompareOptions, Comparison, DEFAULT_CONDITION_LIMIT, Quantiles, ReferenceFile, Shape,
    Triangulation, compare, match_rows,
};
use osculate_render::false_colour::{AxisScale, ColourMap, FalseColourOptions, false_colour};
use osculate_render::output::write_png;
use serde::Serialize;

use crate::cli::Outcome;
use crate::console::{Console, count};
use crate::estimate::{EstimateArgs, describe, positive};
use crate::input::{self, Input};
use crate::output;
use crate::report::Reporter;

/// Compare curvature with what it should be: recorded libigl output, or a closed form.
#[derive(Debug, Args)]
#[command(after_help = "\
Examples:
  osculate verify cow.obj --reference cow.npz --setting r5
  osculate bake ball.obj -o ball.glb && osculate verify ball.glb --analytic sphere:1 --bound 0.01
  osculate verify donut.ply --analytic torus:1,0.45 --heatmap donut.png

FILE is a baked mesh, or any mesh, whose curvature is then estimated in 64 bits on the fly: with --reference by the
libigl method and the setting's own neighbourhood, unless you say otherwise.
Differences are relative to |kappa| + 1 / (bounding box diagonal). Exit code 1 when one is over the bound.")]
#[command(group = clap::ArgGroup::new("against").required(true).args(["reference", "analytic"]))]
pub struct VerifyArgs {
    /// Baked mesh, or any mesh
    #[arg(value_name = "FILE")]
    file: PathBuf,
    /// Reference that `tools/reference/libigl_curvature.py` recorded
    #[arg(long, value_name = "REF.npz")]
    reference: Option<PathBuf>,
    /// Which of the reference's settings: r5 is 5 rings, s5 the sphere of 5 mean edges [default: the one that FILE was
    /// baked with, else r5]
    #[arg(long, value_name = "NAME", requires = "reference")]
    setting: Option<String>,
    /// Closed form: sphere:R, torus:A,r, cylinder:R, ellipsoid:a,b,c, plane or saddle, at the origin
    #[arg(long, value_name = "SHAPE", value_parser = parse_shape)]
    analytic: Option<Shape>,
    /// Largest relative difference of a curvature [default: 1e-9, for a bake in 32-bit floats 1e-6; with --analytic 0.05]
    #[arg(long, value_name = "E", value_parser = positive)]
    bound: Option<f64>,
    /// Largest angle between directions in radians [default: 1e-4; with --analytic 0.05]
    #[arg(long, value_name = "E", value_parser = positive)]
    angle_bound: Option<f64>,
    /// Condition number above which a recorded fit is listed but does not decide
    #[arg(long, value_name = "C", default_value_t = DEFAULT_CONDITION_LIMIT, value_parser = positive)]
    condition_limit: f64,
    /// How many of the worst vertices to list
    #[arg(long, value_name = "N", default_value_t = 5)]
    list: usize,
    /// Draw the relative differences on the mesh into this .png
    #[arg(long, value_name = "OUT.png")]
    heatmap: Option<PathBuf>,
    #[command(flatten)]
    estimate: EstimateArgs,
}

fn parse_shape(text: &str) -> Result<Shape, String> {
    text.parse().map_err(|error: osculate_geom::reference::ParseShapeError| error.to_string())
}

/// What `--json` holds.
#[derive(Debug, Serialize)]
pub struct Report {
    file: String,
    against: Against,
    /// Whether the curvature was read from the file or estimated by this run.
    estimated: bool,
    provenance: Provenance,
    comparison: Comparison,
}

/// What a file was compared with.
#[derive(Debug, Serialize)]
#[serde(tag = "kind", rename_all = "snake_case")]
pub enum Against {
    /// Recorded libigl output.
    Reference {
        /// The reference file.
        file: String,
        /// Which of its settings.
        setting: String,
        /// Version of libigl.
        libigl: Option<String>,
        /// Whether positions were compared after rounding to 32 bits.
        rounded: bool,
        /// Vertices with several equal positions in the reference and no telling which.
        ambiguous: usize,
        /// How the triangles compare.
        triangulation: Triangulation,
    },
    /// A closed form.
    Analytic {
        /// In the words of `--analytic`.
        shape: String,
    },
}

/// Bounds of a comparison with a reference: agreement number by number.
///
/// In 64 bits both programs solve the same systems in different orders, and what is left are the last digits times the
/// condition. Rounding to 32 bits adds up to 6e-8 of each curvature.
fn reference_bounds(single_precision: bool) -> Bounds {
    Bounds { curvature: if single_precision { 1e-6 } else { 1e-9 }, angle: 1e-4 }
}

/// Bounds of a comparison with a closed form: what a usable estimate keeps on a mesh of some thousand triangles.
const ANALYTIC_BOUNDS: Bounds = Bounds { curvature: 0.05, angle: 0.05 };

/// Runs the command.
pub fn run(args: &VerifyArgs, console: &Console, reporter: &Reporter) -> Result<Outcome> {
    let shown = args.file.display().to_string();
    if let Some(path) = &args.heatmap {
        output::check(path)?;
        if output::extension(path) != "png" {
            bail!("{}: the heat map is a .png", path.display());
        }
    }
    let reference = args.reference.as_ref().map(|path| {
        ReferenceFile::read(path).with_context(|| path.display().to_string()).map(|file| (path, file))
    });
    let reference = reference.transpose()?;
    let input = input::read(&args.file, console)?;
    let setting = match &reference {
        Some((path, file)) => {
            Some(choose_setting(args, file, &input).with_context(|| path.display().to_string())?)
        }
        None => None,
    };
    let (baked, estimated) = match input {
        Input::Baked(_) if args.estimate.is_given() => {
            bail!(
                "{shown}: is baked already, so --method and its like have no effect; leave them out, or name the source mesh"
            )
        }
        Input::Baked(baked) => (*baked, false),
        Input::Raw(mesh) => {
            let defaults = defaults(setting.as_deref(), reference.as_ref().map(|(_, file)| file));
            let options = args.estimate.options(&defaults)?;
            let source = Source::read(&args.file).with_context(|| shown.clone())?;
            let _step = console.step("estimating curvature");
            (bake::bake(mesh, source, &options).with_context(|| shown.clone())?, true)
        }
    };
    let (against, comparison) = match (&reference, &setting, &args.analytic) {
        (Some((path, file)), Some(setting), _) => {
            warn_of_other_method(&baked, console, &shown);
            let options =
                compare_options(args, &baked, reference_bounds(is_single_precision(baked.curvature())));
            with_reference(
                baked.mesh(),
                baked.curvature(),
                &path.display().to_string(),
                file,
                setting,
                &options,
            )
        }
        (_, _, Some(shape)) => {
            let expected = shape.expected(baked.mesh().positions()).with_context(|| shown.clone())?;
            let comparison =
                compare(baked.curvature(), &expected, &compare_options(args, &baked, ANALYTIC_BOUNDS));
            (Against::Analytic { shape: shape.to_string() }, comparison)
        }
        _ => bail!("name what to compare with: --reference or --analytic"),
    };
    let report = Report { file: shown, against, estimated, provenance: baked.provenance.clone(), comparison };
    print(&report, console);
    if let Some(path) = &args.heatmap {
        draw(path, baked.into_parts().0, &report.comparison).with_context(|| path.display().to_string())?;
        console.result(format_args!("  wrote      {}", path.display()));
    }
    reporter.write("verify", 1, &report)?;
    Ok(if report.comparison.passed { Outcome::Done } else { Outcome::CheckFailed })
}

fn choose_setting(args: &VerifyArgs, file: &ReferenceFile, input: &Input) -> Result<String> {
    let names = || file.settings.keys().cloned().collect::<Vec<_>>().join(", ");
    if let Some(name) = &args.setting {
        if !file.settings.contains_key(name) {
            bail!("has no setting {name:?}; it has {}", names());
        }
        return Ok(name.clone());
    }
    let baked_with = match input {
        Input::Baked(baked) => Some(baked.provenance.curvature.neighbourhood()),
        Input::Raw(_) => None,
    };
    let same = file
        .settings
        .keys()
        .find(|name| baked_with.is_some() && ReferenceFile::neighbourhood(name) == baked_with);
    let usual = || file.settings.contains_key("r5").then(|| "r5".to_owned());
    let any = || file.settings.keys().next().cloned();
    same.cloned().or_else(usual).or_else(any).context("has no setting")
}

/// How a raw mesh is estimated for a comparison with a reference: as libigl did it.
fn defaults(setting: Option<&str>, file: Option<&ReferenceFile>) -> BakeOptions {
    let (Some(setting), Some(file)) = (setting, file) else { return BakeOptions::default() };
    let neighbourhood = ReferenceFile::neighbourhood(setting);
    let curvature = CurvatureOptions { method: Method::Libigl, neighbourhood, ..Default::default() };
    // libigl saw copies of a position as different vertices, unless the reference says that it was welded.
    let welded = file.meta.get("welded").and_then(serde_json::Value::as_bool).unwrap_or(false);
    let weld = if welded || !has_equal_positions(file) { Weld::Exact } else { Weld::Off };
    BakeOptions { curvature, weld, ..BakeOptions::default() }
}

fn has_equal_positions(file: &ReferenceFile) -> bool {
    let mut keys: Vec<[u64; 3]> =
        file.positions.iter().map(|p| [p.x, p.y, p.z].map(|x| (x + 0.0).to_bits())).collect();
    keys.sort_unstable();
    keys.windows(2).any(|pair| pair[0] == pair[1])
}

fn compare_options(args: &VerifyArgs, baked: &BakedMesh, defaults: Bounds) -> CompareOptions {
    let bounds = Bounds {
        curvature: args.bound.unwrap_or(defaults.curvature),
        angle: args.angle_bound.unwrap_or(defaults.angle),
    };
    CompareOptions {
        condition_limit: args.condition_limit,
        list: args.list,
        ..CompareOptions::new(bounds, baked.mesh().bbox_diagonal())
    }
}

/// Compares curvature with one setting of a reference.
pub fn with_reference(
    mesh: &Mesh,
    curvature: &[VertexCurvature],
    name: &str,
    file: &ReferenceFile,
    setting: &str,
    options: &CompareOptions,
) -> (Against, Comparison) {
    let matching = match_rows(mesh.positions(), &file.positions);
    let comparison = compare(curvature, &file.settings[setting].expected(&matching), options);
    let against = Against::Reference {
        file: name.to_owned(),
        setting: setting.to_owned(),
        libigl: file.meta.get("libigl").and_then(|v| v.as_str()).map(ToOwned::to_owned),
        rounded: matching.rounded,
        ambiguous: matching.ambiguous,
        triangulation: matching.triangulation(mesh.triangles(), &file.triangles),
    };
    (against, comparison)
}

/// Draws the larger relative difference of every vertex on a logarithmic scale; what was not compared is grey.
fn draw(path: &Path, mesh: Mesh, comparison: &Comparison) -> Result<()> {
    #[expect(clippy::cast_possible_truncation, reason = "colours need no more")]
    let values: Vec<f32> = comparison.differences.iter().map(|d| d.map_or(f32::NAN, |d| d as f32)).collect();
    let options = FalseColourOptions {
        title: "difference".to_owned(),
        unit: "relative".to_owned(),
        map: ColourMap::Sequential,
        scale: AxisScale::Logarithmic,
        ..FalseColourOptions::default()
    };
    write_png(path, &false_colour(&Arc::new(mesh), &values, &options)?)?;
    Ok(())
}

fn warn_of_other_method(baked: &BakedMesh, console: &Console, shown: &str) {
    if baked.provenance.curvature.method != Method::Libigl {
        console.warn(format_args!(
            "{shown}: was estimated by {}, which differs from libigl on purpose; bake with --method libigl to compare number by number",
            describe(&baked.provenance.curvature)
        ));
    }
}

/// Whether every curvature is a 32-bit float, as in a file of them.
#[expect(clippy::cast_possible_truncation, reason = "asks whether anything is lost")]
fn is_single_precision(curvature: &[VertexCurvature]) -> bool {
    let exact = |x: f64| f64::from(x as f32) == x;
    curvature.iter().filter_map(|c| c.principal).all(|p| exact(p.kappa_max) && exact(p.kappa_min))
}

fn print(report: &Report, console: &Console) {
    let how = if report.estimated { "estimated here by" } else { "baked by" };
    console.result(format_args!("{}, {how} {}", report.file, describe(&report.provenance.curvature)));
    print_against(&report.against, console);
    print_comparison(&report.comparison, console);
}

/// The lines about what a file was compared with.
pub fn print_against(against: &Against, console: &Console) {
    match against {
        Against::Analytic { shape } => console.result(format_args!("  against    the closed form {shape}")),
        Against::Reference { file, setting, libigl, rounded, ambiguous, triangulation } => {
            let version = libigl.as_deref().unwrap_or("of unknown version");
            let matched = if *rounded { ", positions matched after rounding to 32 bits" } else { "" };
            console.result(format_args!("  against    libigl {version}, {setting} in {file}{matched}"));
            if *ambiguous > 0 {
                console.result(format_args!(
                    "  ambiguous  {} at equal positions of the reference",
                    count(*ambiguous, "vertex")
                ));
            }
            if !triangulation.is_same() {
                console.result(format_args!(
                    "  triangles  differ: {} only here, {} only in the reference",
                    triangulation.only_here, triangulation.only_in_reference
                ));
            }
        }
    }
}

/// The table, the worst vertices and the verdict.
pub fn print_comparison(comparison: &Comparison, console: &Console) {
    let bounds = &comparison.bounds;
    console.result("                 vertices       max      99 %      95 %    median     bound");
    for (name, q, bound) in [
        ("kappa_max", &comparison.kappa_max, bounds.curvature),
        ("kappa_min", &comparison.kappa_min, bounds.curvature),
        ("angle of d1", &comparison.angle, bounds.angle),
    ] {
        let &Quantiles { count, max, p99, p95, median } = q;
        let cells = [max, p99, p95, median, bound].map(|x| format!("{x:>9.1e}")).join(" ");
        console.result(format_args!("  {name:<12} {count:>10} {cells}"));
    }
    let skipped = comparison.skipped;
    for (n, why) in [
        (skipped.bad_in_reference, "no valid value in the reference"),
        (skipped.ill_conditioned, "the reference's fit is ill-conditioned"),
        (skipped.no_answer_in_either, "no answer here nor there"),
        (skipped.unmatched, "no such position in the reference: not compared, and that fails"),
        (comparison.undetermined_here, "an answer in the reference, none here: that fails"),
    ] {
        if n > 0 {
            console.result(format_args!("  not compared: {} ({why})", count(n, "vertex")));
        }
    }
    let interesting = comparison.over_bound + comparison.undetermined_here + skipped.ill_conditioned > 0;
    for vertex in comparison.worst.iter().filter(|_| interesting) {
        console.result(format_args!(
            "  vertex {}: {} [{}]",
            vertex.vertex,
            vertex.reason,
            vertex.status.label()
        ));
    }
    console.result(if comparison.passed {
        "  PASS: every compared vertex is within the bounds".to_owned()
    } else if comparison.compared == 0 {
        "  FAIL: no vertex could be compared".to_owned()
    } else {
        format!("  FAIL: {} over a bound", count(comparison.over_bound, "vertex"))
    });
}

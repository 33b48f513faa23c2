//! `osculate eval`

use std::path::{Path, PathBuf};

use anyhow::{Context, Result, anyhow, bail};
use clap::Args;
use osculate_render::output::write_png;
use osculate_sbtf::SilhouetteBtf;
use osculate_sbtf::evaluate::{
    AppearanceOptions, Coverage, CoverageOptions, Pair, SilhouetteOptions, SilhouetteScore, appearance_pairs,
    coverage, silhouettes, total,
};
use osculate_sbtf::file::ModelFile;
use osculate_sbtf::infer::Material;
use osculate_sbtf::micro::Microstructure;
use osculate_sbtf::model::OpacityHead;
use osculate_sbtf::oracle::{Oracle, OracleOptions};
use serde::Serialize;

use crate::cli::Outcome;
use crate::commands::eval_scenes::{self, SceneArgs};
use crate::console::{Console, number};
use crate::neural::load_micro;
use crate::neural::score::{AppearanceScore, appearance_scores};
use crate::neural::sheet::sheet;
use crate::output;
use crate::report::Reporter;

/// Compare models with exact answers on held-out cylinders
#[derive(Debug, Args)]
#[command(after_help = EXAMPLES)]
pub struct EvalArgs {
    /// Models of one microstructure
    #[arg(value_name = "MODEL.sbtf", required = true)]
    models: Vec<PathBuf>,
    /// The microstructure [default: the procedural one that the first model names]
    #[arg(long, value_name = "NAME|FILE")]
    micro: Option<String>,
    /// Rays for the silhouette, and for the opacity of see-through models, at each curvature
    #[arg(long, value_name = "N", default_value_t = 100_000, value_parser = clap::value_parser!(u32).range(100..))]
    rays: u32,
    /// Paths per pixel of the exact pictures [default: 16, with --scenes 64]
    #[arg(long, value_name = "N", value_parser = clap::value_parser!(u32).range(1..))]
    spp: Option<u32>,
    /// Pairs of viewer and light in pictures at each curvature
    #[arg(long, value_name = "N", default_value_t = AppearanceOptions::default().pairs, value_parser = clap::value_parser!(u32).range(1..=1000))]
    pairs: u32,
    /// Leave out the pictures
    #[arg(long)]
    silhouettes_only: bool,
    /// Write a sheet of pictures: exact, then each model's, a row for each viewer and light, four per curvature
    #[arg(long, value_name = "FILE.png", conflicts_with = "silhouettes_only")]
    sheet: Option<PathBuf>,
    /// End with exit code 1 unless the first model, with --scenes every one, leaves at most this share of the silhouette's error
    #[arg(long, value_name = "SHARE")]
    require: Option<f64>,
    #[command(flatten)]
    scenes: SceneArgs,
}

const EXAMPLES: &str = "\
Examples:
  osculate eval stone.sbtf                              how much of the silhouette's error is left, PSNR and FLIP
  osculate eval stone.sbtf neumip.sbtf --sheet s.png    two models side by side, with pictures
  osculate eval mine.sbtf --micro mine.toml             a microstructure of your own
  osculate eval stone.sbtf wool.sbtf --scenes torus -o out    on a torus against displaced truth, with pictures";

#[derive(Serialize)]
struct Report {
    microstructure: String,
    models: Vec<ModelReport>,
}

/// How one model does.
#[derive(Debug, Clone, Serialize)]
struct ModelReport {
    model: String,
    /// Share of the base error left over all curvatures.
    left: f64,
    silhouettes: Vec<SilhouetteScore>,
    /// Of models with a direct opacity.
    coverage: Option<CoverageReport>,
    appearance: Vec<AppearanceScore>,
}

/// Which rays of all elevations a model stops, beside the truth.
#[derive(Debug, Clone, Serialize)]
struct CoverageReport {
    /// Over all curvatures.
    all: CoverageRow,
    by_kappa: Vec<CoverageRow>,
}

#[derive(Debug, Clone, Copy, Serialize)]
struct CoverageRow {
    /// `None` for all.
    kappa: Option<f32>,
    /// Share of the rays that pass in truth.
    open: f64,
    /// Intersection over union of the rays that are stopped.
    opaque_iou: f64,
    /// The same of those that pass.
    hole_iou: f64,
}

/// Runs the command.
pub fn run(args: &EvalArgs, console: &Console, reporter: &Reporter) -> Result<Outcome> {
    if !args.scenes.scenes.is_empty() {
        if args.micro.is_some() || args.sheet.is_some() {
            bail!("--micro and --sheet are for comparisons on cylinders; leave them out, or --scenes");
        }
        let spp = if args.silhouettes_only { 0 } else { args.spp.unwrap_or(64) };
        return eval_scenes::run(&args.scenes, &args.models, spp, args.require, console, reporter);
    }
    if let Some(path) = &args.sheet {
        output::check(path)?;
    }
    let files = args.models.iter().map(|path| Ok(ModelFile::read(path)?)).collect::<Result<Vec<_>>>()?;
    let micro = microstructure(args, &files, console)?;
    let oracle = Oracle::new(&micro, OracleOptions { samples: args.spp.unwrap_or(16), ..Default::default() });
    let materials: Vec<Material> = files.iter().map(|file| Material::new(&file.model)).collect();
    let depth = micro.geometry.depth();
    let mut models = Vec::new();
    let pictures = if args.silhouettes_only {
        vec![Vec::new(); materials.len()]
    } else {
        compare(&oracle, &materials, args.pairs, console)
    };
    for ((path, material), pairs) in args.models.iter().zip(&materials).zip(&pictures) {
        let scores = {
            let _step = console.step("comparing silhouettes");
            let options = SilhouetteOptions { rays: args.rays, ..Default::default() };
            silhouettes(&oracle, material, depth, &options)
        };
        let coverage = (material.architecture().opacity == OpacityHead::Direct).then(|| {
            let _step = console.step("comparing opacities");
            cover(&oracle, material, args.rays)
        });
        models.push(ModelReport {
            model: path.display().to_string(),
            left: total(&scores).left(),
            silhouettes: scores,
            coverage,
            appearance: appearance_scores(pairs, AppearanceOptions::default().size as usize),
        });
    }
    if let Some(path) = &args.sheet {
        let size = AppearanceOptions::default().size;
        let shown: Vec<Vec<&Pair>> = pictures.iter().map(|pairs| some_of_each(pairs)).collect();
        write_png(path, &sheet(&shown, size as usize)).with_context(|| path.display().to_string())?;
        console.result(format_args!("wrote {}", path.display()));
    }
    print(&models, console);
    let left = models[0].left;
    reporter.write("eval", 1, &Report { microstructure: micro.name, models })?;
    Ok(match args.require {
        Some(bound) if left > bound => {
            console.result(format_args!(
                "over the bound: {} of the base error is left, {bound} allowed",
                number(left)
            ));
            Outcome::CheckFailed
        }
        _ => Outcome::Done,
    })
}

/// The microstructure that the models stand for; refuses models of another one.
fn microstructure(args: &EvalArgs, files: &[ModelFile], console: &Console) -> Result<Microstructure> {
    named_microstructure(args.micro.as_ref(), &args.models, files, console)
}

/// The microstructure that a model stands for.
pub fn microstructure_of(path: &Path, file: &ModelFile, console: &Console) -> Result<Microstructure> {
    named_microstructure(None, &[path.to_owned()], std::slice::from_ref(file), console)
}

fn named_microstructure(
    given: Option<&String>,
    models: &[PathBuf],
    files: &[ModelFile],
    console: &Console,
) -> Result<Microstructure> {
    let sources: Vec<_> = files.iter().map(|file| file.provenance.microstructure.as_ref()).collect();
    let name = match (given, sources[0]) {
        (Some(name), _) => name.clone(),
        (None, Some(source)) => source.name.clone(),
        (None, None) => {
            bail!("{}: does not say what it was trained on; give --micro", models[0].display())
        }
    };
    let micro =
        load_micro(&name, console).with_context(|| format!("{}: its microstructure", models[0].display()))?;
    let micro = match sources[0] {
        Some(source) => source.at_its_depth(micro),
        None => micro,
    };
    let hash = micro.hash();
    for (path, source) in models.iter().zip(sources) {
        if let Some(source) = source.filter(|source| source.sha256 != hash) {
            return Err(another(path, &source.name, &name));
        }
    }
    Ok(micro)
}

fn another(path: &Path, found: &str, wanted: &str) -> anyhow::Error {
    anyhow!(
        "{}: was trained on another microstructure ({found}, of another content than {wanted}); name the right one with --micro",
        path.display()
    )
}

fn cover(oracle: &dyn SilhouetteBtf, material: &Material, rays: u32) -> CoverageReport {
    let options = CoverageOptions { rays, ..Default::default() };
    let row = |kappa: Option<f32>, found: Coverage| CoverageRow {
        kappa,
        open: found.open(),
        opaque_iou: found.opaque_iou(),
        hole_iou: found.hole_iou(),
    };
    let found = coverage(oracle, material, &options);
    CoverageReport {
        all: row(None, found.iter().copied().fold(Coverage::default(), Coverage::plus)),
        by_kappa: options.kappas.iter().zip(found).map(|(&kappa, found)| row(Some(kappa), found)).collect(),
    }
}

fn compare(
    oracle: &dyn SilhouetteBtf,
    materials: &[Material],
    pairs: u32,
    console: &Console,
) -> Vec<Vec<Pair>> {
    let _step = console.step("comparing pictures");
    let tests: Vec<&dyn SilhouetteBtf> = materials.iter().map(|material| material as _).collect();
    appearance_pairs(oracle, &tests, &AppearanceOptions { pairs, ..AppearanceOptions::default() })
}

/// The first few pairs of each curvature, which fit on a page.
fn some_of_each(pairs: &[Pair]) -> Vec<&Pair> {
    const FEW: usize = 4;
    pairs.chunk_by(|a, b| a.kappa == b.kappa).flat_map(|alike| alike.iter().take(FEW)).collect()
}

fn print(models: &[ModelReport], console: &Console) {
    for model in models {
        console.result(format_args!("{}", model.model));
        console.result("  kappa    base error   left   too much   too little");
        let row = |name: String, s: &SilhouetteScore| {
            console.result(format_args!(
                "  {name:>5}    {:>10.5}  {:>5.3}   {:>8.5}   {:>10.5}",
                s.base,
                s.left(),
                s.excess,
                s.missing
            ));
        };
        for score in &model.silhouettes {
            row(score.kappa.to_string(), score);
        }
        row("all".to_owned(), &total(&model.silhouettes));
        if let Some(coverage) = &model.coverage {
            print_coverage(coverage, console);
        }
        if !model.appearance.is_empty() {
            console.result("  kappa    PSNR, dB   FLIP");
        }
        for score in &model.appearance {
            console.result(format_args!("  {:>5}    {:>8.2}  {:>5.3}", score.kappa, score.psnr, score.flip));
        }
    }
}

fn print_coverage(coverage: &CoverageReport, console: &Console) {
    console.result("  kappa    rays that pass   IoU of stopped rays   IoU of passing rays");
    for row in coverage.by_kappa.iter().chain([&coverage.all]) {
        let kappa = row.kappa.map_or("all".to_owned(), |kappa| kappa.to_string());
        console.result(format_args!(
            "  {kappa:>5}    {:>14.4}   {:>19.4}   {:>19.4}",
            row.open, row.opaque_iou, row.hole_iou
        ));
    }
}

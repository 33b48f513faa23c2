//! `osculate train`

use std::ops::ControlFlow;
use std::path::{Path, PathBuf};

use anyhow::{Context, Result, anyhow, bail};
use clap::{Args, ValueEnum};
use osculate_sbtf::file::{MicrostructureSource, ModelFile, Provenance};
use osculate_sbtf::infer::{ExportLoss, MOST_WIDTH, Material, Precision, StoredModel};
use osculate_sbtf::micro::{Geometry, Microstructure};
use osculate_sbtf::model::{Architecture, CurvatureInput, Model, OpacityHead};
use osculate_sbtf::patch::{DatasetOptions, PatchDataset};
use osculate_sbtf::sampling::{FitOptions, fit};
use osculate_sbtf::train::{
    Control, Progress, Scores, Stage, Supervision, TrainOptions, TrainReport, of_checkpoint, resume, train,
};
use serde::Serialize;

use crate::cli::Outcome;
use crate::console::{Console, number};
use crate::neural::curve::curve_plot;
use crate::neural::load_micro;
use crate::output;
use crate::report::Reporter;

/// Train a material on a microstructure
#[derive(Debug, Args)]
#[command(after_help = EXAMPLES)]
pub struct TrainArgs {
    /// A procedural material by name (`osculate micro --list`), or a .toml that describes one
    #[arg(value_name = "MICRO")]
    micro: String,
    /// Model to write
    #[arg(short, long, value_name = "OUT.sbtf")]
    output: PathBuf,
    /// Train for about so long, the samples included; the number of steps that this comes to decides the result
    #[arg(long, value_name = "M", default_value_t = 10.0, conflicts_with = "steps")]
    minutes: f64,
    /// Train for so many steps of each part instead, which gives the same bits every time
    #[arg(long, value_name = "N", value_parser = clap::value_parser!(u64).range(1..))]
    steps: Option<u64>,
    /// Form of the networks
    #[arg(long, value_enum, default_value_t = Form::Taps)]
    form: Form,
    /// How opacity is predicted [default: silhouette for height fields, direct for meshes]
    #[arg(long, value_enum)]
    head: Option<Head>,
    /// Depth in tiles, instead of the microstructure's own
    #[arg(long, value_name = "D")]
    depth: Option<f32>,
    /// Learn from colour and opacity alone, without the true silhouettes and offsets
    #[arg(long)]
    unsupervised: bool,
    /// How feature textures are kept in the file
    #[arg(long, value_enum, default_value_t = PrecisionArg::F16)]
    precision: PrecisionArg,
    /// Texels of the feature textures along each side
    #[arg(long, value_name = "N", value_parser = clap::value_parser!(u16).range(8..=4096))]
    texture: Option<u16>,
    /// Neurons of a hidden layer, instead of the form's own 24 (32 for see-through materials)
    #[arg(long, value_name = "N", value_parser = clap::value_parser!(u16).range(4..=MOST_WIDTH as i64))]
    width: Option<u16>,
    /// Where all random choices come from
    #[arg(long, value_name = "S", default_value_t = 1)]
    seed: u64,
    /// Go on from OUT.sbtf.checkpoint, which an interrupted run leaves; the other options come from there
    #[arg(long)]
    resume: bool,
    /// Write the training curve
    #[arg(long, value_name = "FILE.svg")]
    curve: Option<PathBuf>,
}

const EXAMPLES: &str = "\
Examples:
  osculate train stone-1 -o stone.sbtf                    ten minutes, then look: osculate eval stone.sbtf
  osculate train mine.toml -o mine.sbtf --minutes 3       a height map of your own
  osculate train wool-1 -o wool.sbtf --form paper         the paper's form of the networks
  osculate train cave -o cave.sbtf --resume               go on after an interruption";

#[derive(Debug, Clone, Copy, PartialEq, Eq, ValueEnum)]
enum Form {
    /// Features fetched at several points along the ray
    Taps,
    /// The paper's: features at the point of entry
    Paper,
    /// NeuMIP: no curvature, no silhouettes
    Neumip,
}

#[derive(Debug, Clone, Copy, PartialEq, Eq, ValueEnum)]
enum Head {
    /// The cosine from which on rays hit
    Silhouette,
    /// The opacity itself
    Direct,
}

#[derive(Debug, Clone, Copy, PartialEq, Eq, ValueEnum)]
enum PrecisionArg {
    /// Four bytes a number
    F32,
    /// Two bytes a number
    F16,
    /// One byte a number, with a scale per channel
    U8,
}

impl From<PrecisionArg> for Precision {
    fn from(precision: PrecisionArg) -> Self {
        match precision {
            PrecisionArg::F32 => Self::F32,
            PrecisionArg::F16 => Self::F16,
            PrecisionArg::U8 => Self::U8,
        }
    }
}

#[derive(Serialize)]
struct Report<'a> {
    microstructure: &'a str,
    output: String,
    bytes: u64,
    options: &'a TrainOptions,
    scores: Summary,
    export: ExportLoss,
    report: &'a TrainReport,
}

/// Queries on which the loss by rounding is measured: a tenth of a second.
const EXPORT_QUERIES: usize = 100_000;

/// The last scores of a run.
#[derive(Debug, Clone, Copy, Serialize)]
struct Summary {
    opacity: Option<Scores>,
    appearance: Option<Scores>,
    seconds: f64,
}

/// Runs the command.
pub fn run(args: &TrainArgs, console: &Console, reporter: &Reporter) -> Result<Outcome> {
    check(args)?;
    let micro = microstructure(args, console)?;
    let checkpoint = checkpoint_path(&args.output);
    let saved = args.resume.then(|| of_checkpoint(&checkpoint)).transpose()?;
    let form = match &saved {
        Some((form, _)) => form.clone(),
        None => architecture(args, &micro)?,
    };
    let seed = saved.as_ref().map_or(args.seed, |(_, options)| options.seed);
    let data = DatasetOptions { kappa_range: seen(&form), seed, ..Default::default() };
    let source = {
        let _step = console.step("preparing the microstructure");
        PatchDataset::new(&micro, data).with_context(|| args.micro.clone())?
    };
    let began = std::time::Instant::now();
    let bar = console.steps("training", 1000);
    let mut watch = |progress: &Progress| {
        bar.set_share(progress.fraction);
        bar.say(&message(progress));
        ControlFlow::Continue(())
    };
    let mut control = Control { checkpoint: Some(&checkpoint), progress: &mut watch };
    let (options, (model, report)) = match saved {
        Some((_, options)) => (options, resume(&checkpoint, &source, &mut control)?),
        None => {
            let options = options(args, &form, &source);
            let trained = train(&form, &options, &source, &mut control)?;
            (options, trained)
        }
    };
    drop(bar);
    let summary = Summary {
        opacity: report.last(Stage::Opacity),
        appearance: report.last(Stage::Appearance),
        seconds: began.elapsed().as_secs_f64(),
    };
    let bytes = write(args, &micro, &model, &options, &summary, console)?;
    let export = ExportLoss::measure(&model, args.precision.into(), EXPORT_QUERIES, options.seed);
    if let Some(path) = &args.curve {
        osculate_geom::write_atomically(path, |file| {
            std::io::Write::write_all(file, curve_plot(&report).svg().as_bytes())
        })
        .with_context(|| path.display().to_string())?;
    }
    // Only now is it of no more use.
    std::fs::remove_file(&checkpoint).ok();
    print(args, bytes, (form.opacity, &summary), &export, &report, console);
    let output = args.output.display().to_string();
    reporter.write(
        "train",
        1,
        &Report {
            microstructure: &micro.name,
            output,
            bytes,
            options: &options,
            scores: summary,
            export,
            report: &report,
        },
    )?;
    Ok(Outcome::Done)
}

fn check(args: &TrainArgs) -> Result<()> {
    output::check(&args.output)?;
    if output::extension(&args.output) != "sbtf" {
        bail!("{}: the extension must be .sbtf", args.output.display());
    }
    if let Some(curve) = &args.curve {
        output::check(curve)?;
    }
    if args.steps.is_none() && !(args.minutes > 0.0 && args.minutes.is_finite()) {
        bail!("--minutes {}: must be positive", args.minutes);
    }
    if let Some(depth) = args.depth.filter(|depth| !(*depth > 0.0 && *depth <= 1.0)) {
        bail!("--depth {depth}: must be over 0 and at most 1 tile");
    }
    if args.form == Form::Neumip && args.head.is_some() {
        bail!("--head: NeuMIP has no opacity; leave it out");
    }
    let checkpoint = checkpoint_path(&args.output);
    if args.resume && !checkpoint.is_file() {
        bail!("{}: there is no checkpoint to go on from; leave out --resume", checkpoint.display());
    }
    Ok(())
}

fn microstructure(args: &TrainArgs, console: &Console) -> Result<Microstructure> {
    let micro = load_micro(&args.micro, console)?;
    let Some(depth) = args.depth else { return Ok(micro) };
    let own = || anyhow!("--depth {depth}: {} is a mesh, whose depth is its own; leave it out", args.micro);
    micro.with_depth(depth).ok_or_else(own)
}

/// Where a run keeps what it needs to go on.
fn checkpoint_path(output: &Path) -> PathBuf {
    let mut name = output.as_os_str().to_owned();
    name.push(".checkpoint");
    name.into()
}

fn architecture(args: &TrainArgs, micro: &Microstructure) -> Result<Architecture> {
    let depth = micro.geometry.depth();
    let is_field = matches!(micro.geometry, Geometry::HeightField(_));
    if args.head == Some(Head::Silhouette) && !is_field {
        bail!("--head silhouette: {} is a mesh that rays may pass through; take direct", micro.name)
    }
    let direct = args.head == Some(Head::Direct) || !is_field;
    let mut form = match args.form {
        Form::Taps if !is_field => Architecture::see_through(depth),
        Form::Taps if direct => Architecture::taps(depth).with_direct_head(),
        Form::Taps => Architecture::taps(depth),
        Form::Paper if direct => Architecture { opacity: OpacityHead::Direct, ..Architecture::paper(depth) },
        Form::Paper => Architecture::paper(depth),
        Form::Neumip => Architecture::neumip(depth),
    };
    if let Some(texels) = args.texture {
        for shape in [&mut form.opacity_texture, &mut form.offset_texture, &mut form.colour_texture] {
            (shape.width, shape.height) = (texels.into(), texels.into());
        }
    }
    if let Some(width) = args.width {
        form.width = width.into();
    }
    Ok(form)
}

/// Curvatures that the training sees: none but 0 for networks that do not know the curvature, as NeuMIP has it.
fn seen(form: &Architecture) -> [f32; 2] {
    if form.curvature == CurvatureInput::Absent { [0.0, 0.0] } else { form.kappa_range }
}

fn options(args: &TrainArgs, form: &Architecture, source: &PatchDataset) -> TrainOptions {
    let supervision = if args.unsupervised { Supervision::ColourAndAlpha } else { Supervision::Full };
    let options = TrainOptions { seed: args.seed, supervision, ..TrainOptions::default() };
    match args.steps {
        Some(steps) => TrainOptions { opacity_steps: steps, appearance_steps: steps, ..options },
        None => options.fitted(form, source, args.minutes),
    }
}

/// Fits the sampling and writes the file; its size.
fn write(
    args: &TrainArgs,
    micro: &Microstructure,
    model: &Model,
    options: &TrainOptions,
    summary: &Summary,
    console: &Console,
) -> Result<u64> {
    let _step = console.step("fitting the sampling");
    let stored = StoredModel::new(model, args.precision.into());
    let material = Material::new(&stored);
    let sampler = fit(&material, &FitOptions::new(model.architecture.kappa_range)).sampler;
    let microstructure = MicrostructureSource {
        name: micro.name.clone(),
        sha256: micro.hash(),
        depth: micro.geometry.depth(),
    };
    let provenance = Provenance {
        tool: concat!("osculate ", env!("CARGO_PKG_VERSION")).to_owned(),
        seed: options.seed,
        training: serde_json::to_value(options)?,
        scores: serde_json::to_value(summary)?,
        microstructure: Some(microstructure),
    };
    let file = ModelFile { model: stored, provenance, sampler: Some(sampler) };
    file.write(&args.output)?;
    Ok(std::fs::metadata(&args.output)?.len())
}

fn message(progress: &Progress) -> String {
    let part = match progress.stage {
        Stage::Opacity => "opacity",
        Stage::Appearance => "appearance",
    };
    match progress.held_out {
        Some(scores) => format!("{part}, held-out error {}", number(scores.error)),
        None => part.to_owned(),
    }
}

fn print(
    args: &TrainArgs,
    bytes: u64,
    (head, summary): (OpacityHead, &Summary),
    export: &ExportLoss,
    report: &TrainReport,
    console: &Console,
) {
    for recovery in &report.recoveries {
        console.warn(format_args!(
            "the {:?} module diverged at step {}; went on from step {} with {} of the rates",
            recovery.stage,
            recovery.step,
            recovery.back_to,
            number(recovery.rate_scale)
        ));
    }
    let megabytes = bytes as f64 / 1e6;
    console.result(format_args!(
        "wrote {} ({megabytes:.1} MB) in {:.0} s",
        args.output.display(),
        summary.seconds
    ));
    if let Some(scores) = summary.opacity {
        let what = match head {
            OpacityHead::Direct => "error of the opacity over the share of rays that pass, held-out",
            OpacityHead::Silhouette | OpacityHead::Opaque => "share of the silhouette's error left, held-out",
        };
        console.result(format_args!("  {what}: {}", number(scores.error)));
    }
    if let Some(scores) = summary.appearance {
        console.result(format_args!(
            "  rms of ln(1 + rgb), held-out, with the samples' noise: {}",
            number(scores.error)
        ));
    }
    console.result(format_args!("  kept as {export}"));
    console.result(format_args!("  next: osculate eval {}", args.output.display()));
}

//! `osculate render`

mod load;

use std::ops::ControlFlow;
use std::path::{Path, PathBuf};
use std::time::Duration;

use anyhow::{Context, Result, anyhow, bail};
use clap::Args;
use osculate_geom::field::FilterKind;
use osculate_render::aov::{Aov, aovs};
use osculate_render::false_colour::{Quantity, curvature_picture};
use osculate_render::output::{ExrLayer, write_exr, write_png};
use osculate_render::scene::{LoadRequest, LoadedMesh, MaterialForm, MeshSource, PreviewOptions, SceneFile};
use osculate_render::{
    Counters, EffectPlan, MeshInstance, RenderOptions, Rendering, Scene, SceneError, StopRule, picture, plan,
    render,
};
use serde::Serialize;

use crate::cli::Outcome;
use crate::console::{Console, number};
use crate::estimate::{EstimateArgs, positive};
use crate::filter::{FilterArg, LengthArgs};
use crate::output;
use crate::report::Reporter;
use load::load_mesh;

/// Make a picture of a scene or a mesh: shaded, or its curvature in colours.
#[derive(Debug, Args)]
#[command(after_help = "\
Examples:
  osculate render cow.glb -o cow.png                        shaded, in a studio that fits the mesh
  osculate render cow.glb -o cow_k.png --aov mean           mean curvature in colours with a scale
  osculate render cow.glb -o cow_f.png --aov filtered --filter chord --filter-depth 0.05
  osculate render scene.toml -o scene.exr --noise 0.01 --aov depth,normal,kappa_max
  osculate render scene.toml --explain                      which effects are simulated, and why

A .png with --aov shows one curvature: kappa_max, kappa_min, mean (or curvature), gaussian, along_ray, filtered or error.
An .exr with --aov holds the colours and further layers: depth, normal, uv, kappa_min, kappa_max, kappa_along_ray,
kappa_filtered, or all. Curvature that the file does not have is estimated.")]
pub struct RenderArgs {
    /// Scene (.toml), baked mesh or any mesh
    #[arg(value_name = "IN")]
    input: PathBuf,
    /// Picture: .png or .exr; may be left out with --explain
    #[arg(short, long, value_name = "OUT", required_unless_present = "explain")]
    output: Option<PathBuf>,
    /// Samples per pixel [default: 64]
    #[arg(long, value_name = "N", group = "stop", value_parser = clap::value_parser!(u32).range(1..=1_000_000))]
    spp: Option<u32>,
    /// Render until the relative noise is below E
    #[arg(long, value_name = "E", group = "stop", value_parser = positive)]
    noise: Option<f64>,
    /// Render for so long: seconds, or 90s, 2m, 1h 30m; the only choice whose result depends on the machine
    #[arg(long, value_name = "T", group = "stop", value_parser = time)]
    time: Option<Duration>,
    /// Width and height in pixels [default: the scene's, for a mesh 960x720]
    #[arg(long, value_name = "WxH", value_parser = size)]
    size: Option<[u32; 2]>,
    /// What stands for every microstructure of the scene: neural, oracle, displaced, march, neumip or flat [default: the scene's]
    #[arg(long = "as", value_name = "WORD", value_parser = form)]
    form: Option<MaterialForm>,
    /// Layers or quantities instead of the colours, separated by commas
    #[arg(long, value_name = "NAME", value_delimiter = ',')]
    aov: Vec<String>,
    /// What makes the filtered curvature [default: the scene's, or march]
    #[arg(long, value_enum)]
    filter: Option<FilterArg>,
    #[command(flatten)]
    length: LengthArgs,
    /// Print which effects are simulated and why
    #[arg(long)]
    explain: bool,
    /// Where all random choices come from
    #[arg(long, value_name = "S", default_value_t = 0)]
    seed: u64,
    #[command(flatten)]
    estimate: EstimateArgs,
}

fn size(text: &str) -> Result<[u32; 2], String> {
    let side = |word: &str| word.parse().ok().filter(|n| (1..=32768).contains(n));
    let sides = text.split_once('x').and_then(|(w, h)| Some([side(w)?, side(h)?]));
    sides.ok_or_else(|| "write WIDTHxHEIGHT, each from 1 to 32768".to_owned())
}

fn form(text: &str) -> Result<MaterialForm, String> {
    let known = MaterialForm::ALL.map(MaterialForm::name).join(", ");
    MaterialForm::ALL.into_iter().find(|f| f.name() == text).ok_or_else(|| format!("not one of {known}"))
}

#[derive(Serialize)]
struct Report<'a> {
    input: String,
    output: Option<String>,
    size: [u32; 2],
    plan: &'a EffectPlan,
    #[serde(skip_serializing_if = "Option::is_none")]
    render: Option<RenderReport>,
}

/// What tracing the colours took.
#[derive(Debug, Clone, Serialize)]
pub struct RenderReport {
    samples_per_pixel: f64,
    samples_range: [u32; 2],
    noise: Option<f64>,
    counters: Counters,
    contradictions: Vec<String>,
    preparation_seconds: f64,
    tracing_seconds: f64,
}

/// What a picture shows.
enum Content {
    Colours,
    Quantity(Quantity),
    Layers(Vec<Aov>),
}

impl Content {
    fn needs_curvature(&self) -> bool {
        match self {
            Self::Colours => false,
            Self::Quantity(_) => true,
            Self::Layers(layers) => layers.iter().any(|aov| aov.name().starts_with("kappa")),
        }
    }

    fn needs_filter(&self) -> bool {
        match self {
            Self::Colours => false,
            Self::Quantity(quantity) => *quantity == Quantity::Filtered,
            Self::Layers(layers) => layers.contains(&Aov::KappaFiltered),
        }
    }
}

/// Runs the command.
pub fn run(args: &RenderArgs, console: &Console, reporter: &Reporter) -> Result<Outcome> {
    let content = content(args)?;
    if let Some(path) = &args.output {
        output::check(path)?;
        output::check_distinct(&args.input, path)?;
    }
    let scene = scene(args, &content, console)?;
    let options = RenderOptions { stop: stop_rule(args), seed: args.seed, ..RenderOptions::default() };
    let effects = plan(&scene, options.max_depth);
    if args.explain {
        console.result(effects.to_string().trim_end());
    }
    let render = match &args.output {
        Some(path) => write(path, &scene, &content, &options, &effects, console).map_err(|error| {
            // Of what was read, not of what is written.
            if error.is::<SceneError>() { error.context(args.input.display().to_string()) } else { error }
        })?,
        None => None,
    };
    if let Some(path) = &args.output {
        print(path, &scene, render.as_ref(), console);
    }
    let shown = |path: &PathBuf| path.display().to_string();
    let report = Report {
        input: shown(&args.input),
        output: args.output.as_ref().map(shown),
        size: [scene.width, scene.height],
        plan: &effects,
        render,
    };
    reporter.write("render", 1, &report)?;
    Ok(Outcome::Done)
}

fn content(args: &RenderArgs) -> Result<Content> {
    let Some(path) = &args.output else { return Ok(Content::Colours) };
    let shown = path.display();
    match (output::extension(path).as_str(), &args.aov[..]) {
        ("png" | "exr", []) => Ok(Content::Colours),
        ("png", [name]) => {
            let quantity = if name == "curvature" { Some(Quantity::Mean) } else { quantity(name) };
            let names = "kappa_max, kappa_min, mean, gaussian, along_ray, filtered and error";
            let quantity = quantity.ok_or_else(|| {
                anyhow!("{shown}: --aov {name}: a .png shows one of {names}; layers need an .exr")
            })?;
            Ok(Content::Quantity(quantity))
        }
        ("png", names) => {
            bail!("{shown}: --aov names {} quantities, a .png shows one; write an .exr for more", names.len())
        }
        ("exr", [name]) if name == "all" => Ok(Content::Layers(Aov::ALL.to_vec())),
        ("exr", names) => {
            let layer = |name: &String| {
                let known = Aov::ALL.map(Aov::name).join(", ");
                Aov::from_name(name)
                    .ok_or_else(|| anyhow!("{shown}: --aov {name} is not one of all, {known}"))
            };
            Ok(Content::Layers(names.iter().map(layer).collect::<Result<_>>()?))
        }
        (other, _) => bail!("{shown}: the extension {other:?} is not one of .png and .exr"),
    }
}

fn quantity(name: &str) -> Option<Quantity> {
    // The names that serde gives the variants are the names in scene files and reports too.
    serde_json::from_value(serde_json::Value::String(name.to_owned())).ok()
}

/// A time that is not zero: a number of seconds, or numbers with units.
fn time(text: &str) -> Result<Duration, String> {
    /// Longer than anyone waits.
    const MOST: Duration = Duration::from_secs(1_000_000_000);
    let parsed = match text.parse::<f64>() {
        Ok(seconds) if seconds.is_finite() => {
            Duration::try_from_secs_f64(seconds.min(MOST.as_secs_f64())).ok()
        }
        Ok(_) => None,
        Err(_) => humantime::parse_duration(text).ok(),
    };
    let time = parsed.filter(|time| !time.is_zero()).map(|time| time.min(MOST));
    time.ok_or_else(|| "must be a positive number of seconds, or times like 90s or 1h 30m".to_owned())
}

fn stop_rule(args: &RenderArgs) -> StopRule {
    /// Where `--noise` gives up: a picture of this many samples is as good as it gets in reasonable time.
    const MOST: u32 = 1 << 16;
    match (args.spp, args.noise, args.time) {
        (Some(samples), ..) => StopRule::Samples(samples),
        (_, Some(target), _) => StopRule::Noise { target, most: MOST },
        (.., Some(time)) => StopRule::Time(time),
        _ => StopRule::Samples(64),
    }
}

/// Samples that a mesh of a scene may expect: a share of the picture's, as far as they are known before.
fn samples(args: &RenderArgs, content: &Content, file: &SceneFile) -> u64 {
    /// What `--noise` is taken for, which may stop anywhere.
    const USUAL: u32 = 64;
    /// Of one thread: between what simple and demanding scenes take.
    const PER_SECOND: f64 = 5e5;
    if let Content::Quantity(_) = content {
        return 0;
    }
    let pixels = u64::from(file.image.width) * u64::from(file.image.height);
    let all = match stop_rule(args) {
        StopRule::Samples(samples) => pixels * u64::from(samples),
        StopRule::Noise { .. } => pixels * u64::from(USUAL),
        #[expect(clippy::cast_possible_truncation, clippy::cast_sign_loss, reason = "a rough number")]
        StopRule::Time(time) => {
            (time.as_secs_f64() * PER_SECOND * rayon::current_num_threads() as f64) as u64
        }
    };
    all / file.mesh.len().max(1) as u64
}

fn scene(args: &RenderArgs, content: &Content, console: &Console) -> Result<Scene> {
    let path = &args.input;
    if let Some(form) = args.form.filter(|_| output::extension(path) != "toml") {
        bail!(
            "{}: is no scene, so that --as {} has nothing to change; leave it out",
            path.display(),
            form.name()
        );
    }
    if output::extension(path) != "toml" {
        let (filter, walk) =
            (args.filter.map_or_else(FilterKind::default, FilterKind::from), args.length.walk());
        let request = LoadRequest { source: MeshSource::File(path), shell: None, filter, is_named: true };
        let LoadedMesh { mesh, curvature, field } = load_mesh(&request, args, content, walk, 0, console)?;
        let object = MeshInstance { curvature, field, ..MeshInstance::new(mesh) };
        let mut options = PreviewOptions::default();
        options.size = args.size.unwrap_or(options.size);
        return Ok(Scene::preview(vec![object], &options));
    }
    let shown = path.display().to_string();
    let text = std::fs::read_to_string(path).with_context(|| shown.clone())?;
    let mut file = SceneFile::parse(&text, &shown)?;
    if let Some([width, height]) = args.size {
        (file.image.width, file.image.height) = (width, height);
    }
    if let Some(form) = args.form {
        let mut named = file.material.values_mut().filter(|m| m.micro_form().is_some()).peekable();
        if named.peek().is_none() {
            bail!("{shown}: has no material from a microstructure; leave out --as {}", form.name());
        }
        named.for_each(|material| material.form = Some(form));
    }
    // The arguments come before the scene file.
    file.curvature.filter = args.filter.map(FilterKind::from).or(file.curvature.filter);
    let walk = args.length.walk().or(file.curvature.walk());
    let samples = samples(args, content, &file);
    let mut load = |request: &LoadRequest<'_>| {
        load_mesh(request, args, content, walk, samples, console).map_err(|error| format!("{error:#}").into())
    };
    Ok(file.build(path, &mut load)?)
}

/// Renders and writes; returns what tracing took, if anything was traced.
fn write(
    path: &Path,
    scene: &Scene,
    content: &Content,
    options: &RenderOptions,
    plan: &EffectPlan,
    console: &Console,
) -> Result<Option<RenderReport>> {
    let named = || path.display().to_string();
    match content {
        Content::Quantity(quantity) => {
            let _step = console.step("drawing curvature");
            write_png(path, &curvature_picture(scene, *quantity)?).with_context(named)?;
            Ok(None)
        }
        Content::Colours | Content::Layers(_) => {
            let rendering = trace(scene, options, console)?;
            if output::extension(path) == "png" {
                let picture = picture(scene.width, scene.height, &rendering.film.radiance(), scene.exposure);
                write_png(path, &picture).with_context(named)?;
            } else {
                let mut layers = vec![ExrLayer::rgb("", &rendering.film.radiance())];
                if let Content::Layers(wanted) = content {
                    layers.extend(aovs(scene, wanted)?.0);
                }
                write_exr(path, scene.width, scene.height, &layers).with_context(named)?;
            }
            Ok(Some(report(&rendering, plan)))
        }
    }
}

/// Traces the colours, with a progress bar.
pub fn trace(scene: &Scene, options: &RenderOptions, console: &Console) -> Result<Rendering> {
    const STEPS: u32 = 1000;
    let bar = console.steps("rendering", STEPS.into());
    let rendering = render(scene, options, &mut |progress| {
        bar.set_share(progress.fraction);
        ControlFlow::Continue(())
    })?;
    Ok(rendering)
}

/// What a rendering took, and whether it kept to its plan.
pub fn report(rendering: &Rendering, plan: &EffectPlan) -> RenderReport {
    RenderReport {
        samples_per_pixel: rendering.samples,
        samples_range: rendering.samples_range,
        noise: rendering.film.noise(),
        counters: rendering.counters,
        contradictions: plan.contradictions(&rendering.counters),
        preparation_seconds: rendering.preparation.as_secs_f64(),
        tracing_seconds: rendering.tracing.as_secs_f64(),
    }
}

/// The lines about a picture.
pub fn print(path: &Path, scene: &Scene, report: Option<&RenderReport>, console: &Console) {
    console.result(format_args!("wrote {} ({} x {})", path.display(), scene.width, scene.height));
    if let Some(report) = report {
        let noise = report.noise.map_or_else(String::new, |n| format!(", relative noise {}", number(n)));
        let rays = report.counters.rays + report.counters.shadow_rays;
        let [least, most] = report.samples_range;
        let spread = if least == most { String::new() } else { format!(" ({least} to {most})") };
        console.result(format_args!(
            "  {:.0} samples per pixel{spread}{noise}, {:.1} million rays in {:.2} s",
            report.samples_per_pixel,
            rays as f64 / 1e6,
            report.tracing_seconds
        ));
        for contradiction in &report.contradictions {
            console.warn(format_args!("the plan was not kept: {contradiction}; please report this"));
        }
    }
}

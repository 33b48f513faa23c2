//! `osculate eval --scenes`

use std::fmt;
use std::path::{Path, PathBuf};
use std::sync::Arc;

use anyhow::{Context, Result, anyhow, bail};
use clap::Args;
use osculate_render::output::write_png;
use osculate_render::scene::QueryForm;
use osculate_sbtf::file::ModelFile;
use osculate_sbtf::infer::Material;
use osculate_sbtf::micro::{Geometry, HeightField, Microstructure};
use osculate_sbtf::oracle::{Oracle, OracleOptions};
use osculate_sbtf::sampling::Sampler;
use serde::Serialize;

use crate::cli::Outcome;
use crate::commands::eval::microstructure_of;
use crate::console::{Console, number};
use crate::protocol::{
    Captioned, Entry, Exhibit, FlickerOptions, FlickerRow, PictureOptions, PictureScore, SilhouetteRow,
    Subject, exhibit, flicker_rows, mask_strip, overview, page, pictures, print, sheets, silhouettes,
};
use crate::report::Reporter;
use crate::study::run::{command_line, write_files};

/// The arguments of `--scenes`.
#[derive(Debug, Args)]
pub struct SceneArgs {
    /// Compare on curved meshes with displaced truth instead, as the paper does: `torus`, or mesh files with UV, separated by
    /// commas. The models may stand for different microstructures
    #[arg(long, value_name = "MESH", value_delimiter = ',')]
    pub scenes: Vec<String>,
    /// Models without curvature and silhouettes (`train --form neumip`), shown beside the model of the same microstructure
    #[arg(long, value_name = "NEUMIP.sbtf", requires = "scenes")]
    baseline: Vec<PathBuf>,
    /// Rays along each side of a silhouette
    #[arg(long, value_name = "N", default_value_t = 512, value_parser = clap::value_parser!(u32).range(16..=8192), requires = "scenes")]
    samples: u32,
    /// Also ask the model with the tables of both filters (`render --filter baked` and `baked_chord`)
    #[arg(long, alias = "chord-table", requires = "scenes")]
    tables: bool,
    /// Pixels along each side of a picture
    #[arg(long, value_name = "N", default_value_t = 256, value_parser = clap::value_parser!(u32).range(16..=4096), requires = "scenes")]
    pixels: u32,
    /// Also render N frames under a turning camera and N under a turning sun, and compare their flicker with the truth's
    #[arg(long, value_name = "N", default_value_t = 0, value_parser = frames, requires = "scenes")]
    frames: u32,
    /// Degrees from frame to frame, of the camera and of the sun
    #[arg(long, value_name = "CAMERA,SUN", value_parser = turn, requires = "frames", default_value_t = Turn::default())]
    turn: Turn,
    /// Where all random choices come from
    #[arg(long, value_name = "S", default_value_t = 0, requires = "scenes")]
    seed: u64,
    /// Write pictures and a page with all of them into this folder
    #[arg(short, long, value_name = "DIR", requires = "scenes")]
    output: Option<PathBuf>,
}

fn frames(text: &str) -> Result<u32, String> {
    let count = text.parse().ok().filter(|n| *n == 0 || (3..=1000).contains(n));
    count.ok_or_else(|| "flicker is of 3 to 1000 frames; 0 for none".to_owned())
}

/// Degrees from frame to frame.
#[derive(Debug, Clone, Copy, PartialEq)]
struct Turn {
    camera: f32,
    sun: f32,
}

impl Default for Turn {
    fn default() -> Self {
        Self { camera: FlickerOptions::CAMERA_STEP, sun: FlickerOptions::SUN_STEP }
    }
}

impl fmt::Display for Turn {
    fn fmt(&self, f: &mut fmt::Formatter<'_>) -> fmt::Result {
        write!(f, "{},{}", self.camera, self.sun)
    }
}

fn turn(text: &str) -> Result<Turn, String> {
    let degrees = |word: &str| word.trim().parse().ok().filter(|x: &f32| *x > 0.0 && *x <= 90.0);
    let both = text.split_once(',').and_then(|(camera, sun)| Some((degrees(camera)?, degrees(sun)?)));
    let (camera, sun) = both.ok_or("two numbers of degrees over 0 and at most 90, as in 1,12")?;
    Ok(Turn { camera, sun })
}

/// One material on one mesh.
#[derive(Debug, Serialize)]
pub struct Comparison {
    /// The model's file.
    model: String,
    /// Its name without folder and extension, by which tables and pictures go.
    pub name: String,
    /// Name of the microstructure.
    pub material: String,
    /// Its depth in tiles.
    pub depth: f32,
    /// Name of the mesh.
    pub scene: String,
    /// The base first.
    pub silhouettes: Vec<SilhouetteRow>,
    /// Where the error of the default query comes from.
    pub split: Split,
    /// The truth's noise first; empty with `--silhouettes-only`.
    pub pictures: Vec<PictureScore>,
    /// The truth first; empty without `--frames`.
    pub flicker: Vec<FlickerRow>,
}

/// Shares of the base error by cause; they sum up to what the model leaves.
#[derive(Debug, Clone, Copy, Serialize)]
pub struct Split {
    /// What exact answers to the same queries leave: of the query and the model's form; with exact curvature, where that is known.
    pub form: f64,
    /// What estimated curvature adds; absent where the exact one is not known.
    pub curvature: Option<f64>,
    /// What the model adds to exact answers.
    pub fit: f64,
}

#[derive(Serialize)]
struct Report {
    output: Option<String>,
    files: Vec<String>,
    samples: u32,
    results: Vec<Comparison>,
}

/// A model with what it stands for.
struct Candidate {
    path: PathBuf,
    file: ModelFile,
    micro: Microstructure,
    heights: HeightField,
}

/// Runs the comparison; `spp` samples per pixel, 0 for silhouettes only.
pub fn run(
    args: &SceneArgs,
    models: &[PathBuf],
    spp: u32,
    require: Option<f64>,
    console: &Console,
    reporter: &Reporter,
) -> Result<Outcome> {
    let candidates = models.iter().map(|path| candidate(path, console)).collect::<Result<Vec<_>>>()?;
    let baselines: Vec<(PathBuf, ModelFile)> =
        args.baseline.iter().map(|path| Ok((path.clone(), ModelFile::read(path)?))).collect::<Result<_>>()?;
    let subjects = args.scenes.iter().map(|name| Subject::new(name, console)).collect::<Result<Vec<_>>>()?;
    // Before the work, that it is not for nothing; after what may be refused, that nothing is written then.
    if let Some(folder) = &args.output {
        std::fs::create_dir_all(folder).with_context(|| folder.display().to_string())?;
    }
    let mut results = Vec::new();
    let mut shown = Vec::new();
    let mut exhibits = Vec::new();
    for candidate in &candidates {
        let baseline = baseline_of(candidate, &baselines);
        for subject in &subjects {
            let compared = compare(args, spp, candidate, baseline, subject, console)?;
            print(std::slice::from_ref(&compared.result), console);
            results.push(compared.result);
            shown.push(compared.pictures);
            exhibits.extend(compared.exhibit);
        }
    }
    let files = match &args.output {
        Some(folder) => write(folder, &results, &exhibits, &shown)?,
        None => Vec::new(),
    };
    let over = require.filter(|bound| results.iter().any(|r| left(r) > *bound));
    if let Some(bound) = over {
        for result in results.iter().filter(|r| left(r) > bound) {
            console.result(format_args!(
                "over the bound: {} on {}: {} of the base error is left, {bound} allowed",
                result.name,
                result.scene,
                number(left(result))
            ));
        }
    }
    let output = args.output.as_ref().map(|path| path.display().to_string());
    reporter.write("eval_scenes", 1, &Report { output, files, samples: args.samples, results })?;
    Ok(if over.is_some() { Outcome::CheckFailed } else { Outcome::Done })
}

impl Candidate {
    fn name(&self) -> String {
        self.path.file_stem().unwrap_or_default().to_string_lossy().into_owned()
    }
}

fn candidate(path: &Path, console: &Console) -> Result<Candidate> {
    let file = ModelFile::read(path)?;
    let micro = microstructure_of(path, &file, console)?;
    let Geometry::HeightField(heights) = &micro.geometry else {
        bail!("{}: {} is a see-through mesh, which cannot be displaced", path.display(), micro.name)
    };
    Ok(Candidate { path: path.to_owned(), heights: heights.clone(), micro, file })
}

/// The baseline that was trained on the same microstructure.
fn baseline_of<'a>(candidate: &Candidate, baselines: &'a [(PathBuf, ModelFile)]) -> Option<&'a ModelFile> {
    let hash = |file: &ModelFile| file.provenance.microstructure.as_ref().map(|m| m.sha256.clone());
    let wanted = candidate.micro.hash();
    baselines.iter().find(|(_, file)| hash(file).is_some_and(|h| h == wanted)).map(|(_, file)| file)
}

/// A model as an entry of the protocol.
pub fn entry(file: &ModelFile) -> Entry {
    Entry {
        btf: Arc::new(Material::new(&file.model)),
        sampler: Arc::new(file.sampler.clone().unwrap_or_else(Sampler::cosine)),
        depth: file.model.architecture.depth,
    }
}

/// What came of a material on a mesh.
struct Compared {
    result: Comparison,
    pictures: Vec<Captioned>,
    exhibit: Option<Exhibit>,
}

fn compare(
    args: &SceneArgs,
    spp: u32,
    candidate: &Candidate,
    baseline: Option<&ModelFile>,
    subject: &Subject,
    console: &Console,
) -> Result<Compared> {
    let Candidate { file, micro, heights, path } = candidate;
    let model = entry(file);
    let oracle = Oracle::new(micro, OracleOptions { samples: 1, ..OracleOptions::default() });
    let oracle =
        Entry { btf: Arc::new(oracle), sampler: Arc::new(Sampler::cosine()), depth: heights.depth() };
    let truth = {
        let _step = console.step(&format!("displacing {}", subject.name));
        subject.truth(heights).with_context(|| path.display().to_string())?
    };
    let masks = {
        let count = 9 + 2 * u32::from(args.tables);
        let bar = console.steps(&format!("silhouettes of {} on {}", micro.name, subject.name), count.into());
        let mut done = 0;
        let mut tick = || {
            done += 1;
            bar.set_share(f64::from(done) / f64::from(count));
        };
        silhouettes(subject, (&truth, heights), &model, &oracle, (args.samples, args.tables), &mut tick)
    }
    .with_context(|| path.display().to_string())?;
    let mut pictures_of = Vec::new();
    let mut on_show = None;
    let mut scores = Vec::new();
    let mut flicker = Vec::new();
    if spp > 0 {
        let options = PictureOptions { pixels: args.pixels, spp, seed: args.seed };
        let baseline = baseline.map(|file| (entry(file), file.model.bytes()));
        let beside = baseline.as_ref().map(|(entry, bytes)| (entry, *bytes));
        let shown =
            pictures(subject, (&truth, heights), (&model, file.model.bytes()), beside, &options, console)?;
        pictures_of = sheets(subject, &shown, &masks, args.pixels);
        let on = if args.scenes.len() == 1 { String::new() } else { format!(", {}", subject.name) };
        on_show = Some(exhibit(format!("{}{on}", candidate.name()), &shown, &masks, args.pixels));
        scores = shown.into_iter().map(|s| s.score).collect();
        if args.frames > 0 {
            let bar = console.steps(&format!("flicker of {} on {}", micro.name, subject.name), 1000);
            let mut tick = |share| bar.set_share(share);
            let beside = baseline.as_ref().map(|(entry, _)| entry);
            let Turn { camera: camera_step, sun: sun_step } = args.turn;
            let motions = FlickerOptions { frames: args.frames, camera_step, sun_step };
            flicker = flicker_rows(subject, &truth, &model, beside, (&motions, &options), &mut tick)?;
        }
    }
    pictures_of.extend(mask_strip(&masks));
    let split = split(&masks.rows)?;
    let result = Comparison {
        model: path.display().to_string(),
        name: candidate.name(),
        material: micro.name.clone(),
        depth: heights.depth(),
        scene: subject.name.clone(),
        silhouettes: masks.rows,
        split,
        pictures: scores,
        flicker,
    };
    Ok(Compared { result, pictures: pictures_of, exhibit: on_show })
}

/// Of the default query.
fn split(rows: &[SilhouetteRow]) -> Result<Split> {
    let find = |form: &str, exact: bool| {
        let of = |r: &&SilhouetteRow| {
            r.form == form && r.query == Some(QueryForm::default()) && r.exact_curvature == exact
        };
        rows.iter().find(of).map(|row| row.left)
    };
    let missing = || anyhow!("a mask is missing");
    let (model, oracle) =
        (find("model", false).ok_or_else(missing)?, find("oracle", false).ok_or_else(missing)?);
    let exact = find("oracle", true);
    Ok(Split { form: exact.unwrap_or(oracle), curvature: exact.map(|e| oracle - e), fit: model - oracle })
}

/// What the model leaves with the default query.
fn left(result: &Comparison) -> f64 {
    let Split { form, curvature, fit } = result.split;
    form + curvature.unwrap_or(0.0) + fit
}

fn write(
    folder: &Path,
    results: &[Comparison],
    exhibits: &[Exhibit],
    shown: &[Vec<Captioned>],
) -> Result<Vec<String>> {
    let overview = overview(exhibits);
    let named = overview.iter().map(|o| ("overview.png".to_owned(), o));
    let of_results = results.iter().zip(shown).flat_map(|(result, pictures)| {
        let name = move |index| format!("{}-{}-{}-{index}.png", result.name, result.depth, result.scene);
        pictures.iter().enumerate().map(move |(index, picture)| (name(index), picture))
    });
    let mut files = Vec::new();
    for (name, (_, picture)) in named.chain(of_results) {
        let path = folder.join(&name);
        write_png(&path, picture).with_context(|| path.display().to_string())?;
        files.push(name);
    }
    let page = page(results, overview.as_ref(), shown, &command_line())?;
    files.extend(write_files(folder, vec![("index.html".to_owned(), page)])?);
    Ok(files)
}

//! What training options buy: short runs of one material that differ in one thing, judged on the same held-out samples.
//!
//! ```text
//! cargo run --release -p osculate-sbtf --example train_options -- stone-1 600 default random-features network-batch=16384
//! ```
//!
//! The arguments: material, steps of each part, then variants, each a list of settings with commas between them.

use std::ops::ControlFlow;
use std::time::Instant;

use osculate_sbtf::evaluate::{Coverage, CoverageOptions, coverage};
use osculate_sbtf::infer::{Material, Precision, StoredModel};
use osculate_sbtf::micro::{Geometry, Microstructure};
use osculate_sbtf::model::{Architecture, Model, OffsetForm, OpacityHead, TextureShape, Way};
use osculate_sbtf::oracle::{Oracle, OracleOptions};
use osculate_sbtf::patch::{DatasetOptions, PatchDataset, Tracing};
use osculate_sbtf::samples::{AppearanceBatch, Features, OpacityBatch, SampleSource};
use osculate_sbtf::train::{Control, HELD_OUT, Progress, Stage, TrainOptions, TrainReport, train};

/// Samples of a variant, but judged by those of the default.
struct Judged {
    training: PatchDataset,
    held_out: PatchDataset,
}

impl Judged {
    fn of(&self, index: u64) -> &PatchDataset {
        if index < HELD_OUT { &self.training } else { &self.held_out }
    }
}

impl SampleSource for Judged {
    fn fill_opacity(&self, index: u64, batch: &mut OpacityBatch) {
        self.of(index).fill_opacity(index, batch);
    }

    fn fill_appearance(&self, index: u64, batch: &mut AppearanceBatch) {
        self.of(index).fill_appearance(index, batch);
    }

    fn first_features(&self, which: Features, shape: TextureShape, seed: u64) -> Option<Vec<f32>> {
        self.training.first_features(which, shape, seed)
    }
}

struct Variant {
    form: Architecture,
    options: TrainOptions,
    data: DatasetOptions,
}

impl Variant {
    fn new(depth: f32, steps: u64) -> Self {
        let options = TrainOptions {
            opacity_steps: steps,
            appearance_steps: steps,
            starts: 1,
            scores: 2,
            ..TrainOptions::default()
        };
        Self {
            form: Architecture::taps(depth),
            options,
            data: DatasetOptions { seed: 1, ..Default::default() },
        }
    }

    /// Changes what `key=value` names.
    fn set(&mut self, setting: &str) -> Result<(), Box<dyn std::error::Error>> {
        let (key, value) = setting.split_once('=').unwrap_or((setting, ""));
        let options = &mut self.options;
        match key {
            "default" => {}
            "random-features" => options.informed = false,
            "network-batch" => options.network_batch = value.parse()?,
            "network-rate" => options.network_rate = value.parse()?,
            "texture-rate" => options.texture_rate = value.parse()?,
            "opacity-reuse" => options.opacity_reuse = value.parse()?,
            "appearance-reuse" => options.appearance_reuse = value.parse()?,
            "free-offset" => self.form.offset = OffsetForm::Free,
            "see-through" => self.form = Architecture::see_through(self.form.depth),
            "direct" => self.form.opacity = OpacityHead::Direct,
            "opacity-way" => self.form.opacity_way = way(value)?,
            "offset-way" => self.form.offset_way = way(value)?,
            "taps" => self.form.opacity_taps = taps(value)?,
            "appearance-steps" => options.appearance_steps = value.parse()?,
            "grazing" => self.data.grazing = value.parse()?,
            "patches-per-batch" => self.data.patches_per_batch = value.parse()?,
            "opacity-l1" => options.opacity_loss.l1 = value.parse()?,
            "width" => self.form.width = value.parse()?,
            "blur" => options.blur = value.parse()?,
            "texture" => {
                let size = value.parse()?;
                self.form.opacity_texture = TextureShape::square(size, 8);
            }
            "triangles" => self.data.tracing = Tracing::Triangles,
            _ => return Err(format!("no setting {key:?}").into()),
        }
        Ok(())
    }
}

#[allow(clippy::print_stdout, reason = "an example reports on standard output")]
fn main() -> Result<(), Box<dyn std::error::Error>> {
    let mut arguments = std::env::args().skip(1);
    let micro = Microstructure::load(&arguments.next().ok_or("which material?")?)?.micro;
    let steps = arguments.next().ok_or("how many steps?")?.parse()?;
    println!(
        "left of the silhouette | offset, UV | rms of ln(1 + rgb), noise included | wall seconds | variant"
    );
    for name in arguments {
        let mut variant = Variant::new(micro.geometry.depth(), steps);
        name.split(',').try_for_each(|setting| variant.set(setting))?;
        let held_out = DatasetOptions { tracing: Tracing::March, grazing: 0.1, ..variant.data.clone() };
        let source = Judged {
            training: PatchDataset::new(&micro, variant.data.clone())?,
            held_out: PatchDataset::new(&micro, held_out)?,
        };
        let began = Instant::now();
        let mut onward = |_: &Progress| ControlFlow::Continue(());
        let mut control = Control { checkpoint: None, progress: &mut onward };
        let (model, report) = train(&variant.form, &variant.options, &source, &mut control)?;
        let seconds = began.elapsed().as_secs_f64();
        println!("{}{} | {seconds:.0} | {name}", scores(&report), ious(&micro, &model));
    }
    Ok(())
}

fn way(name: &str) -> Result<Way, String> {
    match name {
        "graze" => Ok(Way::Graze),
        "descend" => Ok(Way::Descend),
        "through" => Ok(Way::Through),
        _ => Err(format!("no way {name:?}")),
    }
}

/// Fractions with colons between them.
fn taps(list: &str) -> Result<Vec<f32>, std::num::ParseFloatError> {
    list.split(':').map(str::parse).collect()
}

/// Intersections over unions of the rays that are stopped and of those that pass, of see-through materials.
fn ious(micro: &Microstructure, model: &Model) -> String {
    if !matches!(micro.geometry, Geometry::TileMesh(_)) {
        return String::new();
    }
    let truth = Oracle::new(micro, OracleOptions::default());
    let test = Material::new(&StoredModel::new(model, Precision::U8));
    let found = coverage(&truth, &test, &CoverageOptions { rays: 20_000, ..Default::default() });
    let all = found.into_iter().fold(Coverage::default(), Coverage::plus);
    format!(" | IoU {:.4}, of holes {:.4}", all.opaque_iou(), all.hole_iou())
}

fn scores(report: &TrainReport) -> String {
    let last = |stage| report.curve.iter().rfind(|point| point.stage == stage).map(|point| point.held_out);
    let opacity = last(Stage::Opacity).map_or(f64::NAN, |scores| scores.error);
    let appearance = last(Stage::Appearance);
    let offset = appearance.and_then(|scores| scores.offset).unwrap_or(f64::NAN);
    format!("{opacity:.4} | {offset:.4} | {:.5}", appearance.map_or(f64::NAN, |scores| scores.error))
}

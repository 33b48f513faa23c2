//! Writes the small models under `tests/data/models`, and what they answer:
//!
//! `cargo run --release -p osculate-sbtf --example record_models -- tests/data/models`

use std::error::Error;
use std::path::PathBuf;

use glam::{Vec2, Vec3};
use osculate_sbtf::file::{ModelFile, Provenance};
use osculate_sbtf::infer::{Material, Precision, StoredModel};
use osculate_sbtf::model::{Architecture, Model, OpacityHead, TextureShape};
use osculate_sbtf::sampling::{FitOptions, fit};
use osculate_sbtf::silhouette::largest_cosine;
use osculate_sbtf::{Query, SilhouetteBtf};
use serde_json::json;

/// Largest difference allowed, relative to 1 + |answer|.
const BOUND: f64 = 1e-5;
const QUERIES: usize = 150;

fn main() -> Result<(), Box<dyn Error>> {
    let directory = PathBuf::from(std::env::args().nth(1).ok_or("usage: record_models DIRECTORY")?);
    let small = |form: Architecture, size| Architecture {
        opacity_texture: TextureShape::square(size, form.opacity_texture.channels),
        offset_texture: TextureShape { width: size / 2, ..TextureShape::square(size, 8) },
        colour_texture: TextureShape::square(size, 5),
        ..form
    };
    let direct = Architecture {
        opacity: OpacityHead::Direct,
        offset_taps: vec![0.0, 1.0],
        ..Architecture::paper(0.2)
    };
    for (name, form, precision) in [
        ("taps", small(Architecture::taps(0.1), 8), Precision::U8),
        ("direct", small(direct, 6), Precision::F16),
        ("see-through", small(Architecture::see_through(0.1), 8), Precision::U8),
        ("neumip", small(Architecture::neumip(0.1), 4), Precision::F32),
    ] {
        let depth = form.depth;
        let model = StoredModel::new(&tame(Model::untrained(form, 5)), precision);
        let material = Material::new(&model);
        let options = FitOptions { views: 8, cells: 2, ..FitOptions::new([-2.5, 2.5]) };
        let sampler = Some(fit(&material, &options).sampler);
        let provenance = Provenance { tool: "record_models".to_owned(), seed: 5, ..Provenance::default() };
        ModelFile { model, provenance, sampler }.write(&directory.join(format!("{name}.sbtf")))?;
        let (mut rows, mut answers) = (Vec::new(), Vec::new());
        for query in queries(depth) {
            let answer = material.eval(&query);
            let (q, a) = (query, answer);
            rows.push([q.uv.x, q.uv.y, q.wo.x, q.wo.y, q.wo.z, q.wi.x, q.wi.y, q.wi.z, q.kappa_hat]);
            answers.push([a.rgb.x, a.rgb.y, a.rgb.z, a.alpha]);
        }
        let recorded = json!({ "bound": BOUND, "queries": rows, "answers": answers });
        std::fs::write(directory.join(format!("{name}.json")), serde_json::to_string(&recorded)? + "\n")?;
    }
    Ok(())
}

/// Features as smooth as trained ones, since noise would turn the rounding of a texture coordinate into differences, and
/// deep dips, so that many grazing rays miss.
fn tame(mut model: Model) -> Model {
    let dip = if model.architecture.opacity == OpacityHead::Silhouette { 0.9 } else { 0.3 };
    if let Some(last) = model.opacity.as_mut().and_then(|module| module.mlp.layers.last_mut()) {
        last.biases[0] += dip;
    }
    let modules = model.opacity.iter_mut().chain([&mut model.offset, &mut model.colour]);
    modules.flat_map(|module| &mut module.texture.texels).for_each(|x| *x *= 0.2);
    model
}

/// Queries over the whole domain and beyond; every second one is grazing.
#[allow(clippy::cast_possible_truncation, reason = "rounded on purpose")]
fn queries(depth: f32) -> Vec<Query> {
    let fraction = |i: usize, step: f64| (i as f64 * step).fract() as f32;
    let query = |i: usize| {
        let kappa_hat = 6.0 * fraction(i, 0.618_033_988_7) - 3.0;
        let cosine = if i.is_multiple_of(2) { 1.0 } else { largest_cosine(kappa_hat.max(0.3), depth) };
        let cosine = cosine * fraction(i, 0.754_877_666_2);
        let (sine, angle) =
            ((1.0 - cosine * cosine).sqrt(), std::f32::consts::TAU * fraction(i, 0.569_840_290_9));
        let wi = [0.819_172_513_4, 0.671_043_606_7, 0.549_700_477_9].map(|step| fraction(i + 7, step) - 0.5);
        Query {
            uv: Vec2::new(8.0 * fraction(i, 0.819_172_513_4) - 4.0, fraction(i, 0.671_043_606_7)),
            wo: Vec3::new(sine * angle.cos(), sine * angle.sin(), cosine),
            wi: Vec3::from(wi).normalize(),
            kappa_hat,
        }
    };
    (0..QUERIES).map(query).collect()
}

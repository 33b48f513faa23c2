//! Renders every setting and compares it with a long rendering of the truth.

use std::sync::Arc;
use std::time::Instant;

use anyhow::Result;
use glam::Vec3;
use osculate_geom::field::FilterKind;
use osculate_render::metrics::{FlipOptions, Image, flip};
use osculate_render::{Frame, RenderOptions, Rendering, Scene, StopRule, render_frames};
use osculate_sbtf::infer::StoredModel;
use osculate_sbtf::march::HeightMarch;
use osculate_sbtf::micro::{HeightField, Microstructure};
use osculate_sbtf::oracle::{Oracle, OracleOptions};
use osculate_sbtf::sampling::Sampler;
use serde::Serialize;

use super::settings::{Extent, Setting, Shown};
use crate::protocol::{Cost, Entry, Form, Subject, Truth};

/// How much is measured.
#[derive(Debug, Clone, Copy, Serialize)]
pub struct Effort {
    /// Pixels a side.
    pub pixels: u32,
    /// Samples per pixel of the reference.
    pub reference_spp: u32,
    /// Renderings of each setting, two or more, each with its own noise.
    pub runs: u32,
    /// Of all random choices.
    pub seed: u64,
    /// Which settings.
    #[serde(flatten)]
    pub extent: Extent,
}

/// What came of a setting.
#[derive(Debug, Clone, Serialize)]
pub struct Row {
    /// What was rendered.
    #[serde(flatten)]
    pub setting: Setting,
    /// The value of its knob, in words.
    pub knob: String,
    /// Root mean square error of the pixels, relative to the reference's mean; of noise and of all else.
    pub error: f64,
    /// What of it more samples would leave: the root of the mean product of errors of different runs against different halves of the
    /// reference, in which noise averages out. 0 where that is negative, which is to say that nothing was found.
    pub bias: f64,
    /// One standard deviation of the bias, over the pixels.
    pub bias_error: f64,
    /// FLIP against the reference, mean over the runs.
    pub flip: f64,
    /// Median seconds of tracing.
    pub seconds: f64,
    /// The fastest and the slowest run.
    pub range: [f64; 2],
    /// Seconds to make the geometry and the hierarchy over it, once.
    pub preparation_seconds: f64,
    /// Triangles that rays are traced against.
    pub triangles: usize,
    /// Of the triangles, without the hierarchy, and of the material.
    pub bytes: usize,
}

/// All rows, and how noisy the reference is, relative.
#[derive(Debug, Clone, Serialize)]
pub struct Results {
    /// Relative noise of the reference.
    pub reference_noise: f64,
    /// The models: the one under study, then the others.
    pub networks: Vec<NetworkSize>,
    /// In the order of the settings.
    pub rows: Vec<Row>,
}

/// A model of the microstructure.
pub struct Network {
    /// In labels.
    pub name: String,
    /// The model.
    pub entry: Entry,
    /// Its size.
    pub size: NetworkSize,
}

/// What is large or small about a model.
#[derive(Debug, Clone, Serialize)]
pub struct NetworkSize {
    /// In labels.
    name: String,
    /// Neurons of a hidden layer, and hidden layers.
    pub hidden: [usize; 2],
    /// Taps of the opacity and of the offset.
    pub taps: [usize; 2],
    /// Texels along a side and features of the colour's texture.
    pub texture: [usize; 2],
    /// Multiplications of a full query.
    pub products: usize,
    /// Of features and weights.
    pub bytes: usize,
}

impl NetworkSize {
    /// Reads it off a model.
    pub fn of(name: &str, model: &StoredModel) -> Self {
        let form = &model.architecture;
        let weights = |layers: &[osculate_sbtf::model::Layer]| -> usize {
            layers.iter().map(|layer| layer.weights.len()).sum()
        };
        Self {
            name: name.to_owned(),
            hidden: [form.width, form.hidden_layers],
            taps: [form.opacity_taps.len(), form.offset_taps.len()],
            texture: [form.colour_texture.width, form.colour_texture.channels],
            products: model.modules().map(|(_, module)| weights(&module.mlp.layers)).sum(),
            bytes: model.bytes(),
        }
    }

    /// In labels.
    pub fn name(&self) -> &str {
        &self.name
    }
}

/// The material under study.
#[derive(Clone, Copy)]
pub struct Material<'a> {
    /// The model under study, then others of the same microstructure.
    pub networks: &'a [Network],
    /// What it was trained on.
    pub micro: &'a Microstructure,
    /// Its heights.
    pub heights: &'a HeightField,
}

/// Renders the reference and all settings. `tick` is called with the share of work that is done.
pub fn measure(
    subject: &Subject,
    material: &Material<'_>,
    effort: &Effort,
    tick: &mut dyn FnMut(f64),
) -> Result<Results> {
    let settings = effort.extent.settings(material.networks.len() - 1);
    let truth = subject.truth_within(material.heights, effort.extent.finest)?;
    let scene = subject.scene(&Form::Displaced(&truth), effort.pixels)?.0;
    // Two halves, with seeds that no run has.
    let halves = trace(&scene, effort.reference_spp.div_ceil(2), effort.seed.wrapping_sub(2), 2, subject)?;
    let reference = Reference::new([0, 1].map(|i| halves[i].film.radiance()));
    let samples = |s: &Setting| f64::from(s.spp * effort.runs);
    let total = f64::from(effort.reference_spp) + settings.iter().map(samples).sum::<f64>();
    let mut done = f64::from(effort.reference_spp);
    tick(done / total);
    let mut rows = Vec::with_capacity(settings.len());
    for setting in &settings {
        rows.push(row(subject, material, &truth, setting, effort, &reference)?);
        done += samples(setting);
        tick(done / total);
    }
    let networks = material.networks.iter().map(|network| network.size.clone()).collect();
    Ok(Results { reference_noise: reference.noise(), networks, rows })
}

fn row(
    subject: &Subject,
    material: &Material<'_>,
    fine: &Truth,
    setting: &Setting,
    effort: &Effort,
    reference: &Reference,
) -> Result<Row> {
    let start = Instant::now();
    let (scene, cost, material_bytes) = scene(subject, material, fine, setting.shown, effort)?;
    let mut preparation_seconds = start.elapsed().as_secs_f64();
    if setting.shown == effort.extent.finest() {
        preparation_seconds += fine.seconds;
    }
    let made = trace(&scene, setting.spp, effort.seed, effort.runs, subject)?;
    preparation_seconds += made[0].preparation.as_secs_f64();
    let mut seconds: Vec<f64> = made.iter().map(|r| r.tracing.as_secs_f64()).collect();
    seconds.sort_by(f64::total_cmp);
    let pictures: Vec<Vec<Vec3>> = made.iter().map(|r| r.film.radiance()).collect();
    let found = reference.errors(&pictures);
    let side = effort.pixels as usize;
    let image = |p: &[Vec3]| Image::srgb_from_linear(side, side, p.iter().copied());
    let of = image(&reference.mean);
    let flips = pictures.iter().map(|p| flip(&of, &image(p), &FlipOptions::default())).sum::<f64>();
    Ok(Row {
        setting: *setting,
        knob: setting.shown.knob(&material.others()),
        error: found.square.sqrt(),
        bias: found.bias(),
        bias_error: found.bias_error(),
        flip: flips / pictures.len() as f64,
        seconds: seconds[seconds.len() / 2],
        range: [seconds[0], seconds[seconds.len() - 1]],
        preparation_seconds,
        triangles: cost.triangles,
        bytes: cost.geometry_bytes + material_bytes,
    })
}

/// A long rendering of the truth, in two halves of independent noise.
struct Reference {
    halves: [Vec<Vec3>; 2],
    mean: Vec<Vec3>,
}

impl Reference {
    fn new(halves: [Vec<Vec3>; 2]) -> Self {
        let mean = halves[0].iter().zip(&halves[1]).map(|(a, b)| 0.5 * (*a + *b)).collect();
        Self { halves, mean }
    }

    /// Mean over pixels and channels.
    fn level(&self) -> f64 {
        let sum: f64 = self.mean.iter().map(|c| f64::from(c.element_sum())).sum();
        sum / (3 * self.mean.len()) as f64
    }

    /// Root mean square of the mean's noise, relative.
    fn noise(&self) -> f64 {
        let [a, b] = &self.halves;
        let squares: f64 = a.iter().zip(b).map(|(a, b)| f64::from((0.5 * (*a - *b)).length_squared())).sum();
        (squares / (3 * a.len()) as f64).sqrt() / self.level()
    }

    /// Of pictures against this.
    fn errors(&self, pictures: &[Vec<Vec3>]) -> Errors {
        let runs = pictures.len() as f64;
        // One picture has no pair, and no product.
        let pairs = (runs * (runs - 1.0)).max(1.0);
        let (mut squares, mut products, mut products_squared) = (0.0, 0.0, 0.0);
        for (pixel, truth) in self.mean.iter().enumerate() {
            let mut product = 0.0;
            for channel in 0..3 {
                let halves = [0, 1].map(|h| f64::from(self.halves[h][pixel][channel]));
                let mut sums = [0.0; 2];
                for picture in pictures {
                    let value = f64::from(picture[pixel][channel]);
                    let [a, b] = halves.map(|half| value - half);
                    squares += (value - f64::from(truth[channel])).powi(2);
                    // A picture is no pair with itself.
                    product -= a * b;
                    sums = [sums[0] + a, sums[1] + b];
                }
                product += sums[0] * sums[1];
            }
            products += product / pairs;
            products_squared += (product / pairs).powi(2);
        }
        let scale = (3 * self.mean.len()) as f64 * self.level().powi(2);
        let spread = products_squared - products * products / self.mean.len() as f64;
        Errors {
            square: squares / (runs * scale),
            product: products / scale,
            product_error: spread.max(0.0).sqrt() / scale,
        }
    }
}

/// Errors of pictures, relative to the square of the reference's level.
#[derive(Debug, Clone, Copy)]
struct Errors {
    /// Mean square difference.
    square: f64,
    /// Mean product of the differences of two pictures, each to another half of the reference, over all pairs.
    product: f64,
    /// Standard deviation of `product`, from its spread over the pixels.
    product_error: f64,
}

impl Errors {
    fn bias(self) -> f64 {
        self.product.max(0.0).sqrt()
    }

    /// Half of what the interval of the product becomes under the root.
    fn bias_error(self) -> f64 {
        let root = |x: f64| x.max(0.0).sqrt();
        0.5 * (root(self.product + self.product_error) - root(self.product - self.product_error))
    }
}

impl Material<'_> {
    /// Names of the other models.
    fn others(&self) -> Vec<String> {
        self.networks[1..].iter().map(|network| network.name.clone()).collect()
    }
}

/// The scene, what its geometry takes, and the material's bytes.
fn scene(
    subject: &Subject,
    material: &Material<'_>,
    fine: &Truth,
    shown: Shown,
    effort: &Effort,
) -> Result<(Scene, Cost, usize)> {
    let Material { networks, micro, heights } = *material;
    let model = &networks[0];
    let texels = heights.heights().texels().len();
    // Height, three colours, roughness and metalness, a float each, and the normals that are made of them.
    let maps = texels * 4 * (1 + 3 + 1 + 1 + 3);
    let entry = |btf| Entry { btf, sampler: Arc::new(Sampler::cosine()), depth: heights.depth() };
    let asked = |entry| Form::Asked { entry, filter: FilterKind::Chord, exact_curvature: false };
    let coarse;
    let (form, bytes) = match shown {
        Shown::Neural { filter } => {
            let form = Form::Asked { entry: model.entry.clone(), filter, exact_curvature: false };
            (form, model.size.bytes)
        }
        Shown::Network { index } => {
            let other = &networks[index + 1];
            (asked(other.entry.clone()), other.size.bytes)
        }
        Shown::Oracle { samples } => {
            let options = OracleOptions { samples, ..OracleOptions::default() };
            (asked(entry(Arc::new(Oracle::new(micro, options)))), maps)
        }
        Shown::March { steps } => (asked(entry(Arc::new(HeightMarch::new(heights, steps)))), maps),
        _ if shown == effort.extent.finest() => (Form::Displaced(fine), maps),
        Shown::Displaced { tolerance } => {
            coarse = subject.truth_within(heights, tolerance)?;
            (Form::Displaced(&coarse), maps)
        }
        Shown::Flat => (Form::Flat(heights), maps),
    };
    let (scene, cost) = subject.scene(&form, effort.pixels)?;
    Ok((scene, cost, bytes))
}

/// From the camera at 35 degrees, with so many seeds one after the other.
fn trace(scene: &Scene, spp: u32, seed: u64, runs: u32, subject: &Subject) -> Result<Vec<Rendering>> {
    let camera = subject.camera_turned(0.0);
    let frame = |run| Frame { camera, light_turn: 0.0, seed: seed.wrapping_add(run) };
    let options = RenderOptions { stop: StopRule::Samples(spp), ..RenderOptions::default() };
    let frames: Vec<Frame> = (0..u64::from(runs)).map(frame).collect();
    Ok(render_frames(scene, &frames, &options, &mut || {})?)
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn errors_are_relative_and_noise_is_told_from_bias() {
        let exact = [Vec3::new(1.0, 2.0, 3.0), Vec3::new(3.0, 2.0, 1.0)];
        let off = |by: f32| exact.map(|c| c + by).to_vec();
        let reference = Reference::new([off(0.0), off(0.0)]);
        let near = |reference: &Reference, pictures: &[Vec<Vec3>], error: f64, bias: f64| {
            let Errors { square, product, .. } = reference.errors(pictures);
            assert!((square.sqrt() - error).abs() < 1e-6, "{square}");
            assert!((product - bias.powi(2).copysign(bias)).abs() < 1e-8, "{product}");
        };
        near(&reference, &[off(0.0), off(0.0)], 0.0, 0.0);
        // All channels 5 % too bright in the mean, which is 2.
        near(&reference, &[off(0.1), off(0.1)], 0.05, 0.05);
        // One of six numbers off by 0.6: 0.6 / sqrt 6 / 2. In the other run, another one is: as noise is.
        let spot = |pixel: usize| {
            let mut spotted = exact.to_vec();
            spotted[pixel].y += 0.6;
            spotted
        };
        near(&reference, &[spot(0), spot(1)], 0.3 / 6.0_f64.sqrt(), 0.0);
        near(&reference, &[spot(0), spot(0), spot(0)], 0.3 / 6.0_f64.sqrt(), 0.3 / 6.0_f64.sqrt());
        // Halves that are off by as much to either side have a noise, and a picture that is exact has no bias but their product.
        let noisy = Reference::new([off(0.1), off(-0.1)]);
        assert!((noisy.noise() - 0.05).abs() < 1e-6);
        near(&noisy, &[off(0.0), off(0.0)], 0.0, -0.05);
    }

    /// Noise of 20 % on pictures that are 5 % too bright.
    #[test]
    fn noise_averages_out_of_the_bias() {
        let mut random = osculate_sbtf::random::Random::new(1, 2, 3);
        let mut picture = |level: f32| -> Vec<Vec3> {
            let mut channel = || level + 0.2 * 12.0_f32.sqrt() * (random.unit() - 0.5);
            (0..3000).map(|_| Vec3::new(channel(), channel(), channel())).collect()
        };
        let reference = Reference::new([picture(1.0), picture(1.0)]);
        let pictures: Vec<Vec<Vec3>> = (0..3).map(|_| picture(1.05)).collect();
        let found = reference.errors(&pictures);
        let Errors { square, product, product_error } = found;
        // The mean of both halves has half the variance of one.
        let all = (0.05_f64.powi(2) + 1.5 * 0.2_f64.powi(2)).sqrt();
        assert!((square.sqrt() - all).abs() < 0.005, "{}", square.sqrt());
        // The product scatters by 0.2^2 / sqrt(9000) or so, 0.0004 of 0.0025, and knows it.
        assert!((0.0002..0.0008).contains(&product_error), "{product_error}");
        assert!((product - 0.0025).abs() < 4.0 * product_error, "{product}");
        assert!(
            (found.bias() - 0.05).abs() < 4.0 * found.bias_error(),
            "{} {}",
            found.bias(),
            found.bias_error()
        );
        assert!((reference.noise() - 0.2 / 2.0_f64.sqrt()).abs() < 0.005, "{}", reference.noise());
    }
}

//! The losses once more in f64, written from their definitions, and their central differences: what the kernels' gradients are
//! held against.
#![allow(clippy::cast_possible_truncation, reason = "texel coordinates")]

use glam::Vec3;

use super::appearance::AppearanceLearner;
use super::learner::{Learner, LearnerState};
use super::opacity::OpacityLearner;
use super::options::{AppearanceLoss, ColourLoss, OpacityLoss, Supervision};
use crate::model::{
    Architecture, CurvatureInput, OffsetForm, OpacityHead, STEEPEST_RAY, TextureShape, Way, azimuth,
};
use crate::random::Random;
use crate::samples::{AppearanceBatch, OpacityBatch};
use crate::silhouette::dip_of_cosine;

/// A module in f64.
#[derive(Clone)]
struct Exact {
    shape: TextureShape,
    sizes: Vec<usize>,
    texture: Vec<f64>,
    network: Vec<f64>,
    sigma: f64,
}

impl Exact {
    fn of(learner: &Learner, sigma: f64) -> Self {
        let wide = |numbers: &[f32]| numbers.iter().map(|&x| f64::from(x)).collect();
        let LearnerState { texture, network, .. } = &learner.state;
        Self {
            shape: learner.shape,
            sizes: learner.layers.sizes().to_vec(),
            texture: wide(&texture.values),
            network: wide(&network.values),
            sigma,
        }
    }

    fn texel(&self, x: i64, y: i64) -> &[f64] {
        let TextureShape { width, height, channels } = self.shape;
        let (x, y) = (x.rem_euclid(width as i64), y.rem_euclid(height as i64));
        let first = usize::try_from(y * width as i64 + x).expect("wrapped") * channels;
        &self.texture[first..first + channels]
    }

    /// The module with its features as the network sees them: the double sum, cut at three sigma.
    fn blurred(&self) -> Self {
        if self.sigma < 0.3 {
            return self.clone();
        }
        let radius = (3.0 * self.sigma).ceil() as i64;
        let gauss = |k: i64| (-0.5 * (k as f64 / self.sigma).powi(2)).exp();
        let total: f64 = (-radius..=radius).map(gauss).sum();
        let mut texture = Vec::new();
        for (y, x) in
            (0..self.shape.height as i64).flat_map(|y| (0..self.shape.width as i64).map(move |x| (y, x)))
        {
            let mut sum = vec![0.0; self.shape.channels];
            for (dy, dx) in (-radius..=radius).flat_map(|dy| (-radius..=radius).map(move |dx| (dy, dx))) {
                let weight = gauss(dx) * gauss(dy) / (total * total);
                sum.iter_mut()
                    .zip(self.texel(x + dx, y + dy))
                    .for_each(|(sum, texel)| *sum += weight * texel);
            }
            texture.extend(sum);
        }
        Self { texture, ..self.clone() }
    }

    fn features(&self, u: f64, v: f64) -> Vec<f64> {
        let (x, y) = (u * self.shape.width as f64 - 0.5, v * self.shape.height as f64 - 0.5);
        let (x0, y0) = (x.floor(), y.floor());
        let (fx, fy) = (x - x0, y - y0);
        let mut sum = vec![0.0; self.shape.channels];
        for (dx, dy, weight) in [
            (0, 0, (1.0 - fx) * (1.0 - fy)),
            (1, 0, fx * (1.0 - fy)),
            (0, 1, (1.0 - fx) * fy),
            (1, 1, fx * fy),
        ] {
            let texel = self.texel(x0 as i64 + dx, y0 as i64 + dy);
            sum.iter_mut().zip(texel).for_each(|(sum, texel)| *sum += weight * texel);
        }
        sum
    }

    fn outputs(&self, mut values: Vec<f64>) -> Vec<f64> {
        let mut rest = self.network.as_slice();
        for (layer, pair) in self.sizes.windows(2).enumerate() {
            assert_eq!(values.len(), pair[0]);
            let (weights, tail) = rest.split_at(pair[0] * pair[1]);
            let (biases, tail) = tail.split_at(pair[1]);
            rest = tail;
            let last = layer + 2 == self.sizes.len();
            values = (weights.chunks(pair[0]).zip(biases))
                .map(|(row, bias)| {
                    let sum = bias + row.iter().zip(&values).map(|(w, x)| w * x).sum::<f64>();
                    if last { sum } else { sum.max(0.0) }
                })
                .collect();
        }
        values
    }
}

fn direction(rows: &[Vec<f32>; 3], i: usize) -> Vec3 {
    Vec3::new(rows[0][i], rows[1][i], rows[2][i])
}

fn push_curvature(form: &Architecture, kappa: f32, inputs: &mut Vec<f64>) {
    if form.curvature == CurvatureInput::Given {
        inputs.push(f64::from(form.encode_curvature(kappa)));
    }
}

fn opacity_loss(
    form: &Architecture,
    loss: OpacityLoss,
    supervision: Supervision,
    module: &Exact,
    batch: &OpacityBatch,
) -> f64 {
    let module = module.blurred();
    let silhouette = form.opacity == OpacityHead::Silhouette;
    let (mut sum, mut count) = (0.0, 0);
    for i in 0..batch.len() {
        let (wo, kappa) = (direction(&batch.wo, i), form.clamp_curvature(batch.kappa_hat[i]));
        if silhouette && kappa <= 0.0 {
            continue;
        }
        let step = azimuth(wo) * form.way_length(form.opacity_way, wo, kappa);
        let mut inputs = Vec::new();
        for &fraction in &form.opacity_taps {
            let at = |axis: usize| f64::from(batch.uv[axis][i]) + f64::from(step[axis]) * f64::from(fraction);
            inputs.extend(module.features(at(0), at(1)));
        }
        let shown = if silhouette { azimuth(wo) } else { wo.truncate() };
        inputs.extend([f64::from(shown.x), f64::from(shown.y)]);
        push_curvature(form, kappa, &mut inputs);
        let output = module.outputs(inputs)[0];
        let pair = |target: f64| {
            let beyond = (target <= 0.0 && output < 0.0) || (target >= 1.0 && output > 1.0);
            let error = if beyond { 0.0 } else { output - target };
            f64::from(loss.l2) * error * error + f64::from(loss.l1) * error.abs()
        };
        let own = f64::from(dip_of_cosine(wo.z, kappa, form.depth));
        count += 1;
        sum += match (silhouette, supervision) {
            (false, _) => pair(f64::from(batch.alpha[i])),
            (true, Supervision::Full) => {
                pair(f64::from(dip_of_cosine(batch.silhouette_cosine[i], kappa, form.depth)))
            }
            (true, Supervision::ColourAndAlpha) if batch.alpha[i] > 0.5 => (output - own).max(0.0),
            (true, Supervision::ColourAndAlpha) => (own - output).max(0.0),
        };
    }
    sum / f64::from(count)
}

fn appearance_loss(
    form: &Architecture,
    loss: AppearanceLoss,
    supervision: Supervision,
    modules: &[Exact; 2],
    batch: &AppearanceBatch,
) -> f64 {
    let modules = [modules[0].blurred(), modules[1].blurred()];
    let mut sum = 0.0;
    for i in 0..batch.len() {
        let (wo, wi) = (direction(&batch.wo, i), direction(&batch.wi, i));
        let kappa = form.clamp_curvature(batch.kappa_hat[i]);
        let step = azimuth(wo) * form.way_length(form.offset_way, wo, kappa);
        let uv = [0, 1].map(|axis: usize| f64::from(batch.uv[axis][i]));
        let mut inputs = Vec::new();
        for &fraction in &form.offset_taps {
            let [u, v] = [0, 1].map(|axis| uv[axis] + f64::from(step[axis]) * f64::from(fraction));
            inputs.extend(modules[0].features(u, v));
        }
        inputs.extend([f64::from(wo.x), f64::from(wo.y)]);
        push_curvature(form, kappa, &mut inputs);
        let found = modules[0].outputs(inputs);
        let offset = [0, 1].map(|axis: usize| match form.offset {
            OffsetForm::Free => found[axis],
            OffsetForm::AlongRay => -found[0] * f64::from(wo[axis]) / f64::from(wo.z.max(STEEPEST_RAY)),
            OffsetForm::AlongReach => found[0] * f64::from(step[axis]),
        });
        let mut inputs = modules[1].features(uv[0] + offset[0], uv[1] + offset[1]);
        inputs.extend([wi.x, wi.y, wi.z, wo.x, wo.y].map(f64::from));
        push_curvature(form, kappa, &mut inputs);
        for (channel, output) in modules[1].outputs(inputs).into_iter().enumerate() {
            let target = f64::from(batch.rgb[channel][i]).ln_1p();
            let error = output - target;
            if output < 0.0 && target <= 0.0 {
                continue;
            }
            sum += match loss.colour {
                ColourLoss::Logarithmic => error * error,
                ColourLoss::Unbiased => 2.0 * (error + (-error).exp() - 1.0),
            } / 3.0;
            sum += f64::from(loss.l1) * error.abs() / 3.0;
        }
        if supervision == Supervision::Full {
            for (found, truth) in offset.iter().zip(&batch.offset) {
                sum += f64::from(loss.offset) * (found - f64::from(truth[i])).abs();
            }
        }
    }
    sum / batch.len() as f64
}

/// Central differences by every number of a module; `loss` takes it changed.
fn differences(module: &Exact, loss: impl Fn(&Exact) -> f64) -> (Vec<f64>, Vec<f64>) {
    let step = 1e-6;
    let by = |numbers: fn(&mut Exact) -> &mut Vec<f64>| {
        let count = numbers(&mut module.clone()).len();
        let at = |i: usize, by: f64| {
            let mut moved = module.clone();
            numbers(&mut moved)[i] += by;
            loss(&moved)
        };
        (0..count).map(|i| (at(i, step) - at(i, -step)) / (2.0 * step)).collect()
    };
    (by(|module| &mut module.texture), by(|module| &mut module.network))
}

/// Gradients in f32 go through a few hundred roundings of 2^-24 at the scale of the largest; the differences through a step
/// of 1e-6.
fn assert_close(what: &str, gradient: &[f32], expected: &[f64]) {
    let scale = expected.iter().fold(0.0_f64, |a, b| a.max(b.abs()));
    assert!(scale > 1e-6, "{what}: gradients that are all nothing prove nothing");
    assert_eq!(gradient.len(), expected.len(), "{what}");
    for (i, (&g, e)) in gradient.iter().zip(expected).enumerate() {
        assert!((f64::from(g) - e).abs() < 2e-5 * scale, "{what} {i}: {g} is not {e} (largest {scale})");
    }
}

pub(super) fn small_form() -> Architecture {
    Architecture {
        opacity_taps: vec![0.0, 0.4, 1.0],
        offset_taps: vec![0.0, 0.7],
        opacity_texture: TextureShape { width: 6, height: 5, channels: 4 },
        offset_texture: TextureShape { width: 5, height: 4, channels: 3 },
        colour_texture: TextureShape { width: 4, height: 6, channels: 8 },
        width: 7,
        ..Architecture::taps(0.15)
    }
}

fn random_direction(random: &mut Random, rows: &mut [Vec<f32>; 3], i: usize, upper: bool) {
    let d = Vec3::from_array(std::array::from_fn(|_| random.signed())).normalize();
    for (axis, row) in rows.iter_mut().enumerate() {
        row[i] = if upper && axis == 2 { d.z.abs() } else { d[axis] };
    }
}

const SAMPLES: usize = 300;

/// Initial biases are 0, which puts neurons whose inputs are all dead exactly on the kink of the rectifier.
fn off_the_kinks(learner: &mut Learner, random: &mut Random) {
    learner.state.network.values.iter_mut().for_each(|x| *x += 0.1 * random.signed());
}

#[test]
fn opacity_gradients_are_central_differences() {
    let mut random = Random::new(11, 0, 0);
    let mut batch = OpacityBatch::default();
    batch.resize(SAMPLES);
    for i in 0..SAMPLES {
        batch.uv.iter_mut().for_each(|row| row[i] = 2.0 * random.signed());
        random_direction(&mut random, &mut batch.wo, i, true);
        batch.kappa_hat[i] = 2.5 * random.signed();
        batch.silhouette_cosine[i] = 0.6 * random.unit();
        batch.alpha[i] = f32::from(u8::from(random.unit() < 0.5));
    }
    let loss = OpacityLoss { l1: 0.3, l2: 1.0 };
    for (head, opacity_way, supervision, sigma) in [
        (OpacityHead::Silhouette, Way::Graze, Supervision::Full, 0.0),
        (OpacityHead::Silhouette, Way::Graze, Supervision::Full, 0.8),
        (OpacityHead::Silhouette, Way::Graze, Supervision::ColourAndAlpha, 0.0),
        (OpacityHead::Direct, Way::Graze, Supervision::Full, 0.0),
        (OpacityHead::Direct, Way::Through, Supervision::Full, 0.8),
    ] {
        let form = Architecture { opacity: head, opacity_way, ..small_form() };
        let mut learner = OpacityLearner::new(&form, loss, supervision, &mut random);
        off_the_kinks(&mut learner.learner, &mut random);
        let value = learner.gradients(&batch, sigma);
        let (texture, network) = learner.gathered(sigma);
        let module = Exact::of(&learner.learner, sigma);
        let exact = |module: &Exact| opacity_loss(&form, loss, supervision, module, &batch);
        assert!((value - exact(&module)).abs() < 1e-5 * value, "{head:?}: {value} {}", exact(&module));
        let (by_texture, by_network) = differences(&module, exact);
        let what = format!("{head:?} {opacity_way:?} {supervision:?} {sigma}");
        assert_close(&format!("{what} texture"), &texture, &by_texture);
        assert_close(&format!("{what} network"), &network, &by_network);
    }
}

#[test]
fn appearance_gradients_are_central_differences() {
    let mut random = Random::new(12, 0, 0);
    let mut batch = AppearanceBatch::default();
    batch.resize(SAMPLES);
    for i in 0..SAMPLES {
        batch.uv.iter_mut().for_each(|row| row[i] = 2.0 * random.signed());
        random_direction(&mut random, &mut batch.wo, i, true);
        random_direction(&mut random, &mut batch.wi, i, false);
        batch.kappa_hat[i] = 2.5 * random.signed();
        batch.offset.iter_mut().for_each(|row| row[i] = 0.3 * random.signed());
        batch.rgb.iter_mut().for_each(|row| row[i] = (4.0 * random.signed()).max(0.0));
    }
    for (offset, offset_way, colour, supervision, sigma) in [
        (OffsetForm::Free, Way::Descend, ColourLoss::Unbiased, Supervision::Full, 0.0),
        (OffsetForm::Free, Way::Descend, ColourLoss::Logarithmic, Supervision::ColourAndAlpha, 0.7),
        (OffsetForm::AlongRay, Way::Descend, ColourLoss::Unbiased, Supervision::ColourAndAlpha, 0.0),
        (OffsetForm::AlongReach, Way::Descend, ColourLoss::Unbiased, Supervision::Full, 0.7),
        (OffsetForm::AlongReach, Way::Through, ColourLoss::Unbiased, Supervision::Full, 0.7),
    ] {
        let curvature =
            if offset == OffsetForm::Free { CurvatureInput::Given } else { CurvatureInput::Absent };
        let form = Architecture { offset, offset_way, curvature, ..small_form() };
        let loss = AppearanceLoss { colour, l1: 0.1, offset: 0.5 };
        let mut learner = AppearanceLearner::new(&form, loss, supervision, &mut random);
        off_the_kinks(&mut learner.offset, &mut random);
        off_the_kinks(&mut learner.colour, &mut random);
        let value = learner.gradients(&batch, sigma);
        let gathered = learner.gathered(sigma);
        let modules = [Exact::of(&learner.offset, sigma), Exact::of(&learner.colour, sigma)];
        let exact = |modules: &[Exact; 2]| appearance_loss(&form, loss, supervision, modules, &batch);
        assert!((value - exact(&modules)).abs() < 1e-5 * value, "{value} {}", exact(&modules));
        for (which, (texture, network)) in gathered.iter().enumerate() {
            let (by_texture, by_network) = differences(&modules[which], |module| {
                let mut changed = modules.clone();
                changed[which] = module.clone();
                exact(&changed)
            });
            let what = format!("{offset:?} {offset_way:?} {supervision:?} module {which}");
            assert_close(&format!("{what} texture"), texture, &by_texture);
            assert_close(&format!("{what} network"), network, &by_network);
        }
    }
}

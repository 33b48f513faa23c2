//! [`Environment`]: light from infinitely far, from all directions.

use std::sync::Arc;

use glam::Vec3;

use super::irradiance::Irradiance;
use super::{LightSample, Receiver};
use crate::distribution::Distribution2d;
use crate::math::{Frame, cosine_hemisphere, luminance};

/// Light from infinitely far.
#[derive(Debug, Clone, PartialEq, Default)]
pub enum Environment {
    /// None.
    #[default]
    Black,
    /// The same linear RGB radiance from everywhere.
    Constant(Vec3),
    /// A latitude-longitude picture.
    Image {
        /// The picture.
        image: Arc<EnvironmentImage>,
        /// Multiplies the picture's radiance.
        intensity: f32,
        /// Turn about +Y in radians; a quarter turn moves what was seen towards -Z to -X.
        rotation: f32,
    },
}

/// Linear RGB radiance over latitude and longitude. The top row is +Y, the middle column is -Z, columns go towards +X.
#[derive(Debug, Clone, PartialEq)]
pub struct EnvironmentImage {
    pub(super) width: usize,
    pub(super) height: usize,
    pub(super) pixels: Vec<Vec3>,
}

impl EnvironmentImage {
    /// Takes pixels row by row. Negative and non-finite components become 0.
    ///
    /// # Panics
    ///
    /// If there are not `width * height` pixels, or none.
    #[must_use]
    pub fn new(width: usize, height: usize, mut pixels: Vec<Vec3>) -> Self {
        assert!(
            !pixels.is_empty() && pixels.len() == width * height,
            "{} pixels for {width} x {height}",
            pixels.len()
        );
        for pixel in &mut pixels {
            *pixel = Vec3::from(pixel.to_array().map(|c| if c.is_finite() { c.max(0.0) } else { 0.0 }));
        }
        Self { width, height, pixels }
    }

    /// Samples a function of the direction.
    #[must_use]
    pub fn from_fn(width: usize, height: usize, radiance: impl Fn(Vec3) -> Vec3) -> Self {
        let at = |k: usize| {
            let (x, y) = ((k % width) as f32 + 0.5, (k / width) as f32 + 0.5);
            radiance(direction_from_uv([x / width as f32, y / height as f32]))
        };
        Self::new(width, height, (0..width * height).map(at).collect())
    }

    /// Width and height in pixels.
    #[must_use]
    pub fn size(&self) -> (usize, usize) {
        (self.width, self.height)
    }

    /// Bilinear radiance at a position in the unit square; wraps around in x.
    #[allow(
        clippy::cast_possible_truncation,
        clippy::cast_sign_loss,
        reason = "wrapped and clamped into the picture"
    )]
    fn lookup(&self, [u, v]: [f32; 2]) -> Vec3 {
        let (x, y) = (u * self.width as f32 - 0.5, v * self.height as f32 - 0.5);
        let (x0, y0) = (x.floor(), y.floor());
        let column = |x: f32| (x as isize).rem_euclid(self.width as isize) as usize;
        let row = |y: f32| (y.max(0.0) as usize).min(self.height - 1);
        let texel = |x: f32, y: f32| self.pixels[row(y) * self.width + column(x)];
        let line = |y: f32| texel(x0, y).lerp(texel(x0 + 1.0, y), x - x0);
        line(y0).lerp(line(y0 + 1.0), y - y0)
    }
}

/// An environment with what sampling it needs.
#[derive(Debug)]
pub(crate) struct EnvironmentSampler {
    kind: Kind,
    irradiance: Irradiance,
}

#[derive(Debug)]
enum Kind {
    Constant(Vec3),
    Image {
        image: Arc<EnvironmentImage>,
        intensity: f32,
        sin_cos: [f32; 2],
        distribution: Distribution2d,
        /// Share of samples that are drawn around the normal instead of from the picture.
        cosine_share: f32,
    },
}

impl EnvironmentSampler {
    /// `None` if no light comes from the environment.
    pub(crate) fn new(environment: &Environment) -> Option<Self> {
        match environment {
            Environment::Black => None,
            Environment::Constant(radiance) => (*radiance != Vec3::ZERO).then(|| Self {
                kind: Kind::Constant(*radiance),
                irradiance: Irradiance::constant(luminance(*radiance)),
            }),
            Environment::Image { image, intensity, rotation } => {
                Self::from_image(image, *intensity, *rotation)
            }
        }
    }

    fn from_image(image: &Arc<EnvironmentImage>, intensity: f32, rotation: f32) -> Option<Self> {
        let weights = cell_weights(image);
        let total: f64 = weights.iter().sum();
        if total <= 0.0 || intensity <= 0.0 {
            return None;
        }
        let distribution = Distribution2d::new(image.width, &weights);
        let sin_cos = [rotation.sin(), rotation.cos()];
        let irradiance = Irradiance::of(image, intensity, sin_cos);
        let cosine_share = cosine_share(image);
        Some(Self {
            kind: Kind::Image { image: Arc::clone(image), intensity, sin_cos, distribution, cosine_share },
            irradiance,
        })
    }

    /// Radiance that arrives from the unit direction `w`.
    pub(crate) fn radiance(&self, w: Vec3) -> Vec3 {
        match &self.kind {
            Kind::Constant(radiance) => *radiance,
            Kind::Image { image, intensity, sin_cos, .. } => {
                *intensity * image.lookup(uv_from_direction(turned(w, [-sin_cos[0], sin_cos[1]])))
            }
        }
    }

    /// Draws a direction for a surface with this normal.
    pub(crate) fn sample(&self, normal: Vec3, u: [f32; 2]) -> Option<LightSample> {
        let around_normal = |u: [f32; 2]| Frame::new(normal).world_from_local(cosine_hemisphere(u));
        let wi = match &self.kind {
            Kind::Constant(_) => around_normal(u),
            // The number that chose between the two is stretched and used again.
            Kind::Image { cosine_share, .. } if u[0] < *cosine_share => {
                around_normal([u[0] / cosine_share, u[1]])
            }
            Kind::Image { sin_cos, distribution, cosine_share, .. } => {
                let (uv, _) = distribution.sample([(u[0] - cosine_share) / (1.0 - cosine_share), u[1]]);
                turned(direction_from_uv(uv), *sin_cos)
            }
        };
        let pdf = self.pdf(normal, wi);
        (pdf > 0.0).then(|| LightSample { wi, distance: f32::INFINITY, radiance: self.radiance(wi), pdf })
    }

    /// Density with which [`Self::sample`] draws `wi`.
    pub(crate) fn pdf(&self, normal: Vec3, wi: Vec3) -> f32 {
        let cosine = wi.dot(normal).max(0.0) * std::f32::consts::FRAC_1_PI;
        match &self.kind {
            Kind::Constant(_) => cosine,
            Kind::Image { sin_cos, distribution, cosine_share, .. } => {
                let uv = uv_from_direction(turned(wi, [-sin_cos[0], sin_cos[1]]));
                cosine_share * cosine + (1.0 - cosine_share) * distribution.pdf(uv) * sphere_density(wi)
            }
        }
    }

    /// Irradiance on an unshadowed surface with this normal, roughly, for choosing among lights.
    ///
    /// Light from below the horizon is left to the directions that materials draw.
    pub(crate) fn importance(&self, receiver: &Receiver) -> f32 {
        self.irradiance.at(receiver.normal)
    }
}

/// How often to draw around the normal instead of from the picture.
///
/// With `V = mean(L^2) / mean(L)^2` over the sphere, the second moment of the estimate is about `V` for cosine-weighted
/// directions, and 8/3 for directions drawn from an even picture, half of which lie below the horizon.
fn cosine_share(image: &EnvironmentImage) -> f32 {
    let (mut mean, mut square, mut area) = (0.0, 0.0, 0.0);
    for (k, pixel) in image.pixels.iter().enumerate() {
        let sine = (std::f32::consts::PI * ((k / image.width) as f32 + 0.5) / image.height as f32).sin();
        let l = luminance(*pixel);
        (mean, square, area) = (mean + sine * l, square + sine * l * l, area + sine);
    }
    let ratio = 8.0 / 3.0 * (mean * mean) / (square * area);
    ratio * ratio / (1.0 + ratio * ratio)
}

/// Luminance of each cell of the picture, averaged with its neighbours, times sin(theta).
///
/// Bilinear lookup spreads a pixel into its neighbours' cells, so their weight must not be 0 where it does.
fn cell_weights(image: &EnvironmentImage) -> Vec<f64> {
    let (width, height) = image.size();
    let at = |x: usize, y: usize| f64::from(luminance(image.pixels[y * width + x]));
    let tap = |x: usize, y: usize| {
        0.25 * at((x + width - 1) % width, y) + 0.5 * at(x, y) + 0.25 * at((x + 1) % width, y)
    };
    let cell = |k: usize| {
        let (x, y) = (k % width, k / width);
        let sum =
            0.25 * tap(x, y.saturating_sub(1)) + 0.5 * tap(x, y) + 0.25 * tap(x, (y + 1).min(height - 1));
        sum * (std::f64::consts::PI * (y as f64 + 0.5) / height as f64).sin()
    };
    (0..width * height).map(cell).collect()
}

/// Solid-angle density, in a direction, of a unit density over the square.
fn sphere_density(w: Vec3) -> f32 {
    // At the poles the density is unbounded; f32 directions do not come closer than this.
    let sine = w.x.hypot(w.z).max(1e-7);
    1.0 / (2.0 * std::f32::consts::PI * std::f32::consts::PI * sine)
}

pub(super) fn direction_from_uv([u, v]: [f32; 2]) -> Vec3 {
    let (phi, theta) = (std::f32::consts::TAU * (u - 0.5), std::f32::consts::PI * v);
    Vec3::new(theta.sin() * phi.sin(), theta.cos(), -theta.sin() * phi.cos())
}

fn uv_from_direction(w: Vec3) -> [f32; 2] {
    let u = 0.5 + w.x.atan2(-w.z) * (0.5 * std::f32::consts::FRAC_1_PI);
    [u, w.y.clamp(-1.0, 1.0).acos() * std::f32::consts::FRAC_1_PI]
}

/// Turns about +Y; a quarter turn takes -Z to -X.
pub(super) fn turned(w: Vec3, [sine, cosine]: [f32; 2]) -> Vec3 {
    Vec3::new(cosine * w.x + sine * w.z, w.y, cosine * w.z - sine * w.x)
}

#[cfg(test)]
mod tests {
    use super::super::Sees;
    use super::*;
    use crate::sampler::{Sampler, SamplerKind};

    fn spotted() -> Environment {
        let image = EnvironmentImage::from_fn(32, 16, |w| {
            Vec3::splat(if w.dot(Vec3::new(0.6, 0.0, 0.8)) > 0.95 { 50.0 } else { 0.1 + w.y.max(0.0) })
        });
        Environment::Image { image: Arc::new(image), intensity: 2.0, rotation: 1.0 }
    }

    #[test]
    fn directions_round_trip() {
        for w in [Vec3::X, Vec3::NEG_Z, Vec3::new(0.48, 0.6, -0.64), Vec3::new(-0.48, -0.6, 0.64)] {
            let back = direction_from_uv(uv_from_direction(w));
            assert!((back - w).length() < 1e-6, "{w} {back}");
        }
        assert!((turned(Vec3::NEG_Z, [1.0, 0.0]) - Vec3::NEG_X).length() < 1e-6);
    }

    #[test]
    fn samples_follow_the_density() {
        let environment = EnvironmentSampler::new(&spotted()).unwrap();
        const CELLS: (usize, usize) = (8, 16);
        const COUNT: u32 = 100_000;
        #[allow(clippy::cast_possible_truncation, clippy::cast_sign_loss, reason = "cells of a small grid")]
        let cell = |w: Vec3| {
            let row = (((w.y + 1.0) * 0.5 * CELLS.0 as f32) as usize).min(CELLS.0 - 1);
            let turn = w.z.atan2(w.x) / std::f32::consts::TAU;
            row * CELLS.1 + (((turn - turn.floor()) * CELLS.1 as f32) as usize).min(CELLS.1 - 1)
        };
        let mut observed = vec![0.0; CELLS.0 * CELLS.1];
        for i in 0..COUNT {
            let u = Sampler::new(SamplerKind::Independent, 3, 0, i).next_2d();
            let sample = environment.sample(Vec3::Y, u).unwrap();
            let pdf = environment.pdf(Vec3::Y, sample.wi);
            // A direction on a cell border may round into the next cell on the way back, but rarely.
            observed[cell(sample.wi)] += 1.0;
            assert!(pdf > 0.0);
        }
        let mut expected = vec![0.0; observed.len()];
        const FINE: usize = 1000;
        for k in 0..FINE * FINE {
            let y = 2.0 * ((k / FINE) as f32 + 0.5) / FINE as f32 - 1.0;
            let phi = std::f32::consts::TAU * ((k % FINE) as f32 + 0.5) / FINE as f32;
            let r = (1.0 - y * y).sqrt();
            let w = Vec3::new(r * phi.cos(), y, r * phi.sin());
            let area = 4.0 * std::f64::consts::PI / (FINE * FINE) as f64;
            expected[cell(w)] += f64::from(environment.pdf(Vec3::Y, w)) * area * f64::from(COUNT);
        }
        let p = osculate_sbtf::chi_square::p_value(&observed, &expected);
        assert!(p > 1e-4, "{p}");
    }

    /// Rings around the bright pole, each one row of the picture wide, so that the density is even within them but for the
    /// Jacobian of latitude and longitude, which goes from 1 to 25 times its value at the equator here.
    #[test]
    fn samples_at_a_pole_follow_the_density() {
        use std::f64::consts::{PI, TAU};
        const ROWS: usize = 64;
        const RINGS: usize = 12;
        const COUNT: u32 = 100_000;
        let image = EnvironmentImage::from_fn(32, ROWS, |w| Vec3::splat(if w.y > 0.85 { 10.0 } else { 0.1 }));
        let environment = Environment::Image { image: Arc::new(image), intensity: 1.0, rotation: 0.3 };
        let environment = EnvironmentSampler::new(&environment).unwrap();
        // Across the axis, so that few of the directions around the pole come from the cosine.
        let normal = Vec3::X;
        #[allow(clippy::cast_possible_truncation, clippy::cast_sign_loss, reason = "rings of a small grid")]
        let ring = |w: Vec3| {
            let theta = f64::from(w.x.hypot(w.z)).atan2(f64::from(w.y));
            ((theta / PI * ROWS as f64) as usize).min(RINGS)
        };
        let mut observed = [0.0; RINGS + 1];
        for i in 0..COUNT {
            let u = Sampler::new(SamplerKind::Independent, 5, 0, i).next_2d();
            let drawn = environment.sample(normal, u);
            observed[drawn.map_or(RINGS, |sample| ring(sample.wi))] += 1.0;
        }
        let mut expected = [0.0; RINGS + 1];
        const FINE: [usize; 2] = [RINGS * 20, 400];
        let steps = [PI * RINGS as f64 / ROWS as f64 / FINE[0] as f64, TAU / FINE[1] as f64];
        for k in 0..FINE[0] * FINE[1] {
            let theta = steps[0] * ((k / FINE[1]) as f64 + 0.5);
            let phi = steps[1] * ((k % FINE[1]) as f64 + 0.5);
            let w = glam::DVec3::new(theta.sin() * phi.cos(), theta.cos(), theta.sin() * phi.sin());
            let solid_angle = theta.sin() * steps[0] * steps[1];
            let pdf = f64::from(environment.pdf(normal, w.as_vec3()));
            expected[k / FINE[1] / 20] += pdf * solid_angle * f64::from(COUNT);
        }
        expected[RINGS] = f64::from(COUNT) - expected[..RINGS].iter().sum::<f64>();
        let p = osculate_sbtf::chi_square::p_value(&observed, &expected);
        assert!(p > 1e-4, "{p}");
    }

    /// Drawn in proportion to the light, a direction's density does not depend on how small its ring is.
    #[test]
    fn density_per_solid_angle_is_even_under_even_light() {
        const ROWS: u16 = 64;
        let image = EnvironmentImage::from_fn(32, ROWS.into(), |_| Vec3::ONE);
        let environment = Environment::Image { image: Arc::new(image), intensity: 1.0, rotation: 0.3 };
        let environment = EnvironmentSampler::new(&environment).unwrap();
        // Seen from below, so that the cosine has no part in it.
        let pdf = |row: u16| {
            let w = direction_from_uv([0.4, (f32::from(row) + 0.5) / f32::from(ROWS)]);
            environment.pdf(Vec3::NEG_Y, w)
        };
        for row in 0..ROWS / 2 {
            let ratio = pdf(row) / pdf(ROWS / 2 - 1);
            // Weights are exact in the middle of a row; what is left is the rounding of f32 directions near the pole.
            assert!((ratio - 1.0).abs() < 1e-3, "row {row}: {ratio} of the density at the equator");
        }
    }

    #[test]
    fn irradiance_has_closed_forms() {
        // Radiance 1 + c.w lights a surface with pi + 2 pi / 3 c.n, which two orders represent exactly.
        let along = Vec3::new(0.3, -0.5, 0.4);
        let image = EnvironmentImage::from_fn(128, 64, |w| Vec3::splat(1.0 + along.dot(w)));
        let environment = Environment::Image { image: Arc::new(image), intensity: 3.0, rotation: 0.0 };
        let sampler = EnvironmentSampler::new(&environment).unwrap();
        for n in [Vec3::X, Vec3::Y, Vec3::NEG_Z, Vec3::new(0.6, 0.64, 0.48)] {
            let expected = 3.0 * (std::f32::consts::PI + std::f32::consts::TAU / 3.0 * along.dot(n));
            let found =
                sampler.importance(&Receiver { origin: Vec3::ZERO, normal: n, sees: Sees::Hemisphere });
            assert!((found / expected - 1.0).abs() < 2e-3, "{n}: {found} instead of {expected}");
        }
    }
}

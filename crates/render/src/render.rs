//! [`render`]: passes over the image, tile by tile, until a rule says stop.

use std::ops::{ControlFlow, Range};
use std::time::{Duration, Instant};

use glam::{Mat3, Vec3};
use rayon::prelude::*;

use crate::camera::{Camera, CameraRay};
use crate::counters::Counters;
use crate::effects::Effects;
use crate::film::{Film, PixelSum};
use crate::integrator::radiance;
use crate::lighting::{PathLimits, Strategy};
use crate::plan::plan;
use crate::prepared::{Prepared, SceneError};
use crate::present::{Simulated, check, check_forced};
use crate::sampler::{Sampler, SamplerKind};
use crate::scene::Scene;
use crate::schedule::{Order, Schedule, TILE, Tile};
use crate::wavefront::{Path, trace};

/// When to stop.
#[derive(Debug, Clone, Copy, PartialEq)]
pub enum StopRule {
    /// After this many samples per pixel.
    Samples(u32),
    /// When [`Film::noise`] is below this, or after `most` samples in every pixel. Tiles get samples by their share in the noise.
    Noise {
        /// Relative root mean square error.
        target: f64,
        /// Bound on the samples per pixel.
        most: u32,
    },
    /// Before this much time has passed, but after one pass. Tiles get samples by their share in the noise. The only rule whose result
    /// depends on the machine.
    Time(Duration),
}

/// How many paths go side by side.
#[derive(Debug, Clone, Copy, PartialEq, Eq)]
pub enum Queries {
    /// So many paths side by side, at least one: rays that go much the same way are traced together, and all that is asked of a material with
    /// silhouettes at a stage is one batch. The number changes no bit of the picture.
    Batched {
        /// Paths of a thread that are traced side by side.
        paths: u32,
    },
    /// One path after the other, query by query: to compare with. A model's single answers differ from its batched ones by the order of
    /// sums, see [`osculate_sbtf::SilhouetteBtf::alpha_batch`].
    Single,
}

impl Default for Queries {
    /// 1024 paths side by side: fewer leave blocks of queries half empty after a few bounces, more leave the second-level cache.
    fn default() -> Self {
        Self::Batched { paths: 1024 }
    }
}

/// What to compute.
#[derive(Debug, Clone, Copy, PartialEq)]
pub struct RenderOptions {
    /// When to stop. Default: 64 samples per pixel.
    pub stop: StopRule,
    /// Most surfaces on a path; 1 is direct light only. Default: 8.
    pub max_depth: u32,
    /// Where all random choices come from. Default: 0.
    pub seed: u64,
    /// Which points are used. Default: Sobol.
    pub sampler: SamplerKind,
    /// How light is gathered. Default: combined.
    pub strategy: Strategy,
    /// How materials with silhouettes are asked. Default: in batches.
    pub queries: Queries,
    /// Effects to simulate instead of the planned ones, to check that planning changes nothing; materials with silhouettes are then
    /// asked everything everywhere.
    pub force: Option<Effects>,
}

impl Default for RenderOptions {
    fn default() -> Self {
        Self {
            stop: StopRule::Samples(64),
            max_depth: 8,
            seed: 0,
            sampler: SamplerKind::default(),
            strategy: Strategy::default(),
            queries: Queries::default(),
            force: None,
        }
    }
}

/// How far a render has come.
#[derive(Debug, Clone, Copy, PartialEq)]
pub struct Progress {
    /// Samples per pixel so far, in the mean.
    pub samples: f64,
    /// Share of the work that is done, in `[0, 1]`; an estimate unless the rule counts samples.
    pub fraction: f64,
    /// [`Film::noise`].
    pub noise: Option<f64>,
    /// Time since the start.
    pub elapsed: Duration,
}

/// A rendered picture and what it took.
#[derive(Debug, Clone)]
pub struct Rendering {
    /// The picture.
    pub film: Film,
    /// Samples per pixel, in the mean.
    pub samples: f64,
    /// Least and most samples of a pixel.
    pub samples_range: [u32; 2],
    /// What was done.
    pub counters: Counters,
    /// Effects that were simulated.
    pub effects: Effects,
    /// Time to prepare the scene: hierarchy, textures, tables.
    pub preparation: Duration,
    /// Time to trace.
    pub tracing: Duration,
}

/// Renders a scene on the current rayon pool.
///
/// The same scene and options give the same bits on any number of threads, except with [`StopRule::Time`], which may
/// stop after more or fewer passes. `progress` is called after every pass; breaking ends the render with what there is.
///
/// # Errors
///
/// A scene that cannot be rendered.
pub fn render(
    scene: &Scene,
    options: &RenderOptions,
    progress: &mut dyn FnMut(&Progress) -> ControlFlow<()>,
) -> Result<Rendering, SceneError> {
    let start = Instant::now();
    let (prepared, effects) = prepare(scene, options)?;
    let preparation = start.elapsed();
    let pass = Pass { scene, camera: &scene.camera, prepared: &prepared, options, effects };
    Ok(pass.render(preparation, progress))
}

/// The scene as it is traced, and the effects that are simulated.
fn prepare(scene: &Scene, options: &RenderOptions) -> Result<(Prepared, Effects), SceneError> {
    let (width, height) = (scene.width, scene.height);
    if !(1..=32768).contains(&width) || !(1..=32768).contains(&height) {
        return Err(SceneError::ImageSize { width, height });
    }
    if let Some(forced) = options.force {
        check_forced()?;
        let mut prepared = Prepared::new(scene)?;
        prepared.tell_all();
        return Ok((prepared, forced));
    }
    let plan = plan(scene, options.max_depth);
    check(&plan)?;
    Ok((Prepared::new(scene)?, plan.effects()))
}

/// A picture of a sequence: where it is seen from, and how the light has turned.
#[derive(Debug, Clone, Copy, PartialEq)]
pub struct Frame {
    /// In the place of the scene's.
    pub camera: Camera,
    /// Angle in radians by which directional lights have turned about +Y. Other lights stay.
    pub light_turn: f32,
    /// Where its random choices come from, in the place of the options'.
    pub seed: u64,
}

/// Renders several pictures of a scene that is prepared once. The first one's preparation is that of all, the others' is
/// zero. `tick` is called after every picture.
///
/// # Errors
///
/// A scene that cannot be rendered.
pub fn render_frames(
    scene: &Scene,
    frames: &[Frame],
    options: &RenderOptions,
    tick: &mut dyn FnMut(),
) -> Result<Vec<Rendering>, SceneError> {
    let start = Instant::now();
    let (mut prepared, effects) = prepare(scene, options)?;
    let mut frames_done = Vec::with_capacity(frames.len());
    let towards: Vec<Vec3> = prepared.suns.iter().map(|sun| sun.wi).collect();
    let mut preparation = start.elapsed();
    for frame in frames {
        let turn = Mat3::from_rotation_y(frame.light_turn);
        for (sun, wi) in prepared.suns.iter_mut().zip(&towards) {
            sun.wi = turn * *wi;
        }
        let pass = Pass {
            scene,
            camera: &frame.camera,
            prepared: &prepared,
            options: &RenderOptions { seed: frame.seed, ..*options },
            effects,
        };
        frames_done.push(pass.render(preparation, &mut |_| ControlFlow::Continue(())));
        preparation = Duration::ZERO;
        tick();
    }
    Ok(frames_done)
}

fn fraction(stop: StopRule, done: f64, noise: Option<f64>, elapsed: Duration) -> f64 {
    match stop {
        StopRule::Samples(total) => done / f64::from(total),
        // The error falls with the root of the number of samples.
        StopRule::Noise { target, most } => {
            let by_noise = noise.map_or(0.0, |noise| (target / noise).powi(2));
            by_noise.max(done / f64::from(most)).min(1.0)
        }
        StopRule::Time(limit) => (elapsed.as_secs_f64() / limit.as_secs_f64()).min(1.0),
    }
}

struct Pass<'a> {
    scene: &'a Scene,
    camera: &'a Camera,
    prepared: &'a Prepared,
    options: &'a RenderOptions,
    effects: Effects,
}

impl Pass<'_> {
    /// Passes until the rule says stop, or `progress`.
    fn render(
        &self,
        preparation: Duration,
        progress: &mut dyn FnMut(&Progress) -> ControlFlow<()>,
    ) -> Rendering {
        let (stop, effects) = (self.options.stop, self.effects);
        let mut film = Film::new(self.scene.width, self.scene.height);
        let mut schedule = Schedule::new(self.scene.width, self.scene.height, stop);
        let mut counters = Counters::default();
        let tracing = Instant::now();
        loop {
            let orders = schedule.next(&film, tracing.elapsed());
            if orders.is_empty() {
                break;
            }
            counters += self.run(&mut film, &mut schedule, &orders);
            let (samples, noise, elapsed) = (schedule.samples(), film.noise(), tracing.elapsed());
            let fraction = fraction(stop, samples, noise, elapsed);
            if progress(&Progress { samples, fraction, noise, elapsed }).is_break() {
                break;
            }
        }
        let (samples, samples_range) = (schedule.samples(), schedule.range());
        let tracing = tracing.elapsed();
        Rendering { film, samples, samples_range, counters, effects, preparation, tracing }
    }

    /// Carries out orders.
    fn run(&self, film: &mut Film, schedule: &mut Schedule, orders: &[Order]) -> Counters {
        // Each tile is summed on its own and merged in order, so threads do not change the result.
        let tiles: Vec<(Vec<PixelSum>, Counters)> = orders
            .par_iter()
            .map(|order| self.tile(schedule.tile(order.tile), order.first, order.count))
            .collect();
        let mut counters = Counters::default();
        for ((sums, counted), order) in tiles.iter().zip(orders) {
            let Tile { corner: [x, y], size: [width, _] } = schedule.tile(order.tile);
            for (row, line) in (y..).zip(sums.chunks(width as usize)) {
                film.merge_row(x, row, line);
            }
            schedule.note(*order, counted);
            counters += *counted;
        }
        counters
    }

    fn tile(&self, tile: Tile, first: u32, count: u32) -> (Vec<PixelSum>, Counters) {
        let mut counters = Counters::default();
        let mut sums = Vec::with_capacity((TILE * TILE) as usize);
        let pixels = tile.pixels();
        let indices = first..first + count;
        match self.options.queries {
            Queries::Batched { paths } => {
                let values = self.side_by_side(pixels, indices.clone(), paths.max(1) as usize, &mut counters);
                let sum = |values: &[Vec3]| PixelSum::of(indices.clone().zip(values.iter().copied()));
                sums.extend(values.chunks(count as usize).map(sum));
            }
            Queries::Single => sums.extend(pixels.map(|pixel| {
                PixelSum::of(indices.clone().map(|index| (index, self.sample(pixel, index, &mut counters))))
            })),
        }
        (sums, counters)
    }

    /// The values of samples, so many at a time: of every pixel those with these indices.
    fn side_by_side(
        &self,
        pixels: impl Iterator<Item = [u32; 2]>,
        indices: Range<u32>,
        at_a_time: usize,
        counters: &mut Counters,
    ) -> Vec<Vec3> {
        let mut values = Vec::with_capacity((TILE * TILE) as usize * indices.len());
        let mut paths = Vec::with_capacity(at_a_time.min(values.capacity()));
        let mut finish = |paths: &mut Vec<Path>, counters: &mut Counters| {
            trace(self.prepared, self.simulated(), self.limits(), paths, counters);
            values.extend(paths.drain(..).map(|path| finite(path.radiance(), counters)));
        };
        for pixel in pixels {
            let mut indices = indices.clone();
            while !indices.is_empty() {
                let room = at_a_time - paths.len();
                let these = indices.by_ref().take(room);
                if self.is_blurred() {
                    paths.extend(these.map(|index| self.path::<true>(pixel, index, counters)));
                } else {
                    paths.extend(these.map(|index| self.path::<false>(pixel, index, counters)));
                }
                if paths.len() == at_a_time {
                    finish(&mut paths, counters);
                }
            }
        }
        finish(&mut paths, counters);
        values
    }

    #[inline(always)]
    fn path<const BLURRED: bool>(&self, pixel: [u32; 2], index: u32, counters: &mut Counters) -> Path {
        let (ray, sampler) = self.camera_ray::<BLURRED>(pixel, index, counters);
        Path::new(ray, sampler)
    }

    /// The value of a sample on its own.
    fn sample(&self, pixel: [u32; 2], index: u32, counters: &mut Counters) -> Vec3 {
        let (ray, mut sampler) = if self.is_blurred() {
            self.camera_ray::<true>(pixel, index, counters)
        } else {
            self.camera_ray::<false>(pixel, index, counters)
        };
        let value = radiance(self.prepared, self.simulated(), self.limits(), ray, &mut sampler, counters);
        finite(value, counters)
    }

    fn simulated(&self) -> Simulated {
        Simulated::new(self.effects)
    }

    fn limits(&self) -> PathLimits {
        PathLimits { max_depth: self.options.max_depth, strategy: self.options.strategy }
    }

    /// Whether rays come from all over a lens.
    fn is_blurred(&self) -> bool {
        self.simulated().depth_of_field() && self.camera.has_depth_of_field()
    }

    /// Where a sample looks, and its numbers for the path.
    #[inline(always)]
    fn camera_ray<const BLURRED: bool>(
        &self,
        [x, y]: [u32; 2],
        index: u32,
        counters: &mut Counters,
    ) -> (CameraRay, Sampler) {
        let pixel = u64::from(y) * u64::from(self.scene.width) + u64::from(x);
        let stream = 2 * pixel + u64::from(index & 1);
        let mut sampler = Sampler::new(self.options.sampler, self.options.seed, stream, index >> 1);
        let [dx, dy] = sampler.next_2d().map(tent);
        let (px, py) = (x as f32 + 0.5 + dx, y as f32 + 0.5 + dy);
        let (width, height) = (self.scene.width as f32, self.scene.height as f32);
        let ray = if BLURRED {
            counters.lens_samples += 1;
            self.camera.lens_ray(px, py, width, height, sampler.next_2d())
        } else {
            self.camera.pinhole_ray(px, py, width, height)
        };
        (ray, sampler)
    }
}

/// A sample's value, counted; black where it is not finite.
fn finite(value: Vec3, counters: &mut Counters) -> Vec3 {
    counters.samples += 1;
    if value.is_finite() {
        return value;
    }
    counters.discarded_samples += 1;
    Vec3::ZERO
}

/// Turns a uniform number into one distributed as a tent on `[-1, 1]`: the pixel filter, sampled instead of weighted.
fn tent(u: f32) -> f32 {
    if u < 0.5 { (2.0 * u).sqrt() - 1.0 } else { 1.0 - (2.0 - 2.0 * u).sqrt() }
}

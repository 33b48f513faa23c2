//! [`PatchDataset`]: training samples made on the fly.

use std::sync::Arc;

use glam::{Vec2, Vec3};
use rayon::prelude::*;

use super::dataset_options::{DatasetError, DatasetOptions, Silhouettes, Tracing};
use super::distribution::{self, KappaDistribution};
use super::field_tracer::FieldTracer;
use super::pool::PatchPool;
use super::{
    GrazingOptions, MeshTracer, OpacityStudy, Patch, PatchSample, TileOptions, TileSurface, Transport,
};
use crate::micro::{Geometry, Microstructure};
use crate::model::TextureShape;
use crate::query::Query;
use crate::random::Random;
use crate::samples::{AppearanceBatch, Features, OpacityBatch, SampleSource};

/// Samples of a microstructure on patches.
#[derive(Debug)]
pub struct PatchDataset {
    options: DatasetOptions,
    kappas: KappaDistribution,
    depth: f32,
    transport: Transport,
    tracer: Tracer,
    /// Of tile meshes, and of height fields where they are asked for.
    triangles: Option<Triangles>,
}

/// What rays are traced through that do without patches, each bent for its own curvature.
#[derive(Debug)]
enum Tracer {
    Field(FieldTracer),
    Mesh(MeshTracer),
}

#[derive(Debug)]
struct Triangles {
    tile: Arc<TileSurface>,
    pool: PatchPool,
}

/// Streams of random numbers.
#[derive(Clone, Copy)]
enum Stream {
    Opacity = 1,
    Appearance = 2,
    Patch = 3,
    Study = 4,
    Features = 5,
}

/// Rows that one task makes.
const ROWS_AT_ONCE: usize = 1024;

/// Rays that are tried for one sample of the appearance.
const MOST_TRIES: u32 = 4096;

impl PatchDataset {
    /// Prepares a microstructure: triangulates it and measures what the sampling needs.
    ///
    /// # Errors
    ///
    /// Where the options contradict themselves, or the material cannot be hit.
    pub fn new(micro: &Microstructure, options: DatasetOptions) -> Result<Self, DatasetError> {
        options.check()?;
        let (tracer, is_field) = match &micro.geometry {
            Geometry::HeightField(field) => {
                (Tracer::Field(FieldTracer::new(field, options.tile.shading)), true)
            }
            Geometry::TileMesh(mesh) => (Tracer::Mesh(MeshTracer::new(mesh, &options.tile)), false),
        };
        let traced = !is_field || options.tracing == Tracing::Triangles;
        let dataset = Self {
            kappas: KappaDistribution::new(options.kappa_range),
            depth: micro.geometry.depth(),
            transport: Transport::new(options.transport),
            tracer,
            triangles: traced.then(|| Triangles::new(micro, &options)),
            options,
        };
        dataset.check_hits(&micro.name)?;
        Ok(dataset)
    }

    /// The triangles that samples come from; `None` where rays march.
    #[must_use]
    pub fn tile(&self) -> Option<&TileSurface> {
        self.triangles.as_ref().map(|triangles| &*triangles.tile)
    }

    /// How many of some queries have a silhouette cosine, by tracing, over patches of the dataset: which opacity head suits. All have
    /// in height fields, and nothing is traced.
    #[must_use]
    pub fn study_opacity(&self, queries: u32, options: &GrazingOptions) -> OpacityStudy {
        let (Tracer::Mesh(_), Some(triangles)) = (&self.tracer, &self.triangles) else {
            return OpacityStudy { queries, not_steps: 0 };
        };
        let patches = self.patches(triangles, 0);
        let is_step = |i: u32| {
            let mut random = Random::new(self.options.seed, Stream::Study as u64, u64::from(i));
            let uv = Vec2::new(random.unit(), random.unit());
            let patch = &patches[i as usize % patches.len()];
            let (_, along) = patch_query(patch, &mut random);
            patch.silhouette_cosine(uv, along, options).is_some()
        };
        let steps = (0..queries).into_par_iter().map(|i| u32::from(is_step(i))).sum::<u32>();
        OpacityStudy { queries, not_steps: queries - steps }
    }

    /// Height fields are closed.
    fn check_hits(&self, name: &str) -> Result<(), DatasetError> {
        const TRIES: u32 = 1024;
        let (Tracer::Mesh(_), Some(triangles)) = (&self.tracer, &self.triangles) else { return Ok(()) };
        let patch = Patch::new(triangles.tile.clone(), self.options.kappa_range[1], 0.0);
        let mut random = Random::new(self.options.seed, 0, 0);
        let mut uv = || Vec2::new(random.unit(), random.unit());
        let hit = (0..TRIES).any(|_| patch.hits(uv(), Vec3::Z));
        if hit { Ok(()) } else { Err(DatasetError::NothingToHit { name: name.to_owned(), tries: TRIES }) }
    }

    /// Numbers of the patches of a batch.
    fn numbers(&self, index: u64) -> impl Iterator<Item = u64> + use<'_> {
        let patches = self.options.patches;
        (0..self.options.patches_per_batch).map(move |k| patches.map_or(index + k, |n| (index + k) % n))
    }

    /// Curvature of a patch, and the angle of the direction across its axis.
    fn cylinder(&self, random: &mut Random) -> (f32, f32) {
        (self.kappas.sample(random), std::f32::consts::TAU * random.unit())
    }

    fn numbered_cylinder(&self, number: u64) -> (f32, f32) {
        self.cylinder(&mut Random::new(self.options.seed, Stream::Patch as u64, number))
    }

    /// The patches of a batch. They are made before the rows are, so that no row waits for another.
    fn patches(&self, triangles: &Triangles, index: u64) -> Vec<Arc<Patch>> {
        let make = |number: u64| {
            triangles.pool.get(number, || {
                let (kappa, rotation) = self.numbered_cylinder(number);
                Patch::new(triangles.tile.clone(), kappa, rotation)
            })
        };
        self.numbers(index).map(make).collect()
    }

    /// Where the rows of a batch of the appearance are traced.
    fn places(&self, index: u64) -> Places {
        match &self.triangles {
            Some(triangles) if self.options.tracing == Tracing::Triangles => {
                Places::Patches(self.patches(triangles, index))
            }
            _ if self.options.patches.is_some() => {
                Places::Cylinders(self.numbers(index).map(|number| self.numbered_cylinder(number)).collect())
            }
            _ => Places::Anywhere,
        }
    }

    fn opacity_sample(&self, patch: Option<&Patch>, random: &mut Random) -> OpacitySample {
        let uv = Vec2::new(random.unit(), random.unit());
        let (kappa, along) = match patch {
            Some(patch) => patch_query(patch, random),
            None => {
                let (kappa, angle) = self.cylinder(random);
                (kappa, Vec2::from_angle(angle))
            }
        };
        let silhouette = match (&self.tracer, patch, self.options.silhouettes) {
            (Tracer::Field(field), ..) => Some(field.sweep.silhouette_cosine(uv, along, kappa)),
            (_, Some(patch), Silhouettes::Traced(options)) => patch.silhouette_cosine(uv, along, &options),
            _ => None,
        };
        let cos_o = match &self.tracer {
            Tracer::Field(_) => distribution::opacity_cosine(silhouette, kappa, self.depth, random),
            Tracer::Mesh(_) => {
                distribution::see_through_cosine(self.options.grazing, kappa, self.depth, random)
            }
        };
        let wo = viewer(along, cos_o);
        let opaque = match (&self.tracer, patch) {
            (_, Some(patch)) => patch.hits(uv, wo),
            (Tracer::Field(_), None) => silhouette.is_some_and(|cosine| cos_o >= cosine),
            (Tracer::Mesh(mesh), None) => mesh.hits(uv, wo, kappa),
        };
        OpacitySample {
            uv,
            wo,
            kappa,
            silhouette: silhouette.unwrap_or(f32::NAN),
            alpha: f32::from(u8::from(opaque)),
        }
    }

    fn appearance_sample(&self, place: Place, random: &mut Random) -> AppearanceSample {
        let mut last = None;
        for _ in 0..MOST_TRIES {
            let uv = Vec2::new(random.unit(), random.unit());
            let (kappa, along) = match place {
                Place::Patch(patch) => patch_query(patch, random),
                Place::Cylinder(kappa, angle) => (kappa, Vec2::from_angle(angle) * either_way(random)),
                Place::Anywhere => {
                    let (kappa, angle) = self.cylinder(random);
                    (kappa, Vec2::from_angle(angle))
                }
            };
            let wo = viewer(along, distribution::appearance_cosine(random));
            let query = Query { uv, wo, wi: distribution::light(wo, random), kappa_hat: kappa };
            let found = self.trace(place, &query, random);
            let PatchSample { offset, rgb } =
                found.unwrap_or(PatchSample { offset: Vec2::ZERO, rgb: Vec3::ZERO });
            let sample = AppearanceSample { query, offset, rgb };
            if found.is_some() {
                return sample;
            }
            last = Some(sample);
        }
        // One ray in a thousand hits a material that passed the check, so that this happens to one sample in 60 at worst.
        last.expect("at least one try")
    }

    fn trace(&self, place: Place, query: &Query, random: &mut Random) -> Option<PatchSample> {
        match (place, &self.tracer) {
            (Place::Patch(patch), _) => patch.sample(&self.transport, query.uv, query.wo, query.wi, random),
            (_, Tracer::Field(field)) => field.sample(&self.transport, query, 1, random),
            (_, Tracer::Mesh(mesh)) => mesh.sample(&self.transport, query, 1, random),
        }
    }
}

impl Triangles {
    fn new(micro: &Microstructure, options: &DatasetOptions) -> Self {
        let [least, most] = options.kappa_range;
        let largest_curvature = least.abs().max(most.abs());
        let tile = Arc::new(TileSurface::new(micro, &TileOptions { largest_curvature, ..options.tile }));
        // Twice what one batch uses, so that a few threads may be at neighbouring batches.
        let kept = 2 * usize::try_from(options.patches_per_batch).unwrap_or(64).min(64) + 2;
        Self { tile, pool: PatchPool::new(kept) }
    }
}

/// Where samples of a batch are traced; the rows are shared out evenly.
enum Places {
    Patches(Vec<Arc<Patch>>),
    Cylinders(Vec<(f32, f32)>),
    Anywhere,
}

impl Places {
    fn of(&self, row: usize, count: usize) -> Place<'_> {
        match self {
            Self::Patches(patches) => Place::Patch(&patches[row * patches.len() / count]),
            Self::Cylinders(cylinders) => {
                let (kappa, angle) = cylinders[row * cylinders.len() / count];
                Place::Cylinder(kappa, angle)
            }
            Self::Anywhere => Place::Anywhere,
        }
    }
}

/// Where a sample is traced.
#[derive(Clone, Copy)]
enum Place<'a> {
    Patch(&'a Patch),
    /// Curvature, and the angle of the direction across the axis.
    Cylinder(f32, f32),
    /// On a cylinder of its own.
    Anywhere,
}

struct OpacitySample {
    uv: Vec2,
    wo: Vec3,
    kappa: f32,
    silhouette: f32,
    alpha: f32,
}

struct AppearanceSample {
    query: Query,
    offset: Vec2,
    rgb: Vec3,
}

/// Curvature of a patch, and one of the two ways across it.
#[allow(clippy::cast_possible_truncation, reason = "it was made from an f32")]
fn patch_query(patch: &Patch, random: &mut Random) -> (f32, Vec2) {
    (patch.kappa() as f32, patch.across().as_vec2() * either_way(random))
}

fn either_way(random: &mut Random) -> f32 {
    if random.unit() < 0.5 { 1.0 } else { -1.0 }
}

/// The direction to a viewer whose rays run along `along`.
fn viewer(along: Vec2, cosine: f32) -> Vec3 {
    ((1.0 - cosine * cosine).max(0.0).sqrt() * -along).extend(cosine)
}

impl SampleSource for PatchDataset {
    fn first_features(&self, which: Features, shape: TextureShape, seed: u64) -> Option<Vec<f32>> {
        let mut random = Random::new(seed, Stream::Features as u64, which as u64);
        match &self.tracer {
            Tracer::Field(field) => Some(field.first_features(which, shape, &mut random)),
            Tracer::Mesh(_) if self.options.tracing == Tracing::Triangles => None,
            Tracer::Mesh(mesh) => Some(mesh.first_features(which, shape, &mut random)),
        }
    }

    fn fill_opacity(&self, index: u64, batch: &mut OpacityBatch) {
        let count = batch.len();
        let Self { options, .. } = self;
        let traced = options.tracing == Tracing::Triangles || options.silhouettes != Silhouettes::Unknown;
        let patches = match (&self.tracer, &self.triangles) {
            (Tracer::Mesh(_), Some(triangles)) if traced => self.patches(triangles, index),
            _ => Vec::new(),
        };
        let sample = |row: usize| {
            let patch = patches.get(row * patches.len() / count);
            let mut random = self.random(Stream::Opacity, index, row);
            self.opacity_sample(patch.map(|p| &**p), &mut random)
        };
        for (first, rows) in chunks(count, sample) {
            for (row, s) in (first..).zip(rows) {
                [batch.uv[0][row], batch.uv[1][row]] = s.uv.to_array();
                [batch.wo[0][row], batch.wo[1][row], batch.wo[2][row]] = s.wo.to_array();
                batch.kappa_hat[row] = s.kappa;
                batch.silhouette_cosine[row] = s.silhouette;
                batch.alpha[row] = s.alpha;
            }
        }
    }

    fn fill_appearance(&self, index: u64, batch: &mut AppearanceBatch) {
        let count = batch.len();
        let places = self.places(index);
        let sample = |row: usize| {
            let mut random = self.random(Stream::Appearance, index, row);
            self.appearance_sample(places.of(row, count), &mut random)
        };
        for (first, rows) in chunks(count, sample) {
            for (row, s) in (first..).zip(rows) {
                let Query { uv, wo, wi, kappa_hat } = s.query;
                [batch.uv[0][row], batch.uv[1][row]] = uv.to_array();
                [batch.wo[0][row], batch.wo[1][row], batch.wo[2][row]] = wo.to_array();
                [batch.wi[0][row], batch.wi[1][row], batch.wi[2][row]] = wi.to_array();
                batch.kappa_hat[row] = kappa_hat;
                [batch.offset[0][row], batch.offset[1][row]] = s.offset.to_array();
                [batch.rgb[0][row], batch.rgb[1][row], batch.rgb[2][row]] = s.rgb.to_array();
            }
        }
    }
}

impl PatchDataset {
    fn random(&self, stream: Stream, index: u64, row: usize) -> Random {
        // Rows of one batch are numbered in the low half.
        Random::new(self.options.seed ^ index.rotate_left(32), stream as u64, row as u64)
    }
}

/// Makes rows in parallel; the parts come with the number of their first row.
fn chunks<T: Send>(count: usize, sample: impl Fn(usize) -> T + Sync) -> Vec<(usize, Vec<T>)> {
    let parts: Vec<usize> = (0..count).step_by(ROWS_AT_ONCE).collect();
    parts
        .into_par_iter()
        .map(|first| (first, (first..(first + ROWS_AT_ONCE).min(count)).map(&sample).collect()))
        .collect()
}

#[cfg(test)]
mod tests;

//! What is measured of the filters on one mesh.

use std::hint::black_box;
use std::sync::Arc;
use std::time::Instant;

use anyhow::{Context, Result};
use osculate_geom::Mesh;
use osculate_geom::curvature::{CurvatureOptions, estimate};
use osculate_geom::field::{
    BakedChord, BakedMinimum, CurvatureField, Filter, FilterQuery, SkipBounds, Stop, WalkLength,
    spread_queries,
};
use osculate_geom::mesh::{Surface, Weld};
use osculate_geom::rays::{Bvh, Ray, to_f32};
use rayon::prelude::*;
use serde::Serialize;

/// How much is measured.
#[derive(Debug, Clone, Copy)]
pub struct Effort {
    /// Rays that errors are measured on, and that are timed.
    pub queries: usize,
    /// Times that each filter is timed; the median counts.
    pub runs: usize,
}

/// A mesh to measure on.
#[derive(Debug)]
pub struct Subject {
    /// In a word or two.
    pub name: String,
    /// With UVs or without.
    pub mesh: Mesh,
    /// Depth of the material as a share of the diagonal.
    pub depth_share: f64,
}

/// Results on one mesh.
#[derive(Debug, Clone, Serialize)]
pub struct MeshResult {
    /// The subject's.
    pub name: String,
    /// Of the mesh.
    pub triangles: usize,
    /// Of the bounding box.
    pub diagonal: f64,
    /// Depth of the material that says how far filters look, world units.
    pub depth: f64,
    /// A ray cast against the mesh's triangles, nanoseconds.
    pub ray_nanoseconds: f64,
    /// One per filter and setting.
    pub rows: Vec<Row>,
    /// The chord's exit against a ray cast.
    pub chord: Option<Spread>,
}

/// One filter in one setting on one mesh.
#[derive(Debug, Clone, Serialize)]
pub struct Row {
    /// Name of the filter.
    pub filter: &'static str,
    /// What distinguishes it from others of that name.
    pub setting: String,
    /// Median time of a query over the runs.
    pub nanoseconds: f64,
    /// Lower and upper quartile.
    pub range: [f64; 2],
    /// Against slicing the whole mesh; `None` for the chord, which is another quantity.
    pub error: Option<Spread>,
    /// Share of the queries answered without a walk because of a bound.
    pub skipped: f64,
    /// Triangles that a walk crosses, on average.
    pub crossings: f64,
    /// Time to make what the filter needs, seconds.
    pub preparation: f64,
    /// What it adds to each vertex of a file.
    pub bytes_per_vertex: usize,
}

/// Errors relative to `|kappa| + 1 / diagonal`.
#[derive(Debug, Clone, Copy, Serialize)]
pub struct Spread {
    /// Rays compared.
    pub count: usize,
    /// Half of them are off by at most this.
    pub median: f64,
    /// 99 % of them are.
    pub p99: f64,
    /// The worst.
    pub max: f64,
}

/// Tolerances of skipped walks, times 1 / diagonal.
const TOLERANCES: [f64; 3] = [0.3, 3.0, 30.0];

/// Measures every filter on a mesh.
pub fn measure(subject: &Subject, effort: Effort, tick: &mut dyn FnMut()) -> Result<MeshResult> {
    let mesh = &subject.mesh;
    let surface = Surface::new(mesh, Weld::Exact);
    let curvature = estimate(&surface, &CurvatureOptions::default()).context("estimating")?;
    let field = CurvatureField::new(surface, curvature).with_uv_set(mesh, 0);
    let depth = subject.depth_share * field.diagonal();
    let rule = WalkLength::Shell { depth }.for_table();
    let queries = spread_queries(&field, effort.queries, rule);
    let truth: Vec<Option<f64>> = queries.par_iter().map(|query| slice(&field, query)).collect();
    tick();

    let candidates = candidates(&field, rule);
    let bvh = Bvh::from_mesh(mesh);
    let rays: Vec<Ray> = queries.iter().map(|query| camera_ray(&field, query)).collect();
    let (mut ray_times, mut times) = (Vec::new(), vec![Vec::new(); candidates.len()]);
    // The runs of all filters alternate, so that what else the machine does hits all of them.
    for _ in 0..effort.runs {
        ray_times.push(block_seconds(&rays, |ray| bvh.closest_hit(black_box(ray)).is_some()));
        for (candidate, times) in candidates.iter().zip(&mut times) {
            times.push(block_seconds(&queries, |query| {
                candidate.filter.ask(&field, black_box(query)).is_some()
            }));
        }
    }
    tick();
    let rows = candidates.into_iter().zip(times).map(|(candidate, times)| {
        let mut row = evaluate(&field, &candidate, &queries, &truth);
        (row.nanoseconds, row.range) = median_and_quartiles(&times, queries.len());
        row
    });
    Ok(MeshResult {
        name: subject.name.clone(),
        triangles: mesh.triangles().len(),
        diagonal: field.diagonal(),
        depth,
        rows: rows.collect(),
        ray_nanoseconds: median_and_quartiles(&ray_times, queries.len()).0,
        chord: chord_against_rays(&field, &bvh, &queries, WalkLength::Shell { depth: field.diagonal() }),
    })
}

struct Candidate {
    filter: Filter,
    setting: String,
    preparation: f64,
    bytes_per_vertex: usize,
}

fn candidates(field: &CurvatureField<'_>, rule: WalkLength) -> Vec<Candidate> {
    let plain = |filter| Candidate { filter, setting: String::new(), preparation: 0.0, bytes_per_vertex: 0 };
    let mut all = vec![plain(Filter::Point), plain(Filter::March), plain(Filter::Chord)];
    let start = Instant::now();
    let bounds = Arc::new(SkipBounds::new(field, rule.nominal(field.diagonal())));
    let preparation = start.elapsed().as_secs_f64();
    all.extend(TOLERANCES.map(|tolerance| Candidate {
        filter: Filter::MarchWithin { bounds: bounds.clone(), tolerance: tolerance / field.diagonal() },
        setting: format!("within {tolerance} / diagonal"),
        preparation,
        bytes_per_vertex: size_of::<f32>(),
    }));
    all.extend(BakedMinimum::AZIMUTHS.map(|azimuths| {
        let start = Instant::now();
        let table = Arc::new(BakedMinimum::new(field, azimuths, rule));
        Candidate {
            filter: Filter::Baked(table),
            setting: format!("{azimuths} azimuths"),
            preparation: start.elapsed().as_secs_f64(),
            bytes_per_vertex: azimuths * size_of::<f32>(),
        }
    }));
    let start = Instant::now();
    let table = BakedChord::new(field, BakedChord::AZIMUTHS, rule);
    all.push(Candidate {
        setting: format!("{} azimuths", table.azimuths()),
        preparation: start.elapsed().as_secs_f64(),
        bytes_per_vertex: table.bytes() / field.surface().positions().len().max(1),
        filter: Filter::BakedChord(Arc::new(table)),
    });
    all
}

fn evaluate(
    field: &CurvatureField<'_>,
    candidate: &Candidate,
    queries: &[FilterQuery],
    truth: &[Option<f64>],
) -> Row {
    let (mut errors, mut skipped, mut crossings) = (Vec::new(), 0.0, 0.0);
    for (query, truth) in queries.iter().zip(truth) {
        let Some(answer) = candidate.filter.ask(field, query) else { continue };
        skipped += f64::from(u8::from(answer.stop == Stop::Skipped));
        crossings += f64::from(answer.crossings);
        let truth = match candidate.filter {
            Filter::BakedChord(_) => Filter::Chord.ask(field, query).map(|exact| exact.kappa),
            _ => *truth,
        };
        if let Some(truth) = truth {
            errors.push((answer.kappa - truth).abs() / (truth.abs() + 1.0 / field.diagonal()));
        }
    }
    // There is nothing to hold the chord itself against here; `chord_against_rays` does.
    let has_truth = !matches!(candidate.filter, Filter::Chord);
    let count = queries.len().max(1) as f64;
    Row {
        filter: candidate.filter.kind().name(),
        setting: candidate.setting.clone(),
        nanoseconds: 0.0,
        range: [0.0; 2],
        error: Spread::new(errors).filter(|_| has_truth),
        skipped: skipped / count,
        crossings: crossings / count,
        preparation: candidate.preparation,
        bytes_per_vertex: candidate.bytes_per_vertex,
    }
}

impl Spread {
    fn new(mut errors: Vec<f64>) -> Option<Self> {
        errors.sort_unstable_by(f64::total_cmp);
        let max = *errors.last()?;
        let last = errors.len() - 1;
        Some(Self { count: errors.len(), median: errors[last / 2], p99: errors[last * 99 / 100], max })
    }
}

/// The filtered minimum by slicing the whole mesh.
fn slice(field: &CurvatureField<'_>, query: &FilterQuery) -> Option<f64> {
    let cosine = field_cosine(field, query)?;
    let along = field.kappa_along(query.point, query.w)?;
    field.minimum_by_slicing(query.point, query.w, query.length.resolve(along, cosine, field.diagonal()))
}

/// Cosine between ray and interpolated normal.
fn field_cosine(field: &CurvatureField<'_>, query: &FilterQuery) -> Option<f64> {
    Some(field.unit_normal(query.point)?.dot(&query.w).clamp(0.0, 1.0))
}

/// The ray that a camera far off would send to the point.
fn camera_ray(field: &CurvatureField<'_>, query: &FilterQuery) -> Ray {
    let origin = field.position(query.point) + query.w * (2.0 * field.diagonal());
    Ray::new(to_f32(&origin), -to_f32(&query.w))
}

/// Chords that a walk found against a ray cast through the triangles from inside. Chords of fewer than four mean edges are left
/// out, because the triangles are not the surface; and so are those where the ray meets another part of the mesh first.
fn chord_against_rays(
    field: &CurvatureField<'_>,
    bvh: &Bvh,
    queries: &[FilterQuery],
    length: WalkLength,
) -> Option<Spread> {
    let edge = (0..field.surface().triangles().len()).map(|t| {
        let [a, b, _] = field.surface().corners(t);
        (b - a).norm()
    });
    let mean_edge = edge.sum::<f64>() / field.surface().triangles().len() as f64;
    let errors = queries.iter().filter_map(|query| {
        let found = Filter::Chord.ask(field, &FilterQuery { length, ..*query })?;
        let t_exit = found.t_exit.filter(|&t| t > 4.0 * mean_edge)?;
        // A tenth of an edge inside, so that the triangle of the entry is not met.
        let skip = 0.1 * mean_edge;
        let origin = field.position(query.point) - query.w * skip;
        let hit = bvh.closest_hit(&Ray::new(to_f32(&origin), -to_f32(&query.w)))?;
        let expected = f64::from(hit.t) + skip;
        let is_same = (expected - t_exit).abs() < 2.0 * mean_edge;
        let cosine = field_cosine(field, query)?;
        let (kappa, expected) = (found.kappa, 2.0 * cosine / expected);
        is_same.then(|| (kappa - expected).abs() / (expected.abs() + 1.0 / field.diagonal()))
    });
    Spread::new(errors.collect())
}

/// Queries that are timed in one go: some tenths of a millisecond, so that most blocks are not interrupted.
const BLOCK: usize = 250;

/// Seconds that each block of queries takes.
fn block_seconds<T>(items: &[T], mut ask: impl FnMut(&T) -> bool) -> Vec<f64> {
    let time = |block: &[T]| {
        let start = Instant::now();
        black_box(block.iter().filter(|item| ask(item)).count());
        start.elapsed().as_secs_f64()
    };
    items.chunks(BLOCK).map(time).collect()
}

/// Nanoseconds a query: medians over the runs and quartiles, block by block, summed over the blocks.
fn median_and_quartiles(runs: &[Vec<f64>], queries: usize) -> (f64, [f64; 2]) {
    let blocks = runs.first().map_or(0, Vec::len);
    let (mut median, mut quartiles) = (0.0, [0.0; 2]);
    for block in 0..blocks {
        let mut times: Vec<f64> = runs.iter().map(|run| run[block]).collect();
        times.sort_unstable_by(f64::total_cmp);
        let last = times.len() - 1;
        median += times[last / 2];
        quartiles[0] += times[last / 4];
        quartiles[1] += times[last * 3 / 4];
    }
    let scale = 1e9 / queries.max(1) as f64;
    (median * scale, quartiles.map(|q| q * scale))
}

/// A sphere with bumps of a tenth of its radius.
pub fn bumpy_sphere(levels: u32) -> Mesh {
    let sphere = osculate_geom::shapes::icosphere(1.0, levels);
    let bump = |p: &osculate_geom::Vec3| {
        p * (1.0 + 0.1 * (5.0 * p.x).sin() * (4.0 * p.y).cos() * (6.0 * p.z + 1.0).sin())
    };
    let positions = sphere.positions().iter().map(bump).collect();
    Mesh::new(positions, sphere.triangles().to_vec()).expect("a bumpy sphere is a mesh")
}

//! Whole renders of small pictures: what each effect that the plan may leave out costs, how time grows with samples, and what it
//! brings to ask neural materials in batches.
#![allow(missing_docs, reason = "criterion_group makes an undocumented function")]

mod asked_often;

use std::hint::black_box;
use std::ops::ControlFlow;
use std::path::Path;
use std::sync::Arc;

use criterion::{Criterion, Throughput, criterion_group, criterion_main};
use glam::Vec3;
use osculate_geom::curvature::{CurvatureOptions, estimate};
use osculate_geom::field::{
    BakedChord, CurvatureField, Filter, FilterKind, FilterQuery, SurfacePoint, WalkLength,
};
use osculate_geom::mesh::{Surface, Weld};
use osculate_geom::shapes;
use osculate_render::scene::{
    DirectionalCurvature, PreviewOptions, QueryForm, RayCurvature, SilhouetteMaterial, SurfaceSource,
};
use osculate_render::{
    Environment, EnvironmentImage, Light, Material, MeshInstance, Queries, RenderOptions, Scene, StopRule,
    render,
};
use osculate_sbtf::SilhouetteBtf;
use osculate_sbtf::file::ModelFile;
use osculate_sbtf::sampling::Sampler;

use asked_often::AskedOften;

const SIZE: [u32; 2] = [128, 96];

/// A torus of 20,000 triangles and what the preview puts around it.
fn studio(material: Material) -> Scene {
    let mesh = Arc::new(shapes::torus(1.0, 0.4, 160, 64));
    let object = MeshInstance { surface: SurfaceSource::Material(material), ..MeshInstance::new(mesh) };
    Scene::preview(vec![object], &PreviewOptions { size: SIZE, ..PreviewOptions::default() })
}

fn clay() -> Material {
    Material::lambert(Vec3::splat(0.5))
}

/// Scenes from one effect to many.
fn scenes() -> Vec<(&'static str, Scene)> {
    let sun = Light::Directional { direction: Vec3::new(0.3, -1.0, -0.4), irradiance: Vec3::splat(3.0) };
    let bare = |lights: Vec<Light>, environment: Environment, material: Material| {
        let mut scene = studio(material);
        scene.objects.truncate(1);
        (scene.lights, scene.environment) = (lights, environment);
        scene
    };
    let sky = EnvironmentImage::from_fn(64, 32, |w| Vec3::splat(if w.y > 0.9 { 20.0 } else { 0.3 }));
    let sky = Environment::Image { image: Arc::new(sky), intensity: 1.0, rotation: 0.0 };
    let glossy = Material { roughness: 0.3, metallic: 1.0, ..clay() };
    vec![
        ("nothing there", Scene { objects: Vec::new(), ..studio(clay()) }),
        ("sun", bare(vec![sun], Environment::Black, clay())),
        ("even sky", bare(Vec::new(), Environment::Constant(Vec3::ONE), clay())),
        ("pictured sky", bare(Vec::new(), sky.clone(), clay())),
        ("metal under a pictured sky", bare(Vec::new(), sky, glossy)),
        ("studio", studio(clay())),
    ]
}

fn bench_pictures(c: &mut Criterion) {
    let mut group = c.benchmark_group("pictures");
    group.sample_size(10);
    for (name, scene) in scenes() {
        for samples in [1, 8] {
            group.throughput(Throughput::Elements(u64::from(SIZE[0] * SIZE[1] * samples)));
            let options = RenderOptions { stop: StopRule::Samples(samples), ..RenderOptions::default() };
            group.bench_function(format!("{name}, {samples} per pixel"), |b| {
                b.iter(|| render(black_box(&scene), &options, &mut |_| ControlFlow::Continue(())));
            });
        }
    }
    group.finish();
}

/// Curvature for rays on the torus, by a filter.
#[derive(Debug)]
struct Field {
    field: CurvatureField<'static>,
    filter: Filter,
    walk: WalkLength,
}

impl DirectionalCurvature for Field {
    fn along(&self, triangle: usize, barycentrics: [f32; 3], direction: Vec3) -> Option<f32> {
        self.ask(triangle, barycentrics, direction).map(|answer| answer.kappa)
    }

    #[allow(clippy::cast_possible_truncation, reason = "rendering is f32")]
    fn ask(&self, triangle: usize, barycentrics: [f32; 3], direction: Vec3) -> Option<RayCurvature> {
        let point = SurfacePoint { triangle, barycentric: barycentrics.map(f64::from) };
        let [x, y, z] = direction.to_array().map(f64::from);
        let query = FilterQuery { point, w: osculate_geom::Vec3::new(x, y, z), length: self.walk };
        let answer = self.filter.ask(&self.field, &query)?;
        let uv_rate = answer.uv_rate.map(|rate| rate.map(|q| q as f32));
        Some(RayCurvature { kappa: answer.kappa as f32, across: Some(answer.across as f32), uv_rate })
    }

    fn filter(&self) -> FilterKind {
        self.filter.kind()
    }
}

/// A torus under the shipped stones, with a sun and an even sky; every question of the stones may be asked some times more.
fn stones(filter: FilterKind, more: u8) -> Scene {
    let (columns, rows) = (240, 120);
    let mesh = Arc::new(shapes::torus_with_uv(1.0, 0.45, columns, rows));
    let surface = Surface::new(&mesh, Weld::Exact).into_owned();
    let curvature = estimate(&surface, &CurvatureOptions::default()).expect("a torus");
    let field = CurvatureField::new(surface, curvature).with_uv_set(&mesh, 0);
    let path = Path::new(env!("CARGO_MANIFEST_DIR")).join("../../assets/materials/stone-1.sbtf");
    let model = ModelFile::from_bytes(&std::fs::read(path).expect("the shipped model")).expect("a model");
    let depth = model.model.architecture.depth;
    let stone = osculate_sbtf::infer::Material::new(&model.model);
    let btf: Arc<dyn SilhouetteBtf + Send + Sync> =
        if more > 0 { Arc::new(AskedOften { material: stone, more }) } else { Arc::new(stone) };
    let silhouette = SilhouetteMaterial {
        btf,
        depth,
        tiles: [6.0, 3.0],
        tile_size: 1.0,
        sampler: Arc::new(Sampler::cosine()),
        query: QueryForm::Chord,
    };
    let mut scene = studio(Material { silhouette: Some(silhouette), ..Material::default() });
    scene.objects.truncate(1);
    scene.objects[0].mesh = mesh;
    let walk = WalkLength::Shell { depth: f64::from(depth) };
    let filter = Filter::of_kind(filter)
        .unwrap_or_else(|| Filter::BakedChord(Arc::new(BakedChord::new(&field, BakedChord::AZIMUTHS, walk))));
    scene.objects[0].field = Some(Arc::new(Field { field, filter, walk }));
    scene.lights =
        vec![Light::Directional { direction: Vec3::new(-1.0, -1.5, -0.5), irradiance: Vec3::splat(2.3) }];
    scene.environment = Environment::Constant(Vec3::splat(0.38));
    scene
}

/// Query by query against paths side by side, and one thread against two.
fn bench_queries(c: &mut Criterion) {
    let mut group = c.benchmark_group("silhouettes");
    group.sample_size(10);
    group.throughput(Throughput::Elements(u64::from(SIZE[0] * SIZE[1] * 8)));
    let ways = [
        ("query by query", Queries::Single, 1),
        ("16 side by side", Queries::Batched { paths: 16 }, 1),
        ("256 side by side", Queries::Batched { paths: 256 }, 1),
        ("1024 side by side", Queries::Batched { paths: 1024 }, 1),
        ("4096 side by side", Queries::Batched { paths: 4096 }, 1),
        ("1024 side by side, two threads", Queries::Batched { paths: 1024 }, 2),
    ];
    for filter in [FilterKind::Chord, FilterKind::BakedChord, FilterKind::Point] {
        let (filter, scene) = (filter.name(), stones(filter, 0));
        for (name, queries, threads) in ways {
            let pool = rayon::ThreadPoolBuilder::new().num_threads(threads).build().expect("a pool");
            let options = RenderOptions { stop: StopRule::Samples(8), queries, ..RenderOptions::default() };
            group.bench_function(format!("{filter}, {name}"), |b| {
                b.iter(|| {
                    pool.install(|| render(black_box(&scene), &options, &mut |_| ControlFlow::Continue(())))
                });
            });
        }
    }
    let pool = rayon::ThreadPoolBuilder::new().num_threads(1).build().expect("a pool");
    for (name, queries) in [("query by query", Queries::Single), ("in batches", Queries::default())] {
        for more in [0, 4] {
            let scene = stones(FilterKind::BakedChord, more);
            let options = RenderOptions { stop: StopRule::Samples(32), queries, ..RenderOptions::default() };
            group.throughput(Throughput::Elements(u64::from(SIZE[0] * SIZE[1] * 32)));
            group.bench_function(format!("asked {more} times more, {name}"), |b| {
                b.iter(|| pool.install(|| render(&scene, &options, &mut |_| ControlFlow::Continue(()))));
            });
        }
    }
    group.finish();
}

criterion_group!(benches, bench_pictures, bench_queries);
criterion_main!(benches);

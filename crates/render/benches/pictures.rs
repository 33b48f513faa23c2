//! Whole renders of small pictures: what each effect that the plan may leave out costs, and how time grows with samples.
#![allow(missing_docs, reason = "criterion_group makes an undocumented function")]

use std::hint::black_box;
use std::ops::ControlFlow;
use std::sync::Arc;

use criterion::{Criterion, Throughput, criterion_group, criterion_main};
use glam::Vec3;
use osculate_geom::shapes;
use osculate_render::scene::{PreviewOptions, SurfaceSource};
use osculate_render::{
    Environment, EnvironmentImage, Light, Material, MeshInstance, RenderOptions, Scene, StopRule, render,
};

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

criterion_group!(benches, bench_pictures);
criterion_main!(benches);

//! Instances against copies: the same mesh in several places, with one hierarchy and one table, or with one each.

mod support;

use std::path::Path;
use std::sync::Arc;

use glam::{Mat3, Vec2, Vec3};
use osculate_render::scene::{
    DirectionalCurvature, LoadedMesh, Placement, QueryForm, RayCurvature, SceneFile, SilhouetteMaterial,
};
use osculate_render::{
    Environment, Light, Material, MeshInstance, Queries, RenderOptions, Rendering, Scene, StopRule,
};
use osculate_sbtf::sampling::Sampler;
use osculate_sbtf::{Answer, Query, SilhouetteBtf};
use support::{object, plane, run, scene, sphere};

/// Shows the curvature and the UV that it is asked with; rays that graze pass.
#[derive(Debug)]
struct Probe;

impl SilhouetteBtf for Probe {
    fn eval(&self, query: &Query) -> Answer {
        let alpha = self.alpha(query.uv, query.wo, query.kappa_hat);
        let shade = 0.1 + 0.1 * (query.uv * std::f32::consts::TAU).sin() * query.wi.z.max(0.0);
        Answer { rgb: alpha * Vec3::new(shade.x, shade.y, 0.2 * query.kappa_hat), alpha }
    }

    fn alpha(&self, _: Vec2, wo: Vec3, _: f32) -> f32 {
        if wo.z > 0.3 { 1.0 } else { 0.0 }
    }
}

/// The unit sphere's.
#[derive(Debug)]
struct One;

impl DirectionalCurvature for One {
    fn along(&self, _: usize, _: [f32; 3], _: Vec3) -> Option<f32> {
        Some(1.0)
    }

    fn ask(&self, _: usize, _: [f32; 3], _: Vec3) -> Option<RayCurvature> {
        Some(RayCurvature { kappa: 1.0, across: None, uv_rate: None })
    }
}

/// A sphere whose UV are its own x and y, or clay without any.
fn ball(neural: bool) -> MeshInstance {
    let mesh = sphere(24);
    if !neural {
        return object(mesh, Material { roughness: 0.3, ..Material::lambert(Vec3::splat(0.6)) });
    }
    let uvs = mesh.positions().iter().map(|p| [p.x, p.y]).collect();
    let silhouette = SilhouetteMaterial {
        btf: Arc::new(Probe),
        depth: 0.1,
        tiles: [1.0; 2],
        tile_size: 1.0,
        sampler: Arc::new(Sampler::cosine()),
        query: QueryForm::Paper,
    };
    let material = Material { silhouette: Some(silhouette), ..Material::default() };
    let mut ball = object(mesh.with_uv_set(uvs).expect("a UV for every vertex"), material);
    ball.field = Some(Arc::new(One));
    ball
}

/// Places that overlap, at several scales and turns.
fn places() -> Vec<Placement> {
    let place = |k: u16| {
        let angle = f32::from(k) * 1.3;
        Placement {
            rotation: Mat3::from_euler(glam::EulerRot::ZYX, angle, 2.0 * angle, 0.5),
            scale: 0.4 + 0.1 * f32::from(k % 5),
            translation: Vec3::new(
                1.1 * f32::from(k % 4) - 1.6,
                1.2 * f32::from(k / 4) - 1.2,
                0.3 * angle.sin(),
            ),
        }
    };
    (0..12).map(place).collect()
}

fn crowd(ball: &MeshInstance, shared: bool) -> Scene {
    let put = |placement: Placement| {
        let mesh = if shared { ball.mesh.clone() } else { Arc::new((*ball.mesh).clone()) };
        MeshInstance { mesh, placement, ..ball.clone() }
    };
    let mut objects: Vec<MeshInstance> = places().into_iter().map(put).collect();
    // Alone with its mesh, and in the middle of the list.
    objects.insert(5, object(plane(8.0, -2.2), Material::lambert(Vec3::splat(0.5))));
    let mut scene = scene(objects, 96, Vec3::new(0.5, 2.0, 9.0), Vec3::ZERO, 32.0);
    scene.lights =
        vec![Light::Directional { direction: Vec3::new(-0.5, -1.0, -0.8), irradiance: Vec3::splat(2.0) }];
    scene.environment = Environment::Constant(Vec3::new(0.3, 0.4, 0.6));
    scene
}

fn render(scene: &Scene) -> Rendering {
    let stop = StopRule::Samples(16);
    run(scene, &RenderOptions { stop, max_depth: 3, ..RenderOptions::default() })
}

/// Rays are turned into the mesh's space and hits back, which rounds otherwise than turning the mesh into the world: a hit moves by some
/// units in the last place of its coordinates and of its instance's place. A path whose hit comes to lie on the other side of an edge goes
/// another way. Moving the copies by as much does the same to as many pixels, and that is the measure.
#[test]
fn instances_look_like_copies() {
    for neural in [false, true] {
        let ball = ball(neural);
        let copies = render(&crowd(&ball, false));
        let mut moved = crowd(&ball, false);
        for object in &mut moved.objects {
            object.placement.translation += Vec3::new(4e-6, -4e-6, 4e-6);
        }
        let (instances, moved) = (render(&crowd(&ball, true)), render(&moved));
        let pixels = copies.film.radiance();
        let apart = |other: &Rendering| {
            let far = |(a, b): (&Vec3, &Vec3)| (*a - *b).abs().max_element() > 1e-3;
            pixels.iter().zip(&other.film.radiance()).filter(|&(a, b)| far((a, b))).count()
        };
        let (found, usual) = (apart(&instances), apart(&moved));
        assert!(found <= usual + 20, "neural {neural}: {found} pixels differ, {usual} for moved copies");
        assert!(found < pixels.len() / 20, "neural {neural}: {found} of {} pixels differ", pixels.len());
        let mean = |p: &[Vec3]| p.iter().map(|p| f64::from(p.element_sum())).sum::<f64>() / p.len() as f64;
        let ratio = mean(&instances.film.radiance()) / mean(&pixels);
        assert!((ratio - 1.0).abs() < 3e-4, "neural {neural}: mean {ratio} of the copies'");
        let counts = |r: &Rendering| [r.counters.rays, r.counters.opacity_queries].map(|n| n as f64);
        for (a, b) in counts(&instances).into_iter().zip(counts(&copies)) {
            assert!((a - b).abs() <= 3e-4 * b, "neural {neural}: {a} for {b}");
        }
    }
}

/// Instances that are met by many rays together are met by the same rays one by one.
#[test]
fn instances_side_by_side_are_instances_one_by_one_to_the_bit() {
    for neural in [false, true] {
        let scene = crowd(&ball(neural), true);
        let asked = |queries| {
            let stop = StopRule::Samples(16);
            run(&scene, &RenderOptions { stop, queries, max_depth: 3, ..RenderOptions::default() })
        };
        let (one, many) = (asked(Queries::Single), asked(Queries::default()));
        assert_eq!(one.film.radiance(), many.film.radiance(), "neural {neural}");
        assert_eq!(one.counters, many.counters, "neural {neural}");
    }
}

/// A material grows with its instance, so that a scene and its enlargement look the same: curvature times tile stays.
#[test]
fn a_larger_instance_shows_the_same_material() {
    let text = |scale: f32, distance: f32| {
        format!(
            "[image]\nwidth = 40\nheight = 40\n[camera]\nposition = [0.0, 0.0, {distance}]\ntarget = [0.0, 0.0, 0.0]\n\
             [environment]\nradiance = [1.0, 1.0, 1.0]\n[[mesh]]\nshape = \"torus:1,0.45\"\nmaterial = \"m\"\n\
             instances = [{{ scale = {scale} }}, {{ scale = [{scale}, {scale}, {scale}], translate = [{far}, 0.0, 0.0] }}]\n\
             [material.m]\noracle = \"stone-1\"\n",
            far = 100.0 * scale
        )
    };
    let ball = ball(true);
    let shown = |scale: f32, distance: f32| {
        let mut load = |_: &osculate_render::scene::LoadRequest<'_>| {
            Ok(LoadedMesh { mesh: ball.mesh.clone(), curvature: None, field: ball.field.clone() })
        };
        let file = SceneFile::parse(&text(scale, distance), "scene.toml").expect("a scene");
        let mut scene = file.build(Path::new("scene.toml"), &mut load).expect("its meshes");
        for object in &mut scene.objects {
            if let osculate_render::scene::SurfaceSource::Material(material) = &mut object.surface
                && let Some(silhouette) = &mut material.silhouette
            {
                silhouette.btf = Arc::new(Probe);
            }
        }
        render(&scene).film.radiance()
    };
    // Powers of two, which round nothing else.
    let (small, large) = (shown(1.0, 8.0), shown(4.0, 32.0));
    assert!(small.iter().any(|p| p.z > 0.02) && small.iter().any(|p| p.x > 0.9), "material and sky");
    let off = small.iter().zip(&large).filter(|(a, b)| (**a - **b).abs().max_element() > 1e-3).count();
    assert!(off < 5, "{off} pixels differ");
}

#[test]
fn places_that_make_no_sense_are_refused() {
    let message = |instances: &str| {
        let text = format!("[[mesh]]\nfile = \"ball\"\ninstances = {instances}\n");
        let mut load = |_: &osculate_render::scene::LoadRequest<'_>| {
            Ok(LoadedMesh { mesh: ball(false).mesh, curvature: None, field: None })
        };
        let file = SceneFile::parse(&text, "scene.toml").map_err(|e| e.to_string())?;
        file.build(Path::new("scene.toml"), &mut load).map(|s| s.objects.len()).map_err(|e| e.to_string())
    };
    // Two and the studio's backdrop.
    assert_eq!(message("[{}, { translate = [3.0, 0.0, 0.0] }]"), Ok(3));
    assert_eq!(message("{ grid = [40, 25], spacing = [3.0, 3.0] }"), Ok(1001));
    let uneven = message("[{ scale = [1.0, 2.0, 1.0] }]").expect_err("not a similarity");
    assert!(
        uneven.contains("mesh[0].instances[0].scale = [1.0, 2.0, 1.0]") && uneven.contains("all axes"),
        "{uneven}"
    );
    for (bad, key) in [
        ("[{ scale = 0.0 }]", "instances[0].scale = 0"),
        ("[{ translate = [nan, 0.0, 0.0] }]", "instances[0].translate"),
        ("{ grid = [0, 5], spacing = [1.0, 1.0] }", "instances.grid = [0, 5]"),
        ("{ grid = [70000, 70000], spacing = [1.0, 1.0] }", "instances.grid = [70000, 70000]"),
        ("[]", "mesh[0].instances = 0"),
    ] {
        let found = message(bad).expect_err(bad);
        assert!(found.starts_with("scene.toml: mesh[0].") && found.contains(key), "{bad}: {found}");
    }
}

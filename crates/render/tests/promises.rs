//! What the renderer promises besides correct light: determinism, plans that cost and change nothing, honest noise.

mod support;

use std::ops::ControlFlow;
use std::sync::Arc;
use std::time::Duration;

use glam::Vec3;
use osculate_render::aov::{Aov, aovs};
use osculate_render::output::{ExrLayer, exr_bytes, read_exr};
use osculate_render::scene::{MeshSource, PreviewOptions, SceneFile};
use osculate_render::{
    Effects, Environment, Light, Material, MeshInstance, RectangleLight, RenderOptions, Rendering, Scene,
    StopRule, Strategy, plan, render,
};
use support::{independent, object, plane, run, scene, sphere};

fn preview(size: [u32; 2]) -> Scene {
    let options = PreviewOptions { size, ..PreviewOptions::default() };
    Scene::preview(vec![MeshInstance::new(Arc::new(sphere(24)))], &options)
}

fn bits(scene: &Scene, options: &RenderOptions) -> Vec<[u32; 3]> {
    run(scene, options).film.radiance().iter().map(|p| p.to_array().map(f32::to_bits)).collect()
}

#[test]
fn threads_do_not_change_a_bit() {
    let scene = preview([70, 50]);
    let options = RenderOptions { stop: StopRule::Samples(6), ..RenderOptions::default() };
    let on = |threads: usize| {
        let pool = rayon::ThreadPoolBuilder::new().num_threads(threads).build().unwrap();
        pool.install(|| bits(&scene, &options))
    };
    let one = on(1);
    assert_eq!(one, on(2));
    assert_eq!(one, on(5));
    let other = bits(&scene, &RenderOptions { seed: 1 << 63, ..options });
    assert_ne!(one, other, "the seed's highest bit is ignored");
}

#[test]
fn planned_and_forced_effects_give_the_same_bits() {
    let lambert = Material::lambert(Vec3::splat(0.6));
    let mut sun = scene(vec![object(sphere(16), lambert)], 24, Vec3::new(0.0, 1.0, 5.0), Vec3::ZERO, 30.0);
    sun.lights.push(Light::Directional { direction: Vec3::NEG_Y, irradiance: Vec3::ONE });
    let mut sky = sun.clone();
    sky.lights.clear();
    sky.environment = Environment::Constant(Vec3::ONE);
    for (case, scene) in [("sun", sun), ("sky", sky), ("studio", preview([30, 20]))] {
        for max_depth in [1, 4] {
            let options = RenderOptions { stop: StopRule::Samples(4), max_depth, ..RenderOptions::default() };
            let planned = run(&scene, &options);
            let forced = RenderOptions { force: Some(Effects::ALL), ..options };
            assert_eq!(bits(&scene, &options), bits(&scene, &forced), "{case}, depth {max_depth}");
            let (effects, counters) = (planned.effects, planned.counters);
            let expectations = [
                ("environment", effects.environment, counters.environment_samples),
                ("area lights", effects.area_lights, counters.area_light_samples),
                ("directional lights", effects.directional_lights, counters.directional_samples),
                ("textures", effects.textures, counters.texture_lookups),
                ("transparency", effects.transparency, counters.pass_throughs),
                ("depth of field", effects.depth_of_field, counters.lens_samples),
                ("curvature", false, counters.curvature_evaluations),
                ("curvature filter", false, counters.filter_walks),
            ];
            let plan = plan(&scene, max_depth);
            for (effect, on, count) in expectations {
                let decision = plan.decision(effect).unwrap_or_else(|| panic!("no decision on {effect}"));
                assert_eq!(decision.needed, on, "{case}: {effect}");
                assert_eq!(count > 0, on, "{case}: {effect} was counted {count} times");
                assert!(!decision.reason.is_empty());
            }
            assert_eq!(counters.discarded_samples, 0, "{case}");
        }
    }
}

#[test]
fn short_renders_agree_with_a_long_one() {
    let scene = preview([16, 12]);
    let short = run(&scene, &independent(256, 6, Strategy::Combined, 1)).film;
    let long = run(&scene, &independent(4096, 6, Strategy::Combined, 2)).film;
    let luminance = |c: &Vec3| c.dot(Vec3::new(0.2126, 0.7152, 0.0722));
    let (a, b) = (short.radiance(), long.radiance());
    let (va, vb) = (short.variance(), long.variance());
    let mut largest = 0.0_f32;
    for i in 0..a.len() {
        let z = (luminance(&a[i]) - luminance(&b[i])) / (va[i] + vb[i]).sqrt().max(1e-6);
        largest = largest.max(z.abs());
    }
    // Sidak: all of 192 normal variables stay below 4.7 with probability 0.9995; skewed samples ask for a little more.
    assert!(largest < 5.2, "largest z of {} pixels: {largest}", a.len());
}

#[test]
fn noise_estimate_predicts_the_error() {
    let scene = preview([48, 36]);
    let reference = run(&scene, &independent(2048, 6, Strategy::Combined, 9)).film.radiance();
    let rendering = run(&scene, &RenderOptions { stop: StopRule::Samples(32), ..RenderOptions::default() });
    let luminance = |c: &Vec3| f64::from(c.dot(Vec3::new(0.2126, 0.7152, 0.0722)));
    let found = rendering.film.radiance();
    let squares: f64 = found.iter().zip(&reference).map(|(a, b)| (luminance(a) - luminance(b)).powi(2)).sum();
    let mean = reference.iter().map(luminance).sum::<f64>() / reference.len() as f64;
    let error = (squares / reference.len() as f64).sqrt() / mean;
    let predicted = rendering.film.noise().expect("two halves");
    assert!((0.8..1.25).contains(&(predicted / error)), "predicted {predicted}, found {error}");
}

#[test]
fn stopping_rules_stop() {
    let scene = preview([32, 24]);
    let stop = |stop| run(&scene, &RenderOptions { stop, ..RenderOptions::default() });
    let noise = stop(StopRule::Noise { target: 0.05, most: 4096 });
    assert!(noise.film.noise().unwrap() <= 0.05 && noise.samples < 4096.0, "{} samples", noise.samples);
    assert_eq!(stop(StopRule::Noise { target: 1e-9, most: 24 }).samples_range, [24, 24]);
    assert!(stop(StopRule::Time(Duration::ZERO)).samples_range[0] >= 1);
    assert_eq!(stop(StopRule::Samples(21)).samples_range, [21, 21]);
}

#[test]
fn samples_go_where_the_noise_is_and_nothing_shifts() {
    // A ball under a lamp before a sky that is the same everywhere: most tiles have nothing to learn.
    let ball = object(sphere(24), Material::lambert(Vec3::splat(0.6)));
    let mut scene = scene(vec![ball], 96, Vec3::new(0.0, 1.0, 12.0), Vec3::ZERO, 24.0);
    scene.environment = Environment::Constant(Vec3::splat(0.5));
    let lamp = RectangleLight::facing(Vec3::new(2.0, 3.0, 2.0), Vec3::ZERO, 1.0, 1.0, Vec3::splat(30.0));
    scene.lights = vec![Light::Rectangle(lamp)];
    let with = |stop, seed| run(&scene, &RenderOptions { stop, seed, ..RenderOptions::default() });
    let rule = StopRule::Noise { target: 0.004, most: 4096 };
    let goal = with(rule, 1);
    assert!(goal.samples_range[1] > 4 * goal.samples_range[0], "{:?}", goal.samples_range);
    // Samples everywhere alike that cost at least as many rays leave more noise.
    let rays = |r: &Rendering| (r.counters.rays + r.counters.shadow_rays) as f64;
    let one = rays(&with(StopRule::Samples(1), 1));
    #[expect(clippy::cast_possible_truncation, clippy::cast_sign_loss, reason = "a few hundred")]
    let alike = with(StopRule::Samples((rays(&goal) / one).ceil() as u32), 1);
    let (found, uniform) = (goal.film.noise().unwrap(), alike.film.noise().unwrap());
    assert!(found < 0.8 * uniform, "{found} {uniform}, {} samples", alike.samples);
    // Fewer samples where it was quiet do not shift the picture: its mean is that of many other samples, everywhere alike. Noise is
    // that of single pixels; of a mean it is what is left of it in the root of their number, and 4 of these are next to never there.
    let other = with(StopRule::Samples(512), 2);
    let mean = |film: &osculate_render::Film| {
        film.radiance().iter().map(|c| f64::from(c.dot(Vec3::new(0.2126, 0.7152, 0.0722)))).sum::<f64>()
    };
    let (a, b) = (mean(&goal.film), mean(&other.film));
    let noise = found.hypot(other.film.noise().unwrap()) / (goal.film.radiance().len() as f64).sqrt();
    assert!((a / b - 1.0).abs() < 4.0 * noise, "{a} {b} {noise}");
    // Numbers of samples come from sums that threads do not change.
    let pool = rayon::ThreadPoolBuilder::new().num_threads(3).build().unwrap();
    let again = pool.install(|| with(rule, 1));
    assert_eq!((again.samples_range, again.film.radiance()), (goal.samples_range, goal.film.radiance()));
}

#[test]
fn exr_round_trip_is_exact() {
    let scene = preview([20, 10]);
    let (mut layers, counters) = aovs(&scene, &Aov::ALL).unwrap();
    assert!(counters.curvature_evaluations > 0 && counters.filter_walks == 0, "{counters:?}");
    layers.push(ExrLayer::rgb("beauty", &vec![Vec3::new(0.1, f32::MIN_POSITIVE, 1e30); 200]));
    let (width, height, back) = read_exr(&exr_bytes(20, 10, &layers).unwrap()).unwrap();
    assert_eq!((width, height), (20, 10));
    let values = |layers: &[ExrLayer]| {
        let mut all: Vec<(String, Vec<u32>)> = Vec::new();
        for layer in layers {
            for (name, values) in &layer.channels {
                all.push((format!("{}.{name}", layer.name), values.iter().map(|v| v.to_bits()).collect()));
            }
        }
        all.sort();
        all
    };
    assert_eq!(values(&layers), values(&back));
}

#[test]
fn scene_files_are_checked_key_by_key() {
    let build = |text: &str| {
        let file = SceneFile::parse(text, "a.toml")?;
        file.build(std::path::Path::new("a.toml"), &mut |request| match request.source {
            MeshSource::File(path) => Err(format!("no {}", path.display()).into()),
            MeshSource::Shape(shape) => Err(format!("no {shape}").into()),
        })
    };
    let cases = [
        ("[image]\nwidht = 3", "widht"),
        ("[image]\nwidth = 0", "image.width = 0"),
        ("[camera]\nposition = [0, 0, 1]", "camera"),
        ("[camera]\nfov_y = 190.0", "camera.fov_y = 190"),
        ("[material.red]\nroughness = 1.5", "material.red.roughness = 1.5"),
        ("[[mesh]]\nfile = 'cow.obj'", "mesh[0].file = cow.obj: no cow.obj"),
        ("[[mesh]]\nfile = 'cow.obj'\nmaterial = 'blue'", "mesh[0].material = blue"),
        ("[[mesh]]\nmaterial = 'blue'", "mesh[0].material = blue"),
        ("[[mesh]]\nfile = 'a.obj'\nshape = 'torus:1,0.4'", "needs one of `file` and `shape`"),
        ("[[mesh]]\nshape = 'torus:1,2'", "mesh[0].shape = torus:1,2"),
        ("[material.wool]\nmodel = 'no.sbtf'", "material.wool.model = no.sbtf"),
        ("[material.wool]\noracle = 'tweed'", "material.wool.oracle = tweed"),
        ("[material.wool]\nmodel = 'a.sbtf'\noracle = 'wool-1'", "leave one out"),
        ("[material.wool]\noracle = 'wool-1'\ntiles = [0.0, 1.0]", "material.wool.tiles (u) = 0"),
        ("[material.wool]\noracle = 'wool-1'\noracle_samples = 0", "material.wool.oracle_samples = 0"),
        ("[[light]]\ntype = 'lamp'", "lamp"),
        (
            "[[light]]\ntype = 'directional'\ndirection = [0, 0, 0]\nirradiance = [1, 1, 1]",
            "light[0].direction",
        ),
        ("[environment]\nfile = 'sky.exr'", "environment.file = sky.exr"),
        ("[environment]", "environment"),
        ("image = nonsense", "a.toml"),
    ];
    for (text, expected) in cases {
        let message = build(text).expect_err(text).to_string();
        assert!(message.contains(expected) && message.starts_with("a.toml"), "{text:?}: {message}");
    }
    let text = "[[light]]\ntype = 'directional'\ndirection = [0, -1, 0]\nirradiance = [1, 1, 1]\n[image]\nwidth = 8\nheight = 8";
    let scene = build(text).unwrap();
    assert_eq!((scene.width, scene.lights.len(), scene.objects.len()), (8, 1, 0));
    run(&scene, &RenderOptions { stop: StopRule::Samples(2), ..RenderOptions::default() });
}

/// Lights of smaller ones would be wrong.
#[test]
fn scenes_that_are_too_small_are_refused_by_size() {
    let scaled = |ball: &MeshInstance, scale: f32| {
        let mut ball = ball.clone();
        ball.placement.scale = scale;
        ball
    };
    let ball = |scale: f32| scaled(&object(sphere(8), Material::default()), scale);
    let found = |objects: Vec<MeshInstance>| {
        let scene = scene(objects, 8, Vec3::new(0.0, 0.0, 1.0), Vec3::ZERO, 30.0);
        render(&scene, &RenderOptions::default(), &mut |_| ControlFlow::Continue(())).map(|_| ())
    };
    let one = ball(0.9e-13);
    for objects in [vec![one.clone()], vec![scaled(&one, 0.5e-13), one]] {
        let message = found(objects).expect_err("too small").to_string();
        assert!(message.contains("beyond 9e-14") && message.contains("down to 1e-13"), "{message}");
    }
    // Small ones in larger scenes, and those that are points at the origin, are only invisible.
    for objects in [vec![ball(1.1e-13)], vec![ball(1e-20), ball(1.0)], vec![]] {
        found(objects).unwrap();
    }
}

#[test]
fn empty_and_odd_scenes_render() {
    let empty = Scene::preview(Vec::new(), &PreviewOptions { size: [5, 3], ..PreviewOptions::default() });
    run(&empty, &RenderOptions { stop: StopRule::Samples(3), ..RenderOptions::default() });
    let flat = scene(vec![object(plane(0.0, 0.0), Material::default())], 4, Vec3::ONE, Vec3::ZERO, 30.0);
    assert!(
        run(&flat, &RenderOptions::default()).film.noise().is_none(),
        "a black picture has no relative noise"
    );
}

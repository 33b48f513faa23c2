//! Light transport against closed forms, and strategies against each other.

mod support;

use std::sync::Arc;

use glam::Vec3;
use osculate_geom::Mesh;
use osculate_render::scene::{Laying, MicroSurface, PreviewOptions, SurfaceSource};
use osculate_render::{
    Environment, EnvironmentImage, Light, Material, MeshInstance, RectangleLight, RenderOptions, Scene,
    StopRule, Strategy,
};
use osculate_sbtf::micro::{Grid, HeightField, Maps, Reflectance};
use support::{assert_agree, independent, mean_and_error, object, plane, run, scene, sphere};

#[test]
fn lambert_sphere_under_a_directional_light() {
    let albedo = 0.7;
    let material = Material::lambert(Vec3::splat(albedo));
    let size = 96;
    let mut scene =
        scene(vec![object(sphere(128), material)], size, Vec3::new(0.0, 0.0, 20.0), Vec3::ZERO, 6.2);
    let to_light = Vec3::new(0.48, 0.6, 0.64);
    scene.lights.push(Light::Directional { direction: -3.0 * to_light, irradiance: Vec3::splat(2.0) });
    let options = RenderOptions { stop: StopRule::Samples(64), max_depth: 1, ..RenderOptions::default() };
    let pixels = run(&scene, &options).film.radiance();
    let tan = 3.1_f32.to_radians().tan();
    let mut compared = 0;
    for (k, found) in pixels.iter().enumerate() {
        let at = |i: usize| (2.0 * (i as f32 + 0.5) / size as f32 - 1.0) * tan;
        let direction = Vec3::new(at(k % size as usize), -at(k / size as usize), -1.0).normalize();
        let origin = Vec3::new(0.0, 0.0, 20.0);
        let b = origin.dot(direction);
        let discriminant = b * b - (origin.length_squared() - 1.0);
        // Away from the rim, where the pixel filter blurs over the edge.
        if discriminant < 0.1 {
            continue;
        }
        let normal = origin + (-b - discriminant.sqrt()) * direction;
        let cosine = normal.dot(to_light);
        let expected = albedo / std::f32::consts::PI * 2.0 * cosine.max(0.0);
        // 0.004: the filter spans 2 of 48 pixels a radius; where the light ends the cosine has a kink as wide as that.
        let bound = if cosine.abs() < 0.08 { 0.012 } else { 0.004 };
        assert!(
            (found.x - expected).abs() < bound,
            "pixel {k}: {} instead of {expected}, cosine {cosine}",
            found.x
        );
        compared += 1;
    }
    assert!(compared > 4000, "only {compared} pixels compared");
}

/// Powers of two change no bit of what is not out of range: the studio with its lights is the same at any size.
#[test]
fn a_studio_looks_alike_at_any_size() {
    let picture = |scale: f64| {
        let ball = sphere(24);
        let positions = ball.positions().iter().map(|p| p * scale).collect();
        let ball = Mesh::new(positions, ball.triangles().to_vec()).unwrap();
        let options = PreviewOptions { size: [32, 24], ..PreviewOptions::default() };
        let studio = Scene::preview(vec![MeshInstance::new(Arc::new(ball))], &options);
        run(&studio, &RenderOptions { stop: StopRule::Samples(16), ..RenderOptions::default() })
            .film
            .radiance()
    };
    let one = picture(1.0);
    for exponent in [-43, -40, -20, 20, 33] {
        let other = picture(f64::from(exponent).exp2());
        let off: f32 = one.iter().zip(&other).map(|(a, b)| (*a - *b).abs().max_element()).sum();
        let all: f32 = one.iter().map(|a| a.max_element()).sum();
        assert!(off < 1e-3 * all, "2^{exponent}: {off} of {all}");
    }
}

/// Lambert's formula for the irradiance from a polygon of radiance 1 that is wholly above the horizon.
fn polygon_irradiance(corners: [Vec3; 4], at: Vec3, normal: Vec3) -> f64 {
    let unit = corners.map(|c| (c - at).normalize().as_dvec3());
    let edge = |i: usize| {
        let (a, b) = (unit[i], unit[(i + 1) % 4]);
        a.dot(b).acos() * a.cross(b).normalize().dot(normal.as_dvec3())
    };
    0.5 * (0..4).map(edge).sum::<f64>().abs()
}

#[test]
fn rectangle_light_on_a_plane() {
    for (center, size) in
        [(Vec3::new(0.3, 1.0, -0.2), 1.0), (Vec3::new(2.0, 0.6, 0.0), 0.5), (Vec3::new(0.0, 0.2, 0.1), 0.3)]
    {
        let light = RectangleLight::facing(center, Vec3::new(0.1, 0.0, 0.0), size, 0.5 * size, Vec3::ONE);
        assert!(
            light.corners().iter().all(|c| c.y > 0.0),
            "Lambert's formula wants all of the light above the plane"
        );
        let target = Vec3::new(0.1, 0.0, 0.05);
        // From below the light's height, so that it is not in the way; so narrow that irradiance is the same in all pixels.
        let viewer = target + 0.1 * Vec3::new(0.1, 0.4, 1.0);
        let mut scene =
            scene(vec![object(plane(50.0, 0.0), Material::lambert(Vec3::ONE))], 4, viewer, target, 0.01);
        scene.lights.push(Light::Rectangle(light));
        let expected = polygon_irradiance(light.corners(), target, Vec3::Y) / std::f64::consts::PI;
        for strategy in [Strategy::Combined, Strategy::Lights, Strategy::Bsdf] {
            let found = mean_and_error(&run(&scene, &independent(10_000, 1, strategy, 3)));
            assert_agree(found, (expected, 0.0), &format!("{center} {strategy:?}"));
        }
    }
}

fn spotted_environment() -> Environment {
    let image = EnvironmentImage::from_fn(64, 32, |w| {
        Vec3::splat(if w.dot(Vec3::new(0.6, 0.64, 0.48)) > 0.9 { 8.0 } else { 0.3 + 0.3 * w.y })
    });
    Environment::Image { image: Arc::new(image), intensity: 1.0, rotation: 0.5 }
}

#[test]
fn strategies_agree() {
    let glossy = Material {
        base_color: Vec3::new(0.8, 0.5, 0.3),
        metallic: 0.5,
        roughness: 0.45,
        ..Material::default()
    };
    for (case, light, environment) in [
        ("rectangle", true, Environment::Black),
        ("environment", false, spotted_environment()),
        ("constant", false, Environment::Constant(Vec3::ONE)),
        ("both", true, spotted_environment()),
    ] {
        let objects = vec![object(sphere(24), glossy.clone()), object(plane(4.0, -1.0), glossy.clone())];
        let mut scene = scene(objects, 8, Vec3::new(0.0, 1.0, 5.0), Vec3::ZERO, 40.0);
        scene.environment = environment;
        if light {
            let rectangle =
                RectangleLight::facing(Vec3::new(1.0, 2.5, 1.0), Vec3::ZERO, 1.5, 1.5, Vec3::splat(4.0));
            scene.lights.push(Light::Rectangle(rectangle));
        }
        let of = |strategy, seed| mean_and_error(&run(&scene, &independent(1000, 3, strategy, seed)));
        let combined = of(Strategy::Combined, 1);
        assert_agree(combined, of(Strategy::Lights, 2), &format!("{case}, lights"));
        assert_agree(combined, of(Strategy::Bsdf, 3), &format!("{case}, BSDF"));
    }
}

#[test]
fn furnace_with_objects_shows_nothing() {
    // A convex white body in a white world is invisible, whatever it is made of.
    for (metallic, specular, roughness) in
        [(0.0, 0.0, 0.5), (0.0, 0.5, 0.4), (1.0, 0.5, 0.3), (1.0, 0.5, 0.9)]
    {
        let material =
            Material { base_color: Vec3::ONE, metallic, specular, roughness, ..Material::default() };
        let mut scene =
            scene(vec![object(sphere(64), material)], 12, Vec3::new(0.0, 0.0, 5.0), Vec3::ZERO, 30.0);
        scene.environment = Environment::Constant(Vec3::ONE);
        let (mean, error) = mean_and_error(&run(&scene, &independent(600, 8, Strategy::Combined, 5)));
        let allowed = if specular == 0.0 && metallic == 0.0 { 1e-6 } else { 0.004 };
        assert!(
            (mean - 1.0).abs() < 4.5 * error + allowed,
            "{metallic} {specular} {roughness}: {mean} +- {error}"
        );
    }
}

/// Slopes of 45 degrees that a microstructure's normals have on a flat triangle: a white surface in a white world loses the wedge
/// between both horizons, and no strategy sees it otherwise.
#[test]
fn light_into_a_triangle_of_a_microstructure_is_lost() {
    let mesh = plane(1.0, 0.0);
    let uvs = mesh.positions().iter().map(|p| [0.5 + 0.5 * p.x, 0.5 - 0.5 * p.z]).collect();
    let mesh = Arc::new(mesh.with_uv_set(uvs).expect("one UV per vertex"));
    // From 1 to 0 over half a tile that is half a tile deep.
    let grooves = Grid::from_fn(64, 64, |p| (2.0 * p.x - 1.0).abs());
    let white = Reflectance { albedo: Vec3::ONE, roughness: 1.0, metalness: 0.0 };
    let field = HeightField::new(grooves, 0.5, Maps::uniform(white));
    let micro = MicroSurface::flat(&mesh, &field, &Laying::new([1.0; 2], 2.0));
    let material = Material { micro: Some(micro), specular: 0.0, ..Material::default() };
    let surface = SurfaceSource::Material(material);
    let object = MeshInstance { surface, ..MeshInstance::new(mesh) };
    let slope = Vec3::new(-0.5, 0.0, 0.1);
    let mut scene = scene(vec![object], 4, slope + Vec3::new(0.1, 1.0, 0.2), slope, 0.01);
    scene.environment = Environment::Constant(Vec3::ONE);
    let expected = 0.5 * (1.0 + std::f64::consts::FRAC_PI_4.cos());
    for strategy in [Strategy::Combined, Strategy::Lights, Strategy::Bsdf] {
        let found = mean_and_error(&run(&scene, &independent(4000, 6, strategy, 4)));
        assert_agree(found, (expected, 0.0), &format!("{strategy:?}"));
        assert!(found.1 < 0.01, "{found:?}");
    }
}

#[test]
fn plane_under_a_bright_sky() {
    let material = Material::lambert(Vec3::splat(0.5));
    let mut scene = scene(
        vec![object(plane(1000.0, -1.0), material)],
        4,
        Vec3::new(0.0, 0.0, 0.0),
        Vec3::new(0.0, -1.0, 0.01),
        20.0,
    );
    scene.environment = Environment::Constant(Vec3::splat(2.0));
    let found = mean_and_error(&run(&scene, &independent(1000, 16, Strategy::Combined, 9)));
    assert!((found.0 - 1.0).abs() < 4.5 * found.1 + 1e-3, "{found:?}");
}

#[test]
fn opacity_mixes_what_is_in_front_and_behind() {
    for strategy in [Strategy::Combined, Strategy::Lights] {
        let veil = Material { opacity: 0.3, ..Material::lambert(Vec3::ZERO) };
        let objects =
            vec![object(plane(50.0, 0.0), Material::lambert(Vec3::ONE)), object(plane(50.0, 1.0), veil)];
        let mut scene = scene(objects, 4, Vec3::new(0.0, 3.0, 0.1), Vec3::ZERO, 5.0);
        scene.environment = Environment::Constant(Vec3::ONE);
        let found = mean_and_error(&run(&scene, &independent(10_000, 1, strategy, 2)));
        // 0.7 of the light gets down, reflects, and 0.7 of it gets up again.
        assert_agree(found, (0.49, 0.0), &format!("{strategy:?}"));
    }
}

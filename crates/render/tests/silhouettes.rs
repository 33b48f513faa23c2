//! Materials with silhouettes in the path tracer, against geometry that is really there.
//!
//! The material is a shell: everything down to `depth` below the bounding surface is empty, and below that lies a smooth
//! Lambert surface. Its answers are closed forms on the circle, which are exact on a tube seen from the side: a tube of radius 1
//! with this material must look like a tube of radius `1 - depth`.

mod support;

use std::sync::Arc;

use glam::{Vec2, Vec3};
use osculate_geom::curvature::{CurvatureOptions, estimate};
use osculate_geom::mesh::{Surface, Weld};
use osculate_geom::{Mesh, Vec3 as Vec3d, shapes};
use osculate_render::scene::{
    DirectionalCurvature, QueryForm, RayCurvature, SilhouetteMaterial, SurfaceSource,
};
use osculate_render::{
    Counters, Effects, Environment, Light, Material, MeshInstance, Queries, RectangleLight, RenderOptions,
    Rendering, Scene, StopRule, Strategy, plan,
};
use osculate_sbtf::infer::{self, Precision, StoredModel};
use osculate_sbtf::model::{Architecture, Model, OpacityHead};
use osculate_sbtf::sampling::Sampler;
use osculate_sbtf::{Answer, Query, SilhouetteBtf};
use support::{assert_agree, independent, mean_and_error, object, plane, run, scene};

const ALBEDO: f32 = 0.7;

/// An empty shell of this depth in tiles over a Lambert surface.
#[derive(Debug)]
struct Shell {
    depth: f32,
}

impl Shell {
    /// Unit normal where the ray hits the inner circle.
    fn hit(&self, wo: Vec3, kappa: f32) -> Option<Vec3> {
        if wo.z <= 0.0 {
            return None;
        }
        if kappa <= 0.0 {
            return Some(Vec3::Z);
        }
        let radius = 1.0 / kappa;
        let inner = radius - self.depth;
        let discriminant = inner * inner - radius * radius * (1.0 - wo.z * wo.z);
        let t = radius * wo.z - discriminant.max(0.0).sqrt();
        (discriminant > 0.0).then(|| (radius * Vec3::Z - t * wo) / inner)
    }
}

impl SilhouetteBtf for Shell {
    fn eval(&self, query: &Query) -> Answer {
        let Some(normal) = self.hit(query.wo, query.kappa_hat) else { return Answer::default() };
        let cosine = normal.dot(query.wi).max(0.0);
        Answer { rgb: Vec3::splat(ALBEDO / std::f32::consts::PI * cosine), alpha: 1.0 }
    }

    fn alpha(&self, _: Vec2, wo: Vec3, kappa_hat: f32) -> f32 {
        if self.hit(wo, kappa_hat).is_some() { 1.0 } else { 0.0 }
    }
}

/// An upright tube without ends, from -8 to 8, whose UV are arc length and height.
fn tube(radius: f64) -> Mesh {
    let columns = 720_u32;
    let (mut points, mut normals, mut uvs) = (Vec::new(), Vec::new(), Vec::new());
    for y in [-8.0, 8.0] {
        for j in 0..=columns {
            let phi = std::f64::consts::TAU * f64::from(j) / f64::from(columns);
            let normal = Vec3d::new(phi.sin(), 0.0, phi.cos());
            points.push(normal * radius + Vec3d::y() * y);
            normals.push(normal);
            uvs.push([radius * phi, y]);
        }
    }
    let quads = (0..columns).map(|a| [a, a + 1, a + columns + 2, a + columns + 1]);
    let triangles = quads.flat_map(|[a, b, c, d]| [[a, b, c], [a, c, d]]).collect();
    Mesh::new(points, triangles)
        .and_then(|m| m.with_normals(normals))
        .and_then(|m| m.with_uv_set(uvs))
        .expect("a tube")
}

const DEPTH: f32 = 0.15;

/// The bounding tube with the shell under it, or what it stands for.
#[derive(Debug, Clone, Copy, PartialEq)]
enum Kind {
    Bounding { tile_size: f32, scale: f32 },
    Displaced,
}

fn instance(kind: Kind) -> MeshInstance {
    let Kind::Bounding { tile_size, scale } = kind else {
        return object(tube(f64::from(1.0 - DEPTH)), Material::lambert(Vec3::splat(ALBEDO)));
    };
    let silhouette = SilhouetteMaterial {
        btf: Arc::new(Shell { depth: DEPTH / tile_size }),
        depth: DEPTH / tile_size,
        tiles: [scale / tile_size; 2],
        tile_size,
        sampler: Arc::new(Sampler::cosine()),
        query: QueryForm::Chord,
    };
    let material = Material { silhouette: Some(silhouette), ..Material::default() };
    let mut object = object(tube(1.0 / f64::from(scale)), material);
    object.field = Some(Arc::new(Across(scale)));
    object.placement.scale = scale;
    object
}

/// Curvature across an upright tube of this curvature, whatever the direction: all that looks for it here is level.
#[derive(Debug)]
struct Across(f32);

impl DirectionalCurvature for Across {
    fn along(&self, _: usize, _: [f32; 3], _: Vec3) -> Option<f32> {
        Some(self.0)
    }

    fn ask(&self, _: usize, _: [f32; 3], _: Vec3) -> Option<RayCurvature> {
        Some(RayCurvature { kappa: self.0, across: None, uv_rate: None })
    }
}

fn view(kind: Kind) -> Scene {
    scene(vec![instance(kind)], 64, Vec3::new(0.0, 0.0, 200.0), Vec3::ZERO, 0.7)
}

/// All sizes of tile and scale stand for the same thing.
const BOUNDINGS: [Kind; 3] = [
    Kind::Bounding { tile_size: 1.0, scale: 1.0 },
    Kind::Bounding { tile_size: 0.25, scale: 1.0 },
    Kind::Bounding { tile_size: 2.0, scale: 40.0 },
];

#[test]
fn a_shell_looks_like_what_is_in_it() {
    // From the side and from behind: where the shell is lit from below the horizon of the bounding surface.
    for to_light in [Vec3::new(0.6, 0.3, 0.7), Vec3::new(0.9, 0.0, -0.44)] {
        let lit = |kind| {
            let mut scene = view(kind);
            scene.lights.push(Light::Directional { direction: -to_light, irradiance: Vec3::splat(2.0) });
            let options =
                RenderOptions { stop: StopRule::Samples(256), max_depth: 1, ..RenderOptions::default() };
            run(&scene, &options).film.radiance()
        };
        let expected = lit(Kind::Displaced);
        assert!(expected.iter().any(|p| p.x > 0.1) && expected.iter().any(|p| p.x == 0.0), "light and dark");
        for kind in BOUNDINGS {
            for (k, (found, expected)) in lit(kind).iter().zip(&expected).enumerate() {
                // A pixel is 1 / 26 of a radius; at the rim the noise of 256 samples of a step is up to 0.5 / sqrt(256), and at
                // the terminator the facets of 720 columns differ.
                let bound = 0.035 * 2.0 * ALBEDO / std::f32::consts::PI;
                assert!((found.x - expected.x).abs() < bound, "{kind:?} pixel {k}: {found} for {expected}");
            }
        }
    }
}

#[test]
fn all_lights_and_strategies_agree_with_what_is_in_the_shell() {
    // So far away that it does not matter that a ray towards it starts at the bounding surface.
    let lamp = RectangleLight::facing(Vec3::new(80.0, 20.0, 20.0), Vec3::ZERO, 60.0, 60.0, Vec3::splat(5.0));
    let set = |scene: &mut Scene, case: usize| match case {
        0 => scene.environment = Environment::Constant(Vec3::splat(0.8)),
        _ => scene.lights.push(Light::Rectangle(lamp)),
    };
    for case in 0..2 {
        let render = |kind, strategy| {
            let mut scene = view(kind);
            scene.width = 16;
            scene.height = 16;
            set(&mut scene, case);
            mean_and_error(&run(&scene, &independent(1000, 1, strategy, 7)))
        };
        let expected = render(Kind::Displaced, Strategy::Combined);
        for strategy in [Strategy::Combined, Strategy::Bsdf] {
            assert_agree(render(BOUNDINGS[0], strategy), expected, &format!("case {case} {strategy:?}"));
        }
    }
}

#[test]
fn shadows_on_other_things_are_those_of_what_is_in_the_shell() {
    let shaded = |kind| {
        let mut scene = view(kind);
        // A wall behind the tube, lit from the viewer's side so that the shadow falls beside the tube.
        let mut wall = object(plane(12.0, 0.0), Material::lambert(Vec3::ONE));
        wall.placement.rotation = glam::Mat3::from_rotation_x(std::f32::consts::FRAC_PI_2);
        wall.placement.translation = Vec3::new(0.0, 0.0, -3.0);
        scene.objects.push(wall);
        scene.width = 24;
        scene.height = 24;
        scene.camera = osculate_render::Camera::look_at(
            Vec3::new(0.0, 0.0, 200.0),
            Vec3::new(-2.0, 0.0, 0.0),
            Vec3::Y,
            1.6_f32.to_radians(),
        );
        let irradiance = Vec3::splat(2.0);
        scene.lights.push(Light::Directional { direction: Vec3::new(-1.0, 0.0, -1.0), irradiance });
        run(&scene, &RenderOptions { stop: StopRule::Samples(256), max_depth: 1, ..RenderOptions::default() })
    };
    let (found, expected) = (shaded(BOUNDINGS[0]), shaded(Kind::Displaced));
    let mean = |r: &Rendering| {
        let pixels = r.film.radiance();
        pixels.iter().map(|p| p.x).sum::<f32>() / pixels.len() as f32
    };
    let (a, b) = (mean(&found), mean(&expected));
    assert!((a / b - 1.0).abs() < 2e-3, "{a} {b}");
    assert!(found.counters.pass_throughs > 0 && found.counters.opacity_queries > 0);
}

/// All kinds of light on all kinds of surface: two tubes under different materials, which light each other through a pane.
fn crowd(materials: [Material; 2]) -> Scene {
    let mut scene = view(BOUNDINGS[0]);
    let [one, two] = materials.map(|material| {
        let mut tube = instance(BOUNDINGS[0]);
        tube.surface = SurfaceSource::Material(material);
        tube
    });
    let mut two = two;
    two.placement.translation = Vec3::new(-1.4, 0.0, -1.8);
    let clay = Material { roughness: 0.3, ..Material::lambert(Vec3::splat(0.6)) };
    let mut wall = object(plane(6.0, 0.0), clay);
    wall.placement.rotation = glam::Mat3::from_rotation_x(std::f32::consts::FRAC_PI_2);
    wall.placement.translation.z = -4.0;
    let mut pane = object(plane(0.8, 0.0), Material { opacity: 0.3, ..Material::default() });
    pane.placement.rotation = wall.placement.rotation;
    pane.placement.translation = Vec3::new(-0.5, 0.5, 2.0);
    scene.objects = vec![one, two, wall, pane];
    scene.camera = osculate_render::Camera::look_at(
        Vec3::new(0.0, 0.0, 30.0),
        Vec3::new(-0.6, 0.0, 0.0),
        Vec3::Y,
        7.0_f32.to_radians(),
    );
    // No multiple of a tile's side.
    (scene.width, scene.height) = (19, 17);
    let lamp = RectangleLight::facing(Vec3::new(3.0, 2.0, 3.0), Vec3::ZERO, 2.0, 2.0, Vec3::splat(8.0));
    let sun = Light::Directional { direction: Vec3::new(1.0, -0.5, -0.8), irradiance: Vec3::ONE };
    scene.lights = vec![Light::Rectangle(lamp), sun];
    scene.environment = Environment::Constant(Vec3::new(0.2, 0.3, 0.5));
    scene
}

fn covered(btf: Arc<dyn SilhouetteBtf + Send + Sync>, depth: f32) -> Material {
    let sampler = Arc::new(Sampler::cosine());
    let silhouette =
        SilhouetteMaterial { btf, depth, tiles: [1.0; 2], tile_size: 1.0, sampler, query: QueryForm::Chord };
    Material { silhouette: Some(silhouette), ..Material::default() }
}

fn asked(scene: &Scene, queries: Queries, strategy: Strategy, max_depth: u32, threads: usize) -> Rendering {
    let stop = StopRule::Samples(7);
    let options = RenderOptions { stop, queries, strategy, max_depth, ..RenderOptions::default() };
    let pool = rayon::ThreadPoolBuilder::new().num_threads(threads).build().expect("a pool");
    pool.install(|| run(scene, &options))
}

/// The two integrators are two programs; closed forms give them the same answers.
#[test]
fn paths_side_by_side_are_paths_one_by_one_to_the_bit() {
    let scene = crowd([0.15, 0.3].map(|depth| covered(Arc::new(Shell { depth }), depth)));
    for strategy in [Strategy::Combined, Strategy::Lights, Strategy::Bsdf] {
        for max_depth in [0, 1, 5] {
            let one = asked(&scene, Queries::Single, strategy, max_depth, 1);
            for (paths, threads) in [(1, 1), (50, 2), (100_000, 1)] {
                let many = asked(&scene, Queries::Batched { paths }, strategy, max_depth, threads);
                let name = format!("{strategy:?}, {max_depth} surfaces, {paths} paths, {threads} threads");
                assert_eq!(many.counters, one.counters, "{name}");
                let differing =
                    one.film.radiance().iter().zip(many.film.radiance()).position(|(a, b)| *a != b);
                assert_eq!(differing, None, "{name}: this pixel");
            }
            let counters = one.counters;
            let reflects = counters.opacity_queries > 0 && counters.pass_throughs > 0;
            assert!(reflects && (max_depth == 0) == (counters.reflectance_queries == 0), "{counters:?}");
        }
    }
}

/// Models give other sums in batches, by 3e-4 of 1 + rgb at most (the bound of the tests of `infer`). A pixel here is a mean of paths of
/// up to three factors below 2, so that it stays within three times that, in proportion to the picture's brightest.
#[test]
fn batches_of_a_model_make_the_picture_of_its_single_queries() {
    let model = |seed| {
        let form = Architecture { opacity: OpacityHead::Direct, ..Architecture::taps(0.1) };
        infer::Material::new(&StoredModel::new(&Model::untrained(form, seed), Precision::F16))
    };
    let scene = crowd([1, 2].map(|seed| covered(Arc::new(model(seed)), 0.1)));
    let one = asked(&scene, Queries::Single, Strategy::Combined, 3, 1);
    let many = [(1024, 1), (33, 2)]
        .map(|(paths, threads)| asked(&scene, Queries::Batched { paths }, Strategy::Combined, 3, threads));
    assert_eq!(many[0].film.radiance(), many[1].film.radiance(), "batch size and threads change nothing");
    let brightest = one.film.radiance().iter().map(|p| p.max_element()).fold(0.0, f32::max);
    let off = |(a, b): (&Vec3, &Vec3)| (*a - *b).abs().max_element() / brightest;
    let worst = one.film.radiance().iter().zip(&many[0].film.radiance()).map(off).fold(0.0, f32::max);
    assert!(worst < 9e-4, "off by {worst} of {brightest}");
}

/// A patch of 2 x 2 that is bent by this much, under an untrained model of a height field, with a lamp near its rim.
fn bent(bend: f64) -> Scene {
    let mesh = shapes::grid(12, 12, [shapes::Ends::Open; 2], |u, v| {
        let (x, y) = (2.0 * u - 1.0, 2.0 * v - 1.0);
        Vec3d::new(x, y, bend * (x * x + 1.3 * y * y))
    });
    let uvs = mesh.positions().iter().map(|p| [1.5 * p.x + 0.2 * p.y, p.y]).collect();
    let mesh = mesh.with_uv_set(uvs).expect("a UV per vertex");
    let estimates = estimate(&Surface::new(&mesh, Weld::Off), &CurvatureOptions::default()).expect("valid");
    let model = StoredModel::new(&Model::untrained(Architecture::taps(0.1), 3), Precision::F16);
    let material = covered(Arc::new(infer::Material::new(&model)), 0.1);
    let object = MeshInstance { curvature: Some(estimates.into()), ..object(mesh, material) };
    let mut scene = scene(vec![object], 24, Vec3::new(0.5, -3.5, 2.5), Vec3::ZERO, 40.0);
    let lamp = RectangleLight::facing(Vec3::new(1.6, 0.3, 0.9), Vec3::ZERO, 0.6, 0.6, Vec3::splat(9.0));
    scene.lights = vec![Light::Rectangle(lamp)];
    scene
}

#[test]
fn what_an_object_need_not_be_asked_changes_no_bit() {
    // Bowls and planes are opaque under a height field; a dome is not.
    for (bend, curvature, opacity) in [(0.0, false, false), (0.4, true, false), (-0.4, true, true)] {
        let scene = bent(bend);
        let plan = plan(&scene, 5);
        let planned = RenderOptions { stop: StopRule::Samples(6), max_depth: 5, ..RenderOptions::default() };
        for queries in [Queries::Single, Queries::default()] {
            let planned = RenderOptions { queries, ..planned };
            let rendering = run(&scene, &planned);
            let forced = run(&scene, &RenderOptions { force: Some(Effects::ALL), ..planned });
            let case = format!("bent by {bend}, {queries:?}: {:?}", rendering.counters);
            assert!(rendering.film.radiance() == forced.film.radiance(), "{case}");
            let Counters { curvature_evaluations, opacity_queries, shadow_rays, .. } = rendering.counters;
            assert_eq!((curvature_evaluations > 0, opacity_queries > 0), (curvature, opacity), "{case}");
            assert!(shadow_rays > 100, "{case}");
            assert_eq!(plan.contradictions(&rendering.counters), Vec::<String>::new(), "{case}");
            // And the check would see it.
            let broken = plan.contradictions(&forced.counters).len();
            assert_eq!(broken, usize::from(!curvature) + usize::from(!opacity), "{case}");
        }
    }
}

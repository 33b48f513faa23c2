//! For each effect of a plan a scene that calls for it and scenes that do without: what tests force on, and what
//! `examples/effect_pairs.rs` counts the instructions of.

use std::path::Path;
use std::sync::Arc;

use glam::{Mat3, Vec3};
use osculate_geom::curvature::{CurvatureOptions, estimate};
use osculate_geom::field::{CurvatureField, Filter, FilterKind, FilterQuery, SurfacePoint, WalkLength};
use osculate_geom::mesh::{Surface, Weld};
use osculate_geom::{Mesh, Vec3 as Vec3d, shapes};
use osculate_render::scene::{
    DirectionalCurvature, QueryForm, RayCurvature, SilhouetteMaterial, SurfaceSource,
};
use osculate_render::{
    Camera, Effects, Environment, Light, Material, MeshInstance, RectangleLight, Scene, Texture,
};
use osculate_sbtf::file::ModelFile;
use osculate_sbtf::infer::{self, Precision, StoredModel};
use osculate_sbtf::model::{Architecture, Model};
use osculate_sbtf::sampling::Sampler;

/// A scene, and how many surfaces a path may have in it.
#[derive(Debug, Clone)]
pub struct Case {
    pub scene: Scene,
    pub max_depth: u32,
    /// Whether what is left out could not change a bit; otherwise it is rounding.
    pub is_exact: bool,
}

/// With an effect, and without it.
#[derive(Debug)]
pub struct Pair {
    pub with: Case,
    /// The first is like the one with it otherwise; others do without for other reasons.
    pub without: Vec<Case>,
}

/// Says what stands for all effects but directional light: the least that shows anything.
pub const ALL_BUT_A_SUN: &str = "all but directional lights";

/// What simulates an effect where a plan does without it. Effects of materials with silhouettes are forced by forcing anything.
pub fn forcing(effect: &str, planned: Effects) -> Effects {
    match effect {
        "environment" => Effects { environment: true, ..planned },
        "area lights" => Effects { area_lights: true, ..planned },
        "directional lights" => Effects { directional_lights: true, ..planned },
        "interreflection" => Effects { interreflection: true, ..planned },
        "textures" => Effects { textures: true, ..planned },
        "transparency" | "shadow pass-through" => Effects { transparency: true, ..planned },
        "silhouettes" | "below-horizon light" => Effects { silhouettes: true, ..planned },
        "depth of field" => Effects { depth_of_field: true, ..planned },
        ALL_BUT_A_SUN => Effects::ALL,
        _ => planned,
    }
}

/// The pair of an effect, by its name in a plan; `None` if nobody made one.
pub fn pair(effect: &str) -> Option<Pair> {
    let pair = match effect {
        "environment" => pair_of(clay([sun()], SKY), [clay([sun()], Environment::Black)]),
        "area lights" => {
            pair_of(clay([sun(), lamp()], Environment::Black), [clay([sun()], Environment::Black)])
        }
        "directional lights" => pair_of(clay([lamp(), sun()], SKY), [clay([lamp()], SKY)]),
        "interreflection" => {
            let direct = Case { max_depth: 1, ..clay([sun()], SKY) };
            pair_of(clay([sun()], SKY), [direct, black()])
        }
        "textures" => pair_of(textured(), [clay([sun()], SKY)]),
        "transparency" | "shadow pass-through" => pair_of(behind_a_pane(), [clay([sun()], SKY)]),
        "parallax offset" => {
            let mut shallow = stones(&Form::Torus, Filter::Point);
            let (_, material) = model(&without_depth(), Sampler::cosine(), [6.0, 3.0]);
            shallow.scene.objects[0].surface = SurfaceSource::Material(material);
            pair_of(stones(&Form::Torus, Filter::Point), [shallow, clay([sun()], SKY)])
        }
        "silhouettes" | "below-horizon light" => {
            pair_of(stones(&Form::Torus, Filter::Point), [clay([sun()], SKY)])
        }
        "silhouette opacity" => pair_of(
            stones(&Form::Bent(-0.4), Filter::Chord),
            [stones(&Form::Bent(0.4), Filter::Chord), stones(&Form::Bent(0.0), Filter::Chord)],
        ),
        "depth of field" => {
            let mut blurred = clay([sun()], SKY);
            blurred.scene.camera = blurred.scene.camera.with_lens(0.05, 4.0);
            pair_of(blurred, [clay([sun()], SKY)])
        }
        "curvature" => pair_of(
            stones(&Form::Bent(0.4), Filter::Point),
            [stones(&Form::Bent(0.0), Filter::Point), stones(&Form::Bent(0.0), Filter::Chord)],
        ),
        "curvature filter" => pair_of(
            stones(&Form::Torus, Filter::Chord),
            [stones(&Form::Torus, Filter::Point), stones(&Form::Bent(0.0), Filter::Chord)],
        ),
        ALL_BUT_A_SUN => {
            let least = Case { max_depth: 1, ..clay([sun()], Environment::Black) };
            pair_of(stones(&Form::Torus, Filter::Chord), [least])
        }
        _ => return None,
    };
    Some(pair)
}

fn pair_of(with: Case, without: impl Into<Vec<Case>>) -> Pair {
    Pair { with, without: without.into() }
}

const SKY: Environment = Environment::Constant(Vec3::new(0.3, 0.4, 0.6));

fn sun() -> Light {
    Light::Directional { direction: Vec3::new(-0.6, -1.0, -0.5), irradiance: Vec3::splat(2.0) }
}

fn lamp() -> Light {
    let place = Vec3::new(1.5, 2.5, 1.0);
    Light::Rectangle(RectangleLight::facing(place, Vec3::ZERO, 0.8, 0.8, Vec3::splat(12.0)))
}

fn object(mesh: Mesh, material: Material) -> MeshInstance {
    MeshInstance { surface: SurfaceSource::Material(material), ..MeshInstance::new(Arc::new(mesh)) }
}

/// A square of side 2 around the origin, facing up, with UV.
fn square() -> Mesh {
    let at = |p: &Vec3d| [0.5 * p.x + 0.5, 0.5 - 0.5 * p.z];
    let corners = [[-1.0, -1.0], [-1.0, 1.0], [1.0, 1.0], [1.0, -1.0]].map(|[x, z]| Vec3d::new(x, 0.0, z));
    let uvs = corners.iter().map(at).collect();
    Mesh::new(corners.to_vec(), vec![[0, 1, 2], [0, 2, 3]])
        .and_then(|m| m.with_uv_set(uvs))
        .expect("a square")
}

/// Seen from the side and a little above.
fn seen(objects: Vec<MeshInstance>, lights: Vec<Light>, environment: Environment) -> Case {
    let scene = Scene {
        camera: Camera::look_at(Vec3::new(0.3, 2.2, 3.6), Vec3::ZERO, Vec3::Y, 40.0_f32.to_radians()),
        width: 48,
        height: 36,
        objects,
        lights,
        environment,
        exposure: 0.0,
    };
    Case { scene, max_depth: 4, is_exact: true }
}

/// A torus on a floor, both of clay.
fn clay(lights: impl Into<Vec<Light>>, environment: Environment) -> Case {
    let grey = Material { roughness: 0.5, ..Material::lambert(Vec3::splat(0.5)) };
    let mut torus = object(shapes::torus(1.0, 0.4, 48, 24), grey.clone());
    torus.placement.rotation = Mat3::from_rotation_x(-std::f32::consts::FRAC_PI_2);
    let mut floor = object(square(), grey);
    floor.placement.scale = 2.0;
    floor.placement.translation.y = -0.4;
    seen(vec![torus, floor], lights.into(), environment)
}

/// The same, all black and dull.
fn black() -> Case {
    let mut case = clay([sun(), lamp()], SKY);
    for object in &mut case.scene.objects {
        object.surface = SurfaceSource::Material(Material::lambert(Vec3::ZERO));
    }
    case
}

/// The same on a patterned floor.
fn textured() -> Case {
    let mut case = clay([sun()], SKY);
    let texels = (0..64_u8).map(|i| [4 * i, 255 - 2 * i, 90]).collect();
    if let SurfaceSource::Material(material) = &mut case.scene.objects[1].surface {
        material.base_color_texture = Some(Arc::new(Texture::from_srgb(8, 8, texels)));
    }
    case
}

/// The same below a pane that lets light through.
fn behind_a_pane() -> Case {
    let mut case = clay([sun()], SKY);
    let mut pane = object(square(), Material { opacity: 0.4, ..Material::default() });
    pane.placement.translation.y = 0.7;
    case.scene.objects.push(pane);
    case
}

/// What neural stones lie on.
enum Form {
    Torus,
    /// A patch of 2 x 2, bent up by this much at its rim: a bowl if positive, a dome if negative.
    Bent(f64),
}

/// Bare shipped stones under a sun and a sky.
fn stones(form: &Form, filter: Filter) -> Case {
    let (mesh, tiles) = match *form {
        Form::Torus => (shapes::torus_with_uv(1.0, 0.45, 96, 48), [6.0, 3.0]),
        Form::Bent(bend) => (patch(bend), [1.0; 2]),
    };
    let surface = Surface::new(&mesh, Weld::Exact).into_owned();
    let estimates = estimate(&surface, &CurvatureOptions::default()).expect("a valid surface");
    let spread = surface.spread(estimates.clone());
    let (depth, material) = stone(tiles);
    let mut stones = object(mesh, material);
    let field = CurvatureField::new(surface, estimates).with_uv_set(&stones.mesh, 0);
    let walk = WalkLength::Shell { depth: f64::from(depth) };
    let kind = filter.kind();
    stones.curvature = Some(spread.into());
    stones.field = Some(Arc::new(Field { field, filter, walk }));
    if let Form::Torus = form {
        stones.placement.rotation = Mat3::from_rotation_x(-std::f32::consts::FRAC_PI_2);
    }
    let mut case = seen(vec![stones], vec![sun()], SKY);
    // A walk over a plane finds the rate of its UV again, but for rounding.
    case.is_exact = !(matches!(form, Form::Bent(0.0)) && kind == FilterKind::Chord);
    case
}

fn patch(bend: f64) -> Mesh {
    let mesh = shapes::grid(24, 24, [shapes::Ends::Open; 2], |u, v| {
        let (x, z) = (2.0 * u - 1.0, 1.0 - 2.0 * v);
        Vec3d::new(x, bend * (x * x + 1.3 * z * z), z)
    });
    let uvs = mesh.positions().iter().map(|p| [1.5 * p.x + 0.2 * p.z, p.z]).collect();
    mesh.with_uv_set(uvs).expect("a UV per vertex")
}

fn stone(tiles: [f32; 2]) -> (f32, Material) {
    let path = Path::new(env!("CARGO_MANIFEST_DIR")).join("../../assets/materials/stone-1.sbtf");
    let file = ModelFile::read(&path).expect("the shipped model");
    model(&file.model, file.sampler.unwrap_or_else(Sampler::cosine), tiles)
}

/// A model, untrained, of something without depth.
fn without_depth() -> StoredModel {
    StoredModel::new(&Model::untrained(Architecture::taps(0.0), 4), Precision::U8)
}

/// The depth of a model, and a material of it.
fn model(model: &StoredModel, sampler: Sampler, tiles: [f32; 2]) -> (f32, Material) {
    let depth = model.architecture.depth;
    let btf = Arc::new(infer::Material::new(model));
    let (sampler, query) = (Arc::new(sampler), QueryForm::Chord);
    let silhouette = SilhouetteMaterial { btf, depth, tiles, tile_size: 1.0, sampler, query };
    (depth, Material { silhouette: Some(silhouette), ..Material::default() })
}

/// Curvature for rays, by a filter.
#[derive(Debug)]
struct Field {
    field: CurvatureField<'static>,
    filter: Filter,
    walk: WalkLength,
}

impl Field {
    /// What a filter makes of a ray that comes from this direction.
    #[allow(clippy::cast_possible_truncation, reason = "rendering is f32")]
    fn filtered_by(&self, filter: &Filter, point: SurfacePoint, direction: Vec3) -> Option<RayCurvature> {
        let query = FilterQuery { point, w: widen(direction), length: self.walk };
        let answer = filter.ask(&self.field, &query)?;
        let uv_rate = answer.uv_rate.map(|rate| rate.map(|q| q as f32));
        Some(RayCurvature { kappa: answer.kappa as f32, across: Some(answer.across as f32), uv_rate })
    }
}

fn widen(v: Vec3) -> Vec3d {
    Vec3d::new(v.x.into(), v.y.into(), v.z.into()).normalize()
}

fn point(triangle: usize, barycentrics: [f32; 3]) -> SurfacePoint {
    SurfacePoint { triangle, barycentric: barycentrics.map(f64::from) }
}

#[allow(clippy::cast_possible_truncation, reason = "rendering is f32")]
impl DirectionalCurvature for Field {
    fn along(&self, triangle: usize, barycentrics: [f32; 3], direction: Vec3) -> Option<f32> {
        self.field.kappa_along(point(triangle, barycentrics), widen(direction)).map(|kappa| kappa as f32)
    }

    fn ask(&self, triangle: usize, barycentrics: [f32; 3], direction: Vec3) -> Option<RayCurvature> {
        self.filtered_by(&self.filter, point(triangle, barycentrics), direction)
    }

    fn at_point(&self, triangle: usize, barycentrics: [f32; 3], direction: Vec3) -> Option<RayCurvature> {
        self.filtered_by(&Filter::Point, point(triangle, barycentrics), direction)
    }

    fn filter(&self) -> FilterKind {
        self.filter.kind()
    }
}

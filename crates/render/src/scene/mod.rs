//! What a picture is made of: [`Scene`], [`MeshInstance`], [`Material`].

mod build;
mod checker;
mod file;
mod form;
mod instances;
mod micro_surface;
mod preview;
mod silhouette;
mod silhouette_section;
mod told;

use std::sync::Arc;

use glam::{Mat3, Vec3};
use osculate_geom::Mesh;
use osculate_geom::curvature::VertexCurvature;
use osculate_geom::field::FilterKind;

pub use file::{
    CurvatureSection, LoadRequest, LoadedMesh, MeshLoader, MeshSource, SceneFile, SceneFileError, Shell,
};
pub use form::MaterialForm;
pub use instances::{GridSection, InstanceSection, InstancesSection, ScaleSection};
pub(crate) use micro_surface::MicroPoint;
pub use micro_surface::{LayError, Laying, MicroSurface};
pub use preview::PreviewOptions;
pub use silhouette::{QueryForm, SilhouetteMaterial};
pub use told::ToldCurvature;

use crate::camera::Camera;
use crate::lights::{Environment, Light};
use crate::texture::{Texture, TextureError};

/// Everything that a picture shows.
#[derive(Debug, Clone)]
pub struct Scene {
    /// The camera.
    pub camera: Camera,
    /// Image width in pixels.
    pub width: u32,
    /// Image height in pixels.
    pub height: u32,
    /// The meshes.
    pub objects: Vec<MeshInstance>,
    /// Light sources at finite places, and directional ones.
    pub lights: Vec<Light>,
    /// Light from infinitely far.
    pub environment: Environment,
    /// Exposure in stops for pictures of 8 bits: colours are multiplied by 2 to this power.
    pub exposure: f32,
}

/// A mesh in the scene.
#[derive(Debug, Clone)]
pub struct MeshInstance {
    /// The mesh. Without normals it is shaded smoothly, with normals weighted by angle.
    pub mesh: Arc<Mesh>,
    /// Baked curvature, one entry per mesh vertex.
    pub curvature: Option<Arc<[VertexCurvature]>>,
    /// Curvature along a direction, for the pictures that show it.
    pub field: Option<Arc<dyn DirectionalCurvature>>,
    /// What it is made of.
    pub surface: SurfaceSource,
    /// Where it stands.
    pub placement: Placement,
    /// Whether the object is part of the studio: framing, curvature pictures and their ranges leave it out.
    pub role: Role,
}

/// Whether an object is what the picture is about.
#[derive(Debug, Clone, Copy, PartialEq, Eq, Default)]
pub enum Role {
    /// What the picture shows.
    #[default]
    Subject,
    /// What it stands on or in front of.
    Backdrop,
}

/// Where an object's material comes from.
#[derive(Debug, Clone, Default)]
pub enum SurfaceSource {
    /// From the parts of the mesh; a light grey where they name none.
    #[default]
    Mesh,
    /// One material for all of it.
    Material(Material),
}

/// Curvature at any point of a mesh along any direction, in the mesh's own space.
///
/// `triangle` and `barycentrics` name the point; `direction` need not be unit or tangent. `None` where the data does not
/// determine a curvature.
pub trait DirectionalCurvature: std::fmt::Debug + Send + Sync {
    /// Curvature along the direction, 1/length.
    fn along(&self, triangle: usize, barycentrics: [f32; 3], direction: Vec3) -> Option<f32>;

    /// Curvature along the direction after the filter, 1/length; see [`osculate_geom::field::Filter`].
    fn filtered(&self, triangle: usize, barycentrics: [f32; 3], direction: Vec3) -> Option<f32> {
        self.ask(triangle, barycentrics, direction).map(|answer| answer.kappa)
    }

    /// What the filter makes of a ray that comes from `direction`.
    fn ask(&self, triangle: usize, barycentrics: [f32; 3], direction: Vec3) -> Option<RayCurvature>;

    /// The same without looking past the point: what [`Filter::Point`](osculate_geom::field::Filter::Point) makes of the ray. All that a build
    /// without filters has.
    fn at_point(&self, triangle: usize, barycentrics: [f32; 3], direction: Vec3) -> Option<RayCurvature> {
        self.ask(triangle, barycentrics, direction)
    }

    /// Which filter it is, for the plan; [`FilterKind::Point`] for what does not look past the point.
    fn filter(&self) -> FilterKind {
        FilterKind::Point
    }
}

/// What a filter makes of a ray, in the mesh's own units.
#[derive(Debug, Clone, Copy, PartialEq)]
pub struct RayCurvature {
    /// Curvature, 1/length.
    pub kappa: f32,
    /// Curvature across the ray's plane, 1/length, if it is known.
    pub across: Option<f32>,
    /// Mean UV displacement per unit of length the way the ray travels, if the filter finds it.
    pub uv_rate: Option<[f32; 2]>,
}

/// A similarity: `world = translation + scale * rotation * object`.
#[derive(Debug, Clone, Copy, PartialEq)]
pub struct Placement {
    /// Rotation; orthonormal with determinant 1.
    pub rotation: Mat3,
    /// Uniform scale, positive.
    pub scale: f32,
    /// Translation in world units.
    pub translation: Vec3,
}

impl Default for Placement {
    /// In place.
    fn default() -> Self {
        Self { rotation: Mat3::IDENTITY, scale: 1.0, translation: Vec3::ZERO }
    }
}

impl Placement {
    /// Where a point of the object is in the world.
    #[must_use]
    pub fn world_from_object(&self, p: Vec3) -> Vec3 {
        self.translation + self.scale * (self.rotation * p)
    }

    /// First `before`, then this.
    #[must_use]
    pub fn after(&self, before: &Self) -> Self {
        Self {
            rotation: self.rotation * before.rotation,
            scale: self.scale * before.scale,
            translation: self.world_from_object(before.translation),
        }
    }
}

/// What a surface is made of.
#[derive(Debug, Clone)]
pub struct Material {
    /// Name, for messages.
    pub name: String,
    /// Linear RGB colour in `[0, 1]`; multiplies the texture. The albedo of a dielectric's base, the reflectance of a metal.
    pub base_color: Vec3,
    /// sRGB picture, addressed with UV set 0.
    pub base_color_texture: Option<Arc<Texture>>,
    /// 0 for dielectrics, 1 for metals, mixed between.
    pub metallic: f32,
    /// Perceptual roughness in `[0, 1]`; GGX's `alpha` is its square.
    pub roughness: f32,
    /// Strength of the dielectric layer in `[0, 1]`: reflectance at normal incidence is 0.08 of it. 0 is exactly Lambert.
    pub specular: f32,
    /// Share of light that the surface stops, in `[0, 1]`; the rest passes straight through.
    pub opacity: f32,
    /// A material with silhouettes, which takes the place of all of the above.
    pub silhouette: Option<SilhouetteMaterial>,
    /// A microstructure on triangles, whose maps take the place of colour, metalness and roughness.
    pub micro: Option<MicroSurface>,
}

impl Default for Material {
    /// A light grey dielectric of roughness 0.6.
    fn default() -> Self {
        Self {
            name: String::new(),
            base_color: Vec3::splat(0.8),
            base_color_texture: None,
            metallic: 0.0,
            roughness: 0.6,
            specular: 0.5,
            opacity: 1.0,
            silhouette: None,
            micro: None,
        }
    }
}

impl Material {
    /// A diffuse reflector of this albedo.
    #[must_use]
    pub fn lambert(albedo: Vec3) -> Self {
        Self { base_color: albedo, specular: 0.0, ..Self::default() }
    }

    /// The material that a mesh file describes.
    ///
    /// # Errors
    ///
    /// A texture that cannot be decoded.
    pub fn from_mesh_file(material: &osculate_geom::Material) -> Result<Self, TextureError> {
        let texture = material.base_color_texture.as_ref().map(|image| Texture::decode(&image.bytes));
        Ok(Self {
            name: material.name.clone(),
            base_color: Vec3::from(material.base_color),
            base_color_texture: texture.transpose()?.map(Arc::new),
            metallic: material.metallic.clamp(0.0, 1.0),
            roughness: material.roughness.clamp(0.0, 1.0),
            ..Self::default()
        })
    }
}

impl MeshInstance {
    /// A mesh in place with its own materials and no curvature.
    #[must_use]
    pub fn new(mesh: Arc<Mesh>) -> Self {
        Self {
            mesh,
            curvature: None,
            field: None,
            surface: SurfaceSource::Mesh,
            placement: Placement::default(),
            role: Role::Subject,
        }
    }

    /// Vertex positions in the world.
    pub(crate) fn world_positions(&self) -> impl Iterator<Item = Vec3> + '_ {
        let points = self.mesh.positions().iter();
        points.map(|p| self.placement.world_from_object(osculate_geom::rays::to_f32(p)))
    }

    /// Whether its curvature comes from a filter that looks past the point.
    pub(crate) fn filters(&self) -> bool {
        self.field.as_ref().is_some_and(|field| field.filter() != FilterKind::Point)
    }

    /// Corners of the bounding box in the world, or `None` without vertices.
    #[must_use]
    pub fn bounds(&self) -> Option<(Vec3, Vec3)> {
        let mut world = self.world_positions();
        let first = world.next()?;
        Some(world.fold((first, first), |(lower, upper), p| (lower.min(p), upper.max(p))))
    }
}

impl Scene {
    /// Corners of the bounding box of all subjects, or `None` without any.
    #[must_use]
    pub fn subject_bounds(&self) -> Option<(Vec3, Vec3)> {
        let subjects = self.objects.iter().filter(|o| o.role == Role::Subject);
        subjects.filter_map(MeshInstance::bounds).reduce(|a, b| (a.0.min(b.0), a.1.max(b.1)))
    }
}

//! [`Prepared`]: the scene as the integrator wants it, made once.

use std::collections::HashMap;

use glam::Vec3;
use osculate_geom::mesh::{Weld, smooth_normals};
use osculate_geom::rays::{Bvh, Hit, to_f32};
use osculate_geom::{Mesh, Vec3 as Vec3d};
use osculate_sbtf::brdf::EnergyTable;
use thiserror::Error;

use crate::curvature::ObjectPoint;
use crate::lights::{EnvironmentSampler, Light, RectangleLight};
use crate::math::luminance;
use crate::scene::{Material, MeshInstance, RayCurvature, Scene, SurfaceSource};

/// Why a scene cannot be rendered.
#[derive(Debug, Error)]
pub enum SceneError {
    /// A texture of a mesh cannot be decoded.
    #[error("object {object}, material {material:?}: {source}")]
    Texture {
        /// Index of the object.
        object: usize,
        /// Name of the material.
        material: String,
        /// What is wrong.
        source: crate::texture::TextureError,
    },
    /// A position beyond the range of `f32`.
    #[error("object {object}: vertex {vertex} is at {position:?}, beyond what single precision holds")]
    TooFar {
        /// Index of the object.
        object: usize,
        /// Index of the vertex.
        vertex: usize,
        /// Where it is.
        position: [f64; 3],
    },
    /// Curvature that belongs to another mesh.
    #[error("object {object}: curvature of {found} vertices for a mesh of {vertices}")]
    CurvatureLength {
        /// Index of the object.
        object: usize,
        /// Entries.
        found: usize,
        /// Vertices.
        vertices: usize,
    },
    /// An image without pixels, or larger than any use.
    #[error("an image of {width} x {height} pixels; each side must be 1 to 32768")]
    ImageSize {
        /// Width.
        width: u32,
        /// Height.
        height: u32,
    },
}

/// Directional light, normalised.
#[derive(Debug)]
pub(crate) struct Sun {
    /// Unit direction to the light.
    pub wi: Vec3,
    pub irradiance: Vec3,
    pub importance: f32,
}

/// Triangles of all objects in one hierarchy, followed by those of the area lights.
#[derive(Debug)]
pub(crate) struct Prepared {
    pub bvh: Bvh,
    /// Vertex indices of the triangles of objects.
    pub indices: Vec<[u32; 3]>,
    pub normals: Vec<Vec3>,
    /// Empty if no material has a texture.
    pub uvs: Vec<[f32; 2]>,
    pub material_of: Vec<u32>,
    pub materials: Vec<Material>,
    pub objects: Vec<MeshInstance>,
    /// First triangle of each object, and the end.
    pub object_starts: Vec<usize>,
    pub rectangles: Vec<RectangleLight>,
    pub suns: Vec<Sun>,
    pub environment: Option<EnvironmentSampler>,
    pub energy: EnergyTable,
}

impl Prepared {
    pub(crate) fn new(scene: &Scene) -> Result<Self, SceneError> {
        let mut builder = Builder::default();
        for (index, object) in scene.objects.iter().enumerate() {
            builder.add(index, object)?;
        }
        let mut rectangles = Vec::new();
        let mut suns = Vec::new();
        for light in &scene.lights {
            match light {
                Light::Rectangle(r) if r.area() > 0.0 && r.radiance != Vec3::ZERO => rectangles.push(*r),
                Light::Directional { direction, irradiance } => {
                    let Some(along) = direction.try_normalize() else { continue };
                    if *irradiance != Vec3::ZERO {
                        suns.push(Sun {
                            wi: -along,
                            irradiance: *irradiance,
                            importance: luminance(*irradiance),
                        });
                    }
                }
                Light::Rectangle(_) => {}
            }
        }
        builder.object_starts.push(builder.indices.len());
        let mut triangles = builder.triangles;
        for [a, b, c, d] in rectangles.iter().map(RectangleLight::corners) {
            triangles.extend([[a, b, c], [a, c, d]]);
        }
        Ok(Self {
            bvh: Bvh::new(triangles),
            indices: builder.indices,
            normals: builder.normals,
            uvs: builder.uvs,
            material_of: builder.material_of,
            materials: builder.materials,
            objects: scene.objects.clone(),
            object_starts: builder.object_starts,
            rectangles,
            suns,
            environment: EnvironmentSampler::new(&scene.environment),
            energy: EnergyTable::new(),
        })
    }

    /// The area light that a triangle belongs to.
    pub(crate) fn rectangle_of(&self, triangle: u32) -> Option<usize> {
        (triangle as usize).checked_sub(self.indices.len()).map(|beyond| beyond / 2)
    }

    /// Curvature for the ray that comes from `wo` and hits an object, 1/length in the world.
    pub(crate) fn ray_curvature(&self, hit: &Hit, wo: Vec3) -> Option<RayCurvature> {
        let (object, triangle) = self.object_of(hit.triangle)?;
        ObjectPoint { object: &self.objects[object], triangle, barycentrics: hit.barycentrics }.ask(wo)
    }

    /// The object that a triangle belongs to, and its number there.
    pub(crate) fn object_of(&self, triangle: u32) -> Option<(usize, usize)> {
        let triangle = triangle as usize;
        if triangle >= self.indices.len() {
            return None;
        }
        let object = self.object_starts.partition_point(|&start| start <= triangle) - 1;
        Some((object, triangle - self.object_starts[object]))
    }
}

#[derive(Default)]
struct Builder {
    triangles: Vec<[Vec3; 3]>,
    indices: Vec<[u32; 3]>,
    normals: Vec<Vec3>,
    uvs: Vec<[f32; 2]>,
    material_of: Vec<u32>,
    materials: Vec<Material>,
    object_starts: Vec<usize>,
}

impl Builder {
    fn add(&mut self, index: usize, object: &MeshInstance) -> Result<(), SceneError> {
        let mesh = &*object.mesh;
        check(index, object)?;
        self.object_starts.push(self.indices.len());
        let place = |p: &Vec3d| object.placement.world_from_object(to_f32(p));
        let positions: Vec<Vec3> = mesh.positions().iter().map(place).collect();
        if let Some(vertex) = positions.iter().position(|p| !p.is_finite()) {
            let position = mesh.positions()[vertex].into();
            return Err(SceneError::TooFar { object: index, vertex, position });
        }
        let first = u32::try_from(self.normals.len()).expect("a scene has fewer than 2^32 vertices");
        let normals = vertex_normals(mesh);
        self.normals
            .extend(normals.iter().map(|n| (object.placement.rotation * to_f32(n)).normalize_or_zero()));
        match mesh.uv_sets().first() {
            #[allow(clippy::cast_possible_truncation, reason = "rendering is f32")]
            Some(uvs) => self.uvs.extend(uvs.iter().map(|uv| uv.map(|x| x as f32))),
            None => self.uvs.resize(self.normals.len(), [0.0; 2]),
        }
        for corners in mesh.triangles() {
            self.triangles.push(corners.map(|v| positions[v as usize]));
            self.indices.push(corners.map(|v| first + v));
        }
        self.add_materials(index, object)
    }

    fn add_materials(&mut self, index: usize, object: &MeshInstance) -> Result<(), SceneError> {
        let mesh = &*object.mesh;
        if let SurfaceSource::Material(material) = &object.surface {
            let number = self.push_material(material.clone());
            self.material_of.resize(self.indices.len(), number);
            return Ok(());
        }
        let mut numbers: HashMap<Option<usize>, u32> = HashMap::new();
        for part in mesh.parts() {
            let number = match numbers.get(&part.material) {
                Some(&number) => number,
                None => {
                    let described =
                        part.material.map_or_else(Default::default, |m| mesh.materials()[m].clone());
                    let material = Material::from_mesh_file(&described).map_err(|source| {
                        SceneError::Texture { object: index, material: described.name.clone(), source }
                    })?;
                    let number = self.push_material(material);
                    numbers.insert(part.material, number);
                    number
                }
            };
            self.material_of.resize(self.material_of.len() + part.triangles.len(), number);
        }
        Ok(())
    }

    fn push_material(&mut self, material: Material) -> u32 {
        self.materials.push(material);
        u32::try_from(self.materials.len() - 1).expect("a scene has fewer than 2^32 materials")
    }
}

fn check(index: usize, object: &MeshInstance) -> Result<(), SceneError> {
    let vertices = object.mesh.positions().len();
    match object.curvature.as_ref().map(|c| c.len()) {
        Some(found) if found != vertices => {
            Err(SceneError::CurvatureLength { object: index, found, vertices })
        }
        _ => Ok(()),
    }
}

/// The mesh's normals; where it has none, smooth ones weighted by the triangles' angles. Not unit; zero if undefined.
fn vertex_normals(mesh: &Mesh) -> Vec<Vec3d> {
    if let Some(normals) = mesh.normals() {
        return normals.to_vec();
    }
    smooth_normals(mesh, Weld::Exact)
}

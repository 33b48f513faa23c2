//! [`Prepared`]: the scene as the integrator wants it, made once.

use std::collections::HashMap;
use std::sync::Arc;

use glam::Vec3;
use osculate_geom::field::FilterKind;
use osculate_geom::mesh::{Weld, smooth_normals};
use osculate_geom::rays::{Bvh, to_f32};
use osculate_geom::{Mesh, Vec3 as Vec3d};
use osculate_sbtf::brdf::EnergyTable;
use thiserror::Error;

use crate::counters::Counters;
use crate::curvature::ObjectPoint;
use crate::geometry::{Geometry, Placed};
use crate::lights::{EnvironmentSampler, Light, RectangleLight};
use crate::math::luminance;
use crate::scene::{Material, MeshInstance, Placement, RayCurvature, Scene, SurfaceSource};
use crate::told::{Told, told};

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
    /// More triangles than there are numbers for them.
    #[error(
        "object {object}: {triangles} triangles with those of the objects before it; a scene has at most 2^32"
    )]
    TooMany {
        /// Index of the object.
        object: usize,
        /// Triangles so far.
        triangles: u64,
    },
    /// An effect that this build was made without, see [`EFFECTS`](crate::EFFECTS).
    #[error(
        "the scene calls for {effect} ({reason}), which this build lacks; build it without OSCULATE_WITHOUT"
    )]
    Lacking {
        /// Which one.
        effect: &'static str,
        /// Why it is called for.
        reason: String,
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

/// A scene with everything that does not change while it is traced worked out. Tables have a row for every triangle of objects that
/// are alone with their mesh, in the world's space, then for every triangle of meshes that several objects share, in their own.
#[derive(Debug)]
pub(crate) struct Prepared {
    pub geometry: Geometry,
    /// Vertex indices of the triangles.
    indices: Vec<[u32; 3]>,
    normals: Vec<Vec3>,
    /// Empty if no material has a texture.
    uvs: Vec<[f32; 2]>,
    material_of: Vec<u32>,
    pub materials: Vec<Material>,
    pub objects: Vec<MeshInstance>,
    /// First triangle and number of each object that is alone with its mesh, and the end.
    object_starts: Vec<(usize, usize)>,
    pub rectangles: Vec<RectangleLight>,
    pub suns: Vec<Sun>,
    pub environment: Option<EnvironmentSampler>,
    pub energy: EnergyTable,
    /// Per object; all of it where there are no silhouettes.
    told: Vec<Told>,
    /// Whether the objects' fields walk.
    walks: bool,
}

impl Prepared {
    pub(crate) fn new(scene: &Scene) -> Result<Self, SceneError> {
        let shared = shared_meshes(scene);
        let mut builder = Builder::default();
        for (index, object) in scene.objects.iter().enumerate() {
            if !shared.contains_key(&MeshKey::of(object)) {
                builder.add(index, object)?;
            }
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
        builder.object_starts.push((builder.indices.len(), scene.objects.len()));
        let mut triangles = std::mem::take(&mut builder.triangles);
        for [a, b, c, d] in rectangles.iter().map(RectangleLight::corners) {
            triangles.extend([[a, b, c], [a, c, d]]);
        }
        let placed = builder.add_shared(scene, shared, triangles.len() as u64)?;
        Ok(Self {
            geometry: Geometry::new(triangles, placed),
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
            told: told(scene),
            walks: scene.filter != FilterKind::Point,
        })
    }

    /// Asks everything everywhere, to check that leaving out changes nothing.
    pub(crate) fn tell_all(&mut self) {
        self.told.fill(Told::ALL);
    }

    /// What the material of an object is told.
    #[inline(always)]
    pub(crate) fn told(&self, object: usize) -> Told {
        self.told[object].in_this_build()
    }

    /// The area light that a triangle belongs to.
    pub(crate) fn rectangle_of(&self, triangle: u32) -> Option<usize> {
        let beyond = (triangle as usize).checked_sub(self.flat_triangles())?;
        (beyond < 2 * self.rectangles.len()).then_some(beyond / 2)
    }

    /// Triangles of objects that are alone with their mesh.
    fn flat_triangles(&self) -> usize {
        self.object_starts.last().map_or(0, |&(end, _)| end)
    }

    /// The material of a triangle, `None` for that of an area light.
    #[inline]
    pub(crate) fn material_of(&self, triangle: u32) -> Option<&Material> {
        let number = if (triangle as usize) < self.flat_triangles() {
            self.material_of[triangle as usize]
        } else {
            let (placed, local) = self.geometry.placed(triangle)?;
            placed.material.unwrap_or_else(|| self.material_of[placed.row + local])
        };
        Some(&self.materials[number as usize])
    }

    /// What the tables have of a triangle of an object.
    #[inline(always)]
    pub(crate) fn facet(&self, triangle: u32) -> Facet {
        let (row, place) = match self.geometry.placed(triangle) {
            None => (triangle as usize, None),
            Some((placed, local)) => (placed.row + local, Some(placed.place)),
        };
        let vertices = self.indices[row].map(|v| v as usize);
        let normals = vertices.map(|v| self.normals[v]);
        Facet {
            corners: self.geometry.corners(triangle),
            normals: place.map_or(normals, |place| normals.map(|n| place.rotation * n)),
            uvs: (!self.uvs.is_empty()).then(|| vertices.map(|v| self.uvs[v])),
        }
    }

    /// Curvature for the ray that comes from `wo` and hits a triangle of an object, 1/length in the world.
    pub(crate) fn ray_curvature(
        &self,
        (object, triangle): (usize, usize),
        barycentrics: [f32; 3],
        wo: Vec3,
        counters: &mut Counters,
    ) -> Option<RayCurvature> {
        let object = &self.objects[object];
        counters.curvature_evaluations += u64::from(object.field.is_some() || object.curvature.is_some());
        counters.filter_walks += u64::from(self.walks && object.field.is_some());
        ObjectPoint { object, triangle, barycentrics }.ask(wo)
    }

    /// The object that a triangle belongs to, and its number there.
    pub(crate) fn object_of(&self, triangle: u32) -> Option<(usize, usize)> {
        if let Some((placed, local)) = self.geometry.placed(triangle) {
            return Some((placed.object, local));
        }
        let triangle = triangle as usize;
        if triangle >= self.flat_triangles() {
            return None;
        }
        let (start, object) =
            self.object_starts[self.object_starts.partition_point(|&(start, _)| start <= triangle) - 1];
        Some((object, triangle - start))
    }
}

/// A triangle in the world, with what its vertices carry.
#[derive(Debug, Clone, Copy)]
pub(crate) struct Facet {
    pub corners: [Vec3; 3],
    pub normals: [Vec3; 3],
    /// `None` if no material has a texture.
    pub uvs: Option<[[f32; 2]; 3]>,
}

impl Facet {
    /// UV at a point; zero if no object has any.
    pub(crate) fn uv_at(&self, [u, v, w]: [f32; 3]) -> [f32; 2] {
        let blend =
            |[a, b, c]: [[f32; 2]; 3]| [0, 1].map(|axis: usize| u * a[axis] + v * b[axis] + w * c[axis]);
        self.uvs.map_or([0.0; 2], blend)
    }
}

/// What tells meshes apart: which it is, and whether its own materials are on it, which take rows of their own.
#[derive(Debug, Clone, Copy, PartialEq, Eq, Hash)]
struct MeshKey(*const Mesh, bool);

impl MeshKey {
    fn of(object: &MeshInstance) -> Self {
        Self(Arc::as_ptr(&object.mesh), matches!(object.surface, SurfaceSource::Mesh))
    }
}

/// Rows and hierarchy of a mesh that several objects share, once they are made, and how far its farthest corner is from its origin.
type Shared = HashMap<MeshKey, Option<(usize, Arc<Bvh>, f32)>>;

/// Meshes that more than one object has.
fn shared_meshes(scene: &Scene) -> Shared {
    let mut counts: HashMap<MeshKey, usize> = HashMap::new();
    for object in &scene.objects {
        *counts.entry(MeshKey::of(object)).or_default() += 1;
    }
    counts.into_iter().filter(|&(_, count)| count > 1).map(|(key, _)| (key, None)).collect()
}

#[derive(Default)]
struct Builder {
    triangles: Vec<[Vec3; 3]>,
    indices: Vec<[u32; 3]>,
    normals: Vec<Vec3>,
    uvs: Vec<[f32; 2]>,
    material_of: Vec<u32>,
    materials: Vec<Material>,
    object_starts: Vec<(usize, usize)>,
}

impl Builder {
    fn add(&mut self, index: usize, object: &MeshInstance) -> Result<(), SceneError> {
        check(index, object)?;
        self.object_starts.push((self.indices.len(), index));
        let corners = self.add_rows(index, object, &object.placement)?;
        self.triangles.extend(corners);
        self.add_materials(index, object)
    }

    /// Rows of the objects that share meshes, numbered from `first`.
    fn add_shared(
        &mut self,
        scene: &Scene,
        mut shared: Shared,
        first: u64,
    ) -> Result<Vec<Placed>, SceneError> {
        let mut placed = Vec::new();
        let mut next = first;
        for (index, object) in scene.objects.iter().enumerate() {
            let Some(mesh) = shared.get_mut(&MeshKey::of(object)) else { continue };
            check(index, object)?;
            let (row, bvh, farthest) = match mesh {
                Some(known) => known.clone(),
                None => {
                    let row = self.indices.len();
                    let corners = self.add_rows(index, object, &Placement::default())?;
                    match object.surface {
                        SurfaceSource::Mesh => self.add_materials(index, object)?,
                        // Each object has its own.
                        SurfaceSource::Material(_) => self.material_of.resize(self.indices.len(), 0),
                    }
                    let farthest = corners.iter().flatten().map(|p| p.length()).fold(0.0, f32::max);
                    mesh.insert((row, Arc::new(Bvh::new(corners)), farthest)).clone()
                }
            };
            let reach = object.placement.scale * farthest + object.placement.translation.length();
            if !reach.is_finite()
                && let Some(position) = out_of_reach(&bvh, &object.placement)
            {
                return Err(SceneError::TooFar { object: index, vertex: 0, position });
            }
            let material = match &object.surface {
                SurfaceSource::Mesh => None,
                SurfaceSource::Material(material) => Some(self.push_material(material.clone())),
            };
            let triangles = next + bvh.triangles().len() as u64;
            let Ok(first) = u32::try_from(next) else {
                return Err(SceneError::TooMany { object: index, triangles });
            };
            if triangles > u64::from(u32::MAX) {
                return Err(SceneError::TooMany { object: index, triangles });
            }
            next = triangles;
            placed.push(Placed {
                first,
                object: index,
                row,
                material,
                mesh: bvh,
                place: object.placement.into(),
            });
        }
        Ok(placed)
    }

    /// Adds what the tables have of a mesh; its triangles in this place.
    fn add_rows(
        &mut self,
        index: usize,
        object: &MeshInstance,
        placement: &Placement,
    ) -> Result<Vec<[Vec3; 3]>, SceneError> {
        let mesh = &*object.mesh;
        let place = |p: &Vec3d| placement.world_from_object(to_f32(p));
        let positions: Vec<Vec3> = mesh.positions().iter().map(place).collect();
        if let Some(vertex) = positions.iter().position(|p| !p.is_finite()) {
            let position = mesh.positions()[vertex].into();
            return Err(SceneError::TooFar { object: index, vertex, position });
        }
        let first = u32::try_from(self.normals.len()).expect("a scene has fewer than 2^32 vertices");
        let normals = vertex_normals(mesh);
        self.normals.extend(normals.iter().map(|n| (placement.rotation * to_f32(n)).normalize_or_zero()));
        match mesh.uv_sets().first() {
            #[allow(clippy::cast_possible_truncation, reason = "rendering is f32")]
            Some(uvs) => self.uvs.extend(uvs.iter().map(|uv| uv.map(|x| x as f32))),
            None => self.uvs.resize(self.normals.len(), [0.0; 2]),
        }
        self.indices.extend(mesh.triangles().iter().map(|corners| corners.map(|v| first + v)));
        Ok(mesh.triangles().iter().map(|corners| corners.map(|v| positions[v as usize])).collect())
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

/// A corner of the mesh that single precision cannot place there, in the mesh's own space.
fn out_of_reach(mesh: &Bvh, placement: &Placement) -> Option<[f64; 3]> {
    let mut corners = mesh.triangles().iter().flatten();
    let far = |p: &&Vec3| !placement.world_from_object(**p).is_finite();
    corners.find(far).map(|p| p.to_array().map(f64::from))
}

/// The mesh's normals; where it has none, smooth ones weighted by the triangles' angles. Not unit; zero if undefined.
fn vertex_normals(mesh: &Mesh) -> Vec<Vec3d> {
    if let Some(normals) = mesh.normals() {
        return normals.to_vec();
    }
    smooth_normals(mesh, Weld::Exact)
}

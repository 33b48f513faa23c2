//! [`Prepared`]: the scene as the integrator wants it, made once.

mod error;
mod tables;

use glam::Vec3;
use osculate_sbtf::brdf::EnergyTable;

pub use error::SceneError;
use tables::{Builder, MeshKey, shared_meshes};

use crate::counters::Counters;
use crate::curvature::ObjectPoint;
use crate::geometry::Geometry;
use crate::lights::{EnvironmentSampler, Light, RectangleLight};
use crate::math::luminance;
use crate::scene::{Material, MeshInstance, RayCurvature, Scene};
use crate::told::{Told, told};

/// Largest coordinate of objects in pictures. Products of lengths are in single precision: of ten times larger scenes, studio included, the lights
/// were wrong.
pub const FARTHEST: f32 = 2e10;

/// Largest coordinate of the subjects of the smallest pictures. Products of lengths underflow below: lights are off by a thousandth at a quarter of this.
pub const SMALLEST: f32 = 1e-13;

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
    /// Per object: whether its field looks past the point.
    filters: Vec<bool>,
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
        builder.check_size()?;
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
            filters: scene.objects.iter().map(MeshInstance::filters).collect(),
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
        let (object, filters) = (&self.objects[object], self.filters[object]);
        counters.curvature_evaluations += u64::from(object.field.is_some() || object.curvature.is_some());
        counters.filter_walks += u64::from(filters);
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

//! [`Builder`]: the rows that the triangles, vertices and materials of a scene's objects become.

use std::collections::HashMap;
use std::sync::Arc;

use glam::Vec3;
use osculate_geom::mesh::{Weld, smooth_normals};
use osculate_geom::rays::{Bvh, to_f32};
use osculate_geom::{Mesh, Vec3 as Vec3d};

use super::{FARTHEST, SMALLEST, SceneError};
use crate::geometry::Placed;
use crate::scene::{Material, MeshInstance, Placement, Role, Scene, SurfaceSource};

/// What tells meshes apart: which it is, and whether its own materials are on it, which take rows of their own.
#[derive(Debug, Clone, Copy, PartialEq, Eq, Hash)]
pub(super) struct MeshKey(*const Mesh, bool);

impl MeshKey {
    pub fn of(object: &MeshInstance) -> Self {
        Self(Arc::as_ptr(&object.mesh), matches!(object.surface, SurfaceSource::Mesh))
    }
}

/// Rows and hierarchy of a mesh that several objects share, once they are made, and how far its farthest corner is from its origin.
pub(super) type Shared = HashMap<MeshKey, Option<(usize, Arc<Bvh>, f32)>>;

/// Meshes that more than one object has.
pub(super) fn shared_meshes(scene: &Scene) -> Shared {
    let mut counts: HashMap<MeshKey, usize> = HashMap::new();
    for object in &scene.objects {
        *counts.entry(MeshKey::of(object)).or_default() += 1;
    }
    counts.into_iter().filter(|&(_, count)| count > 1).map(|(key, _)| (key, None)).collect()
}

/// The tables of a scene while objects come in.
#[derive(Default)]
pub(super) struct Builder {
    /// Corners of the triangles of objects that are alone with their mesh.
    pub triangles: Vec<[Vec3; 3]>,
    pub indices: Vec<[u32; 3]>,
    pub normals: Vec<Vec3>,
    pub uvs: Vec<[f32; 2]>,
    pub material_of: Vec<u32>,
    pub materials: Vec<Material>,
    pub object_starts: Vec<(usize, usize)>,
    /// How far subjects reach from the origin.
    reach: f32,
}

impl Builder {
    fn note(&mut self, object: &MeshInstance, reach: f32) {
        if object.role == Role::Subject {
            self.reach = self.reach.max(reach);
        }
    }

    /// Refuses scenes whose subjects are too small, but for points at the origin.
    pub fn check_size(&self) -> Result<(), SceneError> {
        let reach = self.reach;
        if reach > 0.0 && reach < SMALLEST { Err(SceneError::TooSmall { reach }) } else { Ok(()) }
    }

    /// Rows of an object that is alone with its mesh.
    pub fn add(&mut self, index: usize, object: &MeshInstance) -> Result<(), SceneError> {
        check(index, object)?;
        self.object_starts.push((self.indices.len(), index));
        let corners = self.add_rows(index, object, &object.placement)?;
        self.note(object, corners.iter().flatten().map(|p| p.abs().max_element()).fold(0.0, f32::max));
        self.triangles.extend(corners);
        self.add_materials(index, object)
    }

    /// Rows of the objects that share meshes, numbered from `first`.
    pub fn add_shared(
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
            if exceeds(Vec3::splat(reach))
                && let Some(position) = out_of_reach(&bvh, &object.placement)
            {
                return Err(SceneError::TooFar { object: index, vertex: 0, position });
            }
            self.note(object, reach);
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
        // What stands behind objects may be larger than they are.
        let too_far = |p: &Vec3| if object.role == Role::Backdrop { !p.is_finite() } else { exceeds(*p) };
        if let Some(vertex) = positions.iter().position(too_far) {
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

/// Whether a point is beyond [`FARTHEST`], or no point.
fn exceeds(p: Vec3) -> bool {
    !p.abs().cmple(Vec3::splat(FARTHEST)).all()
}

/// A corner of the mesh that is too far away there, in the mesh's own space.
fn out_of_reach(mesh: &Bvh, placement: &Placement) -> Option<[f64; 3]> {
    let mut corners = mesh.triangles().iter().flatten();
    let far = |p: &&Vec3| exceeds(placement.world_from_object(**p));
    corners.find(far).map(|p| p.to_array().map(f64::from))
}

/// The mesh's normals; where it has none, smooth ones weighted by the triangles' angles. Not unit; zero if undefined.
fn vertex_normals(mesh: &Mesh) -> Vec<Vec3d> {
    if let Some(normals) = mesh.normals() {
        return normals.to_vec();
    }
    smooth_normals(mesh, Weld::Exact)
}

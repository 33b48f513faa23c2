//! Primitives put together to one mesh.

use std::collections::BTreeMap;
use std::collections::hash_map::{Entry, HashMap};

use ::gltf::Semantic;
use ::gltf::json::Index;
use ::gltf::json::accessor::Accessor;
use ::gltf::json::mesh::{Mode, Primitive};
use ::gltf::json::validation::Checked;
use nalgebra::Matrix4;

use super::GltfError;
use super::file::{GltfFile, item, label, valid};
use super::material::UvTransform;
use super::scene::Instance;
use crate::io::ReadProblem;
use crate::io::warnings::Warnings;
use crate::{Mat3, Material, Mesh, Part, Vec3};

/// Instances multiply a small file: 2^28 vertices take 6 GB, more than any scene that is worth a bake.
const MOST_VERTICES: usize = 1 << 28;
const MOST_TRIANGLES: usize = 1 << 28;

/// Primitives of a mesh share vertices if they have the same accessors and the same texture transform.
type VertexKey = (Vec<(Semantic, usize)>, Option<[u32; 5]>);

/// A run of mesh vertices that come from one set of accessors.
#[derive(Debug, Clone)]
struct VertexBlock {
    /// The first of them.
    first: usize,
    /// How many.
    rows: usize,
    /// What was applied to the positions; affine.
    world_from_object: Matrix4<f64>,
}

/// The mesh so far.
pub(super) struct Assembly<'a> {
    file: &'a GltfFile<'a>,
    positions: Vec<Vec3>,
    normals: Vec<Vec3>,
    has_normals: bool,
    uv_sets: Vec<Vec<[f64; 2]>>,
    triangles: Vec<[u32; 3]>,
    parts: Vec<Part>,
    blocks: Vec<VertexBlock>,
}

impl<'a> Assembly<'a> {
    pub fn new(file: &'a GltfFile<'a>) -> Self {
        Self {
            file,
            positions: Vec::new(),
            normals: Vec::new(),
            has_normals: false,
            uv_sets: Vec::new(),
            triangles: Vec::new(),
            parts: Vec::new(),
            blocks: Vec::new(),
        }
    }

    /// Adds all primitives of a mesh.
    pub fn add_instance(&mut self, instance: &Instance, warnings: &mut Warnings) -> Result<(), GltfError> {
        let mesh = item(&self.file.root.meshes, instance.mesh, "mesh", &instance.node)?;
        let mesh_label = label("mesh", instance.mesh.value(), mesh.name.as_ref());
        let mut known: HashMap<VertexKey, usize> = HashMap::new();
        for (number, primitive) in mesh.primitives.iter().enumerate() {
            let place = format!("{mesh_label}, primitive {number}");
            let mode = valid(&primitive.mode, "mode", &place)?;
            if matches!(mode, Mode::Points | Mode::Lines | Mode::LineLoop | Mode::LineStrip) {
                warnings.add("lines", || format!("{place}: lines and points are left out"));
                continue;
            }
            if primitive.targets.as_ref().is_some_and(|t| !t.is_empty()) {
                warnings.add("targets", || format!("{place}: morph targets are left out"));
            }
            let attributes = attributes(primitive);
            let material = primitive.material;
            let json_material =
                material.map(|m| item(&self.file.root.materials, m, "material", &place)).transpose()?;
            let uv_transform = json_material.and_then(UvTransform::of);
            let accessors = attributes.iter().map(|(semantic, i)| (semantic.clone(), i.value())).collect();
            let block = match known.entry((accessors, uv_transform.map(|t| t.key()))) {
                Entry::Occupied(block) => *block.get(),
                Entry::Vacant(slot) => {
                    *slot.insert(self.add_vertices(&attributes, uv_transform, instance, &place)?)
                }
            };
            let start = self.triangles.len();
            self.add_triangles(primitive, mode, block, &place)?;
            if self.triangles.len() > MOST_TRIANGLES {
                return Err(too_large(instance, MOST_TRIANGLES, "triangles"));
            }
            let name = mesh.name.clone().unwrap_or_default();
            let triangles = start..self.triangles.len();
            self.parts.push(Part { name, triangles, material: material.map(|m| m.value()) });
        }
        Ok(())
    }

    /// Appends the vertices of a set of accessors and returns the number of their block.
    fn add_vertices(
        &mut self,
        attributes: &BTreeMap<Semantic, Index<Accessor>>,
        uv_transform: Option<UvTransform>,
        instance: &Instance,
        place: &str,
    ) -> Result<usize, GltfError> {
        let Some(&position) = attributes.get(&Semantic::Positions) else {
            return Err(GltfError::BadValue { place: place.into(), what: "attributes.POSITION" });
        };
        let first = self.positions.len();
        let rows = self.rows::<3>(position, "POSITION", None, place)?;
        let count = rows.len();
        if first + count > MOST_VERTICES {
            return Err(too_large(instance, MOST_VERTICES, "vertices"));
        }
        let world_from_object = instance.world_from_object;
        let moved = world_from_object != Matrix4::identity();
        let linear: Mat3 = world_from_object.fixed_view::<3, 3>(0, 0).into_owned();
        let offset: Vec3 = world_from_object.fixed_view::<3, 1>(0, 3).into_owned();
        let place_of = |p: [f64; 3]| if moved { linear * Vec3::from(p) + offset } else { Vec3::from(p) };
        self.positions.extend(rows.into_iter().map(place_of));
        if self.positions[first..].iter().any(|p| !p.iter().all(|x| x.is_finite())) {
            return Err(GltfError::BadTransform { node: instance.node.clone() });
        }
        self.normals.resize(first, Vec3::zeros());
        if let Some(&normal) = attributes.get(&Semantic::Normals) {
            let rows = self.rows::<3>(normal, "NORMAL", Some(count), place)?;
            let turned = |n: [f64; 3]| if moved { turn_normal(&linear, n.into()) } else { n.into() };
            self.normals.extend(rows.into_iter().map(turned));
            self.has_normals = true;
        }
        self.normals.resize(first + count, Vec3::zeros());
        self.add_uvs(attributes, uv_transform, first, count, place)?;
        self.blocks.push(VertexBlock { first, rows: count, world_from_object });
        Ok(self.blocks.len() - 1)
    }

    fn add_uvs(
        &mut self,
        attributes: &BTreeMap<Semantic, Index<Accessor>>,
        uv_transform: Option<UvTransform>,
        first: usize,
        count: usize,
        place: &str,
    ) -> Result<(), GltfError> {
        // Sets must be numbered without gaps, which also bounds them.
        for (set, number) in (0_u32..).enumerate() {
            let Some(&uv) = attributes.get(&Semantic::TexCoords(number)) else { break };
            let rows = self.rows::<2>(uv, &format!("TEXCOORD_{number}"), Some(count), place)?;
            if self.uv_sets.len() == set {
                self.uv_sets.push(Vec::new());
            }
            self.uv_sets[set].resize(first, [0.0; 2]);
            let transform = uv_transform.filter(|_| set == 0);
            let moved = rows.into_iter().map(|uv| transform.map_or(uv, |t| t.apply(uv)));
            self.uv_sets[set].extend(moved.map(|[u, v]| [u, 1.0 - v]));
        }
        for uvs in &mut self.uv_sets {
            uvs.resize(first + count, [0.0; 2]);
        }
        Ok(())
    }

    /// The rows of an attribute, finite and as many as there are positions.
    fn rows<const N: usize>(
        &self,
        accessor: Index<Accessor>,
        attribute: &str,
        count: Option<usize>,
        place: &str,
    ) -> Result<Vec<[f64; N]>, GltfError> {
        let rows: Vec<[f64; N]> = self.file.rows_f64(accessor, &format_args!("{place}: {attribute}"))?;
        let (primitive, attribute) = (place.to_owned(), attribute.to_owned());
        if let Some(vertices) = count.filter(|&n| n != rows.len()) {
            return Err(GltfError::RowCount { primitive, attribute, found: rows.len(), vertices });
        }
        match rows.iter().position(|row| !row.iter().all(|x| x.is_finite())) {
            Some(vertex) => {
                Err(GltfError::NotFinite { primitive, attribute, vertex, value: rows[vertex].to_vec() })
            }
            None => Ok(rows),
        }
    }

    fn add_triangles(
        &mut self,
        primitive: &Primitive,
        mode: Mode,
        block: usize,
        place: &str,
    ) -> Result<(), GltfError> {
        let VertexBlock { first, rows, world_from_object } = &self.blocks[block];
        let base = u32::try_from(*first).expect("bounded by MOST_VERTICES");
        let all = u32::try_from(*rows).expect("bounded by MOST_VERTICES");
        let indices = match primitive.indices {
            Some(accessor) => self.file.indices(accessor, &format_args!("{place}: indices"))?,
            None => (0..all).collect(),
        };
        if let Some(number) = indices.iter().position(|&i| i >= all) {
            let vertex = indices[number];
            return Err(GltfError::BadIndex { primitive: place.into(), number, vertex, vertices: *rows });
        }
        // A mirror turns triangles inside out.
        let mirrored = world_from_object.fixed_view::<3, 3>(0, 0).determinant() < 0.0;
        let mut push = |[a, b, c]: [u32; 3]| {
            let [b, c] = if mirrored { [c, b] } else { [b, c] };
            self.triangles.push([base + a, base + b, base + c]);
        };
        match mode {
            Mode::TriangleStrip => {
                for (i, t) in indices.windows(3).enumerate() {
                    let odd = i % 2;
                    push([t[0], t[1 + odd], t[2 - odd]]);
                }
            }
            Mode::TriangleFan => {
                for edge in indices.get(1..).unwrap_or_default().windows(2) {
                    push([indices[0], edge[0], edge[1]]);
                }
            }
            _ if indices.len() % 3 != 0 => {
                return Err(GltfError::IndexCount { primitive: place.into(), count: indices.len() });
            }
            _ => indices.chunks_exact(3).for_each(|t| push([t[0], t[1], t[2]])),
        }
        Ok(())
    }

    pub fn into_mesh(self, materials: Vec<Material>) -> Result<Mesh, ReadProblem> {
        let mut mesh = Mesh::new(self.positions, self.triangles)?;
        if self.has_normals {
            mesh = mesh.with_normals(self.normals)?;
        }
        for uvs in self.uv_sets {
            mesh = mesh.with_uv_set(uvs)?;
        }
        if !self.parts.is_empty() {
            mesh = mesh.with_parts(self.parts, materials)?;
        }
        Ok(mesh)
    }
}

fn too_large(instance: &Instance, limit: usize, what: &'static str) -> GltfError {
    GltfError::TooLarge { node: instance.node.clone(), limit, what }
}

/// The attributes with names that the format allows.
fn attributes(primitive: &Primitive) -> BTreeMap<Semantic, Index<Accessor>> {
    let valid = primitive.attributes.iter().filter_map(|(semantic, &accessor)| match semantic {
        Checked::Valid(semantic) => Some((semantic.clone(), accessor)),
        Checked::Invalid => None,
    });
    valid.collect()
}

/// The inverse transpose of the linear part, as its cofactors: those exist when the part is singular too. Unit length;
/// zero stays zero.
fn turn_normal(linear: &Mat3, normal: Vec3) -> Vec3 {
    let [x, y, z] = [linear.column(0), linear.column(1), linear.column(2)];
    let cofactors = Mat3::from_columns(&[y.cross(&z), z.cross(&x), x.cross(&y)]);
    let turned = cofactors * normal * if linear.determinant() < 0.0 { -1.0 } else { 1.0 };
    // Scaled first: the squares of a tiny or huge transform's cofactors leave the range of f64.
    let largest = turned.amax();
    if largest > 0.0 && largest.is_finite() { (turned / largest).normalize() } else { Vec3::zeros() }
}

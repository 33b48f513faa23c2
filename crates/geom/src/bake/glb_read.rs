//! Reading binary glTF that [`write_glb`](super::write_glb) wrote.

use std::collections::HashMap;

use gltf::Semantic;
use gltf::json::accessor::Accessor;
use gltf::json::mesh::{Mode, Primitive};
use gltf::json::validation::Checked;
use gltf::json::{self, Index, Root};
use serde_json::Value;

use super::error::ReadError;
use super::filter_rows::{FilterRows, is_valid};
use super::rows::{CurvatureRow, SecondDirection, curvature_from_row, widen};
use super::{BakedMesh, FORMAT_VERSION, Provenance};
use crate::curvature::VertexCurvature;
use crate::field::BakedMinimum;
use crate::io::{GltfError, GltfFile, no_files};
use crate::mesh::{Material, Part, TextureImage};
use crate::{Mesh, Vec3};

/// Reads the bytes of a baked `.glb`.
///
/// Primitives that share all vertex attributes share vertices in the result too, so rows come back as they were
/// written. What another program has split is appended.
///
/// # Errors
///
/// [`ReadError::NotBaked`] for glTF without a provenance record, and otherwise what is wrong.
pub fn read_baked_glb(bytes: &[u8]) -> Result<BakedMesh, ReadError> {
    if !bytes.starts_with(b"glTF") {
        return Err(ReadError::invalid("it does not begin like binary glTF"));
    }
    // A bake refers to nothing outside itself.
    let file = GltfFile::parse(bytes, &no_files)?;
    let provenance = provenance(&file.root)?;
    if let Some(node) = file.root.nodes.iter().position(is_transformed) {
        let what = format!("node {node} is transformed, which its baked curvature does not follow");
        return Err(ReadError::invalid(what));
    }
    let mut builder = Builder::new(&file, azimuths(&provenance)?);
    for primitive in file.root.meshes.iter().flat_map(|mesh| &mesh.primitives) {
        builder.append(primitive)?;
    }
    let materials = file.root.materials.iter().map(|m| material(&file, m)).collect::<Result<_, _>>()?;
    builder.finish(materials, provenance)
}

impl From<GltfError> for ReadError {
    fn from(error: GltfError) -> Self {
        Self::invalid(error)
    }
}

fn is_transformed(node: &json::Node) -> bool {
    let identity = [1., 0., 0., 0., 0., 1., 0., 0., 0., 0., 1., 0., 0., 0., 0., 1.];
    node.matrix.is_some_and(|m| m != identity)
        || node.translation.is_some_and(|t| t != [0.0; 3])
        || node.rotation.is_some_and(|r| r.0 != [0.0, 0.0, 0.0, 1.0])
        || node.scale.is_some_and(|s| s != [1.0; 3])
}

fn provenance(root: &Root) -> Result<Provenance, ReadError> {
    let extras = root.asset.extras.as_ref().ok_or(ReadError::NotBaked)?;
    let extras: Value = serde_json::from_str(extras.get()).map_err(|_| ReadError::NotBaked)?;
    provenance_from_json(extras.get("osculate").ok_or(ReadError::NotBaked)?)
}

/// The record that both formats hold, after a look at its version.
pub(super) fn provenance_from_json(value: &Value) -> Result<Provenance, ReadError> {
    let found = value
        .get("format_version")
        .and_then(Value::as_u64)
        .ok_or_else(|| ReadError::invalid("the provenance record has no format_version"))?;
    if found > u64::from(FORMAT_VERSION) {
        return Err(ReadError::Version { found, known: FORMAT_VERSION });
    }
    serde::Deserialize::deserialize(value)
        .map_err(|error| ReadError::invalid(format!("the provenance record: {error}")))
}

/// Directions per vertex that the provenance promises, 0 without a filter.
pub(super) fn azimuths(provenance: &Provenance) -> Result<usize, ReadError> {
    let Some(record) = &provenance.filter else { return Ok(0) };
    let is_valid = record.walk.is_valid() && record.bound_length.is_finite() && record.bound_length >= 0.0;
    if !is_valid {
        let what = format!(
            "the provenance record: a filter over {:?}, bounded for {}; lengths are finite and not negative",
            record.walk, record.bound_length
        );
        return Err(ReadError::invalid(what));
    }
    if BakedMinimum::AZIMUTHS.contains(&record.azimuths) {
        return Ok(record.azimuths);
    }
    let what =
        format!("the provenance record: a filter of {} azimuths; 4, 8, 16 or 32 exist", record.azimuths);
    Err(ReadError::invalid(what))
}

/// Names the first value of a vertex's filter that cannot be one.
pub(super) fn check_filter(vertex: usize, values: impl Iterator<Item = f32>) -> Result<(), ReadError> {
    match values.into_iter().find(|&x| !is_valid(x)) {
        None => Ok(()),
        Some(x) => {
            Err(ReadError::invalid(format!("vertex {vertex}: the filter's {x:?} is negative or not finite")))
        }
    }
}

struct Builder<'a> {
    file: &'a GltfFile<'a>,
    positions: Vec<Vec3>,
    normals: Vec<Vec3>,
    uv_sets: Vec<Vec<[f64; 2]>>,
    curvature: Vec<VertexCurvature>,
    /// Of the filter, 0 without one.
    azimuths: usize,
    lowering: Vec<f32>,
    bound: Vec<f32>,
    triangles: Vec<[u32; 3]>,
    parts: Vec<Part>,
    /// First vertex and number of vertices of each set of attributes that has been read, by the accessor indices.
    first_vertex: HashMap<Vec<usize>, (usize, usize)>,
}

impl<'a> Builder<'a> {
    fn new(file: &'a GltfFile<'a>, azimuths: usize) -> Self {
        Self {
            file,
            positions: Vec::new(),
            normals: Vec::new(),
            uv_sets: Vec::new(),
            curvature: Vec::new(),
            azimuths,
            lowering: Vec::new(),
            bound: Vec::new(),
            triangles: Vec::new(),
            parts: Vec::new(),
            first_vertex: HashMap::new(),
        }
    }

    fn append(&mut self, primitive: &Primitive) -> Result<(), ReadError> {
        let key: Vec<usize> = primitive.attributes.values().map(Index::value).collect();
        let (first, count) = match self.first_vertex.get(&key) {
            Some(&rows) => rows,
            None => {
                let rows = (self.positions.len(), self.append_vertices(primitive)?);
                self.first_vertex.insert(key, rows);
                rows
            }
        };
        match primitive.mode {
            Checked::Valid(Mode::Points) if primitive.indices.is_none() => return Ok(()),
            Checked::Valid(Mode::Triangles) => {}
            mode => return Err(ReadError::invalid(format!("a primitive has mode {mode:?}, not triangles"))),
        }
        let indices = match primitive.indices {
            Some(accessor) => self.file.indices(accessor, &"indices")?,
            None => (0..u32::try_from(count).unwrap_or(u32::MAX)).collect(),
        };
        let start = self.triangles.len();
        for corners in indices.chunks(3) {
            let &[a, b, c] = corners else {
                return Err(ReadError::invalid(format!("{} indices are not whole triangles", indices.len())));
            };
            if let Some(index) = [a, b, c].into_iter().find(|&i| i as usize >= count) {
                let what = format!("triangle {} uses vertex {index} of {count}", self.triangles.len());
                return Err(ReadError::invalid(what));
            }
            let shifted = [a, b, c].map(|i| u32::try_from(first + i as usize));
            let [Ok(a), Ok(b), Ok(c)] = shifted else {
                return Err(ReadError::invalid("more vertices than 32-bit indices can name"));
            };
            self.triangles.push([a, b, c]);
        }
        let extras = primitive.extras.as_ref().and_then(|raw| serde_json::from_str::<Value>(raw.get()).ok());
        let name = extras.as_ref().and_then(|e| e.get("name")).and_then(Value::as_str).unwrap_or_default();
        self.parts.push(Part {
            name: name.to_owned(),
            triangles: start..self.triangles.len(),
            material: primitive.material.map(|m| m.value()),
        });
        Ok(())
    }

    /// Appends the vertices of a primitive and returns how many they are.
    fn append_vertices(&mut self, primitive: &Primitive) -> Result<usize, ReadError> {
        let attributes = Attributes { primitive, file: self.file };
        let positions = attributes.floats::<3>(&Semantic::Positions, "POSITION")?;
        let count = positions.len();
        let normals = attributes.floats::<3>(&Semantic::Normals, "NORMAL")?;
        let kappa = attributes.floats::<2>(&extra("CURVATURE"), "_CURVATURE")?;
        let d1 = attributes.floats::<3>(&extra("CURVATURE_DIR"), "_CURVATURE_DIR")?;
        let error = attributes.floats::<1>(&extra("CURVATURE_ERROR"), "_CURVATURE_ERROR")?;
        let status = attributes.bytes(&extra("CURVATURE_STATUS"), "_CURVATURE_STATUS")?;
        for (name, found) in [
            ("NORMAL", normals.len()),
            ("_CURVATURE", kappa.len()),
            ("_CURVATURE_DIR", d1.len()),
            ("_CURVATURE_ERROR", error.len()),
            ("_CURVATURE_STATUS", status.len()),
        ] {
            if found != count {
                return Err(ReadError::invalid(format!("{name} has {found} rows for {count} vertices")));
            }
        }
        for vertex in 0..count {
            let normal = widen(normals[vertex]);
            let [error] = error[vertex];
            let row = CurvatureRow {
                kappa: kappa[vertex],
                d1: d1[vertex],
                d2: d1[vertex],
                error,
                status: status[vertex],
            };
            let curvature = curvature_from_row(&row, SecondDirection::AcrossNormal(normal))
                .map_err(|bad| ReadError::invalid(format!("vertex {vertex}: {bad}")))?;
            self.curvature.push(curvature);
        }
        self.append_filter(&attributes, count)?;
        self.append_uvs(&attributes, count)?;
        self.positions.extend(positions.into_iter().map(widen));
        self.normals.extend(normals.into_iter().map(widen));
        Ok(count)
    }

    fn append_filter(&mut self, attributes: &Attributes<'_>, count: usize) -> Result<(), ReadError> {
        if self.azimuths == 0 {
            return Ok(());
        }
        let read = |name: &str| attributes.floats::<4>(&extra(&name[1..]), name);
        let parts = (0..self.azimuths / 4).map(|part| read(&format!("_CURVATURE_FILTER_{part}")));
        let parts = parts.collect::<Result<Vec<_>, _>>()?;
        let bound = attributes.floats::<1>(&extra("CURVATURE_FILTER_BOUND"), "_CURVATURE_FILTER_BOUND")?;
        if bound.len() != count || parts.iter().any(|part| part.len() != count) {
            return Err(ReadError::invalid(format!(
                "_CURVATURE_FILTER has not {count} rows, one per vertex"
            )));
        }
        for vertex in 0..count {
            let values = parts.iter().flat_map(|part| part[vertex]).chain(bound[vertex]);
            check_filter(vertex, values)?;
            self.lowering.extend(parts.iter().flat_map(|part| part[vertex]));
            self.bound.extend(bound[vertex]);
        }
        Ok(())
    }

    fn append_uvs(&mut self, attributes: &Attributes<'_>, count: usize) -> Result<(), ReadError> {
        let sets = (0..).take_while(|&set| attributes.find(&Semantic::TexCoords(set)).is_some()).count();
        if self.positions.is_empty() {
            self.uv_sets.resize(sets, Vec::new());
        } else if self.uv_sets.len() != sets {
            return Err(ReadError::invalid("the primitives have different numbers of UV sets"));
        }
        for (number, set) in (0u32..).zip(&mut self.uv_sets) {
            let rows = attributes.floats::<2>(&Semantic::TexCoords(number), "TEXCOORD")?;
            if rows.len() != count {
                return Err(ReadError::invalid(format!("TEXCOORD_{number} has not one row per vertex")));
            }
            set.extend(rows.into_iter().map(|[u, v]| [f64::from(u), 1.0 - f64::from(v)]));
        }
        Ok(())
    }

    fn finish(self, materials: Vec<Material>, provenance: Provenance) -> Result<BakedMesh, ReadError> {
        // A mesh without triangles is written as points and has the one empty part that `Mesh::new` makes.
        let mut mesh = Mesh::new(self.positions, self.triangles)?.with_normals(self.normals)?;
        for uvs in self.uv_sets {
            mesh = mesh.with_uv_set(uvs)?;
        }
        let parts = if self.parts.is_empty() { mesh.parts().to_vec() } else { self.parts };
        let mesh = mesh.with_parts(parts, materials)?;
        let filter = provenance.filter.zip(FilterRows::new(self.azimuths, self.lowering, self.bound));
        let baked = BakedMesh::new(mesh, self.curvature, provenance);
        Ok(match filter {
            Some((record, rows)) => baked.with_filter(rows, record),
            None => baked,
        })
    }
}

fn extra(name: &str) -> Semantic {
    Semantic::Extras(name.to_owned())
}

struct Attributes<'a> {
    primitive: &'a Primitive,
    file: &'a GltfFile<'a>,
}

impl Attributes<'_> {
    fn find(&self, semantic: &Semantic) -> Option<Index<Accessor>> {
        self.primitive.attributes.get(&Checked::Valid(semantic.clone())).copied()
    }

    fn named(&self, semantic: &Semantic, name: &str) -> Result<Index<Accessor>, ReadError> {
        self.find(semantic).ok_or_else(|| ReadError::invalid(format!("a primitive has no attribute {name}")))
    }

    fn floats<const N: usize>(&self, semantic: &Semantic, name: &str) -> Result<Vec<[f32; N]>, ReadError> {
        Ok(self.file.rows_f32(self.named(semantic, name)?, &name)?)
    }

    fn bytes(&self, semantic: &Semantic, name: &str) -> Result<Vec<u8>, ReadError> {
        Ok(self.file.rows_u8(self.named(semantic, name)?, &name)?)
    }
}

fn material(file: &GltfFile<'_>, material: &json::Material) -> Result<Material, ReadError> {
    let pbr = &material.pbr_metallic_roughness;
    let [r, g, b, _] = pbr.base_color_factor.0;
    let texture = pbr.base_color_texture.as_ref().map(|info| info.index.value());
    Ok(Material {
        name: material.name.clone().unwrap_or_default(),
        base_color: [r, g, b],
        metallic: pbr.metallic_factor.0,
        roughness: pbr.roughness_factor.0,
        base_color_texture: texture.map(|texture| texture_image(file, texture)).transpose()?,
    })
}

/// The bytes of a texture's image inside the file, with the type that the file says, so that a bake passes them on.
fn texture_image(file: &GltfFile<'_>, texture: usize) -> Result<TextureImage, ReadError> {
    let image = file.root.textures.get(texture).and_then(|t| file.root.images.get(t.source.value()));
    let inside = image.and_then(|image| image.buffer_view.zip(image.mime_type.as_ref()));
    let Some((view, mime_type)) = inside else {
        let what = format!("the image of texture {texture} is not inside the file, or has no MIME type");
        return Err(ReadError::invalid(what));
    };
    let (bytes, _) = file.view(view, &format_args!("texture {texture}"))?;
    Ok(TextureImage { mime_type: mime_type.0.clone(), bytes: bytes.to_vec() })
}

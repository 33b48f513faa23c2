//! Reading binary glTF that [`write_glb`](super::write_glb) wrote.

use std::collections::HashMap;

use gltf::accessor::{DataType, Dimensions};
use gltf::mesh::Mode;
use gltf::{Accessor, Gltf, Primitive, Semantic};
use serde_json::Value;

use super::error::ReadError;
use super::filter_rows::{FilterRows, is_valid};
use super::rows::{CurvatureRow, SecondDirection, curvature_from_row, widen};
use super::{BakedMesh, FORMAT_VERSION, Provenance};
use crate::curvature::VertexCurvature;
use crate::field::BakedMinimum;
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
    let gltf = parse(bytes).map_err(|error| ReadError::invalid(describe(&error)))?;
    let provenance = provenance(&gltf)?;
    let bin = gltf.blob.as_deref().unwrap_or_default();
    let mut builder = Builder { azimuths: azimuths(&provenance)?, ..Builder::default() };
    for node in gltf.nodes() {
        let identity = gltf::scene::Transform::Matrix {
            matrix: [[1., 0., 0., 0.], [0., 1., 0., 0.], [0., 0., 1., 0.], [0., 0., 0., 1.]],
        };
        if node.transform().matrix() != identity.matrix() {
            let what =
                format!("node {} is transformed, which its baked curvature does not follow", node.index());
            return Err(ReadError::invalid(what));
        }
    }
    for primitive in gltf.meshes().flat_map(|mesh| mesh.primitives()) {
        builder.append(&primitive, bin)?;
    }
    let materials = gltf.materials().map(|m| material(&gltf, &m, bin)).collect::<Result<_, _>>()?;
    builder.finish(materials, provenance)
}

/// The document, after looking at what the `gltf` crate takes on trust before it validates.
fn parse(bytes: &[u8]) -> Result<Gltf, gltf::Error> {
    let length = bytes.get(8..12).and_then(|b| b.try_into().ok()).map_or(0, u32::from_le_bytes);
    if !bytes.starts_with(b"glTF") || (length as usize) < 20 {
        // The crate would read JSON without a container, and subtract the header from a shorter length.
        let magic = std::array::from_fn(|k| bytes.get(k).copied().unwrap_or_default());
        return Err(gltf::Error::Binary(gltf::binary::Error::Magic(magic)));
    }
    let Gltf { document, blob } = Gltf::from_slice_without_validation(bytes)?;
    let root = document.into_json();
    let mut primitives = root.meshes.iter().flat_map(|mesh| &mesh.primitives);
    let missing = primitives.find_map(|primitive| {
        let (_, accessor) =
            primitive.attributes.iter().find(|(_, accessor)| root.get(**accessor).is_none())?;
        Some(*accessor)
    });
    if let Some(accessor) = missing {
        let path = gltf_json::Path::new().field("accessors").index(accessor.value());
        return Err(gltf::Error::Validation(vec![(path, gltf_json::validation::Error::IndexOutOfBounds)]));
    }
    Ok(Gltf { document: gltf::Document::from_json(root)?, blob })
}

fn describe(error: &gltf::Error) -> String {
    match error {
        gltf::Error::Validation(errors) => match errors.first() {
            Some((path, error)) => format!("{path}: {error}"),
            None => error.to_string(),
        },
        _ => error.to_string(),
    }
}

fn provenance(gltf: &Gltf) -> Result<Provenance, ReadError> {
    let extras = gltf.as_json().asset.extras.as_ref().ok_or(ReadError::NotBaked)?;
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

#[derive(Default)]
struct Builder {
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
    /// First vertex of each set of vertex attributes that has been read, by the accessor indices.
    first_vertex: HashMap<Vec<usize>, (usize, usize)>,
}

impl Builder {
    fn append(&mut self, primitive: &Primitive<'_>, bin: &[u8]) -> Result<(), ReadError> {
        let key: Vec<usize> = primitive.attributes().map(|(_, accessor)| accessor.index()).collect();
        let (first, count) = match self.first_vertex.get(&key) {
            Some(&rows) => rows,
            None => {
                let rows = (self.positions.len(), self.append_vertices(primitive, bin)?);
                self.first_vertex.insert(key, rows);
                rows
            }
        };
        match primitive.mode() {
            Mode::Points if primitive.indices().is_none() => return Ok(()),
            Mode::Triangles => {}
            mode => return Err(ReadError::invalid(format!("a primitive has mode {mode:?}, not triangles"))),
        }
        let indices = match primitive.indices() {
            Some(accessor) => index_rows(&accessor, bin)?,
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
        let extras =
            primitive.extras().as_ref().and_then(|raw| serde_json::from_str::<Value>(raw.get()).ok());
        let name = extras.as_ref().and_then(|e| e.get("name")).and_then(Value::as_str).unwrap_or_default();
        self.parts.push(Part {
            name: name.to_owned(),
            triangles: start..self.triangles.len(),
            material: primitive.material().index(),
        });
        Ok(())
    }

    /// Appends the vertices of a primitive and returns how many they are.
    fn append_vertices(&mut self, primitive: &Primitive<'_>, bin: &[u8]) -> Result<usize, ReadError> {
        let attributes = Attributes { primitive, bin };
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

    fn append_filter(&mut self, attributes: &Attributes<'_, '_>, count: usize) -> Result<(), ReadError> {
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

    fn append_uvs(&mut self, attributes: &Attributes<'_, '_>, count: usize) -> Result<(), ReadError> {
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

struct Attributes<'a, 'b> {
    primitive: &'b Primitive<'a>,
    bin: &'b [u8],
}

impl<'a> Attributes<'a, '_> {
    fn find(&self, semantic: &Semantic) -> Option<Accessor<'a>> {
        self.primitive.get(semantic)
    }

    fn named(&self, semantic: &Semantic, name: &str) -> Result<Accessor<'a>, ReadError> {
        self.find(semantic).ok_or_else(|| ReadError::invalid(format!("a primitive has no attribute {name}")))
    }

    fn floats<const N: usize>(&self, semantic: &Semantic, name: &str) -> Result<Vec<[f32; N]>, ReadError> {
        let accessor = self.named(semantic, name)?;
        let dimensions = match N {
            1 => Dimensions::Scalar,
            2 => Dimensions::Vec2,
            3 => Dimensions::Vec3,
            _ => Dimensions::Vec4,
        };
        expect_type(&accessor, name, DataType::F32, dimensions)?;
        let rows = rows::<4, N>(&accessor, name, self.bin)?;
        Ok(rows.map(|row| row.map(f32::from_le_bytes)).collect())
    }

    fn bytes(&self, semantic: &Semantic, name: &str) -> Result<Vec<u8>, ReadError> {
        let accessor = self.named(semantic, name)?;
        expect_type(&accessor, name, DataType::U8, Dimensions::Scalar)?;
        Ok(rows::<1, 1>(&accessor, name, self.bin)?.map(|[[byte]]| byte).collect())
    }
}

fn index_rows(accessor: &Accessor<'_>, bin: &[u8]) -> Result<Vec<u32>, ReadError> {
    expect_type(accessor, "indices", accessor.data_type(), Dimensions::Scalar)?;
    Ok(match accessor.data_type() {
        DataType::U8 => rows::<1, 1>(accessor, "indices", bin)?.map(|[[byte]]| u32::from(byte)).collect(),
        DataType::U16 => {
            rows::<2, 1>(accessor, "indices", bin)?.map(|[b]| u32::from(u16::from_le_bytes(b))).collect()
        }
        DataType::U32 => rows::<4, 1>(accessor, "indices", bin)?.map(|[b]| u32::from_le_bytes(b)).collect(),
        other => return Err(ReadError::invalid(format!("indices have type {other:?}"))),
    })
}

fn expect_type(
    accessor: &Accessor<'_>,
    name: &str,
    data_type: DataType,
    dimensions: Dimensions,
) -> Result<(), ReadError> {
    let found = (accessor.data_type(), accessor.dimensions());
    if found != (data_type, dimensions) || accessor.sparse().is_some() || accessor.normalized() {
        let what = format!("{name} has type {found:?}, expected plain {:?}", (data_type, dimensions));
        return Err(ReadError::invalid(what));
    }
    Ok(())
}

/// The rows of an accessor as `N` components of `SIZE` bytes, after checking that they lie in the binary chunk.
fn rows<'b, const SIZE: usize, const N: usize>(
    accessor: &Accessor<'_>,
    name: &str,
    bin: &'b [u8],
) -> Result<impl Iterator<Item = [[u8; SIZE]; N]> + use<'b, SIZE, N>, ReadError> {
    let width = SIZE * N;
    let outside = || ReadError::invalid(format!("{name} reaches outside its buffer"));
    let view = accessor.view().ok_or_else(outside)?;
    let data = view_bytes(&view, bin).ok_or_else(outside)?;
    let stride = view.stride().unwrap_or(width);
    let (offset, count) = (accessor.offset(), accessor.count());
    let end = count
        .checked_sub(1)
        .and_then(|last| last.checked_mul(stride)?.checked_add(offset)?.checked_add(width));
    if stride < width || end.is_none_or(|end| end > data.len()) {
        return Err(outside());
    }
    Ok((0..count).map(move |row| {
        let bytes = &data[offset + row * stride..][..width];
        std::array::from_fn(|k| std::array::from_fn(|b| bytes[k * SIZE + b]))
    }))
}

fn view_bytes<'b>(view: &gltf::buffer::View<'_>, bin: &'b [u8]) -> Option<&'b [u8]> {
    if !matches!(view.buffer().source(), gltf::buffer::Source::Bin) {
        return None;
    }
    bin.get(view.offset()..view.offset().checked_add(view.length())?)
}

fn material(gltf: &Gltf, material: &gltf::Material<'_>, bin: &[u8]) -> Result<Material, ReadError> {
    let pbr = material.pbr_metallic_roughness();
    let [r, g, b, _] = pbr.base_color_factor();
    let image = pbr.base_color_texture().map(|info| info.texture().source().index());
    let texture = image.map(|image| texture_image(gltf, image, bin)).transpose()?;
    Ok(Material {
        name: material.name().unwrap_or_default().to_owned(),
        base_color: [r, g, b],
        metallic: pbr.metallic_factor(),
        roughness: pbr.roughness_factor(),
        base_color_texture: texture,
    })
}

/// The bytes of an image inside the file. Goes by the JSON, because the `gltf` crate unwraps an absent MIME type.
fn texture_image(gltf: &Gltf, image: usize, bin: &[u8]) -> Result<TextureImage, ReadError> {
    let bytes = gltf.as_json().images.get(image).and_then(|image| {
        let view = gltf.views().nth(image.buffer_view?.value())?;
        Some(TextureImage {
            mime_type: image.mime_type.as_ref()?.0.clone(),
            bytes: view_bytes(&view, bin)?.to_vec(),
        })
    });
    bytes.ok_or_else(|| {
        ReadError::invalid(format!("image {image} is not inside the file, or has no MIME type"))
    })
}

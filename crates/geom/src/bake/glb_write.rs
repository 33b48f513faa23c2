//! Writing binary glTF.

use std::collections::BTreeMap;
use std::io::Write;
use std::path::Path;

use gltf_json::accessor::{ComponentType, GenericComponentType, Type};
use gltf_json::validation::{Checked, USize64};
use gltf_json::{Index, Root, Value, accessor, buffer, material, mesh, texture};
use serde_json::json;
use serde_json::value::to_raw_value;

use super::BakedMesh;
use super::error::WriteError;
use super::float::FileFloat;
use super::rows::{Rows, narrow_rows};
use crate::mesh::{Material, Part};
use crate::write_atomically;

/// Writes a bake as binary glTF, all numbers as 32-bit floats, in one glTF mesh with one primitive per non-empty part.
///
/// The primitives share the vertex attributes, so a row of an attribute is a vertex of the mesh. A mesh without
/// triangles becomes a primitive of points. Material textures are written when the mesh has a UV set to address them.
///
/// # Errors
///
/// A mesh without vertices, a value that overflows `f32` (named), a file over 4 GiB, or what the file system says. The
/// file is not touched then.
pub fn write_glb(path: &Path, baked: &BakedMesh) -> Result<(), WriteError> {
    let (json, bin) = encode(baked)?;
    let pad = |length: usize| length.div_ceil(4) * 4;
    let total = 12 + 8 + pad(json.len()) as u64 + 8 + bin.len() as u64;
    let u32_from = |bytes: u64| u32::try_from(bytes).map_err(|_| WriteError::TooLarge { bytes: total });
    let total_field = u32_from(total)?;
    let (json_field, bin_field) = (u32_from(pad(json.len()) as u64)?, u32_from(bin.len() as u64)?);
    write_atomically(path, |w| {
        w.write_all(b"glTF")?;
        w.write_all(&2u32.to_le_bytes())?;
        w.write_all(&total_field.to_le_bytes())?;
        w.write_all(&json_field.to_le_bytes())?;
        w.write_all(b"JSON")?;
        w.write_all(&json)?;
        // The JSON chunk is padded with spaces, the binary one (below, in `Builder`) with zeros.
        w.write_all(&b"   "[..pad(json.len()) - json.len()])?;
        w.write_all(&bin_field.to_le_bytes())?;
        w.write_all(b"BIN\0")?;
        w.write_all(&bin)
    })?;
    Ok(())
}

/// The JSON and the binary chunk, the latter padded to four bytes.
fn encode(baked: &BakedMesh) -> Result<(Vec<u8>, Vec<u8>), WriteError> {
    let source = baked.mesh();
    if source.positions().is_empty() {
        return Err(WriteError::Empty);
    }
    let mut builder = Builder::default();
    let attributes = vertex_attributes(&mut builder, baked)?;
    let primitives = primitives(&mut builder, baked, &attributes);
    let has_uvs = !source.uv_sets().is_empty();
    for material in source.materials() {
        let material = builder.material(material, has_uvs);
        builder.root.materials.push(material);
    }
    builder.finish(primitives, baked)
}

type Attributes = BTreeMap<Checked<mesh::Semantic>, Index<accessor::Accessor>>;

fn vertex_attributes(builder: &mut Builder, baked: &BakedMesh) -> Result<Attributes, WriteError> {
    let rows = Rows::<f32>::new(baked)?;
    let count = rows.positions.len();
    let mut attributes = Attributes::new();
    let mut add = |semantic, index| attributes.insert(Checked::Valid(semantic), index);
    let extra = |name: &str| mesh::Semantic::Extras(name.to_owned());

    let positions = builder.floats(Type::Vec3, rows.positions.iter().copied());
    let (min, max) = min_max(&rows.positions);
    builder.root.accessors[positions.value()].min = Some(json!(min));
    builder.root.accessors[positions.value()].max = Some(json!(max));
    add(mesh::Semantic::Positions, positions);
    add(mesh::Semantic::Normals, builder.floats(Type::Vec3, rows.normals.iter().copied()));
    for (set, uvs) in (0u32..).zip(baked.mesh().uv_sets()) {
        // glTF's v points down. The f32 of the flipped value is what the file holds; the reader flips it back in f64,
        // which is exact unless it is below 2^-30, so a second round trip gives the same bits.
        let flipped = narrow_rows::<f32, 2>("UV", uvs.iter().map(|&[u, v]| [u, 1.0 - v]))?;
        add(mesh::Semantic::TexCoords(set), builder.floats(Type::Vec2, flipped.into_iter()));
    }
    let curvature = &rows.curvature;
    add(extra("CURVATURE"), builder.floats(Type::Vec2, curvature.iter().map(|c| c.kappa)));
    add(extra("CURVATURE_DIR"), builder.floats(Type::Vec3, curvature.iter().map(|c| c.d1)));
    add(extra("CURVATURE_ERROR"), builder.floats(Type::Scalar, curvature.iter().map(|c| [c.error])));
    // Vertex attributes must start every four bytes, so the status has three bytes of padding.
    let start = builder.bin.len();
    builder.bin.extend(curvature.iter().flat_map(|c| [c.status, 0, 0, 0]));
    let view = builder.view(start, Some(buffer::Target::ArrayBuffer), Some(4));
    add(extra("CURVATURE_STATUS"), builder.accessor(view, 0, count, ComponentType::U8, Type::Scalar));
    if let Some(filter) = baked.filter() {
        for part in 0..filter.azimuths() / 4 {
            let rows = filter.lowering().chunks_exact(filter.azimuths());
            let rows = rows.map(|row| std::array::from_fn::<f32, 4, _>(|k| row[4 * part + k]));
            add(extra(&format!("CURVATURE_FILTER_{part}")), builder.floats(Type::Vec4, rows));
        }
        add(
            extra("CURVATURE_FILTER_BOUND"),
            builder.floats(Type::Scalar, filter.bound().iter().map(|&b| [b])),
        );
    }
    Ok(attributes)
}

fn primitives(builder: &mut Builder, baked: &BakedMesh, attributes: &Attributes) -> Vec<mesh::Primitive> {
    let source = baked.mesh();
    let primitive = |part: Option<&Part>, mode, indices| mesh::Primitive {
        attributes: attributes.clone(),
        extensions: None,
        extras: part
            .filter(|part| !part.name.is_empty())
            .map(|part| to_raw_value(&json!({ "name": part.name })).expect("a string is valid JSON")),
        indices,
        material: part.and_then(|part| part.material).map(index),
        mode: Checked::Valid(mode),
        targets: None,
    };
    if source.triangles().is_empty() {
        return vec![primitive(None, mesh::Mode::Points, None)];
    }
    let start = builder.bin.len();
    builder.bin.extend(source.triangles().iter().flatten().flat_map(|i| i.to_le_bytes()));
    let view = builder.view(start, Some(buffer::Target::ElementArrayBuffer), None);
    let non_empty = source.parts().iter().filter(|part| !part.triangles.is_empty());
    non_empty
        .map(|part| {
            let (offset, count) = (12 * part.triangles.start, 3 * part.triangles.len());
            let indices = builder.accessor(view, offset, count, ComponentType::U32, Type::Scalar);
            primitive(Some(part), mesh::Mode::Triangles, Some(indices))
        })
        .collect()
}

fn min_max(rows: &[[f32; 3]]) -> ([f64; 3], [f64; 3]) {
    // In f64, so that the JSON holds the exact values and not their shortest decimal form.
    let mut min = [f64::INFINITY; 3];
    let mut max = [f64::NEG_INFINITY; 3];
    for row in rows {
        for k in 0..3 {
            min[k] = min[k].min(f64::from(row[k]));
            max[k] = max[k].max(f64::from(row[k]));
        }
    }
    (min, max)
}

fn index<T>(value: usize) -> Index<T> {
    Index::new(u32::try_from(value).expect("fewer glTF objects than vertices"))
}

/// The glTF document under construction and its one buffer.
#[derive(Default)]
struct Builder {
    root: Root,
    bin: Vec<u8>,
}

impl Builder {
    fn floats<const N: usize>(
        &mut self,
        type_: Type,
        rows: impl Iterator<Item = [f32; N]>,
    ) -> Index<accessor::Accessor> {
        let start = self.bin.len();
        rows.flatten().for_each(|x| x.put(&mut self.bin));
        let count = (self.bin.len() - start) / (4 * N);
        let view = self.view(start, Some(buffer::Target::ArrayBuffer), None);
        self.accessor(view, 0, count, ComponentType::F32, type_)
    }

    /// A view of what was appended to the buffer since `start`; pads the buffer to four bytes.
    fn view(
        &mut self,
        start: usize,
        target: Option<buffer::Target>,
        stride: Option<usize>,
    ) -> Index<buffer::View> {
        let view = buffer::View {
            buffer: Index::new(0),
            byte_length: USize64::from(self.bin.len() - start),
            byte_offset: Some(USize64::from(start)),
            byte_stride: stride.map(buffer::Stride),
            name: None,
            target: target.map(Checked::Valid),
            extensions: None,
            extras: None,
        };
        self.bin.resize(self.bin.len().div_ceil(4) * 4, 0);
        Index::push(&mut self.root.buffer_views, view)
    }

    fn accessor(
        &mut self,
        view: Index<buffer::View>,
        offset: usize,
        count: usize,
        component: ComponentType,
        type_: Type,
    ) -> Index<accessor::Accessor> {
        let accessor = accessor::Accessor {
            buffer_view: Some(view),
            byte_offset: (offset > 0).then(|| USize64::from(offset)),
            count: USize64::from(count),
            component_type: Checked::Valid(GenericComponentType(component)),
            type_: Checked::Valid(type_),
            min: None,
            max: None,
            name: None,
            normalized: false,
            sparse: None,
            extensions: None,
            extras: None,
        };
        Index::push(&mut self.root.accessors, accessor)
    }

    fn material(&mut self, material: &Material, has_uvs: bool) -> material::Material {
        let [r, g, b] = material.base_color;
        let texture = material.base_color_texture.as_ref().filter(|_| has_uvs).map(|image| {
            let start = self.bin.len();
            self.bin.extend_from_slice(&image.bytes);
            let view = self.view(start, None, None);
            let image = gltf_json::Image {
                buffer_view: Some(view),
                mime_type: Some(gltf_json::image::MimeType(image.mime_type.clone())),
                name: None,
                uri: None,
                extensions: None,
                extras: None,
            };
            let source = Index::push(&mut self.root.images, image);
            let texture =
                texture::Texture { name: None, sampler: None, source, extensions: None, extras: None };
            let index = Index::push(&mut self.root.textures, texture);
            texture::Info { index, tex_coord: 0, extensions: None, extras: None }
        });
        material::Material {
            name: (!material.name.is_empty()).then(|| material.name.clone()),
            pbr_metallic_roughness: material::PbrMetallicRoughness {
                base_color_factor: material::PbrBaseColorFactor([r, g, b, 1.0]),
                base_color_texture: texture,
                metallic_factor: material::StrengthFactor(material.metallic),
                roughness_factor: material::StrengthFactor(material.roughness),
                ..Default::default()
            },
            ..Default::default()
        }
    }

    fn finish(
        mut self,
        primitives: Vec<mesh::Primitive>,
        baked: &BakedMesh,
    ) -> Result<(Vec<u8>, Vec<u8>), WriteError> {
        let mesh = mesh::Mesh { extensions: None, extras: None, name: None, primitives, weights: None };
        self.root.meshes.push(mesh);
        self.root.nodes.push(gltf_json::Node { mesh: Some(Index::new(0)), ..Default::default() });
        let scene =
            gltf_json::Scene { extensions: None, extras: None, name: None, nodes: vec![Index::new(0)] };
        self.root.scenes.push(scene);
        self.root.scene = Some(Index::new(0));
        self.root.buffers.push(buffer::Buffer {
            byte_length: USize64::from(self.bin.len()),
            name: None,
            uri: None,
            extensions: None,
            extras: None,
        });
        let provenance: Value = serde_json::to_value(&baked.provenance).map_err(std::io::Error::from)?;
        self.root.asset.generator = Some(baked.provenance.tool.clone());
        self.root.asset.extras =
            Some(to_raw_value(&json!({ "osculate": provenance })).map_err(std::io::Error::from)?);
        let json = serde_json::to_vec(&self.root).map_err(std::io::Error::from)?;
        Ok((json, self.bin))
    }
}

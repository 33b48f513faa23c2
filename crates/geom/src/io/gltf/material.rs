//! Materials of a glTF file.

use ::gltf::json::Index;
use ::gltf::json::material::Material as JsonMaterial;
use ::gltf::json::texture::Texture;

use super::file::{GltfFile, item, label, read_uri};
use crate::Material;
use crate::io::files::{Resolver, Textures};
use crate::io::warnings::Warnings;

/// All materials, in the file's order. A texture that cannot be read is a warning.
pub(super) fn materials(
    file: &GltfFile<'_>,
    resolver: &Resolver<'_>,
    warnings: &mut Warnings,
) -> Vec<Material> {
    let mut textures = Textures::default();
    let materials = file.root.materials.iter().enumerate();
    materials.map(|(number, json)| material(file, number, json, resolver, &mut textures, warnings)).collect()
}

fn material(
    file: &GltfFile<'_>,
    number: usize,
    json: &JsonMaterial,
    resolver: &Resolver<'_>,
    textures: &mut Textures,
    warnings: &mut Warnings,
) -> Material {
    let pbr = &json.pbr_metallic_roughness;
    let [r, g, b, _] = pbr.base_color_factor.0;
    let place = label("material", number, json.name.as_ref());
    let texture = pbr.base_color_texture.as_ref().and_then(|info| {
        if info.tex_coord != 0 {
            warnings.add("tex_coord", || {
                format!("{place}: its texture uses UV set {}; it will be shown with set 0", info.tex_coord)
            });
        }
        match encoded_image(file, info.index, resolver, &place) {
            Ok(bytes) => textures.accept(&place, bytes, warnings),
            Err(message) => {
                warnings.add("texture", || format!("{place}: its texture is left out: {message}"));
                None
            }
        }
    });
    let unit = |x: f32| if x.is_finite() { x.clamp(0.0, 1.0) } else { 1.0 };
    Material {
        name: json.name.clone().unwrap_or_default(),
        base_color: [r, g, b].map(unit),
        metallic: unit(pbr.metallic_factor.0),
        roughness: unit(pbr.roughness_factor.0),
        base_color_texture: texture,
    }
}

fn encoded_image(
    file: &GltfFile<'_>,
    texture: Index<Texture>,
    resolver: &Resolver<'_>,
    place: &str,
) -> Result<Vec<u8>, String> {
    let texture = item(&file.root.textures, texture, "texture", &place).map_err(|e| e.to_string())?;
    let image = item(&file.root.images, texture.source, "image", &place).map_err(|e| e.to_string())?;
    match (image.buffer_view, &image.uri) {
        (Some(view), _) => {
            file.view(view, &place).map(|(bytes, _)| bytes.to_vec()).map_err(|e| e.to_string())
        }
        (None, Some(uri)) => read_uri(uri, resolver),
        (None, None) => Err("it has neither a bufferView nor a uri".into()),
    }
}

//! Materials of a glTF file.

use ::gltf::json::Index;
use ::gltf::json::material::Material as JsonMaterial;
use ::gltf::json::texture::{Info, Texture};

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
        let set = uv_set(info);
        if set != 0 {
            warnings.add("uv set", || {
                format!("{place}: its texture uses UV set {set}; it will be shown with set 0")
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

/// What `KHR_texture_transform` does to the texture coordinates of a material: scaled, rotated, moved.
#[derive(Debug, Clone, Copy, PartialEq)]
pub(super) struct UvTransform {
    offset: [f32; 2],
    rotation: f32,
    scale: [f32; 2],
}

impl UvTransform {
    /// That of the base colour texture, if it is shown with UV set 0. Quantised files need it: their texture coordinates
    /// are integers that only the transform brings to [0, 1].
    pub fn of(material: &JsonMaterial) -> Option<Self> {
        let info = material.pbr_metallic_roughness.base_color_texture.as_ref().filter(|i| uv_set(i) == 0)?;
        let transform = info.extensions.as_ref()?.texture_transform.as_ref()?;
        Some(Self { offset: transform.offset.0, rotation: transform.rotation.0, scale: transform.scale.0 })
    }

    /// Equal for equal transforms.
    pub fn key(&self) -> [u32; 5] {
        let ([x, y], [sx, sy]) = (self.offset, self.scale);
        [x, y, self.rotation, sx, sy].map(f32::to_bits)
    }

    /// In glTF's coordinates, where v points down, so that a counter-clockwise rotation takes v to u.
    pub fn apply(&self, [u, v]: [f64; 2]) -> [f64; 2] {
        let (sin, cos) = f64::from(self.rotation).sin_cos();
        let (u, v) = (u * f64::from(self.scale[0]), v * f64::from(self.scale[1]));
        [cos * u + sin * v + f64::from(self.offset[0]), cos * v - sin * u + f64::from(self.offset[1])]
    }
}

/// The UV set of a texture; a transform may name another one.
fn uv_set(info: &Info) -> u32 {
    let transform = info.extensions.as_ref().and_then(|e| e.texture_transform.as_ref());
    transform.and_then(|t| t.tex_coord).unwrap_or(info.tex_coord)
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

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn texture_transforms_follow_the_example_of_the_extension() {
        // "Only the lower left quadrant of the source image, rotated clockwise 90 degrees", with v down.
        let transform =
            UvTransform { offset: [0.0, 1.0], rotation: std::f32::consts::FRAC_PI_2, scale: [0.5; 2] };
        for (uv, expected) in [([0.0, 0.0], [0.0, 1.0]), ([1.0, 0.0], [0.0, 0.5]), ([1.0, 1.0], [0.5, 0.5])] {
            let found = transform.apply(uv);
            // The rotation is an f32.
            assert!(
                (found[0] - expected[0]).abs() + (found[1] - expected[1]).abs() < 1e-7,
                "{uv:?} gives {found:?}"
            );
        }
    }
}

//! glTF 2.0 and GLB, on the JSON types of the `gltf` crate.

mod accessor;
mod error;
mod file;
mod material;
mod primitive;
mod scene;

use ::gltf::json::Root;

pub use error::GltfError;
pub(crate) use file::GltfFile;

use super::files::Resolver;
use super::warnings::Warnings;
use super::{Read, ReadProblem, finish};
use primitive::Assembly;

/// Reads glTF or GLB (told by the first bytes): all primitives of the default scene in one mesh, in world space. Buffers
/// and textures that the file names come from `resolver`.
///
/// Each primitive becomes a part, named after its mesh. Primitives of a mesh that share their attributes share their
/// vertices. Triangles of mirrored nodes are turned over, so that they still face outward.
///
/// # Errors
///
/// See [`GltfError`]; and a scene without triangles.
pub fn read_gltf(bytes: &[u8], resolver: &Resolver<'_>) -> Result<Read, ReadProblem> {
    let file = GltfFile::parse(bytes, resolver)?;
    let mut warnings = Warnings::default();
    let mut assembly = Assembly::new(&file);
    for instance in &scene::instances(&file.root, &mut warnings)? {
        assembly.add_instance(instance, &mut warnings)?;
    }
    warn_of_extensions(&file.root, &mut warnings);
    let materials = material::materials(&file, resolver, &mut warnings);
    finish(assembly.into_mesh(materials)?, warnings)
}

/// Extensions that change the picture, in files that do not require them.
fn warn_of_extensions(root: &Root, warnings: &mut Warnings) {
    for (extension, what) in
        [("EXT_mesh_gpu_instancing", "GPU instances"), ("KHR_texture_basisu", "Basis Universal textures")]
    {
        if root.extensions_used.iter().any(|e| e == extension) {
            warnings.add(extension, || format!("{what} ({extension}) are left out"));
        }
    }
}

#[cfg(test)]
mod tests {
    use super::*;
    use crate::Vec3;
    use crate::io::no_files;

    /// Two triangles over four vertices with normals, UVs (in bytes) and 16-bit indices, in one data URI.
    fn quad(primitive: &str, node: &str) -> Vec<u8> {
        let mut data = Vec::new();
        for p in [[0.0_f32, 0.0, 0.0], [1.0, 0.0, 0.0], [1.0, 1.0, 0.0], [0.0, 1.0, 0.0]] {
            data.extend(p.iter().flat_map(|x| x.to_le_bytes()));
        }
        for _ in 0..4 {
            data.extend([0.0_f32, 0.0, 1.0].iter().flat_map(|x| x.to_le_bytes()));
        }
        data.extend([0_u8, 0, 255, 0, 255, 255, 0, 255]);
        data.extend([0_u16, 1, 2, 0, 2, 3].iter().flat_map(|x| x.to_le_bytes()));
        let uri: String = data.iter().map(|b| format!("%{b:02x}")).collect();
        format!(
            r#"{{"asset":{{"version":"2.0"}},"buffers":[{{"byteLength":116,"uri":"data:,{uri}"}}],
            "bufferViews":[{{"buffer":0,"byteLength":48}},{{"buffer":0,"byteOffset":48,"byteLength":48}},
                {{"buffer":0,"byteOffset":96,"byteLength":8}},{{"buffer":0,"byteOffset":104,"byteLength":12}}],
            "accessors":[{{"bufferView":0,"componentType":5126,"count":4,"type":"VEC3"}},
                {{"bufferView":1,"componentType":5126,"count":4,"type":"VEC3"}},
                {{"bufferView":2,"componentType":5121,"normalized":true,"count":4,"type":"VEC2"}},
                {{"bufferView":3,"componentType":5123,"count":6,"type":"SCALAR"}}],
            "materials":[{{"name":"m","pbrMetallicRoughness":{{"baseColorFactor":[1,0.5,0,1],"roughnessFactor":0.25}}}}],
            "meshes":[{{"name":"Quad","primitives":[{primitive}]}}],"nodes":[{{"mesh":0{node}}}]}}"#
        )
        .into_bytes()
    }

    const ATTRIBUTES: &str = r#""attributes":{"POSITION":0,"NORMAL":1,"TEXCOORD_0":2}"#;

    #[test]
    fn reads_attributes_parts_and_materials() {
        let primitive = format!(r#"{{{ATTRIBUTES},"indices":3,"material":0}}"#);
        let read = read_gltf(&quad(&primitive, ""), &no_files).unwrap();
        let mesh = read.mesh;
        assert_eq!(mesh.triangles(), [[0, 1, 2], [0, 2, 3]]);
        assert_eq!(mesh.normals().unwrap(), [Vec3::z(); 4]);
        assert_eq!(mesh.uv_sets()[0], [[0.0, 1.0], [1.0, 1.0], [1.0, 0.0], [0.0, 0.0]]);
        assert_eq!((mesh.parts()[0].name.as_str(), mesh.parts()[0].material), ("Quad", Some(0)));
        let material = &mesh.materials()[0];
        assert_eq!(
            (material.base_color, material.metallic, material.roughness),
            ([1.0, 0.5, 0.0], 1.0, 0.25)
        );
    }

    #[test]
    fn primitives_with_the_same_attributes_share_vertices() {
        let two = format!(
            r#"{{{ATTRIBUTES},"indices":3}},{{{ATTRIBUTES},"mode":5}},{{"attributes":{{"POSITION":0}},"mode":6}}"#
        );
        let mesh = read_gltf(&quad(&two, ""), &no_files).unwrap().mesh;
        assert_eq!(mesh.positions().len(), 8);
        assert_eq!(mesh.triangles()[2..], [[0, 1, 2], [1, 3, 2], [4, 5, 6], [4, 6, 7]]);
        assert_eq!(mesh.normals().unwrap()[4], Vec3::zeros());
        assert_eq!(mesh.parts().len(), 3);
    }

    #[test]
    fn mirrors_turn_triangles_and_normals_follow() {
        let primitive = format!(r#"{{{ATTRIBUTES},"indices":3}}"#);
        let mesh = read_gltf(&quad(&primitive, r#","scale":[-2,1,4],"translation":[5,0,0]"#), &no_files)
            .unwrap()
            .mesh;
        assert_eq!(mesh.positions()[1], Vec3::new(3.0, 0.0, 0.0));
        assert_eq!(mesh.normals().unwrap()[0], Vec3::z());
        let [a, b, c] = mesh.corners(0);
        assert!((b - a).cross(&(c - a)).z > 0.0);
        // Tilted by a non-uniform scale: normals stay perpendicular, and point to the same side.
        let tilted = r#","matrix":[2,0,1,0, 0,1,0,0, 0,0,-1,0, 0,0,0,1]"#;
        let mesh = read_gltf(&quad(&primitive, tilted), &no_files).unwrap().mesh;
        let [a, b, c] = mesh.corners(0);
        let normal = (b - a).cross(&(c - a)).normalize();
        assert!((normal - mesh.normals().unwrap()[0]).norm() < 1e-12, "{normal}");
    }

    #[test]
    fn texture_transforms_are_applied_per_material() {
        let plain = format!(r#"{{{ATTRIBUTES},"indices":3,"material":0}},{{{ATTRIBUTES},"indices":3}}"#);
        let json = String::from_utf8(quad(&plain, "")).unwrap();
        let transform = r#""baseColorTexture":{"index":0,"extensions":{"KHR_texture_transform":{"scale":[4,2],"offset":[0.5,0]}}},"#;
        let json = json.replace(r#""baseColorFactor""#, &format!(r#"{transform}"baseColorFactor""#));
        let mesh = read_gltf(json.as_bytes(), &no_files).unwrap().mesh;
        assert_eq!(mesh.uv_sets()[0][..4], [[0.5, 1.0], [4.5, 1.0], [4.5, -1.0], [0.5, -1.0]]);
        assert_eq!(mesh.uv_sets()[0][4..], [[0.0, 1.0], [1.0, 1.0], [1.0, 0.0], [0.0, 0.0]]);
    }

    #[test]
    fn lines_are_left_out() {
        let primitive = format!(r#"{{{ATTRIBUTES},"mode":1}},{{{ATTRIBUTES},"indices":3}}"#);
        let read = read_gltf(&quad(&primitive, ""), &no_files).unwrap();
        assert_eq!(read.warnings, ["mesh 0 \"Quad\", primitive 0: lines and points are left out"]);
        assert_eq!(read.mesh.parts().len(), 1);
    }

    #[test]
    fn errors_name_the_primitive() {
        let message = |primitive: &str| read_gltf(&quad(primitive, ""), &no_files).unwrap_err().to_string();
        let beyond = message(r#"{"attributes":{"POSITION":0},"indices":2}"#);
        assert_eq!(beyond, "accessor 2 is VEC2 of U8; expected SCALAR of U8, U16 or U32");
        let missing = message(r#"{"attributes":{"NORMAL":1}}"#);
        assert_eq!(missing, "mesh 0 \"Quad\", primitive 0 has no valid attributes.POSITION");
        let accessor = message(r#"{"attributes":{"POSITION":77}}"#);
        assert_eq!(accessor, "mesh 0 \"Quad\", primitive 0: POSITION names accessor 77 of 4");
        let mode = message(r#"{"attributes":{"POSITION":0},"mode":9}"#);
        assert_eq!(mode, "mesh 0 \"Quad\", primitive 0 has no valid mode");
        let material = message(r#"{"attributes":{"POSITION":0},"mode":6,"material":3}"#);
        assert_eq!(material, "mesh 0 \"Quad\", primitive 0 names material 3 of 1");
        let count = message(r#"{"attributes":{"POSITION":0}}"#);
        assert_eq!(count, "mesh 0 \"Quad\", primitive 0: has 4 indices, which is no multiple of 3");
    }
}

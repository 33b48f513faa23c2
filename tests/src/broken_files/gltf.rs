//! glTF and GLB files that must be refused.

use super::{BrokenFile, broken, edit};

const GLTF: &str = r#"{"asset":{"version":"2.0"},"scene":0,"scenes":[{"nodes":[0]}],
"nodes":[{"name":"root","mesh":0,"children":[1]},{"name":"leaf"}],
"meshes":[{"name":"tri","primitives":[{"attributes":{"POSITION":0},"indices":1}]}],
"accessors":[{"bufferView":0,"componentType":5126,"count":3,"type":"VEC3"},{"bufferView":1,"componentType":5125,"count":3,"type":"SCALAR"}],
"bufferViews":[{"buffer":0,"byteLength":36},{"buffer":0,"byteOffset":36,"byteLength":12}],
"buffers":[{"byteLength":48,"uri":"tri.bin"}]}"#;

pub(super) fn gltf_of(edits: &[(&str, &str)]) -> String {
    edits.iter().fold(GLTF.to_owned(), |json, (old, new)| edit(&json, old, new))
}

fn triangle_data(x: f32, last_index: u32) -> Vec<u8> {
    let positions = [0.0, 0.0, 0.0, x, 0.0, 0.0, 0.0, 1.0, 0.0];
    let indices = [0, 1, last_index];
    let positions = positions.iter().flat_map(|p| f32::to_le_bytes(*p));
    positions.chain(indices.iter().flat_map(|i| i.to_le_bytes())).collect()
}

fn broken_gltf(name: &'static str, edits: &[(&str, &str)], expect: &'static str) -> BrokenFile {
    let companions = vec![("tri.bin", triangle_data(1.0, 2))];
    BrokenFile { companions, ..broken(name, gltf_of(edits), expect) }
}

pub(super) fn gltf() -> Vec<BrokenFile> {
    let mut not_utf8 = GLTF.as_bytes().to_vec();
    let name = GLTF.find("root").unwrap_or(0);
    not_utf8[name] = 0xff;
    vec![
        broken("json.gltf", &GLTF[..100], "JSON: EOF while parsing"),
        broken("not_utf8.gltf", not_utf8, "JSON: "),
        broken("no_asset.gltf", "{}", "JSON: missing field `asset`"),
        broken("deep.gltf", "{\"asset\":".to_owned() + &"[".repeat(100_000), "JSON: "),
        broken_gltf("version.gltf", &[("\"2.0\"", "\"1.0\"")], "is glTF version 1.0"),
        broken_gltf(
            "draco.gltf",
            &[("\"scene\":0", "\"scene\":0,\"extensionsRequired\":[\"KHR_draco_mesh_compression\"]")],
            "requires the extension KHR_draco_mesh_compression",
        ),
        broken_gltf(
            "meshopt.gltf",
            &[("\"scene\":0", "\"scene\":0,\"extensionsRequired\":[\"EXT_meshopt_compression\"]")],
            "requires the extension EXT_meshopt_compression",
        ),
        broken_gltf(
            "cycle.gltf",
            &[("\"name\":\"leaf\"", "\"children\":[0]")],
            "node 0 \"root\" is below itself",
        ),
        broken_gltf(
            "self.gltf",
            &[("\"name\":\"leaf\"", "\"children\":[1]")],
            "node 1 is a child of both node 0 \"root\" and node 1",
        ),
        broken_gltf(
            "child.gltf",
            &[("\"children\":[1]", "\"children\":[7]")],
            "the children of node 0 \"root\" names node 7 of 2",
        ),
        broken_gltf("scene.gltf", &[("\"scene\":0", "\"scene\":4")], "scene names scene 4 of 1"),
        broken_gltf(
            "scene_node.gltf",
            &[("[{\"nodes\":[0]}]", "[{\"nodes\":[5]}]")],
            "the scene names node 5 of 2",
        ),
        broken_gltf("node_mesh.gltf", &[("\"mesh\":0", "\"mesh\":3")], "node 0 \"root\" names mesh 3 of 1"),
        broken_gltf("no_mesh.gltf", &[("\"mesh\":0,", "")], "has no triangles"),
        broken_gltf(
            "scale.gltf",
            &[("\"mesh\":0", "\"mesh\":0,\"scale\":[1e39,1,1]")],
            "number out of range at line",
        ),
        BrokenFile {
            companions: vec![],
            ..broken_gltf("missing.gltf", &[], "buffer 0 (\"tri.bin\") cannot be read")
        },
        BrokenFile {
            companions: vec![("tri.bin", vec![0; 20])],
            ..broken_gltf("short.gltf", &[], "buffer 0 (\"tri.bin\") has 20 bytes of 48")
        },
        broken_gltf(
            "no_uri.gltf",
            &[(",\"uri\":\"tri.bin\"", "")],
            "buffer 0 (binary chunk) cannot be read: there is no uri",
        ),
        broken_gltf(
            "base64.gltf",
            &[("tri.bin", "data:;base64,!!!!")],
            "buffer 0 (data URI) cannot be read: the data URI is not base64",
        ),
    ]
}

pub(super) fn gltf_geometry() -> Vec<BrokenFile> {
    let with_data = |name, data, expect| BrokenFile {
        companions: vec![("tri.bin", data)],
        ..broken_gltf(name, &[], expect)
    };
    vec![
        with_data(
            "beyond.gltf",
            triangle_data(1.0, 9),
            "mesh 0 \"tri\", primitive 0: index 2 is vertex 9 of 3",
        ),
        with_data(
            "nan.gltf",
            triangle_data(f32::NAN, 2),
            "mesh 0 \"tri\", primitive 0: POSITION of vertex 1 is not finite: [NaN, 0.0, 0.0]",
        ),
        broken_gltf(
            "position.gltf",
            &[("\"POSITION\":0", "\"POSITION\":8")],
            "POSITION names accessor 8 of 2",
        ),
        broken_gltf(
            "indices.gltf",
            &[("\"indices\":1", "\"indices\":6")],
            "primitive 0: indices names accessor 6 of 2",
        ),
        broken_gltf(
            "no_position.gltf",
            &[("\"POSITION\":0", "")],
            "primitive 0 has no valid attributes.POSITION",
        ),
        broken_gltf("mode.gltf", &[("\"indices\":1", "\"mode\":12")], "primitive 0 has no valid mode"),
        broken_gltf(
            "material.gltf",
            &[("\"indices\":1", "\"material\":2")],
            "primitive 0 names material 2 of 0",
        ),
        broken_gltf(
            "rows.gltf",
            &[
                ("\"POSITION\":0", "\"POSITION\":0,\"NORMAL\":2"),
                (
                    "],\n\"bufferViews",
                    ",{\"bufferView\":0,\"componentType\":5126,\"count\":2,\"type\":\"VEC3\"}],\n\"bufferViews",
                ),
            ],
            "primitive 0: NORMAL has 2 rows for 3 positions",
        ),
        broken_gltf(
            "index_type.gltf",
            &[("\"indices\":1", "\"indices\":0")],
            "accessor 0 is VEC3 of F32; expected SCALAR",
        ),
        broken_gltf("vec2.gltf", &[("VEC3", "VEC2")], "accessor 0 is VEC2 of F32; expected 3 components"),
        broken_gltf("component.gltf", &[("5126", "9999")], "accessors[0] has no valid componentType"),
        broken_gltf(
            "view.gltf",
            &[("\"bufferView\":0", "\"bufferView\":5")],
            "accessors[0] names buffer view 5 of 2",
        ),
        broken_gltf(
            "view_buffer.gltf",
            &[("{\"buffer\":0,\"byteLength\"", "{\"buffer\":1,\"byteLength\"")],
            "bufferViews[0] names buffer 1 of 1",
        ),
        broken_gltf(
            "view_span.gltf",
            &[("\"byteLength\":36", "\"byteLength\":49")],
            "buffer view 0 takes 49 bytes from byte 0 of buffer 0, which has 48",
        ),
        broken_gltf(
            "huge_count.gltf",
            &[("\"count\":3,\"type\":\"VEC3\"", "\"count\":4000000000,\"type\":\"VEC3\"")],
            "accessor 0 takes 4000000000 rows of 12 bytes",
        ),
        broken_gltf(
            "stride.gltf",
            &[("\"byteLength\":36", "\"byteLength\":36,\"byteStride\":4")],
            "rows of 12 bytes, one every 4",
        ),
        broken_gltf(
            "two_indices.gltf",
            &[("5125,\"count\":3", "5125,\"count\":2")],
            "has 2 indices, which is no multiple of 3",
        ),
        broken_gltf("no_data.gltf", &[("\"bufferView\":0,", "")], "accessor 0 has no data"),
        broken_gltf(
            "zeros.gltf",
            &[(
                "\"bufferView\":0,\"componentType\":5126,\"count\":3",
                "\"componentType\":5126,\"count\":4000000000,\"sparse\":{\"count\":1,\"indices\":{\"bufferView\":1,\"componentType\":5125},\"values\":{\"bufferView\":0}}",
            )],
            "accessor 0 claims 4000000000 rows that are stored nowhere",
        ),
        broken_gltf(
            "sparse.gltf",
            &[(
                "\"count\":3,\"type\":\"VEC3\"",
                "\"count\":2,\"type\":\"VEC3\",\"sparse\":{\"count\":3,\"indices\":{\"bufferView\":1,\"componentType\":5125},\"values\":{\"bufferView\":0}}",
            )],
            "accessor 0: sparse value 2 is for row 2 of 2",
        ),
    ]
}

pub(super) fn glb_of(edits: &[(&str, &str)]) -> Vec<u8> {
    let json = edit(&gltf_of(edits), ",\"uri\":\"tri.bin\"", "");
    let json = format!("{json:width$}", width = json.len().next_multiple_of(4));
    let mut chunks = Vec::new();
    for (kind, content) in [(b"JSON", json.as_bytes()), (b"BIN\0", &triangle_data(1.0, 2))] {
        chunks.extend(length(content.len()));
        chunks.extend(kind);
        chunks.extend(content);
    }
    [&b"glTF\x02\0\0\0"[..], &length(chunks.len() + 12), &chunks].concat()
}

fn length(bytes: usize) -> [u8; 4] {
    u32::try_from(bytes).expect("test files are small").to_le_bytes()
}

pub(super) fn glb() -> Vec<BrokenFile> {
    let good = glb_of(&[]);
    let patched = |at: usize, bytes: &[u8]| {
        let mut glb = good.clone();
        glb[at..at + bytes.len()].copy_from_slice(bytes);
        glb
    };
    let json_length = u32::from_le_bytes([good[12], good[13], good[14], good[15]]) as usize;
    vec![
        broken("header.glb", &good[..9], "the GLB header needs 12 bytes, the file has 9"),
        broken("magic.glb", "glTX0000", "JSON: "),
        broken("version.glb", patched(4, &[1]), "is glTF version 1;"),
        broken("truncated.glb", &good[..100], "bytes, the file has 100; it may be cut off"),
        broken("small.glb", patched(8, &[5, 0, 0, 0]), "the header claims 5 bytes, fewer than its own 12"),
        broken(
            "json_chunk.glb",
            patched(12, &[0xff, 0xff, 0xff, 0x7f]),
            "Json chunk claims 2147483647 bytes",
        ),
        broken("chunk_type.glb", patched(16, b"TEXT"), "type \"TEXT\" is neither JSON nor BIN"),
        broken("order.glb", patched(16, b"BIN\0"), "GLB chunk: "),
        broken(
            "bin_chunk.glb",
            patched(20 + json_length, &[0xff, 0xff]),
            "Bin chunk claims 65535 bytes, 48 follow",
        ),
        broken("json.glb", patched(20, b"["), "JSON: "),
        broken(
            "short_bin.glb",
            glb_of(&[("\"byteLength\":48", "\"byteLength\":480")]),
            "buffer 0 (binary chunk) has 48 bytes of 480",
        ),
        broken(
            "cycle.glb",
            glb_of(&[("\"name\":\"leaf\"", "\"children\":[0]")]),
            "node 0 \"root\" is below itself",
        ),
    ]
}

//! GLB. The container is made around the input, so that mutations reach the JSON and the binary chunk: JSON up to the
//! first zero byte, then the chunk. An input that starts with "glTF" is taken as it is.
#![no_main]

use libfuzzer_sys::fuzz_target;
use osculate_geom::io::{no_files, read_gltf};

fuzz_target!(|data: &[u8]| {
    let contained;
    let glb = if data.starts_with(b"glTF") {
        data
    } else {
        contained = contain(data);
        &contained
    };
    if let Ok(read) = read_gltf(glb, &no_files) {
        assert!(!read.mesh.triangles().is_empty());
    }
});

fn contain(data: &[u8]) -> Vec<u8> {
    let end = data.iter().position(|&b| b == 0).unwrap_or(data.len());
    let (json, binary) = (&data[..end], data.get(end + 1..).unwrap_or(&[]));
    let mut chunks = Vec::new();
    for (kind, content) in [(b"JSON", json), (b"BIN\0", binary)] {
        chunks.extend((content.len() as u32).to_le_bytes());
        chunks.extend(kind);
        chunks.extend(content);
    }
    let mut glb = b"glTF\x02\0\0\0".to_vec();
    glb.extend((chunks.len() as u32 + 12).to_le_bytes());
    glb.extend(chunks);
    glb
}

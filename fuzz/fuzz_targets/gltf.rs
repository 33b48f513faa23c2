//! glTF as JSON. What follows a zero byte is the content of every file that it names.
#![no_main]

use libfuzzer_sys::fuzz_target;
use osculate_geom::io::read_gltf;

fuzz_target!(|data: &[u8]| {
    let (json, other) = match data.iter().position(|&b| b == 0) {
        Some(end) => (&data[..end], &data[end + 1..]),
        None => (data, &[][..]),
    };
    if let Ok(read) = read_gltf(json, &|_: &str| Ok(other.to_vec())) {
        assert!(!read.mesh.triangles().is_empty());
    }
});

//! OBJ. What follows a zero byte is the file's material library, under whatever name.
#![no_main]

use libfuzzer_sys::fuzz_target;
use osculate_geom::io::read_obj;

fuzz_target!(|data: &[u8]| {
    let (obj, library) = match data.iter().position(|&b| b == 0) {
        Some(end) => (&data[..end], &data[end + 1..]),
        None => (data, &[][..]),
    };
    let files = |name: &str| {
        let image = name.ends_with("png");
        Ok(if image { b"\x89PNG\r\n\x1a\n".to_vec() } else { library.to_vec() })
    };
    if let Ok(read) = read_obj(obj, &files) {
        assert!(!read.mesh.triangles().is_empty());
    }
});

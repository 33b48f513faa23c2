//! STL.
#![no_main]

use libfuzzer_sys::fuzz_target;
use osculate_geom::io::read_stl;

fuzz_target!(|data: &[u8]| {
    if let Ok(read) = read_stl(data) {
        assert!(!read.mesh.triangles().is_empty());
    }
});

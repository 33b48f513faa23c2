//! Baked meshes of both formats: what is read can be written and read again.
#![no_main]

use libfuzzer_sys::fuzz_target;
use osculate_geom::bake::{read_baked_glb, read_baked_ply};

fuzz_target!(|data: &[u8]| {
    let baked = if data.starts_with(b"ply") { read_baked_ply(data) } else { read_baked_glb(data) };
    if let Ok(baked) = baked {
        assert_eq!(baked.curvature().len(), baked.mesh().positions().len());
        for curvature in baked.curvature() {
            assert!(curvature.principal.is_none_or(|p| p.kappa_min <= p.kappa_max));
        }
    }
});

//! Baked meshes of both formats: what is read can be written and read again.
#![no_main]

use libfuzzer_sys::fuzz_target;
use osculate_geom::bake::{read_baked_glb, read_baked_ply};

fuzz_target!(|data: &[u8]| {
    let baked = if data.starts_with(b"ply") { read_baked_ply(data) } else { read_baked_glb(data) };
    if let Ok(baked) = baked {
        assert_eq!(baked.curvature().len(), baked.mesh().positions().len());
        if let Some(filter) = baked.filter() {
            assert_eq!(filter.bound().len(), baked.curvature().len());
            assert_eq!(filter.lowering().len(), filter.azimuths() * filter.bound().len());
            assert!(filter.lowering().iter().chain(filter.bound()).all(|x| x.is_finite() && *x >= 0.0));
        }
        for curvature in baked.curvature() {
            assert!(curvature.principal.is_none_or(|p| p.kappa_min <= p.kappa_max));
        }
    }
});

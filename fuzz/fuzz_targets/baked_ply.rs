//! Baked PLY: what is read has sound rows.
#![no_main]

use libfuzzer_sys::fuzz_target;
use osculate_geom::bake::read_baked_ply;

fuzz_target!(|data: &[u8]| {
    let Ok(baked) = read_baked_ply(data) else { return };
    let mesh = baked.mesh();
    assert_eq!(baked.curvature().len(), mesh.positions().len());
    assert!(mesh.triangles().iter().flatten().all(|&v| (v as usize) < mesh.positions().len()));
    for curvature in baked.curvature() {
        assert!(curvature.error >= 0.0);
        assert!(curvature.principal.is_none_or(|p| p.kappa_min <= p.kappa_max && p.kappa_max.is_finite()));
    }
});

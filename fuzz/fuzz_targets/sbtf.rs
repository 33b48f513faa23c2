//! Models: what is read can be compiled, asked, and written to the same model.
#![no_main]

use glam::{Vec2, Vec3};
use libfuzzer_sys::fuzz_target;
use osculate_sbtf::file::ModelFile;
use osculate_sbtf::infer::Material;
use osculate_sbtf::{Incidence, Query, SilhouetteBtf};

fuzz_target!(|data: &[u8]| {
    let Ok(file) = ModelFile::from_bytes(data) else { return };
    let material = Material::new(&file.model);
    for kappa_hat in [-1.0, 0.0, 3.0] {
        for wo in [Vec3::Z, Vec3::new(0.8, 0.6, 1e-6)] {
            let query = Query { uv: Vec2::new(0.9, -3.0), wo, wi: Vec3::new(0.0, 0.6, -0.8), kappa_hat };
            let answer = material.eval(&query);
            assert!(answer.rgb.is_finite() && (0.0..=1.0).contains(&answer.alpha));
            if let Some(sampler) = &file.sampler {
                let (wi, pdf) = sampler.sample(&Incidence { uv: query.uv, wo, kappa_hat }, 0.5, Vec2::new(0.3, 0.7));
                assert!(wi.is_finite() && pdf > 0.0);
            }
        }
    }
    let bytes = file.to_bytes().expect("what was read can be written");
    assert_eq!(ModelFile::from_bytes(&bytes).expect("and read"), file);
});

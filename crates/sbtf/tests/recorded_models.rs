//! Recorded models read the same and answer the same on every machine. `tests/data/README.md` says what made them.

use std::path::Path;

use glam::{Vec2, Vec3};
use osculate_sbtf::file::ModelFile;
use osculate_sbtf::infer::{Instructions, Material};
use osculate_sbtf::{Answer, Query, SilhouetteBtf};

#[test]
fn recorded_models_answer_as_recorded() {
    let directory = Path::new(env!("CARGO_MANIFEST_DIR")).join("../../tests/data/models");
    for name in ["taps", "direct", "see-through", "neumip"] {
        let path = directory.join(format!("{name}.sbtf"));
        let file = ModelFile::read(&path).unwrap();
        assert_eq!(file.to_bytes().unwrap(), std::fs::read(&path).unwrap(), "{name}: a round trip");
        let text = std::fs::read_to_string(directory.join(format!("{name}.json"))).unwrap();
        let recorded: serde_json::Value = serde_json::from_str(&text).unwrap();
        let rows = |key: &str| -> Vec<Vec<f32>> { serde_json::from_value(recorded[key].clone()).unwrap() };
        let (queries, answers) = (rows("queries"), rows("answers"));
        assert!(queries.len() == 150 && answers.iter().filter(|a| a[3] > 0.0).count() > 50, "{name}");
        let bound: f32 = serde_json::from_value(recorded["bound"].clone()).unwrap();
        for instructions in [Instructions::Avx512, Instructions::Avx2, Instructions::Portable] {
            let Some(material) = Material::with_instructions(&file.model, instructions) else { continue };
            for (q, a) in queries.iter().zip(&answers) {
                let query = Query {
                    uv: Vec2::new(q[0], q[1]),
                    wo: Vec3::new(q[2], q[3], q[4]),
                    wi: Vec3::new(q[5], q[6], q[7]),
                    kappa_hat: q[8],
                };
                let wanted = Answer { rgb: Vec3::new(a[0], a[1], a[2]), alpha: a[3] };
                let got = material.eval(&query);
                let off = ((got.rgb - wanted.rgb) / (Vec3::ONE + wanted.rgb)).abs().max_element();
                assert!(
                    off.max((got.alpha - wanted.alpha).abs()) < bound,
                    "{name} {query:?}: {got:?} {wanted:?}"
                );
            }
        }
    }
}

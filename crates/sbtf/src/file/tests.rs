//! Round trips, and files that are none.

use super::*;
use crate::infer::{Precision, StoredModel};
use crate::model::{Architecture, Model, TextureShape};
use crate::sampling::{Grid, Lobe, Sampler};

fn small(form: Architecture) -> Architecture {
    let texture = TextureShape { width: 3, height: 2, channels: 8 };
    Architecture {
        opacity_texture: texture,
        offset_texture: texture,
        colour_texture: TextureShape { channels: 5, ..texture },
        width: 4,
        ..form
    }
}

fn model_file(form: Architecture, precision: Precision) -> ModelFile {
    ModelFile {
        model: StoredModel::new(&Model::untrained(small(form), 1), precision),
        provenance: Provenance {
            tool: "a test".to_owned(),
            seed: u64::MAX,
            training: serde_json::json!({"z": 0.1, "a": [1e-300, -0.0], "m": "ä"}),
            scores: serde_json::Value::Null,
            microstructure: Some(MicrostructureSource {
                name: "wool".to_owned(),
                sha256: "00".to_owned(),
                depth: 0.1,
            }),
        },
        sampler: Some(Sampler::cosine()),
    }
}

#[test]
fn round_trips_are_exact_in_numbers_and_in_bytes() {
    for form in [
        Architecture::paper(0.1),
        Architecture::taps(1.0 / 3.0),
        Architecture::neumip(0.7),
        Architecture::see_through(0.2),
    ] {
        for precision in Precision::ALL {
            let file = model_file(form.clone(), precision);
            let bytes = file.to_bytes().unwrap();
            let read = ModelFile::from_bytes(&bytes).unwrap();
            assert_eq!(read, file);
            assert_eq!(read.to_bytes().unwrap(), bytes);
        }
    }
    let directory = tempfile::tempdir().unwrap();
    let path = directory.path().join("model.sbtf");
    let file = ModelFile { sampler: None, ..model_file(Architecture::paper(0.1), Precision::U8) };
    file.write(&path).unwrap();
    assert_eq!(ModelFile::read(&path).unwrap(), file);
}

#[test]
fn files_have_the_oldest_version_that_says_what_they_say() {
    let says = |form: Architecture, words: &str| {
        let bytes = model_file(form, Precision::U8).to_bytes().unwrap();
        String::from_utf8_lossy(&bytes).contains(words)
    };
    assert!(says(Architecture::taps(0.1), "\\\"version\\\":1") && !says(Architecture::taps(0.1), "_way"));
    assert!(says(Architecture::see_through(0.1), "\\\"version\\\":2"));
    assert!(says(Architecture::see_through(0.1), "\\\"opacity_way\\\":\\\"through\\\""));
    let grid = Grid { curvature_edges: vec![0.5], ..Grid::default() };
    for sampler in [
        Sampler::new(vec![Lobe::Uniform], grid, vec![1.0; 2]).unwrap(),
        Sampler::new(
            vec![Lobe::Uniform, Lobe::Forward { sharpness: 40.0, height: 0.3 }],
            Grid::default(),
            vec![0.5; 2],
        )
        .unwrap(),
    ] {
        let file = ModelFile { sampler: Some(sampler), ..model_file(Architecture::taps(0.1), Precision::U8) };
        let bytes = file.to_bytes().unwrap();
        assert!(String::from_utf8_lossy(&bytes).contains("\\\"version\\\":3"));
        assert_eq!(ModelFile::from_bytes(&bytes).unwrap(), file);
        assert_eq!(ModelFile::from_bytes(&bytes).unwrap().to_bytes().unwrap(), bytes);
        let older = with_header(&bytes, |header| header.replace("\\\"version\\\":3", "\\\"version\\\":2"));
        let message = ModelFile::from_bytes(&older).unwrap_err().to_string();
        assert!(message.contains("that version 2 does not know"), "{message}");
    }
}

#[test]
fn any_safetensors_reader_can_load_it() {
    let file = model_file(Architecture::paper(0.1), Precision::F16);
    let bytes = file.to_bytes().unwrap();
    let tensors = safetensors::SafeTensors::deserialize(&bytes).unwrap();
    assert_eq!(tensors.len(), 3 * (1 + 2 * 4));
    assert_eq!(tensors.tensor("opacity.texture").unwrap().shape(), [2, 3, 8]);
    assert_eq!(tensors.tensor("colour.layers.0.weight").unwrap().shape(), [4, 5 + 6]);
}

/// Rewrites the header of a file, keeping its data.
fn with_header(bytes: &[u8], edit: impl Fn(&str) -> String) -> Vec<u8> {
    let length = usize::try_from(u64::from_le_bytes(bytes[..8].try_into().unwrap())).unwrap();
    let header = edit(std::str::from_utf8(&bytes[8..8 + length]).unwrap());
    let mut edited = (header.len() as u64).to_le_bytes().to_vec();
    edited.extend(header.as_bytes());
    edited.extend(&bytes[8 + length..]);
    edited
}

#[test]
fn broken_files_get_one_clear_error() {
    let bytes = model_file(Architecture::paper(0.1), Precision::F32).to_bytes().unwrap();
    let replaced = |from: &str, to: &str| {
        assert!(String::from_utf8_lossy(&bytes).contains(from), "{from} is in the header");
        with_header(&bytes, |header| header.replacen(from, to, 1))
    };
    let mut not_a_number = bytes.clone();
    let end = not_a_number.len();
    not_a_number[end - 4..].copy_from_slice(&f32::NAN.to_le_bytes());
    let long = |length: u64| [&length.to_le_bytes()[..], b"{}"].concat();
    let cases: Vec<(Vec<u8>, &str)> = vec![
        (vec![], "ends after 0 bytes"),
        (bytes[..5].to_vec(), "ends after 5 bytes, within the header"),
        (bytes[..300].to_vec(), "ends after 300 bytes, within the header"),
        (bytes[..end - 1].to_vec(), "follow the header; copy it again"),
        ([&bytes[..], b"x"].concat(), "follow the header; copy it again"),
        (long(u64::MAX), "claims a header of 18446744073709551615 bytes"),
        (long(10_000_000_000), "claims a header of 10000000000 bytes"),
        (long(2), "without the metadata of a model"),
        (
            with_header(&bytes, |h| h.replace("\"data_offsets\":[0,", "\"data_offsets\":[5,")),
            "no safetensors file",
        ),
        (b"\x04\0\0\0\0\0\0\0nope".to_vec(), "no safetensors file"),
        (
            replaced("\\\"version\\\":1", "\\\"version\\\":7"),
            "format version is 7; this program reads 1 to 3",
        ),
        (replaced("osculate-sbtf", "other"), "its format is \"other\""),
        (replaced("\\\"depth\\\":0.1", "\\\"depth\\\":-1"), "depth is -1"),
        (replaced("\\\"depth\\\":0.1", "\\\"depth\\\":true"), "its metadata: invalid type"),
        (
            replaced("\\\"width\\\":4", "\\\"width\\\":5"),
            "has shape [4, 11]; the architecture asks for [5, 11]",
        ),
        (replaced("\\\"width\\\":4", "\\\"width\\\":4000000000"), "width is 4000000000; 1 to 128"),
        (replaced("\\\"hidden_layers\\\":3", "\\\"hidden_layers\\\":2"), "asks for [1, 4]"),
        (replaced("\\\"silhouette\\\"", "\\\"opaque\\\""), "\"opacity.layers.0.bias\" is none that"),
        (replaced("[-2.5,2.5]", "[0.0,0.0]"), "kappa_range is [0, 0]"),
        (
            replaced("\"offset.layers.0.bias\":{", "\"offset.layers.9.bias\":{"),
            "\"offset.layers.0.bias\" is missing",
        ),
        (replaced("\\\"opacity_taps\\\":[0.0]", "\\\"opacity_taps\\\":[]"), "number of opacity_taps is 0"),
        (replaced("[0.1,0.9]", "[0.1,0.1]"), "mixture 0 has weights [0.1, 0.1]"),
        (not_a_number, "is NaN; train or export it again"),
    ];
    for (bytes, wanted) in cases {
        let read = ModelFile::from_bytes(&bytes).map(drop);
        let message = read.expect_err(wanted).to_string();
        assert!(message.contains(wanted), "{message:?} does not say {wanted:?}");
    }
}

#[test]
fn ten_gigabytes_are_not_believed() {
    let bytes = model_file(Architecture::paper(0.1), Precision::F32).to_bytes().unwrap();
    let claimed = with_header(&bytes, |header| {
        let start = header.find("\"colour.texture\":{").unwrap();
        let end = start + header[start..].find("}").unwrap();
        let tensor =
            r#""colour.texture":{"dtype":"F32","shape":[50000,50000,1],"data_offsets":[0,10000000000]"#;
        format!("{}{tensor}{}", &header[..start], &header[end..])
    });
    let message = ModelFile::from_bytes(&claimed).unwrap_err().to_string();
    assert!(message.contains("claim 10000000000 bytes"), "{message}");
}

#[test]
fn errors_name_the_file() {
    let directory = tempfile::tempdir().unwrap();
    let path = directory.path().join("half.sbtf");
    std::fs::write(&path, [1, 2, 3]).unwrap();
    let message = ModelFile::read(&path).unwrap_err().to_string();
    assert!(message.starts_with(&path.display().to_string()) && message.contains("3 bytes"), "{message}");
    let missing = ModelFile::read(&directory.path().join("none.sbtf")).unwrap_err().to_string();
    assert!(missing.contains("none.sbtf: "), "{missing}");
}

//! Specifications of materials, and lists of lights: parsed, and built as far as that goes without files.
#![no_main]

use std::path::Path;

use libfuzzer_sys::fuzz_target;
use osculate_sbtf::micro::import::Spec;
use osculate_sbtf::micro::measured::Lights;

fuzz_target!(|data: &[u8]| {
    let Ok(text) = std::str::from_utf8(data) else { return };
    let _ = Lights::parse(text);
    let _ = Lights::parse_plain(text);
    let Ok(spec) = Spec::parse(text) else { return };
    // Files are looked up below a folder that does not exist; an absolute path would leave it. Recipes take long and read nothing.
    if text.contains('/') || text.contains('\\') || spec.builtin.is_some() {
        return;
    }
    assert!(spec.build(Path::new("no-such-folder/material.toml")).is_err());
});

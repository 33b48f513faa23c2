//! Materials through the real binary: what is shown, what is written, and one line for whatever does not fit.

#![allow(clippy::unwrap_used, reason = "a test that cannot set up its files must stop")]

mod common;

use common::Workspace;
use image::{ExtendedColorType, ImageEncoder as _};

const FIELD: &str = "height = \"h.png\"\ndepth = 0.1\nalbedo = [0.5, 0.4, 0.3]\nroughness = 0.6\n";

fn png(w: &Workspace, name: &str, (width, height): (u32, u32), colour: ExtendedColorType, bytes: &[u8]) {
    let mut out = Vec::new();
    image::codecs::png::PngEncoder::new(&mut out).write_image(bytes, width, height, colour).unwrap();
    std::fs::write(w.path(name), out).unwrap();
}

/// 16-bit heights of a function over the unit square.
fn heights(w: &Workspace, name: &str, (width, height): (u32, u32), value: impl Fn(f32, f32) -> f32) {
    let texel =
        |i: u32| value((i % width) as f32 / width as f32, (i / width) as f32 / height as f32).clamp(0.0, 1.0);
    #[expect(clippy::cast_possible_truncation, clippy::cast_sign_loss, reason = "clamped")]
    let bytes: Vec<u8> =
        (0..width * height).flat_map(|i| ((texel(i) * 65_535.0) as u16).to_ne_bytes()).collect();
    png(w, name, (width, height), ExtendedColorType::L16, &bytes);
}

fn wave(u: f32, v: f32) -> f32 {
    let tau = std::f32::consts::TAU;
    0.5 + 0.25 * (tau * u).sin() + 0.25 * (tau * 2.0 * v).cos()
}

#[test]
fn a_procedural_material_is_shown_and_its_maps_come_back() {
    let w = Workspace::new();
    let list = w.ok("micro --list").stdout;
    assert_eq!(list.lines().count(), 13, "{list}");
    let shown = w.ok("micro shell --size 32 -o shell.png --maps maps --json report.json").stdout;
    assert!(shown.contains("512 x 512") && shown.contains("seam"), "{shown}");
    let report = w.json("report.json");
    assert_eq!(report["schema"], "osculate.micro/1");
    assert_eq!(report["micro"]["hash"].as_str().unwrap().len(), 64);
    assert_eq!(&w.read("shell.png")[1..4], b"PNG");
    w.ok("micro maps/material.toml --json again.json");
    let again = w.json("again.json");
    let slope = |r: &serde_json::Value| r["micro"]["field"]["slope_degrees"]["p95"].as_f64().unwrap();
    // 16 bits keep slopes of tens of degrees to a thousandth of a degree or so.
    assert!((slope(&report) - slope(&again)).abs() < 0.05);
}

/// The whole way of a measured material, short of the training.
#[test]
fn photographs_of_a_material_become_a_material() {
    let w = Workspace::new();
    let taken = w.ok("micro leather --photographs photos --size 24").stdout;
    assert!(taken.contains("12 photographs"), "{taken}");
    let read = w.ok("micro --measured photos -o again.toml --json measured.json").stdout;
    assert!(read.contains("from 12 images"), "{read}");
    w.ok("micro again.toml --json again.json");
    w.ok("micro leather --json leather.json");
    let depth = |name: &str| w.json(name)["micro"]["depth"].as_f64().unwrap();
    // Half of the grain is finer than these texels, which take it for roughness.
    let ratio = depth("again.json") / depth("leather.json");
    assert!((0.6..1.2).contains(&ratio), "{ratio}");
    w.refuses("micro basket-weave --photographs other", &["basket-weave", "no height field"]);
}

#[test]
fn maps_of_any_size_are_taken() {
    let w = Workspace::new();
    heights(&w, "h.png", (45, 34), wave);
    png(&w, "a.png", (3, 5), ExtendedColorType::Rgb8, &[120; 45]);
    w.write("m.toml", &FIELD.replace("[0.5, 0.4, 0.3]", "\"a.png\""));
    assert!(w.ok("micro m.toml").stdout.contains("45 x 34"));
    let eight: Vec<u8> = (0..64_u8).map(|i| 32 * (i % 8).min(8 - i % 8)).collect();
    png(&w, "h.png", (8, 8), ExtendedColorType::L8, &eight);
    let run = w.ok("micro m.toml");
    assert!(run.stderr.contains("h.png: has 8 bits a height"), "{run:?}");
}

#[test]
fn a_map_that_does_not_tile_is_refused_mirrored_or_accepted() {
    let w = Workspace::new();
    heights(&w, "h.png", (40, 30), |u, _| u);
    w.write("m.toml", FIELD);
    let message = w.refuses("micro m.toml", &["h.png", "39.0 times", "mirror"]);
    assert_eq!(message.matches("does not tile along u").count(), 1, "said once: {message}");
    w.write("m.toml", &format!("{FIELD}tiling = \"mirror\""));
    w.ok("micro m.toml --json r.json");
    let report = w.json("r.json");
    assert_eq!(report["micro"]["field"]["size"][0], 80);
    assert!(report["micro"]["field"]["seam"]["u"]["ratio"].as_f64().unwrap() < 1.0);
    assert!(report["seam"]["u"]["ratio"].as_f64().unwrap() > 30.0, "the file's own seam");
    w.write("m.toml", &format!("{FIELD}tiling = \"accept\""));
    assert!(w.ok("micro m.toml").stderr.contains("does not tile along u"));
}

#[test]
fn every_bad_material_is_one_line_and_exit_code_2() {
    let w = Workspace::new();
    w.refuses("micro granite", &["granite", "cave", "wool-2"]);
    w.refuses("micro no.toml", &["no.toml", "cannot be read"]);
    w.refuses("micro cave -o cave.jpg", &["cave.jpg", ".png"]);
    w.refuses("micro basket-weave --maps maps", &["basket-weave", "leave --maps"]);
    w.refuses("micro --measured nowhere", &["nowhere", "lights.toml"]);
    w.write("m.toml", FIELD);
    w.refuses("micro m.toml", &["h.png", "cannot be read"]);
    w.write("h.png", "no image");
    w.refuses("micro m.toml", &["h.png", "no PNG, JPEG or EXR"]);
    png(&w, "h.png", (4, 4), ExtendedColorType::L8, &[77; 16]);
    w.refuses("micro m.toml", &["h.png", "everywhere"]);
    png(&w, "h.png", (2, 1), ExtendedColorType::Rgb8, &[255, 0, 0, 0, 0, 0]);
    w.refuses("micro m.toml", &["h.png", "in colour", "(0, 0)"]);
    std::fs::write(w.path("h.png"), one_bit_png()).unwrap();
    w.refuses("micro m.toml", &["h.png", "1 bits", "8 or 16"]);
    std::fs::write(w.path("h.png"), huge_png()).unwrap();
    w.refuses("micro m.toml", &["h.png", "30000 x 30000", "16384"]);
    nan_exr(&w, "h.exr");
    w.write("m.toml", &FIELD.replace("h.png", "h.exr"));
    w.refuses("micro m.toml", &["h.exr", "texel (1, 0)", "NaN", "finite"]);
    heights(&w, "h.png", (16, 16), wave);
    for (key, line, part) in [
        ("depth", "", "depth: is missing"),
        ("depth", "depth = -1", "depth: -1"),
        ("albedo", "", "albedo: is missing"),
        ("roughness", "", "roughness: is missing"),
        ("roughness", "roughness = 2", "roughness: 2"),
        ("roughness", "roughness = 0.5\ngloss = 1", "gloss"),
        ("roughness", "roughness = 0.5\nnormal = \"h.png\"", "grey"),
    ] {
        let kept: Vec<_> = FIELD.lines().filter(|l| !l.starts_with(key)).collect();
        w.write("m.toml", &format!("{}\n{line}\n", kept.join("\n")));
        let file = if part == "grey" { "h.png" } else { "m.toml" };
        w.refuses("micro m.toml", &[file, part]);
    }
}

#[test]
fn meshes_become_tiles_or_say_why_not() {
    let w = Workspace::new();
    let quad = "v 0 0 0\nv 2 0 0\nv 2 2 0.4\nv 0 2 0\nf 1 2 3 4\n";
    w.write("m.obj", quad);
    w.write("m.toml", "mesh = \"m.obj\"\nperiod = [2, 2]\n");
    let shown = w.ok("micro m.toml --json r.json --size 32 -o m.png").stdout;
    assert!(shown.contains("2 triangles"), "{shown}");
    assert!((w.json("r.json")["micro"]["depth"].as_f64().unwrap() - 0.2).abs() < 1e-6);
    w.write("m.toml", "mesh = \"m.obj\"\nperiod = [0.1, 2]\n");
    w.refuses("micro m.toml", &["m.obj", "vertex 1", "period"]);
    w.write("m.toml", "mesh = \"m.obj\"\nperiod = [2, 2]\ndepth = 0.1\n");
    w.refuses("micro m.toml", &["m.obj", "0.2", "0.1"]);
    w.write("m.obj", &quad.replace("0.4", "0"));
    w.write("m.toml", "mesh = \"m.obj\"\nperiod = [2, 2]\n");
    w.refuses("micro m.toml", &["m.obj", "not flat"]);
}

fn nan_exr(w: &Workspace, name: &str) {
    use exr::prelude::WritableImage as _;
    let pixel = |p: exr::math::Vec2<usize>| {
        let x = if p.x() == 1 { f32::NAN } else { 0.5 };
        (x, x, x)
    };
    let image = exr::image::Image::from_channels((3, 2), exr::image::SpecificChannels::rgb(pixel));
    image.write().to_file(w.path(name)).unwrap();
}

/// A PNG of the header alone, and the start of its data.
fn header_png(side: u32, bits: u8, data: &[u8]) -> Vec<u8> {
    let chunk = |name: &[u8; 4], data: &[u8]| {
        let length = u32::try_from(data.len()).unwrap();
        let body = [name.as_slice(), data].concat();
        [length.to_be_bytes().as_slice(), &body, &crc32(&body).to_be_bytes()].concat()
    };
    let header = [side.to_be_bytes().as_slice(), &side.to_be_bytes(), &[bits, 0, 0, 0, 0]].concat();
    [b"\x89PNG\r\n\x1a\n".as_slice(), &chunk(b"IHDR", &header), &chunk(b"IDAT", data), &chunk(b"IEND", b"")]
        .concat()
}

fn huge_png() -> Vec<u8> {
    header_png(30_000, 8, b"")
}

/// Two by two texels of one bit: stored without compression, with zlib's header and checksum.
fn one_bit_png() -> Vec<u8> {
    let raw = [0, 0b1000_0000, 0, 0b0100_0000];
    let (mut a, mut b) = (1_u32, 0_u32);
    for byte in raw {
        a = (a + u32::from(byte)) % 65_521;
        b = (b + a) % 65_521;
    }
    let data = [[0x78, 0x01, 1, 4, 0, !4, !0].as_slice(), &raw, &(b << 16 | a).to_be_bytes()].concat();
    header_png(2, 1, &data)
}

fn crc32(bytes: &[u8]) -> u32 {
    !bytes.iter().fold(!0, |crc, &byte| {
        (0..8).fold(crc ^ u32::from(byte), |c, _| if c & 1 == 1 { c >> 1 ^ 0xEDB8_8320 } else { c >> 1 })
    })
}

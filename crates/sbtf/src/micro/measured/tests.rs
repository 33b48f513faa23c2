use std::f32::consts::TAU;
use std::path::Path;

use glam::{Vec2, Vec3};
use image::{ExtendedColorType, ImageEncoder as _};

use super::*;

const SIZE: usize = 96;

/// A smooth relief with slopes up to about 40 degrees; mean height as integration returns it.
fn height(p: Vec2) -> f32 {
    0.03 * (TAU * (2.0 * p.x + p.y)).sin() + 0.02 * (TAU * (p.x - 3.0 * p.y) + 1.0).cos()
}

fn normal(p: Vec2) -> Vec3 {
    let step = 1e-3;
    let slope = |d: Vec2| (height(p + d) - height(p - d)) / (2.0 * step);
    Vec3::new(-slope(Vec2::new(step, 0.0)), -slope(Vec2::new(0.0, step)), 1.0).normalize()
}

fn albedo(p: Vec2) -> Vec3 {
    Vec3::new(0.5, 0.35, 0.25) * (1.0 + 0.3 * (TAU * 2.0 * p.x).sin() * (TAU * p.y).cos())
}

/// Twelve lights on two rings; the lower one grazes enough to cast shadows.
fn lights() -> Vec<Vec3> {
    let ring = |elevation: f32, turn: f32| {
        (0..6_u8).map(move |k| {
            let azimuth = TAU * (f32::from(k) + turn) / 6.0;
            Vec2::from_angle(azimuth).extend(elevation.tan()).normalize()
        })
    };
    ring(0.4, 0.0).chain(ring(1.0, 0.5)).collect()
}

/// Marches to the light: an independent test of the shadow of a closed form.
fn shadowed(p: Vec2, light: Vec3) -> bool {
    let z = height(p);
    (1..300_u16).any(|i| {
        let t = f32::from(i) * 0.0015;
        height(p + light.truncate() * t) > z + light.z * t + 1e-5
    })
}

/// What a camera above sees, with an optional highlight of this roughness.
fn photograph(light: Vec3, roughness: Option<f32>) -> Vec<Vec3> {
    let half = (light + Vec3::Z).normalize();
    Grid::from_fn(SIZE, SIZE, |p| {
        let n = normal(p);
        let cosine = n.dot(light);
        if cosine <= 0.0 || shadowed(p, light) {
            return Vec3::ZERO;
        }
        let lobe = roughness.map_or(0.0, |r| {
            let a2 = r.powi(4);
            let spread = n.dot(half).powi(2) * (a2 - 1.0) + 1.0;
            // Fresnel 0.04; the visibility of low light is 1 / (4 cos cos).
            0.04 * a2 / (spread * spread) / (4.0 * n.z)
        });
        albedo(p) * cosine + Vec3::splat(lobe)
    })
    .texels()
    .to_vec()
}

fn height_error(z: &Grid<f32>) -> f32 {
    let truth = Grid::from_fn(SIZE, SIZE, height);
    let mean = |g: &Grid<f32>| g.texels().iter().sum::<f32>() / g.texels().len() as f32;
    let (a, b) = (mean(z), mean(&truth));
    let squares = z.texels().iter().zip(truth.texels()).map(|(x, y)| ((x - a) - (y - b)).powi(2));
    // Relative to the relief's depth of 0.1.
    (squares.sum::<f32>() / z.texels().len() as f32).sqrt() / 0.1
}

fn median_angle(normals: &Grid<Vec3>) -> f32 {
    let truth = Grid::from_fn(SIZE, SIZE, normal);
    let angle = |(a, b): (&Vec3, &Vec3)| a.dot(*b).clamp(-1.0, 1.0).acos().to_degrees();
    let mut angles: Vec<f32> = normals.texels().iter().zip(truth.texels()).map(angle).collect();
    angles.sort_by(f32::total_cmp);
    angles[angles.len() / 2]
}

#[test]
fn a_rendered_relief_comes_back_in_spite_of_shadows() {
    let directions = lights();
    let images: Vec<_> = directions.iter().map(|&l| photograph(l, None)).collect();
    let dark = images.iter().flatten().filter(|c| **c == Vec3::ZERO).count() as f32;
    assert!(dark / (images.len() * SIZE * SIZE) as f32 > 0.03, "the test has shadows");
    let estimate = estimate(&images, &directions, SIZE);
    let (angle, error) = (median_angle(&estimate.normals), height_error(&integrate(&estimate.normals)));
    // Exact but for single precision where at least three lights reach, which is everywhere.
    assert!(angle < 0.05, "{angle} degrees");
    assert!(error < 0.002, "{error} of the depth");
    let colours = Grid::from_fn(SIZE, SIZE, albedo);
    for (a, b) in estimate.albedo.texels().iter().zip(colours.texels()) {
        assert!((*a - *b).abs().max_element() < 0.02, "{a} {b}");
    }
    assert!(estimate.residual < 0.005, "{}", estimate.residual);
}

#[test]
fn highlights_are_left_out_and_tell_the_roughness() {
    let directions = lights();
    // A wider lobe looks more like matt light.
    for (roughness, degrees, share) in [(0.3_f32, 1.5, 0.03), (0.5, 4.0, 0.06)] {
        let images: Vec<_> = directions.iter().map(|&l| photograph(l, Some(roughness))).collect();
        let estimate = estimate(&images, &directions, SIZE);
        let angle = median_angle(&estimate.normals);
        assert!(angle < degrees, "{angle} degrees at {roughness}");
        let error = height_error(&integrate(&estimate.normals));
        assert!(error < share, "{error} of the depth at {roughness}");
        let found =
            roughness::from_highlights(&images, &directions, &estimate.normals, &estimate.albedo).unwrap();
        assert!((found - roughness).abs() < 0.1, "{found} for {roughness}");
    }
}

/// Writes a measurement of 16-bit linear images.
fn write_measurement(directory: &Path, directions: &[Vec3]) {
    let mut list = String::from("encoding = \"linear\"\n");
    for (k, &light) in directions.iter().enumerate() {
        let grid = Grid::new(SIZE, SIZE, photograph(light, None));
        let rows = grid.texels().chunks(SIZE).rev().flatten();
        // Half the light: the list states it.
        let codes = rows.flat_map(|c| (*c * 0.5).to_array());
        let bytes: Vec<u8> = codes.flat_map(|x| crate::colour::code_16(x).to_ne_bytes()).collect();
        let mut png = Vec::new();
        let side = u32::try_from(SIZE).unwrap();
        image::codecs::png::PngEncoder::new(&mut png)
            .write_image(&bytes, side, side, ExtendedColorType::Rgb16)
            .unwrap();
        std::fs::write(directory.join(format!("{k}.png")), png).unwrap();
        let [x, y, z] = (light * 2.0).to_array();
        list += &format!("[[image]]\nfile = \"{k}.png\"\ndirection = [{x}, {y}, {z}]\nintensity = 0.5\n");
    }
    std::fs::write(directory.join("lights.toml"), list).unwrap();
}

#[test]
fn a_directory_of_images_becomes_a_material_and_goes_through_files() {
    let directory = tempfile::tempdir().unwrap();
    write_measurement(directory.path(), &lights());
    let measured = measure(directory.path()).unwrap();
    let Geometry::HeightField(field) = &measured.micro.geometry else { panic!("a height field") };
    let z = field.heights().texels().iter().map(|h| h * field.depth()).collect();
    let error = height_error(&Grid::new(SIZE, SIZE, z));
    // 16-bit codes at half the light: angles to 1e-4.
    assert!(error < 0.003, "{error}");
    assert_eq!(measured.warnings.len(), 1, "no highlight: {:?}", measured.warnings);
    let spec = crate::micro::import::save_maps(field, directory.path(), "m_").unwrap();
    let path = directory.path().join("m.toml");
    crate::micro::import::save_spec(&spec, &path).unwrap();
    let read = Microstructure::load(path.to_str().unwrap()).unwrap();
    let Geometry::HeightField(again) = &read.micro.geometry else { panic!("a height field") };
    for (a, b) in again.heights().texels().iter().zip(field.heights().texels()) {
        // Half a code of 16 bits.
        assert!((a - b).abs() < 1e-5, "{a} {b}");
    }
    assert!(read.warnings.is_empty());
}

#[test]
fn bad_measurements_name_the_file_and_the_reason() {
    let image = "[[image]]\nfile = \"0.png\"\ndirection = [0, 0, 1]\n";
    for (text, part) in [
        (format!("encoding = \"linear\"\n{image}{image}"), "2 are listed"),
        (format!("{image}{image}{image}"), "encoding"),
        (
            format!(
                "encoding = \"linear\"\n{image}{image}[[image]]\nfile = \"1.png\"\ndirection = [0, 0, -1]"
            ),
            "1.png",
        ),
        (format!("encoding = \"linear\"\n{image}{image}{image}intensity = 0"), "intensity: 0"),
    ] {
        let message = Lights::parse(&text).unwrap_err().to_string();
        assert!(message.contains(part), "{text}: {message}");
    }
    let plain = "encoding srgb # as the camera wrote them\n a.png 1 0 1\nb.png 0 1 1 2\nc.png 0 0 1\n";
    assert_eq!(Lights::parse_plain(plain).unwrap().image[1].intensity, 2.0);
    assert!(Lights::parse_plain("a.png 1 0 1").unwrap_err().to_string().contains("encoding"));
    assert!(Lights::parse_plain("a.png 1 x 1").unwrap_err().to_string().contains("line: 1"));

    let directory = tempfile::tempdir().unwrap();
    // Lights on one great circle leave the slope across it open.
    let flat: Vec<Vec3> = [-0.8_f32, 0.1, 0.9].map(|x| Vec3::new(x, 0.0, 1.0).normalize()).to_vec();
    write_measurement(directory.path(), &flat);
    let message = measure(directory.path()).unwrap_err().to_string();
    assert!(message.contains("lights.toml: direction") && message.contains("one plane"), "{message}");
    std::fs::remove_file(directory.path().join("1.png")).unwrap();
    assert!(measure(directory.path()).unwrap_err().to_string().contains("1.png: cannot be read"));
}

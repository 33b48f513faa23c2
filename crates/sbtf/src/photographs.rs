//! Photographs of a microstructure as a measurement takes them: from straight above, from afar, under one distant light at a time.
//!
//! They are traced exactly, with shadows, highlights and light that bounces between slopes, and written as
//! [`measure`](crate::micro::measured::measure) reads them: so one finds out what a measurement loses, on a material of which all is known.

use std::f32::consts::{PI, TAU};
use std::io::{self, Write as _};
use std::path::Path;

use glam::{Vec2, Vec3};
use image::{ExtendedColorType, ImageEncoder as _};
use osculate_geom::write_atomically;
use rayon::prelude::*;

use crate::colour::code_16;
use crate::micro::import::{Encoding, Tiling};
use crate::micro::measured::{Light, Lights};
use crate::micro::{Geometry, HeightField, Microstructure};
use crate::oracle::{Oracle, OracleOptions};
use crate::query::{Query, SilhouetteBtf as _};
use crate::random::Random;

/// Value that images have where a white matt surface faces the light; highlights up to twice as bright are kept.
const INTENSITY: f32 = 0.5;

/// How photographs are taken.
#[derive(Debug, Clone, PartialEq)]
pub struct PhotographOptions {
    /// Texels along each side of an image, which shows one tile (256).
    pub size: usize,
    /// Paths per texel, each from its own point of it (32).
    pub samples: u32,
    /// Unit directions to the lights, one image each ([`two_rings`]).
    pub lights: Vec<Vec3>,
    /// Of all random choices (0).
    pub seed: u64,
}

impl Default for PhotographOptions {
    fn default() -> Self {
        Self { size: 256, samples: 32, lights: two_rings(), seed: 0 }
    }
}

/// Twelve lights from all sides, six 35 degrees above the surface and six between them at 60.
#[must_use]
pub fn two_rings() -> Vec<Vec3> {
    let ring = |elevation: f32, turn: f32| {
        (0..6_u8).map(move |k| {
            let azimuth = TAU * (f32::from(k) + turn) / 6.0;
            (elevation.cos() * Vec2::from_angle(azimuth)).extend(elevation.sin())
        })
    };
    ring(35.0_f32.to_radians(), 0.0).chain(ring(60.0_f32.to_radians(), 0.5)).collect()
}

/// The images, a light each: linear RGB row by row from the top, 1 where a white matt surface faces the light.
///
/// # Panics
///
/// If there are no samples.
#[must_use]
pub fn photographs(field: &HeightField, options: &PhotographOptions) -> Vec<Vec<Vec3>> {
    let micro = Microstructure { name: String::new(), geometry: Geometry::HeightField(field.clone()) };
    let oracle =
        Oracle::new(&micro, OracleOptions { samples: 1, seed: options.seed, ..OracleOptions::default() });
    let size = options.size;
    let texel = |light: Vec3, index: usize| {
        let corner = Vec2::new((index % size) as f32, (size - 1 - index / size) as f32);
        // The same points under every light, as a camera that stands still has them.
        let mut random = Random::new(options.seed, 0x7068_6F74, index as u64);
        let sum: Vec3 = (0..options.samples)
            .map(|_| {
                let uv = (corner + Vec2::new(random.unit(), random.unit())) / size as f32;
                oracle.eval(&Query { uv, wi: light, wo: Vec3::Z, kappa_hat: 0.0 }).rgb
            })
            .sum();
        // Radiance per irradiance; a white matt surface has 1 / pi of it.
        sum * (PI / options.samples as f32)
    };
    assert!(options.samples > 0, "at least one path per texel");
    let image = |light: &Vec3| (0..size * size).into_par_iter().map(|i| texel(*light, i)).collect();
    options.lights.iter().map(image).collect()
}

/// Writes images of 16 bits, `01.png` and on, and `lights.toml` into a directory that exists. The images tile, which the list says: a reader
/// has no seam to look for.
///
/// # Errors
///
/// What the file system reports.
pub fn save_photographs(
    images: &[Vec<Vec3>],
    options: &PhotographOptions,
    directory: &Path,
) -> io::Result<()> {
    let side = u32::try_from(options.size).map_err(io::Error::other)?;
    let mut image = Vec::with_capacity(images.len());
    for (i, (texels, light)) in images.iter().zip(&options.lights).enumerate() {
        let file = format!("{:02}.png", i + 1);
        let codes = texels.iter().flat_map(|c| (*c * INTENSITY).to_array().map(code_16));
        let bytes: Vec<u8> = codes.flat_map(u16::to_ne_bytes).collect();
        let mut png = Vec::new();
        image::codecs::png::PngEncoder::new(&mut png)
            .write_image(&bytes, side, side, ExtendedColorType::Rgb16)
            .map_err(io::Error::other)?;
        write_atomically(&directory.join(&file), |w| w.write_all(&png))?;
        image.push(Light { file, direction: light.to_array(), intensity: INTENSITY });
    }
    let lights = Lights { encoding: Encoding::Linear, roughness: None, tiling: Tiling::Accept, image };
    let text = toml::to_string(&lights).map_err(io::Error::other)?;
    write_atomically(&directory.join("lights.toml"), |w| w.write_all(text.as_bytes()))
}

#[cfg(test)]
mod tests {
    use super::*;
    use crate::micro::{Grid, Maps, Reflectance, measured};
    use crate::patch::test_fields::{level, sinusoid};

    /// Matt: only what Fresnel takes away at the surface and gives back as a wide lobe is missing.
    fn matt(field: &HeightField, albedo: f32) -> HeightField {
        let maps = Maps::uniform(Reflectance { albedo: Vec3::splat(albedo), roughness: 1.0, metalness: 0.0 });
        HeightField::new(field.heights().clone(), field.depth(), maps)
    }

    /// A flat sheet under a light 60 degrees from the normal is half as bright as facing it, and in all its texels alike.
    #[test]
    fn a_flat_sheet_follows_the_cosine() {
        let half = Vec3::new(0.75_f32.sqrt(), 0.0, 0.5);
        let options = PhotographOptions { size: 4, samples: 4, lights: vec![Vec3::Z, half], seed: 1 };
        let images = photographs(&matt(&level(1.0, 0.1), 0.6), &options);
        let (facing, slanted) = (images[0][0].x, images[1][0].x);
        assert!(images.iter().all(|i| i.iter().all(|c| (*c - i[0]).abs().max_element() < 1e-5)));
        // Within the dielectric's 4 % and its grazing rise.
        assert!((facing / 0.6 - 1.0).abs() < 0.06, "{facing}");
        assert!((slanted / facing - 0.5).abs() < 0.05, "{slanted} {facing}");
    }

    /// What was photographed comes back: orientation, heights, albedo. Light that bounces between slopes flattens it a little.
    #[test]
    fn photographs_of_a_relief_are_measured_again() {
        const SIZE: usize = 48;
        let field = matt(&sinusoid(SIZE, 0.08), 0.5);
        let options = PhotographOptions { size: SIZE, samples: 16, ..PhotographOptions::default() };
        let directory = tempfile::tempdir().unwrap();
        save_photographs(&photographs(&field, &options), &options, directory.path()).unwrap();
        let found = measured::measure(directory.path()).unwrap();
        assert_eq!(found.images, 12);
        let Geometry::HeightField(found) = &found.micro.geometry else { panic!("a height field") };
        let levelled = |field: &HeightField| {
            let z: Vec<f32> = field.heights().texels().iter().map(|h| h * field.depth()).collect();
            let mean = z.iter().sum::<f32>() / z.len() as f32;
            Grid::new(SIZE, SIZE, z.into_iter().map(|z| z - mean).collect())
        };
        let (truth, test) = (levelled(&field), levelled(found));
        let squares = truth.texels().iter().zip(test.texels()).map(|(a, b)| (a - b).powi(2));
        let error = (squares.sum::<f32>() / (SIZE * SIZE) as f32).sqrt() / 0.08;
        assert!(error < 0.03, "{error} of the depth");
        let albedo = found.maps().albedo.texels().iter().map(|c| c.x).sum::<f32>() / (SIZE * SIZE) as f32;
        assert!((albedo - 0.5).abs() < 0.04, "{albedo}");
    }
}

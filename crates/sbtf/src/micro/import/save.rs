//! Writing a height field as maps.

use std::io::{self, Write as _};
use std::path::Path;

use image::{ExtendedColorType, ImageEncoder as _};
use osculate_geom::write_atomically;

use super::spec::{MapOrValue, Spec};
use crate::colour::{code_8, code_16, srgb_from_linear};
use crate::micro::{Grid, HeightField};

/// Writes `PREFIXheight.png` (16 bits), `PREFIXalbedo.png` (sRGB, 8 bits), `PREFIXroughness.png` and `PREFIXmetalness.png` (8 bits) into
/// a directory that exists, and returns a specification that names them. Normal maps are left out.
///
/// # Errors
///
/// What the file system reports.
pub fn save_maps(field: &HeightField, directory: &Path, prefix: &str) -> io::Result<Spec> {
    let name = |map: &str| format!("{prefix}{map}.png");
    let write =
        |map: &str, bytes: Vec<u8>| write_atomically(&directory.join(name(map)), |w| w.write_all(&bytes));
    let heights: Vec<u8> =
        rows_down(field.heights()).iter().flat_map(|&h| code_16(h).to_ne_bytes()).collect();
    write("height", png(field.heights(), &heights, ExtendedColorType::L16)?)?;
    let maps = field.maps();
    let albedo: Vec<u8> = rows_down(&maps.albedo)
        .iter()
        .flat_map(|c| c.to_array().map(|x| code_8(srgb_from_linear(x))))
        .collect();
    write("albedo", png(&maps.albedo, &albedo, ExtendedColorType::Rgb8)?)?;
    for (map, grid) in [("roughness", &maps.roughness), ("metalness", &maps.metalness)] {
        let codes: Vec<u8> = rows_down(grid).iter().map(|&x| code_8(x)).collect();
        write(map, png(grid, &codes, ExtendedColorType::L8)?)?;
    }
    Ok(Spec {
        depth: Some(field.depth()),
        height: Some(name("height")),
        height_range: Some([0.0, 1.0]),
        albedo: Some(MapOrValue::Map(name("albedo"))),
        roughness: Some(MapOrValue::Map(name("roughness"))),
        metalness: Some(MapOrValue::Map(name("metalness"))),
        ..Spec::default()
    })
}

/// Writes a specification.
///
/// # Errors
///
/// What the file system reports.
pub fn save_spec(spec: &Spec, path: &Path) -> io::Result<()> {
    let text = toml::to_string(spec).map_err(io::Error::other)?;
    write_atomically(path, |w| w.write_all(text.as_bytes()))
}

fn rows_down<T: Copy>(grid: &Grid<T>) -> Vec<T> {
    grid.texels().chunks(grid.width()).rev().flatten().copied().collect()
}

fn png<T: Copy>(grid: &Grid<T>, bytes: &[u8], colour: ExtendedColorType) -> io::Result<Vec<u8>> {
    let side = |n: usize| u32::try_from(n).map_err(io::Error::other);
    let mut out = Vec::new();
    image::codecs::png::PngEncoder::new(&mut out)
        .write_image(bytes, side(grid.width())?, side(grid.height())?, colour)
        .map_err(io::Error::other)?;
    Ok(out)
}

//! Measured materials: photographs from above under known lights become a height field with maps.
//!
//! A directory holds the images and a list of lights, [`Lights`]. Each texel's normal and albedo come from photometric stereo
//! ([`stereo`](self), Woodham, "Photometric Method for Determining Surface Orientation from Multiple Images", Optical Engineering
//! 1980), with shadows and highlights left out; heights from the normals, by the least squares over a periodic tile (Frankot, Chellappa,
//! "A Method for Enforcing Integrability in Shape from Shading Algorithms", PAMI 1988).
//!
//! Assumed: the camera looks straight down from afar, lights are far away, the surface is matt but for highlights, light that
//! bounces between slopes is small. Deep narrow pits, undercuts and mirrors are out of scope.

mod images;
mod integrate;
mod lights;
mod roughness;
mod stereo;

use std::path::Path;

use glam::Vec3;

use super::import::{ImportError, Problem, SEAM_LIMIT, Tiling};
use super::{Geometry, Grid, HeightField, Maps, Microstructure, SeamReport};
use images::Photographs;
pub use integrate::integrate;
pub use lights::{Light, Lights};
pub use stereo::{Estimate, estimate};

/// A measured material and how well the images agree with it.
#[derive(Debug, Clone)]
pub struct Measured {
    /// The material; normals are in the heights.
    pub micro: Microstructure,
    /// One line each, naming the file.
    pub warnings: Vec<String>,
    /// Images that were used.
    pub images: usize,
    /// Root mean square of what the matt model leaves unexplained where it was used, over the mean brightness.
    pub residual: f32,
    /// Share of all observations that were left out as shadow or highlight.
    pub left_out: f32,
}

/// Reads a directory with `lights.toml` or `lights.txt` and the images that it names.
///
/// # Errors
///
/// Files that are missing or do not fit, fewer than three lights, lights that nearly lie in one plane, images that are not square or
/// differ in size, photographs that do not tile (unless the list says what to do), a flat surface.
pub fn measure(directory: &Path) -> Result<Measured, ImportError> {
    let (list, lights) = Lights::read(directory)?;
    let photographs = Photographs::read(directory, &lights)?;
    let fail = |problem| ImportError::new(&list, problem);
    let directions: Vec<Vec3> = lights.image.iter().map(Light::unit_direction).collect();
    stereo::check_lights(&directions).map_err(fail)?;
    let estimate = estimate(&photographs.observations, &directions, photographs.size);
    let Estimate { mut normals, mut albedo, residual, left_out } = estimate;
    let mut warnings = Vec::new();
    let roughness = match lights.roughness {
        Some(value) => value,
        None => roughness::from_highlights(&photographs.observations, &directions, &normals, &albedo)
            .unwrap_or_else(|| {
                warnings.push(format!(
                    "{}: no highlight to tell the roughness by; 0.9 is taken. Give `roughness`",
                    list.display()
                ));
                0.9
            }),
    };
    check_tiling(&normals, &albedo, lights.tiling, &list, &mut warnings)?;
    if lights.tiling == Tiling::Mirror {
        normals = normals.mirrored(|n, x, y| n * Vec3::new(x, y, 1.0));
        albedo = albedo.mirrored(|value, _, _| value);
    }
    let (heights, depth) = relief(&normals).ok_or_else(|| fail(Problem::Constant(0.0)))?;
    if albedo.texels().iter().any(|c| c.max_element() > 1.0) {
        let text = "some albedos are over 1 and are clamped; are the intensities right?";
        warnings.push(format!("{}: {text}", list.display()));
    }
    let clamped = albedo.texels().iter().map(|c| c.clamp(Vec3::ZERO, Vec3::ONE)).collect();
    let maps = Maps {
        albedo: Grid::new(albedo.width(), albedo.height(), clamped),
        roughness: Grid::new(1, 1, vec![roughness]),
        metalness: Grid::new(1, 1, vec![0.0]),
        normal: None,
    };
    let name =
        directory.file_name().map_or_else(|| "measured".to_owned(), |n| n.to_string_lossy().into_owned());
    let geometry = Geometry::HeightField(HeightField::new(heights, depth, maps));
    let micro = Microstructure { name, geometry };
    Ok(Measured { micro, warnings, images: directions.len(), residual, left_out })
}

/// Heights in `[0, 1]` and the depth that they span; `None` for a flat surface.
fn relief(normals: &Grid<Vec3>) -> Option<(Grid<f32>, f32)> {
    let z = integrate(normals);
    let lowest = z.texels().iter().copied().fold(f32::MAX, f32::min);
    let highest = z.texels().iter().copied().fold(f32::MIN, f32::max);
    let depth = highest - lowest;
    // A relief of a thousandth of a texel is rounding.
    if depth * (z.width() as f32) < 1e-3 {
        return None;
    }
    let heights = z.texels().iter().map(|z| ((z - lowest) / depth).clamp(0.0, 1.0)).collect();
    Some((Grid::new(z.width(), z.height(), heights), depth))
}

/// Integration closes any seam, so that it has to be looked for in what goes into it.
fn check_tiling(
    normals: &Grid<Vec3>,
    albedo: &Grid<Vec3>,
    tiling: Tiling,
    list: &Path,
    warnings: &mut Vec<String>,
) -> Result<(), ImportError> {
    let plane = |grid: &Grid<Vec3>, value: fn(&Vec3) -> f32| {
        SeamReport::new(&Grid::new(grid.width(), grid.height(), grid.texels().iter().map(value).collect()))
    };
    let reports = [plane(normals, |n| n.x), plane(normals, |n| n.y), plane(albedo, |c| c.element_sum())];
    let seams = reports.iter().flat_map(|r| [("u", r.u.ratio), ("v", r.v.ratio)]);
    let (axis, ratio) = seams.fold(("u", 0.0), |a, b| if b.1 > a.1 { b } else { a });
    if ratio > SEAM_LIMIT {
        match tiling {
            Tiling::Require => {
                return Err(ImportError::new(list, Problem::Seam { axis, ratio, limit: SEAM_LIMIT }));
            }
            Tiling::Accept => {
                warnings.push(format!(
                    "{}: the photographs do not tile along {axis}: {ratio:.1}",
                    list.display()
                ));
            }
            Tiling::Mirror => {}
        }
    }
    Ok(())
}

#[cfg(test)]
mod tests;

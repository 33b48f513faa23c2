//! Height fields from maps.

use std::path::{Path, PathBuf};

use glam::Vec3;

use super::spec::{Encoding, MapOrValue, NormalY, Spec, Tiling};
use super::{ImportError, Imported, Problem, Raster, SEAM_LIMIT, TexelFormat, raster, worst};
use crate::colour::linear_from_srgb;
use crate::micro::{Geometry, Grid, HeightField, Maps, Microstructure, SeamReport};

/// Files beside the specification, and what there is to say about them.
struct Reader<'a> {
    spec: &'a Path,
    mirror: bool,
    warnings: Vec<String>,
}

pub(super) fn build(spec: &Spec, path: &Path) -> Result<Imported, ImportError> {
    let mirror = spec.tiling == Tiling::Mirror;
    let mut reader = Reader { spec: path, mirror, warnings: Vec::new() };
    let (heights, seam) = reader.heights(spec)?;
    let maps = reader.maps(spec)?;
    // `Spec::parse` proves that it is there.
    let depth = spec.depth.ok_or_else(|| ImportError::new(path, Problem::key("depth", "is missing")))?;
    let micro = Microstructure {
        name: String::new(),
        geometry: Geometry::HeightField(HeightField::new(heights, depth, maps)),
    };
    Ok(Imported { micro, warnings: reader.warnings, seam: Some(seam) })
}

impl Reader<'_> {
    fn read(&self, name: &str) -> Result<(PathBuf, Raster), ImportError> {
        let path = self.spec.parent().unwrap_or_else(|| Path::new("")).join(name);
        let bytes = std::fs::read(&path).map_err(|e| ImportError::new(&path, Problem::Unreadable(e)))?;
        let raster = Raster::decode(&bytes).map_err(|problem| ImportError::new(&path, problem))?;
        if self.mirror {
            raster::check_size(2 * raster.width, 2 * raster.height).map_err(|_| {
                ImportError::new(&path, Problem::key("tiling", "too large to mirror; scale it down"))
            })?;
        }
        Ok((path, raster))
    }

    fn heights(&mut self, spec: &Spec) -> Result<(Grid<f32>, SeamReport), ImportError> {
        let name = spec.height.as_deref().unwrap_or_default();
        let (path, raster) = self.read(name)?;
        let fail = |problem| ImportError::new(&path, problem);
        if let TexelFormat::Code(bits) = raster.format {
            if bits < 8 {
                return Err(fail(Problem::BitDepth(bits)));
            }
            if bits == 8 {
                let text =
                    "has 8 bits a height: steep light shows 255 steps; a 16-bit PNG or an EXR has none";
                self.warnings.push(format!("{}: {text}", path.display()));
            }
        }
        let (width, height) = (raster.width, raster.height);
        let values = raster.into_grey().map_err(fail)?;
        check(&values, width, f32::is_finite, "heights are finite numbers").map_err(fail)?;
        let heights = Grid::new(width, height, upright(&normalised(values, spec).map_err(fail)?, width));
        let seam = SeamReport::new(&heights);
        let (axis, largest) = worst(&seam);
        if largest.ratio > SEAM_LIMIT {
            match spec.tiling {
                Tiling::Require => {
                    return Err(fail(Problem::Seam { axis, ratio: largest.ratio, limit: SEAM_LIMIT }));
                }
                Tiling::Accept => self.warnings.push(format!(
                    "{}: does not tile along {axis}: the seam is {:.1} times the jumps inside",
                    path.display(),
                    largest.ratio
                )),
                Tiling::Mirror => {}
            }
        }
        Ok((self.tiled(heights), seam))
    }

    fn maps(&self, spec: &Spec) -> Result<Maps, ImportError> {
        let albedo = match &spec.albedo {
            Some(MapOrValue::Map(name)) => self.albedo(name, spec.albedo_encoding)?,
            Some(MapOrValue::Value(colour)) => Grid::new(1, 1, vec![Vec3::from(*colour)]),
            None => Grid::new(1, 1, vec![Vec3::splat(0.5)]),
        };
        let normal = spec.normal.as_deref().map(|name| self.normals(name, spec.normal_y)).transpose()?;
        let roughness = self.share_map(spec.roughness.as_ref(), 0.5)?;
        Ok(Maps { albedo, roughness, metalness: self.share_map(spec.metalness.as_ref(), 0.0)?, normal })
    }

    fn albedo(&self, name: &str, encoding: Encoding) -> Result<Grid<Vec3>, ImportError> {
        let (path, raster) = self.read(name)?;
        let decode = |x: f32| match (raster.format, encoding) {
            (TexelFormat::Code(_), Encoding::Srgb) => linear_from_srgb(x),
            _ => x,
        };
        for plane in &raster.planes {
            check(plane, raster.width, |x| (0.0..=1.0).contains(&x), "albedos lie in [0, 1]")
                .map_err(|problem| ImportError::new(&path, problem))?;
        }
        let plane = |channel: usize| &raster.planes[channel.min(raster.planes.len() - 1)];
        let (r, g, b) = (plane(0), plane(1), plane(2));
        let texels: Vec<Vec3> =
            (0..r.len()).map(|i| Vec3::new(decode(r[i]), decode(g[i]), decode(b[i]))).collect();
        Ok(self.tiled(Grid::new(raster.width, raster.height, upright(&texels, raster.width))))
    }

    fn share_map(&self, source: Option<&MapOrValue<f32>>, default: f32) -> Result<Grid<f32>, ImportError> {
        let name = match source {
            Some(MapOrValue::Map(name)) => name,
            Some(&MapOrValue::Value(value)) => return Ok(Grid::new(1, 1, vec![value])),
            None => return Ok(Grid::new(1, 1, vec![default])),
        };
        let (path, raster) = self.read(name)?;
        let fail = |problem| ImportError::new(&path, problem);
        let (width, height) = (raster.width, raster.height);
        let values = raster.into_grey().map_err(fail)?;
        check(&values, width, |x| (0.0..=1.0).contains(&x), "values lie in [0, 1]").map_err(fail)?;
        Ok(self.tiled(Grid::new(width, height, upright(&values, width))))
    }

    fn normals(&self, name: &str, y: NormalY) -> Result<Grid<Vec3>, ImportError> {
        let (path, raster) = self.read(name)?;
        let fail = |problem| ImportError::new(&path, problem);
        let [x_plane, y_plane, z_plane] = raster.planes.as_slice() else {
            return Err(fail(Problem::Channels("is grey; a normal map has red, green and blue".into())));
        };
        for plane in &raster.planes {
            check(plane, raster.width, f32::is_finite, "normals are finite numbers").map_err(fail)?;
        }
        let sign = if y == NormalY::Up { 1.0 } else { -1.0 };
        let component = |x: f32| if raster.format == TexelFormat::Float { x } else { 2.0 * x - 1.0 };
        let mut texels = Vec::with_capacity(x_plane.len());
        for (i, &z) in z_plane.iter().enumerate() {
            let n = Vec3::new(component(x_plane[i]), sign * component(y_plane[i]), component(z));
            if n.z <= 0.0 || n.length() < 0.1 {
                let (column, row) = (i % raster.width, i / raster.width);
                return Err(fail(Problem::Texel {
                    column,
                    row,
                    value: z,
                    what: "normals point out of the surface",
                }));
            }
            texels.push(n.normalize());
        }
        let grid = Grid::new(raster.width, raster.height, upright(&texels, raster.width));
        // A mirrored normal map has mirrored normals.
        Ok(if self.mirror { grid.mirrored(|n, x, y| n * Vec3::new(x, y, 1.0)) } else { grid })
    }

    fn tiled<T: Copy>(&self, grid: Grid<T>) -> Grid<T> {
        if self.mirror { grid.mirrored(|value, _, _| value) } else { grid }
    }
}

/// Heights in `[0, 1]`, 1 where the bounding surface is touched.
fn normalised(mut values: Vec<f32>, spec: &Spec) -> Result<Vec<f32>, Problem> {
    let least = values.iter().copied().fold(f32::MAX, f32::min);
    let greatest = values.iter().copied().fold(f32::MIN, f32::max);
    if least == greatest {
        return Err(Problem::Constant(least));
    }
    let [low, high] = spec.height_range.unwrap_or([least, greatest]);
    // In double precision: the range of an EXR may overflow a single.
    let (low, range) = (f64::from(low), f64::from(high) - f64::from(low));
    for value in &mut values {
        #[allow(clippy::cast_possible_truncation, reason = "between 0 and 1")]
        let share = ((f64::from(*value) - low) / range).clamp(0.0, 1.0) as f32;
        *value = if spec.invert { 1.0 - share } else { share };
    }
    let first = values[0];
    if values.iter().all(|&v| v == first) {
        return Err(Problem::key(
            "height_range",
            format!("the map's {least} to {greatest} is all outside of it"),
        ));
    }
    Ok(values)
}

fn check(
    values: &[f32],
    width: usize,
    good: impl Fn(f32) -> bool,
    what: &'static str,
) -> Result<(), Problem> {
    let Some(i) = values.iter().position(|&x| !good(x)) else { return Ok(()) };
    Err(Problem::Texel { column: i % width, row: i / width, value: values[i], what })
}

/// Rows from the bottom up, as grids have them.
fn upright<T: Copy>(texels: &[T], width: usize) -> Vec<T> {
    texels.chunks(width).rev().flatten().copied().collect()
}

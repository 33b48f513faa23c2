//! The images of a measurement, in step.

use std::path::Path;

use glam::Vec3;

use super::Lights;
use crate::colour::linear_from_srgb;
use crate::micro::import::{Encoding, ImportError, Problem, Raster, TexelFormat};

/// Most numbers that all images of a measurement may hold: 3 GB.
const MAX_VALUES: usize = 1 << 28;

/// Square images of equal size.
pub(super) struct Photographs {
    /// Texels along each side.
    pub size: usize,
    /// Per image, linear RGB over the light's intensity; rows from the bottom up.
    pub observations: Vec<Vec<Vec3>>,
}

impl Photographs {
    pub(super) fn read(directory: &Path, lights: &Lights) -> Result<Self, ImportError> {
        let mut size = 0;
        let mut observations = Vec::new();
        for light in &lights.image {
            let path = directory.join(&light.file);
            let fail = |problem| ImportError::new(&path, problem);
            let bytes = std::fs::read(&path).map_err(|e| fail(Problem::Unreadable(e)))?;
            let raster = Raster::decode(&bytes).map_err(fail)?;
            let (width, height) = (raster.width, raster.height);
            if width != height {
                return Err(fail(Problem::key(
                    "size",
                    format!("{width} x {height} is not square, as a tile is; crop it"),
                )));
            }
            if size != 0 && size != width {
                return Err(fail(Problem::key(
                    "size",
                    format!("{width} texels a side; the images before have {size}"),
                )));
            }
            size = width;
            if width * height * 3 * lights.image.len() > MAX_VALUES {
                return Err(fail(Problem::TooLarge { width, height }));
            }
            observations.push(linear(&raster, lights.encoding, light.intensity).map_err(fail)?);
        }
        Ok(Self { size, observations })
    }
}

fn linear(raster: &Raster, encoding: Encoding, intensity: f32) -> Result<Vec<Vec3>, Problem> {
    for plane in &raster.planes {
        if let Some(i) = plane.iter().position(|x| !(x.is_finite() && *x >= 0.0)) {
            let (column, row) = (i % raster.width, i / raster.width);
            return Err(Problem::Texel {
                column,
                row,
                value: plane[i],
                what: "light is finite and not negative",
            });
        }
    }
    let curved = encoding == Encoding::Srgb && raster.format != TexelFormat::Float;
    let decode = |x: f32| if curved { linear_from_srgb(x) } else { x } / intensity;
    let plane = |channel: usize| &raster.planes[channel.min(raster.planes.len() - 1)];
    let (r, g, b) = (plane(0), plane(1), plane(2));
    let texel = |i: usize| Vec3::new(decode(r[i]), decode(g[i]), decode(b[i]));
    let rows = (0..raster.height).rev();
    Ok(rows.flat_map(|row| (0..raster.width).map(move |x| row * raster.width + x)).map(texel).collect())
}

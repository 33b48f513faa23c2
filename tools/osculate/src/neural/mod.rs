//! What the commands about neural materials share.

pub mod curve;
pub mod score;
pub mod sheet;

use anyhow::Result;
use osculate_sbtf::micro::{Geometry, Microstructure};

use crate::console::Console;

/// A microstructure by name or file, with another depth if one is given. Warnings are printed.
pub fn load_micro(name: &str, depth: Option<f32>, console: &Console) -> Result<Microstructure> {
    let imported = Microstructure::load(name)?;
    for warning in &imported.warnings {
        console.warn(warning);
    }
    let mut micro = imported.micro;
    let Some(depth) = depth else { return Ok(micro) };
    anyhow::ensure!(
        depth.is_finite() && depth > 0.0 && depth <= 1.0,
        "--depth {depth}: must be over 0 and at most 1 tile"
    );
    match micro.geometry {
        Geometry::HeightField(field) => micro.geometry = Geometry::HeightField(field.with_depth(depth)),
        Geometry::TileMesh(_) => {
            anyhow::bail!("--depth {depth}: {name} is a mesh, whose depth is its own; leave it out")
        }
    }
    Ok(micro)
}

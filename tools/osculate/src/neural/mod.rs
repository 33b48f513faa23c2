//! What the commands about neural materials share.

pub mod curve;
pub mod score;
pub mod sheet;

use anyhow::Result;
use osculate_sbtf::micro::Microstructure;

use crate::console::Console;

/// A microstructure by name or file. Warnings are printed.
pub fn load_micro(name: &str, console: &Console) -> Result<Microstructure> {
    let imported = Microstructure::load(name)?;
    for warning in &imported.warnings {
        console.warn(warning);
    }
    Ok(imported.micro)
}

//! Files in.

use std::path::Path;

use anyhow::{Context, Result};
use osculate_geom::Mesh;
use osculate_geom::bake::{self, BakedMesh};
use osculate_geom::io;

use crate::console::Console;
use crate::output::extension;

/// A mesh file, with curvature or without.
#[derive(Debug)]
pub enum Input {
    /// Written by `osculate bake`.
    Baked(Box<BakedMesh>),
    /// Any mesh.
    Raw(Mesh),
}

/// Reads a mesh, baked or not.
pub fn read(path: &Path, console: &Console) -> Result<Input> {
    if matches!(extension(path).as_str(), "glb" | "ply") && path.is_file() {
        match bake::read_baked(path) {
            Ok(baked) => return Ok(Input::Baked(Box::new(baked))),
            // Anything but a record that is there and damaged may still be a mesh; its reader says best what is wrong.
            Err(bake::ReadError::NotBaked) => {}
            Err(bake::ReadError::Invalid(_)) if !has_record(path) => {}
            Err(error) => return Err(error).with_context(|| path.display().to_string()),
        }
    }
    read_mesh(path, console).map(Input::Raw)
}

/// Reads a mesh as it is, whether baked or not.
pub fn read_mesh(path: &Path, console: &Console) -> Result<Mesh> {
    let _step = console.step(&format!("reading {}", path.display()));
    let read = io::read_mesh(path)?;
    for warning in &read.warnings {
        console.warn(format_args!("{}: {warning}", path.display()));
    }
    Ok(read.mesh)
}

/// Whether a file that is no valid bake looks as if it had been one.
fn has_record(path: &Path) -> bool {
    const MARK: &[u8] = b"\"format_version\"";
    std::fs::read(path).is_ok_and(|bytes| bytes.windows(MARK.len()).any(|window| window == MARK))
}

//! Reading mesh files.

mod corners;
mod error;
mod files;
mod obj;
mod ply;
mod polygon;
mod stl;
mod warnings;

pub use error::ReadProblem;
pub use files::{Resolver, files_beside, no_files};
pub use obj::{ObjError, read_obj};
pub use ply::{PlyError, read_ply};
pub use stl::{StlError, read_stl};

use crate::Mesh;

/// A mesh as read, and what had to be left out of it.
#[derive(Debug, Clone, PartialEq)]
pub struct Read {
    /// At least one triangle.
    pub mesh: Mesh,
    /// One line each, without the file's name.
    pub warnings: Vec<String>,
}

/// The last step of every reader.
fn finish(mesh: Mesh, warnings: warnings::Warnings) -> Result<Read, ReadProblem> {
    if mesh.triangles().is_empty() {
        return Err(ReadProblem::NoTriangles { vertices: mesh.positions().len() });
    }
    Ok(Read { mesh, warnings: warnings.into_lines() })
}

/// The number as a 32-bit index, if it is one.
fn index_from_f64(value: f64) -> Option<u32> {
    let whole = value >= 0.0 && value <= f64::from(u32::MAX) && value.fract() == 0.0;
    #[expect(
        clippy::cast_possible_truncation,
        clippy::cast_sign_loss,
        reason = "checked to be a whole number in range"
    )]
    whole.then_some(value as u32)
}

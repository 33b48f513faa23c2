//! Reading meshes from OBJ, PLY, STL, glTF and GLB files.
//!
//! [`read_mesh`] takes a path. [`read_obj`], [`read_ply`], [`read_stl`] and [`read_gltf`] take bytes, and a [`Resolver`]
//! where the format names further files.
//!
//! What all readers promise:
//!
//! - Mesh vertex `i` is the file's `i`-th position, also when no face uses it. Copies that differing UVs or normals force
//!   come after all of them.
//! - Polygons are cut into triangles that cover exactly the polygon, concave ones and ones with collinear corners too.
//! - A file that breaks its format gives an error that names the file, the element and the value; never a panic, and no
//!   memory beyond a small multiple of the file's size.
//! - What is left out, such as lines or a missing texture, is named in [`Read::warnings`].

mod corners;
mod error;
mod files;
mod format;
mod gltf;
mod obj;
mod ply;
mod polygon;
mod stl;
mod warnings;

use std::path::Path;

pub use error::{ReadError, ReadProblem};
pub use files::{Resolver, files_beside, no_files};
pub use format::Format;
pub(crate) use gltf::GltfFile;
pub use gltf::{GltfError, read_gltf};
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

/// Reads a mesh file, by its extension: `.obj`, `.ply`, `.stl`, `.gltf` or `.glb`, in any case.
///
/// Files that it names (materials, buffers, textures) are looked up relative to its directory.
///
/// # Errors
///
/// An unknown extension, content of another format than the extension says, a file that cannot be read or breaks its
/// format, or one without triangles.
pub fn read_mesh(path: &Path) -> Result<Read, ReadError> {
    let fail = |problem| ReadError { path: path.to_owned(), problem: Box::new(problem) };
    let format = Format::from_path(path).map_err(fail)?;
    let bytes = files::read_file(path).map_err(|e| fail(ReadProblem::Unreadable(e)))?;
    read_bytes(&bytes, format, &files_beside(path)).map_err(fail)
}

fn read_bytes(bytes: &[u8], format: Format, resolver: &Resolver<'_>) -> Result<Read, ReadProblem> {
    if bytes.is_empty() {
        return Err(ReadProblem::EmptyFile);
    }
    format.check_content(bytes)?;
    match format {
        Format::Obj => read_obj(bytes, resolver),
        Format::Ply => read_ply(bytes),
        Format::Stl => read_stl(bytes),
        Format::Gltf | Format::Glb => read_gltf(bytes, resolver),
    }
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

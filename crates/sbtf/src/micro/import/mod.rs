//! Materials of the user's own: a `.toml` that names a procedural material, maps, or a mesh.
//!
//! Files that a specification names are looked up relative to it. Nothing is repaired silently: what does not fit is an
//! [`ImportError`] that names the file, and what fits badly is a warning in [`Imported`].

mod error;
mod field;
mod mesh;
mod raster;
mod save;
mod spec;

use std::path::Path;

use super::{Builtin, DEFAULT_RESOLUTION, Microstructure, Seam, SeamReport};
pub use error::{ImportError, Problem};
pub use raster::{MAX_SIDE, MAX_TEXELS, Raster, TexelFormat};
pub use save::{save_maps, save_spec};
pub use spec::{Colour, Encoding, MapOrValue, NormalY, Spec, Tiling, Up};

/// The largest seam of a height map that counts as tiling, see [`Seam`]: jumps across the border up to three times as large as
/// those inside. A joint or crease that lies on the border reaches about two.
pub const SEAM_LIMIT: f32 = 3.0;

/// A microstructure from a file, and what is to be said about it.
#[derive(Debug, Clone)]
pub struct Imported {
    /// The material.
    pub micro: Microstructure,
    /// One line each, naming the file.
    pub warnings: Vec<String>,
    /// Seam of the heights as the file has them, before any mirroring; `None` for meshes.
    pub seam: Option<SeamReport>,
}

impl Microstructure {
    /// The procedural material of this name, or what the `.toml` file at this path describes.
    ///
    /// A name that ends in `.toml` or holds a path separator is a path.
    ///
    /// # Errors
    ///
    /// Neither a name nor a file; anything in the file or in those it names that does not fit.
    pub fn load(path_or_name: &str) -> Result<Imported, ImportError> {
        let path = Path::new(path_or_name);
        let is_path = path_or_name.contains(['/', '\\']) || path.extension().is_some_and(|e| e == "toml");
        if !is_path {
            let Some(builtin) = Builtin::find(path_or_name) else {
                let names = Self::builtin_names().collect::<Vec<_>>().join(", ");
                return Err(ImportError::new(path, Problem::UnknownName(names)));
            };
            return Ok(imported(builtin.build(DEFAULT_RESOLUTION)));
        }
        let text =
            std::fs::read_to_string(path).map_err(|e| ImportError::new(path, Problem::Unreadable(e)))?;
        Spec::parse(&text).map_err(|problem| ImportError::new(path, problem))?.build(path)
    }
}

impl Spec {
    /// Makes the material; `path` is where the specification stands, and need not exist.
    ///
    /// # Errors
    ///
    /// Files that cannot be read or do not fit.
    pub fn build(&self, path: &Path) -> Result<Imported, ImportError> {
        let name = self.name.clone().or_else(|| Some(path.file_stem()?.to_string_lossy().into_owned()));
        let mut imported = if let Some(builtin) = &self.builtin {
            self.build_builtin(builtin).map(imported).map_err(|problem| ImportError::new(path, problem))?
        } else if let Some(mesh) = &self.mesh {
            mesh::build(self, mesh, path)?
        } else {
            field::build(self, path)?
        };
        if let Some(name) = name.filter(|_| self.builtin.is_none() || self.name.is_some()) {
            imported.micro.name = name;
        }
        Ok(imported)
    }

    fn build_builtin(&self, name: &str) -> Result<Microstructure, Problem> {
        let Some(builtin) = Builtin::find(name) else {
            let names = Microstructure::builtin_names().collect::<Vec<_>>().join(", ");
            return Err(Problem::UnknownName(names));
        };
        let micro = builtin.build(self.resolution.unwrap_or(DEFAULT_RESOLUTION));
        let Some(depth) = self.depth else { return Ok(micro) };
        let own = || Problem::key("depth", "a procedural mesh has its own; leave it out");
        micro.with_depth(depth).ok_or_else(own)
    }
}

fn imported(micro: Microstructure) -> Imported {
    let seam = match &micro.geometry {
        super::Geometry::HeightField(field) => Some(SeamReport::new(field.heights())),
        super::Geometry::TileMesh(_) => None,
    };
    Imported { micro, warnings: Vec::new(), seam }
}

/// The larger seam.
fn worst(seam: &SeamReport) -> (&'static str, Seam) {
    if seam.u.ratio >= seam.v.ratio { ("u", seam.u) } else { ("v", seam.v) }
}

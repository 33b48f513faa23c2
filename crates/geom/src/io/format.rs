//! [`Format`]: which format a file's extension says, and which its first bytes say.

use std::fmt;
use std::path::Path;

use super::{ReadProblem, stl};

/// A mesh file format.
#[derive(Debug, Clone, Copy, PartialEq, Eq)]
pub enum Format {
    /// Wavefront OBJ.
    Obj,
    /// Stanford polygon file.
    Ply,
    /// Stereolithography, binary or ASCII.
    Stl,
    /// glTF 2.0 as JSON.
    Gltf,
    /// glTF 2.0 in its binary container.
    Glb,
}

impl Format {
    const ALL: [Self; 5] = [Self::Obj, Self::Ply, Self::Stl, Self::Gltf, Self::Glb];

    /// The format that a path's extension says, in any case.
    ///
    /// # Errors
    ///
    /// No extension, or an unknown one.
    pub fn from_path(path: &Path) -> Result<Self, ReadProblem> {
        let Some(extension) = path.extension() else { return Err(ReadProblem::NoExtension) };
        let extension = extension.to_string_lossy();
        Self::ALL
            .into_iter()
            .find(|format| extension.eq_ignore_ascii_case(format.extension()))
            .ok_or_else(|| ReadProblem::UnknownExtension { extension: extension.into_owned() })
    }

    /// Lower case, without the dot.
    #[must_use]
    pub fn extension(self) -> &'static str {
        match self {
            Self::Obj => "obj",
            Self::Ply => "ply",
            Self::Stl => "stl",
            Self::Gltf => "gltf",
            Self::Glb => "glb",
        }
    }

    /// An error if the bytes are surely of another format. OBJ has no mark to be known by, so that anything else is left to
    /// the reader to refuse.
    pub(super) fn check_content(self, bytes: &[u8]) -> Result<(), ReadProblem> {
        if self.matches(bytes) {
            return Ok(());
        }
        match Self::ALL.into_iter().find(|format| format.matches(bytes)) {
            Some(found) => Err(ReadProblem::WrongExtension { expected: self, found }),
            None => Ok(()),
        }
    }

    fn matches(self, bytes: &[u8]) -> bool {
        match self {
            Self::Obj => false,
            Self::Ply => bytes.starts_with(b"ply\n") || bytes.starts_with(b"ply\r"),
            Self::Stl => stl::is_binary(bytes) || stl::is_ascii(bytes),
            Self::Gltf => bytes.trim_ascii_start().starts_with(b"{"),
            Self::Glb => bytes.starts_with(b"glTF"),
        }
    }
}

impl fmt::Display for Format {
    fn fmt(&self, f: &mut fmt::Formatter<'_>) -> fmt::Result {
        f.write_str(match self {
            Self::Obj => "OBJ",
            Self::Ply => "PLY",
            Self::Stl => "STL",
            Self::Gltf => "glTF (JSON)",
            Self::Glb => "GLB (binary glTF)",
        })
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn extensions_are_known_in_any_case() {
        assert_eq!(Format::from_path(Path::new("a/b.OBJ")).unwrap(), Format::Obj);
        assert_eq!(Format::from_path(Path::new("b.tar.Glb")).unwrap(), Format::Glb);
        assert!(matches!(Format::from_path(Path::new("obj")), Err(ReadProblem::NoExtension)));
        let unknown = Format::from_path(Path::new("a.fbx")).unwrap_err();
        assert!(unknown.to_string().starts_with("\"fbx\" is no known extension"), "{unknown}");
    }

    #[test]
    fn lying_extensions_are_found_out() {
        let ply = b"ply\nformat ascii 1.0\n";
        let error = Format::Obj.check_content(ply).unwrap_err();
        assert_eq!(error.to_string(), "the extension says OBJ, the content is PLY; rename it to end in .ply");
        assert!(Format::Ply.check_content(ply).is_ok());
        assert!(Format::Gltf.check_content(b"glTF\x02\0\0\0").is_err());
        assert!(Format::Stl.check_content(b" \n{\"asset\":{}}").is_err());
        assert!(Format::Stl.check_content(b"v 0 0 0\n").is_ok());
    }
}

//! The files that a mesh file names: materials, buffers, textures.

use std::fs;
use std::io;
use std::path::Path;

use super::warnings::Warnings;
use crate::mesh::TextureImage;

/// Returns the bytes of a file that a mesh file names, by the name it uses (with `/` between directories).
pub type Resolver<'a> = dyn Fn(&str) -> io::Result<Vec<u8>> + 'a;

/// A [`Resolver`] that looks in the directory of `path`.
pub fn files_beside(path: &Path) -> impl Fn(&str) -> io::Result<Vec<u8>> + use<> {
    let directory = path.parent().map(Path::to_owned).unwrap_or_default();
    move |name| read_file(&directory.join(name))
}

/// A [`Resolver`] that finds nothing.
///
/// # Errors
///
/// Always.
pub fn no_files(_name: &str) -> io::Result<Vec<u8>> {
    Err(io::Error::new(io::ErrorKind::NotFound, "no other files at hand"))
}

/// Reads a regular file. Devices and pipes may have no end, and a file may name any path.
pub(super) fn read_file(path: &Path) -> io::Result<Vec<u8>> {
    if !fs::metadata(path)?.is_file() {
        return Err(io::Error::new(io::ErrorKind::InvalidInput, "not a regular file"));
    }
    fs::read(path)
}

/// Textures of one mesh, with a bound on their sum: many materials may name one large image.
#[derive(Debug, Default)]
pub(super) struct Textures {
    bytes: usize,
}

impl Textures {
    /// More than any asset holds, less than a machine.
    const MOST_BYTES: usize = 1 << 30;

    /// The image if it is PNG or JPEG, else a warning and `None`.
    pub fn accept(&mut self, name: &str, bytes: Vec<u8>, warnings: &mut Warnings) -> Option<TextureImage> {
        let Some(mime_type) = mime_type(&bytes) else {
            warnings.add("texture format", || {
                format!("texture {name:?} is left out: it is neither PNG nor JPEG")
            });
            return None;
        };
        self.bytes = self.bytes.saturating_add(bytes.len());
        if self.bytes > Self::MOST_BYTES {
            warnings
                .add("texture size", || format!("texture {name:?} is left out: the textures exceed 1 GiB"));
            return None;
        }
        Some(TextureImage { mime_type: mime_type.to_owned(), bytes })
    }
}

fn mime_type(bytes: &[u8]) -> Option<&'static str> {
    if bytes.starts_with(b"\x89PNG\r\n\x1a\n") {
        Some("image/png")
    } else if bytes.starts_with(&[0xff, 0xd8, 0xff]) {
        Some("image/jpeg")
    } else {
        None
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn only_regular_files_are_read() {
        let directory = tempfile::tempdir().unwrap();
        fs::write(directory.path().join("a.mtl"), "x").unwrap();
        let mesh = directory.path().join("mesh.obj");
        let resolve = files_beside(&mesh);
        assert_eq!(resolve("a.mtl").unwrap(), b"x");
        assert!(resolve("missing.mtl").is_err());
        assert!(resolve(".").is_err());
    }

    #[test]
    fn images_are_told_by_content() {
        let mut warnings = Warnings::default();
        let mut textures = Textures::default();
        let jpeg = textures.accept("a.png", vec![0xff, 0xd8, 0xff, 0xe0], &mut warnings).unwrap();
        assert_eq!(jpeg.mime_type, "image/jpeg");
        assert!(textures.accept("b.tga", vec![0, 0, 2], &mut warnings).is_none());
        assert_eq!(warnings.into_lines(), ["texture \"b.tga\" is left out: it is neither PNG nor JPEG"]);
    }
}

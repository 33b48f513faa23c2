//! STL, binary and ASCII.

use thiserror::Error;

use super::warnings::Warnings;
use super::{Read, ReadProblem, finish};
use crate::{Mesh, Part, Vec3};

const HEADER_BYTES: usize = 84;
const FACET_BYTES: usize = 50;

/// What is wrong with an STL file. Facets and lines are counted from 1.
#[derive(Debug, Clone, PartialEq, Error)]
pub enum StlError {
    /// Neither kind of STL.
    #[error(
        "is neither binary STL (84 bytes of header at least, there are {bytes}) nor ASCII STL (\"solid\", \"facet\")"
    )]
    NotStl {
        /// The file's size.
        bytes: usize,
    },
    /// The header's count does not fit the file.
    #[error(
        "the header claims {facets} facets, {needed} bytes in all, but the file has {bytes}; it may be cut off"
    )]
    Truncated {
        /// As the header says.
        facets: u32,
        /// For that many.
        needed: u64,
        /// The file's size.
        bytes: usize,
    },
    /// A coordinate is NaN or infinite.
    #[error("vertex {corner} of facet {facet} is not finite: {value:?}")]
    NotFinite {
        /// Number of the facet.
        facet: usize,
        /// 1 to 3.
        corner: usize,
        /// Its coordinates.
        value: [f64; 3],
    },
    /// A word of an ASCII file is not the one that the grammar asks for.
    #[error("line {line}: facet {facet}: expected {expected}, found {found:?}")]
    Unexpected {
        /// Number of the line.
        line: usize,
        /// Number of the facet.
        facet: usize,
        /// A word, or "a number".
        expected: &'static str,
        /// What is there.
        found: String,
    },
    /// An ASCII file ends inside a facet.
    #[error("line {line}: the file ends in facet {facet}, where {expected} is expected; it may be cut off")]
    Unfinished {
        /// Number of the last line.
        line: usize,
        /// Number of the facet.
        facet: usize,
        /// A word, or "a number".
        expected: &'static str,
    },
}

/// Reads STL. Triangles have three vertices of their own each; [`Surface`](crate::mesh::Surface) welds them. Facet
/// normals are left out (the corners say the same, and many writers leave them zero); the solids of an ASCII file become
/// parts.
///
/// Binary files are told by their size, 84 + 50 n bytes, since their header often says "solid" too.
///
/// # Errors
///
/// See [`StlError`]; and a file without facets.
pub fn read_stl(bytes: &[u8]) -> Result<Read, ReadProblem> {
    if !is_binary(bytes) && is_ascii(bytes) { read_ascii(bytes) } else { read_binary(bytes) }
}

/// Whether the size is what the header's facet count says.
pub(super) fn is_binary(bytes: &[u8]) -> bool {
    claimed_facets(bytes).is_some_and(|n| needed_bytes(n) == bytes.len() as u64)
}

/// Whether it starts with `solid` and has a facet, or its end, before anything that is not text.
pub(super) fn is_ascii(bytes: &[u8]) -> bool {
    let text = bytes.strip_prefix(b"\xef\xbb\xbf").unwrap_or(bytes).trim_ascii_start();
    let Some((start, rest)) = text.split_at_checked(5) else { return false };
    if !start.eq_ignore_ascii_case(b"solid") {
        return false;
    }
    // The name of the solid may be long and in any encoding; a zero byte is in no text.
    let head = &rest[..rest.len().min(4096)];
    let head = &head[..head.iter().position(|&b| b == 0).unwrap_or(head.len())];
    let has = |word: &[u8]| head.windows(word.len()).any(|w| w.eq_ignore_ascii_case(word));
    has(b"facet") || has(b"endsolid")
}

fn claimed_facets(bytes: &[u8]) -> Option<u32> {
    bytes.get(80..HEADER_BYTES)?.try_into().ok().map(u32::from_le_bytes)
}

fn needed_bytes(facets: u32) -> u64 {
    HEADER_BYTES as u64 + FACET_BYTES as u64 * u64::from(facets)
}

fn read_binary(bytes: &[u8]) -> Result<Read, ReadProblem> {
    let facets = claimed_facets(bytes).ok_or(StlError::NotStl { bytes: bytes.len() })?;
    let needed = needed_bytes(facets);
    let Some(extra) = (bytes.len() as u64).checked_sub(needed) else {
        return Err(StlError::Truncated { facets, needed, bytes: bytes.len() }.into());
    };
    let mut warnings = Warnings::default();
    if extra > 0 {
        warnings.add("extra", || format!("{extra} bytes after the last of {facets} facets are left out"));
    }
    let mut soup = Soup::default();
    soup.positions.reserve_exact(3 * facets as usize);
    for facet in bytes[HEADER_BYTES..].chunks_exact(FACET_BYTES).take(facets as usize) {
        // 12 bytes of normal, three vertices of three f32, 2 bytes of attributes.
        for vertex in facet[12..48].chunks_exact(12) {
            let coordinate = |i: usize| {
                f64::from(f32::from_le_bytes([vertex[i], vertex[i + 1], vertex[i + 2], vertex[i + 3]]))
            };
            soup.push([coordinate(0), coordinate(4), coordinate(8)])?;
        }
    }
    finish(soup.into_mesh(Vec::new())?, warnings)
}

#[derive(Default)]
struct Soup {
    positions: Vec<Vec3>,
}

impl Soup {
    fn push(&mut self, value: [f64; 3]) -> Result<(), StlError> {
        if !value.iter().all(|x| x.is_finite()) {
            let vertex = self.positions.len();
            return Err(StlError::NotFinite { facet: vertex / 3 + 1, corner: vertex % 3 + 1, value });
        }
        self.positions.push(Vec3::from(value));
        Ok(())
    }

    fn facets(&self) -> usize {
        self.positions.len() / 3
    }

    fn into_mesh(self, parts: Vec<Part>) -> Result<Mesh, ReadProblem> {
        let count = self.positions.len();
        let vertices =
            u32::try_from(count).map_err(|_| crate::MeshError::TooMany { what: "vertices", count })?;
        let triangles = (0..vertices / 3).map(|t| [3 * t, 3 * t + 1, 3 * t + 2]).collect();
        let mesh = Mesh::new(self.positions, triangles)?;
        Ok(if parts.is_empty() { mesh } else { mesh.with_parts(parts, Vec::new())? })
    }
}

fn read_ascii(bytes: &[u8]) -> Result<Read, ReadProblem> {
    let bytes = bytes.strip_prefix(b"\xef\xbb\xbf").unwrap_or(bytes);
    let mut words = Words { bytes, at: 0, line: 1, facet: 1 };
    let mut soup = Soup::default();
    let mut parts = Vec::new();
    while let Some(word) = words.next() {
        if !word.eq_ignore_ascii_case(b"solid") {
            return Err(words.unexpected("\"solid\"", word).into());
        }
        let name = words.rest_of_line();
        let start = soup.facets();
        read_solid(&mut words, &mut soup)?;
        parts.push(Part { name, triangles: start..soup.facets(), material: None });
    }
    finish(soup.into_mesh(parts)?, Warnings::default())
}

fn read_solid(words: &mut Words<'_>, soup: &mut Soup) -> Result<(), StlError> {
    loop {
        words.facet = soup.facets() + 1;
        let word = words.require("\"facet\" or \"endsolid\"")?;
        if word.eq_ignore_ascii_case(b"endsolid") {
            words.rest_of_line();
            return Ok(());
        }
        if !word.eq_ignore_ascii_case(b"facet") {
            return Err(words.unexpected("\"facet\" or \"endsolid\"", word));
        }
        words.keyword("normal")?;
        for _ in 0..3 {
            // Some writers put "nan" for a facet without area, so whatever is here is passed over.
            words.require("a number")?;
        }
        words.keyword("outer")?;
        words.keyword("loop")?;
        for _ in 0..3 {
            words.keyword("vertex")?;
            let vertex = [words.number()?, words.number()?, words.number()?];
            soup.push(vertex)?;
        }
        words.keyword("endloop")?;
        words.keyword("endfacet")?;
    }
}

/// The words of an ASCII file, with the place for messages.
struct Words<'a> {
    bytes: &'a [u8],
    at: usize,
    line: usize,
    facet: usize,
}

impl<'a> Words<'a> {
    fn next(&mut self) -> Option<&'a [u8]> {
        while let Some(byte) = self.bytes.get(self.at).filter(|b| b.is_ascii_whitespace()) {
            self.line += usize::from(*byte == b'\n');
            self.at += 1;
        }
        let rest = &self.bytes[self.at..];
        let length = rest.iter().position(u8::is_ascii_whitespace).unwrap_or(rest.len());
        self.at += length;
        (length > 0).then(|| &rest[..length])
    }

    fn rest_of_line(&mut self) -> String {
        let rest = &self.bytes[self.at..];
        let length = rest.iter().position(|&b| b == b'\n').unwrap_or(rest.len());
        self.at += length;
        String::from_utf8_lossy(rest[..length].trim_ascii()).into_owned()
    }

    fn require(&mut self, expected: &'static str) -> Result<&'a [u8], StlError> {
        self.next().ok_or(StlError::Unfinished { line: self.line, facet: self.facet, expected })
    }

    fn keyword(&mut self, expected: &'static str) -> Result<(), StlError> {
        let word = self.require(expected)?;
        if word.eq_ignore_ascii_case(expected.as_bytes()) {
            Ok(())
        } else {
            Err(self.unexpected(expected, word))
        }
    }

    fn number(&mut self) -> Result<f64, StlError> {
        let word = self.require("a number")?;
        let number = std::str::from_utf8(word).ok().and_then(|w| w.parse().ok());
        number.ok_or_else(|| self.unexpected("a number", word))
    }

    fn unexpected(&self, expected: &'static str, found: &[u8]) -> StlError {
        let found = String::from_utf8_lossy(&found[..found.len().min(40)]).into_owned();
        StlError::Unexpected { line: self.line, facet: self.facet, expected, found }
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    fn binary(header: &[u8], facets: &[[f32; 9]]) -> Vec<u8> {
        let mut bytes = header.to_vec();
        bytes.resize(80, 0);
        bytes.extend(u32::try_from(facets.len()).unwrap().to_le_bytes());
        for facet in facets {
            bytes.extend([0; 12]);
            bytes.extend(facet.iter().flat_map(|x| x.to_le_bytes()));
            bytes.extend([0; 2]);
        }
        bytes
    }

    const FACET: [f32; 9] = [0.0, 0.0, 0.0, 1.0, 0.0, 0.0, 0.0, 1.0, 0.5];
    const ASCII: &str = "solid a b\r\n FACET NORMAL nan nan nan\n outer loop\n vertex 0 0 0\n vertex 1 0 0\n vertex 0 1e0 .5\n endloop\n endfacet\nendsolid a b\nsolid\nfacet normal 0 0 0 outer loop vertex 0 0 0 vertex 1 0 0 vertex 0 1 0.25 endloop endfacet endsolid";

    #[test]
    fn binary_files_that_say_solid_are_binary() {
        let read = read_stl(&binary(b"solid facet by some CAD", &[FACET, FACET])).unwrap();
        assert_eq!(read.mesh.triangles(), [[0, 1, 2], [3, 4, 5]]);
        assert_eq!(read.mesh.positions()[2], Vec3::new(0.0, 1.0, 0.5));
        assert!(read.warnings.is_empty());
    }

    #[test]
    fn ascii_solids_become_parts() {
        let read = read_stl(ASCII.as_bytes()).unwrap();
        let names: Vec<_> =
            read.mesh.parts().iter().map(|p| (p.name.as_str(), p.triangles.clone())).collect();
        assert_eq!(names, [("a b", 0..1), ("", 1..2)]);
        assert_eq!(read.mesh.positions()[2], Vec3::new(0.0, 1.0, 0.5));
    }

    #[test]
    fn extra_bytes_are_a_warning_and_missing_ones_an_error() {
        let mut bytes = binary(b"", &[FACET]);
        bytes.push(0);
        assert_eq!(read_stl(&bytes).unwrap().warnings, ["1 bytes after the last of 1 facets are left out"]);
        bytes.truncate(100);
        let error = read_stl(&bytes).unwrap_err().to_string();
        assert!(error.contains("claims 1 facets, 134 bytes in all, but the file has 100"), "{error}");
    }

    #[test]
    fn every_cut_of_an_ascii_file_is_an_error_or_a_mesh() {
        for end in 0..ASCII.len() {
            if let Ok(read) = read_stl(&ASCII.as_bytes()[..end]) {
                assert_eq!(read.mesh.triangles().len(), 1, "cut at {end}");
            }
        }
    }

    #[test]
    fn not_finite_is_named() {
        let mut facet = FACET;
        facet[4] = f32::NAN;
        let error = read_stl(&binary(b"", &[FACET, facet])).unwrap_err().to_string();
        assert_eq!(error, "vertex 2 of facet 2 is not finite: [1.0, NaN, 0.0]");
    }
}

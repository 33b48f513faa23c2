//! What `tobj` is given in place of the file.
//!
//! `tobj` numbers vertices anew, drops unused ones, and replaces a missing texture coordinate by its neighbour's. So it is
//! handed the same faces, groups and materials over positions whose first coordinate is their own number: what comes back
//! says which line of the file each corner used. Texture coordinate and normal 1 of the stream stand for "none".
//! Every index is checked here first, which also gives messages their line.

use std::borrow::Cow;
use std::collections::BTreeSet;
use std::io::{self, BufRead, Write};

use super::ObjError;
use super::lines::{logical_lines, number, shown, split_keyword, words};
use super::values::Values;
use crate::io::warnings::Warnings;

/// Coordinate of the entry that stands for a missing texture coordinate or normal.
pub(super) const NONE: f64 = -1.0;
/// Material name that no file can have, for `usemtl` without a name.
const NO_MATERIAL: &str = "\u{1}";

/// What the stream has noticed.
#[derive(Debug, Default)]
pub(super) struct Notes {
    /// What is wrong with the file, once reading has failed.
    pub error: Option<ObjError>,
    pub warnings: Warnings,
    /// Names in `usemtl` lines.
    pub materials: BTreeSet<String>,
}

/// The stream, produced line by line.
pub(super) struct TobjStream<'a, L> {
    notes: Notes,
    values: &'a Values,
    lines: L,
    /// Lines of the header that have been written: the values under their own numbers.
    header: usize,
    /// How many positions, texture coordinates and normals the file has before the current line.
    seen: [usize; 3],
    faces: usize,
    buffer: Vec<u8>,
    at: usize,
}

impl<'a> TobjStream<'a, ()> {
    pub fn new(
        bytes: &'a [u8],
        values: &'a Values,
    ) -> TobjStream<'a, impl Iterator<Item = (usize, Cow<'a, [u8]>)>> {
        TobjStream {
            notes: Notes::default(),
            values,
            lines: logical_lines(bytes),
            header: 0,
            seen: [0; 3],
            faces: 0,
            buffer: Vec::new(),
            at: 0,
        }
    }
}

impl<'a, L: Iterator<Item = (usize, Cow<'a, [u8]>)>> TobjStream<'a, L> {
    pub fn into_notes(self) -> Notes {
        self.notes
    }

    /// Fills the buffer with the next line that `tobj` needs; leaves it empty at the end.
    fn next_line(&mut self) -> Result<(), ObjError> {
        self.buffer.clear();
        self.at = 0;
        if self.write_header() {
            return Ok(());
        }
        while self.buffer.is_empty() {
            let Some((line, text)) = self.lines.next() else { return Ok(()) };
            self.translate(line, &text)?;
        }
        Ok(())
    }

    /// Values come first, so that a face may name a vertex that the file defines after it.
    fn write_header(&mut self) -> bool {
        let (v, vt, vn) = (self.values.positions.len(), self.values.uvs.len(), self.values.normals.len());
        let i = self.header;
        // Without values of a kind there is nothing to mark as missing, and tobj saves its work.
        let (marked_vt, marked_vn) = (if vt > 0 { vt + 1 } else { 0 }, if vn > 0 { vn + 1 } else { 0 });
        let written = if i < v {
            writeln!(self.buffer, "v {i} 0 0")
        } else if i < v + marked_vt {
            write_entry(&mut self.buffer, "vt", i - v, "0")
        } else if i < v + marked_vt + marked_vn {
            write_entry(&mut self.buffer, "vn", i - v - marked_vt, "0 0")
        } else {
            return false;
        };
        written.expect("a Vec takes all that is written");
        self.header += 1;
        true
    }

    fn translate(&mut self, line: usize, text: &[u8]) -> Result<(), ObjError> {
        let (keyword, rest) = split_keyword(text);
        match keyword {
            b"v" => self.seen[0] += 1,
            b"vt" => self.seen[1] += 1,
            b"vn" => self.seen[2] += 1,
            b"f" => self.translate_face(line, rest)?,
            b"g" | b"o" => self.write_named(keyword, rest),
            b"usemtl" if rest.is_empty() => self.write_named(keyword, NO_MATERIAL.as_bytes()),
            b"usemtl" => {
                self.notes.materials.insert(String::from_utf8_lossy(rest).into_owned());
                self.write_named(keyword, rest);
            }
            b"mtllib" => self.write_named(keyword, rest),
            b"l" | b"p" => {
                self.notes.warnings.add("lines", || format!("lines and points are left out (line {line})"));
            }
            b"curv" | b"curv2" | b"surf" => {
                self.notes
                    .warnings
                    .add("free-form", || format!("free-form curves and surfaces are left out (line {line})"));
            }
            _ if keyword.starts_with(b"#") => {}
            _ if keyword.iter().any(|b| !b.is_ascii_graphic()) => {
                return Err(ObjError::NotText { line, found: shown(keyword) });
            }
            _ => {}
        }
        Ok(())
    }

    /// tobj takes names as UTF-8, up to the end of the line.
    fn write_named(&mut self, keyword: &[u8], name: &[u8]) {
        self.buffer.extend_from_slice(keyword);
        self.buffer.push(b' ');
        self.buffer.extend_from_slice(String::from_utf8_lossy(name).replace(['\r', '\n'], " ").as_bytes());
        self.buffer.push(b'\n');
    }

    fn translate_face(&mut self, line: usize, rest: &[u8]) -> Result<(), ObjError> {
        self.faces += 1;
        let face = self.faces;
        self.buffer.push(b'f');
        for word in words(rest) {
            let [v, vt, vn] = self.corner(word, face, line)?;
            write!(self.buffer, " {v}").expect("a Vec takes all that is written");
            if !self.values.uvs.is_empty() || !self.values.normals.is_empty() {
                write!(self.buffer, "/{}/{}", vt + 1, vn + 1).expect("a Vec takes all that is written");
            }
        }
        self.buffer.push(b'\n');
        Ok(())
    }

    /// Position, texture coordinate and normal of a corner, from 1; 0 for none.
    fn corner(&self, word: &[u8], face: usize, line: usize) -> Result<[usize; 3], ObjError> {
        let bad_corner = || ObjError::BadCorner { face, found: shown(word), line };
        let counts = [self.values.positions.len(), self.values.uvs.len(), self.values.normals.len()];
        let mut indices = [0; 3];
        if word.starts_with(b"/") || word.iter().filter(|&&b| b == b'/').count() > 2 {
            return Err(bad_corner());
        }
        for (kind, field) in word.split(|&b| b == b'/').enumerate() {
            if field.is_empty() {
                continue;
            }
            let index: i64 = number(field).ok_or_else(bad_corner)?;
            let what = ["vertex", "texture coordinate", "normal"][kind];
            let bad_index = |count, hint| ObjError::BadIndex { face, what, index, count, hint, line };
            let magnitude = usize::try_from(index.unsigned_abs()).unwrap_or(usize::MAX);
            indices[kind] = match index {
                0 => return Err(bad_index(counts[kind], "; OBJ counts from 1")),
                1.. if magnitude <= counts[kind] => magnitude,
                1.. => return Err(bad_index(counts[kind], "")),
                // -1 is the last one before this face.
                _ if magnitude <= self.seen[kind] => self.seen[kind] + 1 - magnitude,
                _ => return Err(bad_index(self.seen[kind], " before it")),
            };
        }
        Ok(indices)
    }
}

/// Entry 0 is the mark for "none", entry `i` the file's `i`-th, from 1.
fn write_entry(buffer: &mut Vec<u8>, keyword: &str, entry: usize, rest: &str) -> io::Result<()> {
    match entry {
        0 => writeln!(buffer, "{keyword} {NONE} {rest}"),
        _ => writeln!(buffer, "{keyword} {} {rest}", entry - 1),
    }
}

impl<'a, L: Iterator<Item = (usize, Cow<'a, [u8]>)>> io::Read for TobjStream<'a, L> {
    fn read(&mut self, out: &mut [u8]) -> io::Result<usize> {
        let mut available = self.fill_buf()?;
        let count = available.read(out)?;
        self.consume(count);
        Ok(count)
    }
}

impl<'a, L: Iterator<Item = (usize, Cow<'a, [u8]>)>> BufRead for TobjStream<'a, L> {
    fn fill_buf(&mut self) -> io::Result<&[u8]> {
        if self.at >= self.buffer.len()
            && let Err(error) = self.next_line()
        {
            self.notes.error = Some(error);
            return Err(io::Error::other("the OBJ file is not valid"));
        }
        Ok(&self.buffer[self.at..])
    }

    fn consume(&mut self, count: usize) {
        self.at += count;
    }
}

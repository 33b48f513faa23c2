//! Writing PLY.

use std::fmt::Write as _;
use std::io::Write;
use std::path::Path;

use super::super::error::WriteError;
use super::super::float::FileFloat;
use super::super::rows::{Rows, narrow_rows};
use super::super::{BakedMesh, Provenance};
use super::{COMMENT, CURVATURE, FILTER_BOUND, STATUS, filter_name, uv_names};
use crate::write_atomically;

/// Width of the floats in a `.ply`.
#[derive(Debug, Clone, Copy, PartialEq, Eq, Default)]
pub enum Precision {
    /// 32 bits, what every reader expects.
    #[default]
    F32,
    /// 64 bits: every curvature as it was computed. Twice the size.
    F64,
}

/// Longest piece of provenance on one comment line. `RPly` stops at lines of 1024 bytes and words of 256.
const COMMENT_PIECE: usize = 200;

/// Writes a bake as binary little-endian PLY: positions, normals, UV sets, then the curvature.
///
/// Parts, materials and images are left out: PLY has no common form for them.
///
/// # Errors
///
/// A value that overflows the float type (named), or what the file system says. The file is not touched then.
pub fn write_ply(path: &Path, baked: &BakedMesh, precision: Precision) -> Result<(), WriteError> {
    match precision {
        Precision::F32 => write_as::<f32>(path, baked, "float"),
        Precision::F64 => write_as::<f64>(path, baked, "double"),
    }
}

fn write_as<F: FileFloat>(path: &Path, baked: &BakedMesh, type_name: &str) -> Result<(), WriteError> {
    let mesh = baked.mesh();
    let rows = Rows::<F>::new(baked)?;
    let uvs = mesh
        .uv_sets()
        .iter()
        .map(|set| narrow_rows::<F, 2>("UV", set.iter().copied()))
        .collect::<Result<Vec<_>, _>>()?;
    let header = header(baked, type_name)?;
    write_atomically(path, |w| {
        w.write_all(header.as_bytes())?;
        let mut row = Vec::new();
        for vertex in 0..rows.positions.len() {
            row.clear();
            let c = &rows.curvature[vertex];
            let mut put = |values: &[F]| values.iter().for_each(|x| x.put(&mut row));
            put(&rows.positions[vertex]);
            put(&rows.normals[vertex]);
            uvs.iter().for_each(|set| put(&set[vertex]));
            put(&c.kappa);
            put(&c.d1);
            put(&c.d2);
            put(&[c.error]);
            if let Some(filter) = baked.filter() {
                let n = filter.azimuths();
                let values = filter.lowering()[vertex * n..][..n].iter().chain([&filter.bound()[vertex]]);
                values.for_each(|&x| put(&[F::narrow(x.into()).expect("f32 fits into both floats")]));
            }
            row.push(c.status);
            w.write_all(&row)?;
        }
        for triangle in mesh.triangles() {
            w.write_all(&[3])?;
            triangle.iter().try_for_each(|i| w.write_all(&i.to_le_bytes()))?;
        }
        Ok(())
    })?;
    Ok(())
}

fn header(baked: &BakedMesh, type_name: &str) -> Result<String, WriteError> {
    let mesh = baked.mesh();
    let uvs: Vec<_> = (0..mesh.uv_sets().len()).flat_map(uv_names).collect();
    let names = ["x", "y", "z", "nx", "ny", "nz"].into_iter().chain(uvs.iter().map(String::as_str));
    let mut text = "ply\nformat binary_little_endian 1.0\n".to_owned();
    for piece in comment_pieces(&baked.provenance)? {
        let _ = writeln!(text, "comment {COMMENT} {piece}");
    }
    let _ = writeln!(text, "element vertex {}", mesh.positions().len());
    let mut filter: Vec<String> =
        baked.filter().map_or_else(Vec::new, |filter| (0..filter.azimuths()).map(filter_name).collect());
    filter.extend(baked.filter().map(|_| FILTER_BOUND.to_owned()));
    for name in names.chain(CURVATURE).chain(filter.iter().map(String::as_str)) {
        let _ = writeln!(text, "property {type_name} {name}");
    }
    let _ = writeln!(text, "property uchar {STATUS}");
    let _ = writeln!(text, "element face {}", mesh.triangles().len());
    // `int` and not `uint`, because that is what other programs look for; the bytes are the same below 2^31 vertices.
    let _ = write!(text, "property list uchar int vertex_indices\nend_header\n");
    Ok(text)
}

/// The provenance as JSON in ASCII without blanks, cut into lines.
fn comment_pieces(provenance: &Provenance) -> Result<Vec<String>, WriteError> {
    let json = serde_json::to_string(provenance).map_err(std::io::Error::from)?;
    let mut ascii = String::with_capacity(json.len());
    // Compact JSON has blanks and non-ASCII characters only within strings, where an escape means the same.
    for unit in json.encode_utf16() {
        match u8::try_from(unit) {
            Ok(byte) if byte.is_ascii_graphic() => ascii.push(char::from(byte)),
            _ => {
                let _ = write!(ascii, "\\u{unit:04x}");
            }
        }
    }
    let pieces = ascii.as_bytes().chunks(COMMENT_PIECE);
    Ok(pieces.map(|piece| piece.iter().map(|&b| char::from(b)).collect()).collect())
}

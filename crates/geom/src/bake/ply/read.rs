//! Reading PLY that [`write_ply`](super::write_ply) wrote.

use super::super::error::ReadError;
use super::super::filter_rows::FilterRows;
use super::super::float::{FileFloat, nearest_f32};
use super::super::glb_read::{azimuths, check_filter, provenance_from_json};
use super::super::rows::{BadRow, CurvatureRow, SecondDirection, curvature_from_row, widen};
use super::super::{BakedMesh, Provenance};
use super::{COMMENT, CURVATURE, FILTER_BOUND, STATUS, filter_name, uv_names};
use crate::Mesh;
use crate::curvature::VertexCurvature;

/// Reads the bytes of a baked `.ply`: the layout that `write_ply` writes, in binary, with the vertex properties in any
/// order and further scalar ones ignored.
///
/// # Errors
///
/// [`ReadError::NotBaked`] for PLY without a provenance record, and otherwise what is wrong.
pub fn read_baked_ply(bytes: &[u8]) -> Result<BakedMesh, ReadError> {
    let (header, body) = Header::parse(bytes)?;
    let stride: usize = header.properties.iter().map(|p| p.width.bytes()).sum();
    let vertex_bytes = header.vertices.checked_mul(stride).filter(|&n| n <= body.len());
    let Some(vertex_bytes) = vertex_bytes else {
        let what = format!("{} vertices of {stride} bytes do not fit into the file", header.vertices);
        return Err(ReadError::invalid(what));
    };
    let (vertex_bytes, face_bytes) = body.split_at(vertex_bytes);
    let triangles = triangles(face_bytes, header.faces)?;
    match header.property("k1")?.width {
        Width::F32 => read_as::<f32>(&header, vertex_bytes, stride, triangles),
        Width::F64 => read_as::<f64>(&header, vertex_bytes, stride, triangles),
        Width::U8 => Err(ReadError::invalid("k1 is no float property")),
    }
}

/// A float that PLY rows hold.
trait PlyFloat: FileFloat {
    const WIDTH: Width;
    fn get(bytes: &[u8], at: usize) -> Self;
}

impl PlyFloat for f32 {
    const WIDTH: Width = Width::F32;
    fn get(bytes: &[u8], at: usize) -> Self {
        Self::from_le_bytes(std::array::from_fn(|b| bytes[at + b]))
    }
}

impl PlyFloat for f64 {
    const WIDTH: Width = Width::F64;
    fn get(bytes: &[u8], at: usize) -> Self {
        Self::from_le_bytes(std::array::from_fn(|b| bytes[at + b]))
    }
}

fn read_as<F: PlyFloat>(
    header: &Header,
    bytes: &[u8],
    stride: usize,
    triangles: Vec<[u32; 3]>,
) -> Result<BakedMesh, ReadError> {
    let offset = |name: &str, width: Width| -> Result<usize, ReadError> {
        let property = header.property(name)?;
        if property.width == width {
            Ok(property.offset)
        } else {
            Err(ReadError::invalid(format!("property {name} is {:?}, expected {width:?}", property.width)))
        }
    };
    let columns = |names: &[&str]| -> Result<Vec<usize>, ReadError> {
        names.iter().map(|name| offset(name, F::WIDTH)).collect()
    };
    let geometry = columns(&["x", "y", "z", "nx", "ny", "nz"])?;
    let curvature_columns = columns(&CURVATURE)?;
    let status = offset(STATUS, Width::U8)?;
    let uv_columns = (0..)
        .map(uv_names)
        .take_while(|names| header.property(&names[0]).is_ok())
        .map(|[s, t]| Ok([offset(&s, F::WIDTH)?, offset(&t, F::WIDTH)?]))
        .collect::<Result<Vec<_>, ReadError>>()?;

    let azimuths = azimuths(&header.provenance)?;
    let mut filter_columns =
        (0..azimuths).map(|k| offset(&filter_name(k), F::WIDTH)).collect::<Result<Vec<_>, ReadError>>()?;
    if azimuths > 0 {
        filter_columns.push(offset(FILTER_BOUND, F::WIDTH)?);
    }
    let (mut lowering, mut bound) = (Vec::new(), Vec::new());

    let (mut positions, mut normals, mut curvature) = (Vec::new(), Vec::new(), Vec::new());
    let mut uv_sets = vec![Vec::new(); uv_columns.len()];
    for (vertex, row) in bytes.chunks_exact(stride.max(1)).enumerate() {
        let xyz = |columns: &[usize]| std::array::from_fn::<F, 3, _>(|k| F::get(row, columns[k]));
        positions.push(widen(xyz(&geometry)));
        normals.push(widen(xyz(&geometry[3..])));
        curvature.push(
            curvature_at::<F>(row, &curvature_columns, row[status])
                .map_err(|bad| ReadError::invalid(format!("vertex {vertex}: {bad}")))?,
        );
        let values: Vec<f32> =
            filter_columns.iter().map(|&at| narrow_filter(F::get(row, at).widen())).collect();
        check_filter(vertex, values.iter().copied())?;
        if let [values @ .., last] = &values[..] {
            lowering.extend_from_slice(values);
            bound.push(*last);
        }
        for (set, columns) in uv_sets.iter_mut().zip(&uv_columns) {
            set.push(columns.map(|at| F::get(row, at).widen()));
        }
    }
    let mut mesh = Mesh::new(positions, triangles)?.with_normals(normals)?;
    for set in uv_sets {
        mesh = mesh.with_uv_set(set)?;
    }
    let baked = BakedMesh::new(mesh, curvature, header.provenance.clone());
    Ok(match header.provenance.filter.zip(FilterRows::new(azimuths, lowering, bound)) {
        Some((record, rows)) => baked.with_filter(rows, record),
        None => baked,
    })
}

/// The filter's values are 32-bit floats whatever the file's width; what is not finite stays so.
fn narrow_filter(x: f64) -> f32 {
    match (x.is_nan(), x.is_infinite()) {
        (true, _) => f32::NAN,
        (_, true) => f32::INFINITY,
        _ => nearest_f32(x),
    }
}

fn curvature_at<F: PlyFloat>(row: &[u8], at: &[usize], status: u8) -> Result<VertexCurvature, BadRow> {
    let value = |k: usize| F::get(row, at[k]);
    let xyz = |k: usize| std::array::from_fn(|i| value(k + i));
    let row = CurvatureRow { kappa: [value(0), value(1)], d1: xyz(2), d2: xyz(5), error: value(8), status };
    curvature_from_row(&row, SecondDirection::Stored)
}

fn triangles(bytes: &[u8], count: usize) -> Result<Vec<[u32; 3]>, ReadError> {
    if count.checked_mul(13) != Some(bytes.len()) {
        let what =
            format!("{count} triangles take 13 bytes each, but {} bytes follow the vertices", bytes.len());
        return Err(ReadError::invalid(what));
    }
    bytes
        .chunks_exact(13)
        .enumerate()
        .map(|(face, row)| match row[0] {
            3 => Ok(std::array::from_fn(|k| u32::from_le_bytes(std::array::from_fn(|b| row[1 + 4 * k + b])))),
            corners => Err(ReadError::invalid(format!("face {face} has {corners} corners, a bake has 3"))),
        })
        .collect()
}

#[derive(Debug, Clone, Copy, PartialEq, Eq)]
enum Width {
    U8,
    F32,
    F64,
}

impl Width {
    fn bytes(self) -> usize {
        match self {
            Self::U8 => 1,
            Self::F32 => 4,
            Self::F64 => 8,
        }
    }
}

struct Property {
    name: String,
    width: Width,
    offset: usize,
}

struct Header {
    provenance: Provenance,
    vertices: usize,
    faces: usize,
    properties: Vec<Property>,
}

impl Header {
    /// Splits the file after its header. A PLY without our comment is "not baked", whatever else it holds.
    fn parse(bytes: &[u8]) -> Result<(Self, &[u8]), ReadError> {
        const END: &[u8] = b"\nend_header\n";
        if !bytes.starts_with(b"ply\n") && !bytes.starts_with(b"ply\r") {
            return Err(ReadError::invalid("the first line is not `ply`"));
        }
        let end = bytes.windows(END.len()).position(|w| w == END).ok_or(ReadError::NotBaked)?;
        let text = std::str::from_utf8(&bytes[..end]).map_err(|_| ReadError::NotBaked)?;
        let prefix = format!("comment {COMMENT} ");
        let json: String = text.lines().filter_map(|line| line.strip_prefix(&prefix)).collect();
        if json.is_empty() {
            return Err(ReadError::NotBaked);
        }
        let json = serde_json::from_str(&json)
            .map_err(|error| ReadError::invalid(format!("the provenance record: {error}")))?;
        let mut header =
            Self { provenance: provenance_from_json(&json)?, vertices: 0, faces: 0, properties: Vec::new() };
        header.parse_elements(text)?;
        Ok((header, &bytes[end + END.len()..]))
    }

    fn parse_elements(&mut self, text: &str) -> Result<(), ReadError> {
        let unexpected = |line: &str| ReadError::invalid(format!("a bake has no header line {line:?}"));
        let mut element = "";
        for line in text.lines().skip(1).filter(|line| !line.starts_with("comment")) {
            let words: Vec<_> = line.split_ascii_whitespace().collect();
            match (element, words.as_slice()) {
                (_, ["format", "binary_little_endian", "1.0"]) => {}
                ("", ["element", "vertex", count]) => {
                    element = "vertex";
                    self.vertices = count.parse().map_err(|_| unexpected(line))?;
                }
                ("vertex", ["element", "face", count]) => {
                    element = "face";
                    self.faces = count.parse().map_err(|_| unexpected(line))?;
                }
                ("vertex", ["property", kind, name]) => self.push_property(kind, name)?,
                ("face", ["property", "list", "uchar", "int" | "uint", "vertex_indices"]) => {}
                _ => return Err(unexpected(line)),
            }
        }
        if element == "face" { Ok(()) } else { Err(ReadError::invalid("the header names no faces")) }
    }

    fn push_property(&mut self, kind: &str, name: &str) -> Result<(), ReadError> {
        let width = match kind {
            "float" | "float32" => Width::F32,
            "double" | "float64" => Width::F64,
            "uchar" | "uint8" => Width::U8,
            _ => return Err(ReadError::invalid(format!("property {name} has type {kind}"))),
        };
        let offset = self.properties.last().map_or(0, |p| p.offset + p.width.bytes());
        self.properties.push(Property { name: name.to_owned(), width, offset });
        Ok(())
    }

    fn property(&self, name: &str) -> Result<&Property, ReadError> {
        self.properties
            .iter()
            .find(|p| p.name == name)
            .ok_or_else(|| ReadError::invalid(format!("the vertices have no property {name}")))
    }
}

//! PLY, ASCII and binary.

mod body;
mod error;
mod header;
mod source;

pub(crate) use body::{Element, Lists, Ply};
pub use error::PlyError;

use super::corners::{Attributes, CornerVertices};
use super::polygon::{push_polygon, warn_of_few_corners};
use super::warnings::Warnings;
use super::{Read, ReadProblem, finish, index_from_f64};
use crate::{MeshError, Vec3};

/// Names under which writers store vertex texture coordinates.
const UV_NAMES: [[&str; 2]; 4] =
    [["s", "t"], ["u", "v"], ["texture_u", "texture_v"], ["texture_s", "texture_t"]];
const POSITION: [&str; 3] = ["x", "y", "z"];
const NORMAL: [&str; 3] = ["nx", "ny", "nz"];
const CORNER_LISTS: [&str; 2] = ["vertex_indices", "vertex_index"];

/// Reads PLY: vertex `x y z`, with `nx ny nz` and `s t` (or `u v`, `texture_u texture_v`) if there; faces
/// as `vertex_indices` or `vertex_index` lists, with MeshLab's `texcoord` list per face if there; or triangle strips as
/// `tristrips` of `vertex_indices` with -1 between strips. Other elements and properties are passed over.
///
/// # Errors
///
/// See [`PlyError`]; and a file without faces.
pub fn read_ply(bytes: &[u8]) -> Result<Read, ReadProblem> {
    let ply = Ply::parse(bytes, &|element, property| match element {
        "vertex" => {
            POSITION.contains(&property)
                || NORMAL.contains(&property)
                || UV_NAMES.as_flattened().contains(&property)
        }
        "face" => CORNER_LISTS.contains(&property) || property == "texcoord",
        "tristrips" => CORNER_LISTS.contains(&property),
        _ => false,
    })?;
    let vertices = ply.element("vertex").ok_or(PlyError::NoElement { element: "vertex", hint: "" })?;
    let positions = positions(vertices)?;
    let attributes = vertex_attributes(vertices)?;
    let mut warnings = Warnings::default();
    if let Some(name) = ply.comments.iter().find_map(|c| c.strip_prefix("TextureFile ")) {
        warnings.add("texture", || {
            format!("texture {name:?} is left out: textures are read from OBJ and glTF files")
        });
    }
    let mut triangles = Vec::new();
    let mut corners = CornerVertices::new(positions);
    match (ply.element("face"), ply.element("tristrips")) {
        (Some(faces), _) if faces.rows > 0 => {
            read_faces(faces, &attributes, &mut corners, &mut triangles, &mut warnings)?;
        }
        (_, Some(strips)) => read_strips(strips, attributes.len(), &mut triangles)?,
        (Some(_), None) => {}
        (None, None) => {
            return Err(PlyError::NoElement {
                element: "face",
                hint: ": a point cloud; curvature needs a surface",
            }
            .into());
        }
    }
    corners.fill_unused(&attributes);
    finish(corners.into_mesh(triangles)?, warnings)
}

/// The vertex positions.
pub(crate) fn positions(vertices: &Element) -> Result<Vec<Vec3>, PlyError> {
    let column = |property| {
        vertices.scalar(property).ok_or(PlyError::NoProperty { element: "vertex", kind: "scalar", property })
    };
    let columns = [column("x")?, column("y")?, column("z")?];
    check_finite(&POSITION, &columns)?;
    Ok((0..vertices.rows).map(|i| Vec3::new(columns[0][i], columns[1][i], columns[2][i])).collect())
}

fn vertex_attributes(vertices: &Element) -> Result<Vec<Attributes>, PlyError> {
    let mut attributes = vec![Attributes::default(); vertices.rows];
    if let [Some(nx), Some(ny), Some(nz)] = NORMAL.map(|name| vertices.scalar(name)) {
        check_finite(&NORMAL, &[nx, ny, nz])?;
        for (i, a) in attributes.iter_mut().enumerate() {
            a.normal = Some(Vec3::new(nx[i], ny[i], nz[i]));
        }
    }
    for names in UV_NAMES {
        let [Some(u), Some(v)] = names.map(|name| vertices.scalar(name)) else { continue };
        check_finite(&names, &[u, v])?;
        for (i, a) in attributes.iter_mut().enumerate() {
            a.uv = Some([u[i], v[i]]);
        }
        break;
    }
    Ok(attributes)
}

fn check_finite(names: &[&str], columns: &[&[f64]]) -> Result<(), PlyError> {
    for (name, column) in names.iter().zip(columns) {
        if let Some(row) = column.iter().position(|x| !x.is_finite()) {
            let (property, value) = ((*name).to_owned(), column[row]);
            return Err(PlyError::NotFinite { element: "vertex", row, property, value });
        }
    }
    Ok(())
}

fn corner_lists<'a>(element: &'a Element, name: &'static str) -> Result<&'a Lists, PlyError> {
    CORNER_LISTS.iter().find_map(|property| element.lists(property)).ok_or(PlyError::NoProperty {
        element: name,
        kind: "list",
        property: CORNER_LISTS[0],
    })
}

fn read_faces(
    faces: &Element,
    attributes: &[Attributes],
    corners: &mut CornerVertices,
    triangles: &mut Vec<[u32; 3]>,
    warnings: &mut Warnings,
) -> Result<(), ReadProblem> {
    let texcoords = faces.lists("texcoord");
    let mut vertices = Vec::new();
    for (face, list) in corner_lists(faces, "face")?.iter().enumerate() {
        if list.len() < 3 {
            warn_of_few_corners(face, list.len(), warnings);
            continue;
        }
        let uvs = texcoords.map_or(&[][..], |t| t.row(face));
        check_texcoords(face, uvs, list.len())?;
        vertices.clear();
        for (corner, &index) in list.iter().enumerate() {
            let position = vertex_index(face, index, attributes.len())?;
            let vertex = match uvs.get(2 * corner..2 * corner + 2) {
                None => Some(position),
                Some(uv) => {
                    let normal = attributes[position as usize].normal;
                    corners.vertex(position, Attributes { uv: Some([uv[0], uv[1]]), normal })
                }
            };
            vertices
                .push(vertex.ok_or(MeshError::TooMany { what: "vertices", count: u32::MAX as usize + 1 })?);
        }
        push_polygon(&vertices, corners, face, triangles, warnings);
    }
    Ok(())
}

fn check_texcoords(face: usize, uvs: &[f64], corners: usize) -> Result<(), PlyError> {
    if !uvs.is_empty() && uvs.len() != 2 * corners {
        return Err(PlyError::BadTexcoords { face, found: uvs.len(), corners });
    }
    match uvs.iter().find(|x| !x.is_finite()) {
        Some(&value) => {
            Err(PlyError::NotFinite { element: "face", row: face, property: "texcoord".into(), value })
        }
        None => Ok(()),
    }
}

fn vertex_index(face: usize, index: f64, vertices: usize) -> Result<u32, PlyError> {
    index_from_f64(index).filter(|&i| (i as usize) < vertices).ok_or(PlyError::BadIndex {
        face,
        index,
        vertices,
    })
}

/// Triangles of the strips: every second one is stored the other way round, and -1 starts a new strip.
fn read_strips(strips: &Element, vertices: usize, triangles: &mut Vec<[u32; 3]>) -> Result<(), PlyError> {
    for (row, list) in corner_lists(strips, "tristrips")?.iter().enumerate() {
        for strip in list.split(|&index| index == -1.0) {
            let strip = strip
                .iter()
                .map(|&i| vertex_index(row, i, vertices))
                .collect::<Result<Vec<u32>, PlyError>>()?;
            for (i, t) in strip.windows(3).enumerate() {
                let odd = i % 2;
                let triangle = [t[0], t[1 + odd], t[2 - odd]];
                // Writers repeat a vertex to turn the strip around; those triangles are not part of the surface.
                if t[0] != t[1] && t[1] != t[2] && t[2] != t[0] {
                    triangles.push(triangle);
                }
            }
        }
    }
    Ok(())
}

#[cfg(test)]
mod tests {
    use super::*;

    fn read(body: &str) -> Result<Read, ReadProblem> {
        read_ply(format!("ply\nformat ascii 1.0\n{body}").as_bytes())
    }

    #[test]
    fn polygons_normals_and_uvs() {
        let ply = "element vertex 5\nproperty double x\nproperty double y\nproperty double z\nproperty float nx\nproperty float ny\nproperty float nz\nproperty uchar red\nproperty float s\nproperty float t\nelement edge 1\nproperty int a\nelement face 2\nproperty uchar flags\nproperty list uchar int vertex_index\nend_header\n\
            0 0 0 0 0 1 9 0 0\n1 0 0 0 0 1 9 1 0\n1 1 0 0 0 1 9 1 1\n0 1 0 0 0 1 9 0 1\n7 7 7 0 0 2 9 .5 .5\n3\n1 4 0 1 2 3\n1 3 0 1 2\n";
        let mesh = read(ply).unwrap().mesh;
        assert_eq!(mesh.triangles(), [[0, 1, 2], [0, 2, 3], [0, 1, 2]]);
        assert_eq!(mesh.positions()[4], Vec3::repeat(7.0));
        assert_eq!(mesh.normals().unwrap()[4], Vec3::new(0.0, 0.0, 2.0));
        assert_eq!(mesh.uv_sets()[0][4], [0.5, 0.5]);
    }

    #[test]
    fn texture_coordinates_of_faces_split_vertices() {
        let ply = "element vertex 4\nproperty float x\nproperty float y\nproperty float z\nelement face 2\nproperty list uchar int vertex_indices\nproperty list uchar float texcoord\nend_header\n\
            0 0 0\n1 0 0\n0 1 0\n5 5 5\n3 0 1 2 6 0 0 1 0 0 1\n3 2 1 0 6 0 1 1 0 .5 .5\n";
        let mesh = read(ply).unwrap().mesh;
        assert_eq!(mesh.triangles(), [[0, 1, 2], [2, 1, 4]]);
        assert_eq!(mesh.positions()[4], mesh.positions()[0]);
        assert_eq!(mesh.uv_sets()[0], [[0.0, 0.0], [1.0, 0.0], [0.0, 1.0], [0.0, 0.0], [0.5, 0.5]]);
    }

    #[test]
    fn faces_of_two_corners_are_left_out() {
        let ply = "element vertex 3\nproperty float x\nproperty float y\nproperty float z\nelement face 2\nproperty list uchar int vertex_indices\nend_header\n0 0 0\n1 0 0\n0 1 0\n2 0 1\n3 0 1 2\n";
        let read = read(ply).unwrap();
        assert_eq!(read.mesh.triangles(), [[0, 1, 2]]);
        assert_eq!(read.warnings, ["face 0 has 2 corners and is left out"]);
    }

    #[test]
    fn strips_alternate_and_restart() {
        let ply = "element vertex 5\nproperty float x\nproperty float y\nproperty float z\nelement tristrips 1\nproperty list int int vertex_indices\nend_header\n\
            0 0 0\n1 0 0\n0 1 0\n1 1 0\n2 2 2\n8 0 1 2 3 -1 2 1 4\n";
        assert_eq!(read(ply).unwrap().mesh.triangles(), [[0, 1, 2], [1, 3, 2], [2, 1, 4]]);
    }

    #[test]
    fn errors_name_element_and_value() {
        let header = "element vertex 3\nproperty float x\nproperty float y\nproperty float z\nelement face 1\nproperty list uchar int vertex_indices\nend_header\n";
        let message = |body: &str| read(&format!("{header}{body}")).unwrap_err().to_string();
        assert_eq!(message("0 0 0\n1 0 0\n0 1 0\n3 0 1 3\n"), "face 0 uses vertex 3 of 3");
        assert_eq!(message("0 0 0\n1 0 0\n0 1 0\n3 0 -1 2\n"), "face 0 uses vertex -1 of 3");
        assert_eq!(
            message("0 0 0\n1 inf 0\n0 1 0\n3 0 1 2\n"),
            "vertex 1: property \"y\" is not finite: inf"
        );
        assert!(
            read("element vertex 0\nproperty float x\nproperty float y\nproperty float z\nend_header\n")
                .is_err()
        );
        let no_z = read("element vertex 0\nproperty float x\nproperty float y\nend_header\n").unwrap_err();
        assert_eq!(no_z.to_string(), "element \"vertex\" has no scalar property \"z\"");
    }
}

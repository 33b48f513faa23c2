//! Wavefront OBJ, through `tobj`.

mod error;
mod lines;
mod mtl;
mod stream;
mod values;

use std::cell::RefCell;
use std::collections::HashSet;

pub use error::ObjError;

use super::corners::{Attributes, CornerVertices};
use super::files::{Resolver, Textures};
use super::polygon::{push_polygon, warn_of_few_corners};
use super::warnings::Warnings;
use super::{Read, ReadProblem, finish, index_from_f64};
use crate::{MeshError, Part, Vec3};
use mtl::Libraries;
use stream::{Notes, TobjStream};
use values::Values;

/// Reads OBJ. Groups, objects and changes of material start a new part, in file order; `.mtl` files and textures come from
/// `resolver`, and are warnings if they do not.
///
/// # Errors
///
/// See [`ObjError`]; and a file without faces.
pub fn read_obj(bytes: &[u8], resolver: &Resolver<'_>) -> Result<Read, ReadProblem> {
    let values = Values::read(bytes)?;
    let mut stream = TobjStream::new(bytes, &values);
    let libraries = RefCell::new(Libraries { resolver, warnings: Warnings::default(), read: HashSet::new() });
    let loaded = tobj::load_obj_buf(&mut stream, &tobj::LoadOptions::default(), |path| {
        libraries.borrow_mut().load(&path.to_string_lossy())
    });
    let Notes { error, warnings: left_out, materials: used } = stream.into_notes();
    if let Some(error) = error {
        return Err(error.into());
    }
    let (models, materials) = loaded.map_err(ObjError::Tobj)?;
    let mut warnings = libraries.into_inner().warnings;
    warnings.append(left_out);
    let mut builder = Builder::new(values);
    for model in &models {
        builder.add_model(model, &mut warnings)?;
    }
    builder.warn_of_gaps(&mut warnings);
    let mut textures = Textures::default();
    // tobj's error is that of a library, which has been turned into a warning.
    let materials = materials.unwrap_or_default();
    for name in used.iter().filter(|name| !materials.iter().any(|m| m.name == **name)) {
        warnings.add("material", || format!("material {name:?} is in no material library"));
    }
    let materials =
        materials.iter().map(|m| mtl::convert(m, resolver, &mut textures, &mut warnings)).collect();
    let mesh = builder.corners.into_mesh(builder.triangles)?.with_parts(builder.parts, materials)?;
    finish(mesh, warnings)
}

struct Builder {
    corners: CornerVertices,
    uvs: Vec<[f64; 2]>,
    normals: Vec<Vec3>,
    triangles: Vec<[u32; 3]>,
    parts: Vec<Part>,
    faces: usize,
    /// Of those, the ones that are left out.
    faces_left_out: usize,
    faces_without: [usize; 2],
}

impl Builder {
    fn new(values: Values) -> Self {
        Self {
            corners: CornerVertices::new(values.positions),
            uvs: values.uvs,
            normals: values.normals,
            triangles: Vec::new(),
            parts: Vec::new(),
            faces: 0,
            faces_left_out: 0,
            faces_without: [0; 2],
        }
    }

    fn add_model(&mut self, model: &tobj::Model, warnings: &mut Warnings) -> Result<(), MeshError> {
        let mesh = &model.mesh;
        let start = self.triangles.len();
        let mut next_corner = 0;
        let faces =
            if mesh.face_arities.is_empty() { mesh.indices.len() / 3 } else { mesh.face_arities.len() };
        let mut polygon = Vec::new();
        for face in 0..faces {
            let arity = mesh.face_arities.get(face).map_or(3, |&n| n as usize);
            self.faces += 1;
            if arity < 3 {
                warn_of_few_corners(self.faces, arity, warnings);
                self.faces_left_out += 1;
                next_corner += arity;
                continue;
            }
            polygon.clear();
            let mut missing = [false; 2];
            for corner in next_corner..next_corner + arity {
                polygon.push(self.vertex(mesh, corner, &mut missing)?);
            }
            next_corner += arity;
            for (count, missing) in self.faces_without.iter_mut().zip(missing) {
                *count += usize::from(missing);
            }
            push_polygon(&polygon, &self.corners, self.faces, &mut self.triangles, warnings);
        }
        // tobj's name for what comes before the first group.
        let name = if model.name == "unnamed_object" { String::new() } else { model.name.clone() };
        let triangles = start..self.triangles.len();
        if !triangles.is_empty() {
            self.parts.push(Part { name, triangles, material: mesh.material_id });
        }
        Ok(())
    }

    /// The mesh vertex of a corner; the stream has made tobj's coordinates the file's numbers.
    fn vertex(
        &mut self,
        mesh: &tobj::Mesh,
        corner: usize,
        missing: &mut [bool; 2],
    ) -> Result<u32, MeshError> {
        let number = |coordinates: &[f64], width: usize, index: u32| {
            index_from_f64(coordinates[width * index as usize]).map(|i| i as usize)
        };
        let position =
            number(&mesh.positions, 3, mesh.indices[corner]).expect("the stream numbers every position");
        let uv = mesh.texcoord_indices.get(corner).and_then(|&i| number(&mesh.texcoords, 2, i));
        let normal = mesh.normal_indices.get(corner).and_then(|&i| number(&mesh.normals, 3, i));
        missing[0] |= uv.is_none();
        missing[1] |= normal.is_none();
        let attributes = Attributes { uv: uv.map(|i| self.uvs[i]), normal: normal.map(|i| self.normals[i]) };
        let position = u32::try_from(position).expect("the values are bounded by u32::MAX");
        self.corners
            .vertex(position, attributes)
            .ok_or(MeshError::TooMany { what: "vertices", count: u32::MAX as usize + 1 })
    }

    fn warn_of_gaps(&self, warnings: &mut Warnings) {
        let kinds = [("texture coordinates", "(0, 0)"), ("normals", "none")];
        for ((what, instead), without) in kinds.into_iter().zip(self.faces_without) {
            let faces = self.faces - self.faces_left_out;
            if without > 0 && without < faces {
                warnings
                    .add(what, || format!("{without} of {faces} faces have no {what}; they get {instead}"));
            }
        }
    }
}

#[cfg(test)]
mod tests {
    use super::*;
    use crate::Mesh;
    use crate::io::no_files;

    fn read(text: &str) -> Result<Read, ReadProblem> {
        read_obj(text.as_bytes(), &no_files)
    }

    fn mesh(text: &str) -> Mesh {
        read(text).unwrap().mesh
    }

    #[test]
    fn vertices_keep_their_numbers_and_copies_come_last() {
        let text = "v 9 9 9\nv 0 0 0\nv 1 0 0\nv 0 1 0\nv 1 1 0.1\nvt 0 0\nvt 1 0\nvt 0 1\nvt .5 .5\nvt 0 1\n\
            f 3/2 4/3 2/1\nf 3/4 5/4 4/5\n";
        let mesh = mesh(text);
        assert_eq!(mesh.positions().len(), 6);
        assert_eq!(mesh.triangles(), [[2, 3, 1], [5, 4, 3]]);
        assert_eq!(mesh.positions()[5], Vec3::x());
        assert_eq!(mesh.uv_sets()[0][5], [0.5, 0.5]);
        assert_eq!(mesh.uv_sets()[0][0], [0.0, 0.0]);
    }

    #[test]
    fn coordinates_keep_all_their_bits() {
        let mesh = mesh("v 0.1 0.30000000000000004 1e-300\nv 1 0 0\nv 0 1 0\nf 1 2 3");
        assert_eq!(mesh.positions()[0], Vec3::new(0.1, 0.30000000000000004, 1e-300));
    }

    #[test]
    fn relative_indices_and_forward_references() {
        let text = "f 1 2 3\nv 0 0 0\nv 1 0 0\nv 0 1 0\nvn 0 0 1\nf -3//-1 -2//-1 -1//-1\nv 5 5 5\n";
        let read = read(text).unwrap();
        assert_eq!(read.mesh.triangles(), [[0, 1, 2], [4, 5, 6]]);
        assert_eq!(read.mesh.normals().unwrap()[4], Vec3::z());
        assert_eq!(read.mesh.normals().unwrap()[0], Vec3::zeros());
        assert_eq!(read.warnings, ["1 of 2 faces have no normals; they get none"]);
    }

    #[test]
    fn a_missing_texture_coordinate_is_not_its_neighbours() {
        let mesh = mesh("v 0 0 0\nv 1 0 0\nv 0 1 0\nv 1 1 0\nvt .25 .75\nf 1/1 2/1 3/1\nf 2 4 3\n");
        assert_eq!(mesh.triangles(), [[0, 1, 2], [4, 3, 5]]);
        assert_eq!(mesh.uv_sets()[0][3..], [[0.0, 0.0]; 3]);
    }

    #[test]
    fn groups_and_materials_become_parts() {
        let text = "mtllib my lib.mtl\nv 0 0 0\nv 1 0 0\nv 0 1 0\nv 1 1 0\nf 1 2 3\no box 1\nusemtl red\nf 2 4 3\nusemtl missing\nf 1 2 3\nusemtl\ng\nf 1 2 4 3\n";
        let png = b"\x89PNG\r\n\x1a\n";
        let files = |name: &str| match name {
            "my lib.mtl" => Ok(b"newmtl red\r\nKd 1 0 0\r\nmap_Kd t.png\r\nPr 0.3\r\n".to_vec()),
            "t.png" => Ok(png.to_vec()),
            _ => no_files(name),
        };
        let read = read_obj(text.as_bytes(), &files).unwrap();
        let parts: Vec<_> =
            read.mesh.parts().iter().map(|p| (p.name.as_str(), p.triangles.clone(), p.material)).collect();
        assert_eq!(
            parts,
            [("", 0..1, None), ("box 1", 1..2, Some(0)), ("box 1", 2..3, None), ("", 3..5, None)]
        );
        let material = &read.mesh.materials()[0];
        assert_eq!((material.base_color, material.roughness), ([1.0, 0.0, 0.0], 0.3));
        assert_eq!(material.base_color_texture.as_ref().unwrap().bytes, png);
        assert_eq!(read.warnings, ["material \"missing\" is in no material library"]);
    }

    #[test]
    fn odd_but_valid_files() {
        let text = "\u{feff}# caf\u{e9}\r\nv\t0 0 0 1 0 0\r\nv 1 0 0\r\nv 0 1 \\\r\n0\r\nl 1 2\r\ns off\r\nf 1 2 3 # tail\r\n";
        let read = read(text).unwrap();
        assert_eq!(read.mesh.triangles(), [[0, 1, 2]]);
        assert_eq!(read.warnings, ["lines and points are left out (line 6)"]);
        let latin1 = read_obj(b"# \xe9\no \xe9\nv 0 0 0\nv 1 0 0\nv 0 1 0\nf 1 2 3", &no_files).unwrap();
        assert_eq!(latin1.mesh.parts()[0].name, "\u{fffd}");
    }

    #[test]
    fn missing_library_is_a_warning() {
        let read = read("mtllib a.mtl\nv 0 0 0\nv 1 0 0\nv 0 1 0\nusemtl x\nf 1 2 3").unwrap();
        assert!(
            read.warnings[0].starts_with("material library \"a.mtl\" is left out"),
            "{:?}",
            read.warnings
        );
    }

    #[test]
    fn errors_name_face_value_and_line() {
        let message =
            |faces: &str| read(&format!("v 0 0 0\nv 1 0 0\nv 0 1 0\n{faces}")).unwrap_err().to_string();
        assert_eq!(message("f 1 2 3\nf 1 2 4"), "face 2 uses vertex 4 of 3 (line 5)");
        assert_eq!(message("f 1 2 0"), "face 1 uses vertex 0 of 3; OBJ counts from 1 (line 4)");
        assert_eq!(message("f 1 2 -4"), "face 1 uses vertex -4 of 3 before it (line 4)");
        assert_eq!(message("f 1/1 2/1 3/1"), "face 1 uses texture coordinate 1 of 0 (line 4)");
        assert!(message("f 1 2 3/1/1/1").starts_with("face 1 has the corner \"3/1/1/1\""));
        assert!(message("f 1 2 99999999999999999999").starts_with("face 1 has the corner"));
        assert!(message("\u{0}\u{1}").starts_with("line 4: expected a statement"));
        assert_eq!(message(""), "has no triangles (3 vertices); curvature needs a surface");
    }

    #[test]
    fn faces_without_area_do_not_shift_the_numbers_of_others() {
        let read = read("v 0 0 0\nv 1 0 0\nv 0 1 0\nv 0 0 0\nf 1 2\nf\nf 1 2 3\nf 1 1 4 4\n").unwrap();
        assert_eq!(read.mesh.triangles().len(), 3);
        let warnings = [
            "face 1 has 2 corners and is left out (and 1 more like it)",
            "face 4 with 4 corners has no area; it is cut as a fan",
        ];
        assert_eq!(read.warnings, warnings);
    }

    #[test]
    fn crossing_polygon_is_named() {
        let read = read("v 0 0 0\nv 2 2 0\nv 2 0 0\nv 0 1 0\nf 1 2 3\nf 1 2 3 4").unwrap();
        assert_eq!(read.warnings, ["face 2 with 4 corners crosses or touches itself; it is cut as a fan"]);
    }
}

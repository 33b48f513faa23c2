//! [`Mesh`]: triangles over vertices that carry normals and UVs, checked once.

use std::ops::Range;

use thiserror::Error;

use crate::Vec3;

/// A triangle mesh with the attributes that its file gave to each vertex.
///
/// A vertex here is a *split* vertex, as in glTF: two vertices may share a position and differ in UV or normal. What the
/// curvature is estimated on is the surface with those splits removed, see [`Surface`](super::Surface).
///
/// Readers keep the file's own vertex order: vertex `i` is the file's `i`-th position, and copies that a seam forces
/// (OBJ) come after all of them. Vertices that no triangle uses are kept, so that output rows match input rows.
///
/// Invariants, proved by [`Mesh::new`] and the `with_` methods: positions, normals and UVs are finite, every index is in
/// range, there are at most `u32::MAX` vertices and triangles, every attribute has one entry per vertex, and the parts cover the triangles in
/// order without gaps.
#[derive(Debug, Clone, PartialEq)]
pub struct Mesh {
    positions: Vec<Vec3>,
    triangles: Vec<[u32; 3]>,
    normals: Option<Vec<Vec3>>,
    uv_sets: Vec<Vec<[f64; 2]>>,
    parts: Vec<Part>,
    materials: Vec<Material>,
}

/// A named run of triangles with one material: an OBJ group or a glTF primitive.
#[derive(Debug, Clone, PartialEq, Eq)]
pub struct Part {
    /// Name from the file, or empty.
    pub name: String,
    /// The triangles of this part, as a range of triangle indices.
    pub triangles: Range<usize>,
    /// Index into [`Mesh::materials`].
    pub material: Option<usize>,
}

/// The part of a file's material that Osculate carries through a bake and renders with.
#[derive(Debug, Clone, PartialEq)]
pub struct Material {
    /// Name from the file, or empty.
    pub name: String,
    /// Linear RGB base colour, each in `[0, 1]`; multiplies the texture.
    pub base_color: [f32; 3],
    /// Metalness in `[0, 1]`.
    pub metallic: f32,
    /// Perceptual roughness in `[0, 1]`, glTF's `alpha = roughness^2`.
    pub roughness: f32,
    /// sRGB base colour texture, addressed with UV set 0.
    pub base_color_texture: Option<TextureImage>,
}

/// An image as its file holds it, still encoded, so that a bake passes it on without loss.
#[derive(Clone, PartialEq, Eq)]
pub struct TextureImage {
    /// `image/png` or `image/jpeg`.
    pub mime_type: String,
    /// The encoded bytes.
    pub bytes: Vec<u8>,
}

impl std::fmt::Debug for TextureImage {
    fn fmt(&self, f: &mut std::fmt::Formatter<'_>) -> std::fmt::Result {
        write!(f, "TextureImage({}, {} bytes)", self.mime_type, self.bytes.len())
    }
}

impl Default for Material {
    /// A light grey dielectric of roughness 0.6.
    fn default() -> Self {
        Self {
            name: String::new(),
            base_color: [0.8; 3],
            metallic: 0.0,
            roughness: 0.6,
            base_color_texture: None,
        }
    }
}

/// Why data is not a [`Mesh`].
#[derive(Debug, Clone, PartialEq, Error)]
pub enum MeshError {
    /// A coordinate is NaN or infinite.
    #[error("{attribute} of vertex {vertex} is not finite: {value:?}")]
    NotFinite {
        /// `position`, `normal` or `UV`.
        attribute: &'static str,
        /// Index of the vertex.
        vertex: usize,
        /// Its coordinates.
        value: Vec<f64>,
    },
    /// A triangle names a vertex that does not exist.
    #[error("triangle {triangle} uses vertex {index} of {vertices}")]
    IndexOutOfRange {
        /// Index of the triangle.
        triangle: usize,
        /// The vertex it names.
        index: u32,
        /// How many there are.
        vertices: usize,
    },
    /// An attribute has not one entry per vertex.
    #[error("{attribute} has {found} entries for {vertices} vertices")]
    AttributeLength {
        /// `normal` or `UV`.
        attribute: &'static str,
        /// Its length.
        found: usize,
        /// The vertex count.
        vertices: usize,
    },
    /// More vertices or triangles than 32-bit indices can name.
    #[error("{count} {what} are more than the {} that 32-bit indices can name", u32::MAX)]
    TooMany {
        /// `vertices` or `triangles`.
        what: &'static str,
        /// How many.
        count: usize,
    },
    /// The parts do not cover the triangles in order, or name a missing material.
    #[error(
        "part {part} ({name:?}) covers triangles {start}..{end}, which does not continue the part before it or leaves the {triangles} triangles, or its material is not among the {materials}"
    )]
    BadPart {
        /// Index of the part.
        part: usize,
        /// Its name.
        name: String,
        /// First triangle.
        start: usize,
        /// One past the last triangle.
        end: usize,
        /// Triangles in the mesh.
        triangles: usize,
        /// Materials in the mesh.
        materials: usize,
    },
}

impl Mesh {
    /// Builds a mesh without attributes, in one unnamed part.
    ///
    /// Degenerate triangles (repeated or collinear corners) and unused vertices are allowed: estimation flags them.
    ///
    /// # Errors
    ///
    /// A position that is not finite, an index out of range, or more than `u32::MAX` vertices or triangles.
    pub fn new(positions: Vec<Vec3>, triangles: Vec<[u32; 3]>) -> Result<Self, MeshError> {
        for (what, count) in [("vertices", positions.len()), ("triangles", triangles.len())] {
            if u32::try_from(count).is_err() {
                return Err(MeshError::TooMany { what, count });
            }
        }
        check_finite("position", positions.iter().map(Vec3::as_slice))?;
        let vertices = positions.len();
        for (triangle, corners) in triangles.iter().enumerate() {
            if let Some(&index) = corners.iter().find(|&&i| i as usize >= vertices) {
                return Err(MeshError::IndexOutOfRange { triangle, index, vertices });
            }
        }
        let parts = vec![Part { name: String::new(), triangles: 0..triangles.len(), material: None }];
        Ok(Self { positions, triangles, normals: None, uv_sets: Vec::new(), parts, materials: Vec::new() })
    }

    /// Adds vertex normals. They need not be unit: readers pass on what the file says; a zero normal means "unknown".
    ///
    /// # Errors
    ///
    /// A wrong length, or a component that is not finite.
    pub fn with_normals(mut self, normals: Vec<Vec3>) -> Result<Self, MeshError> {
        self.check_length("normal", normals.len())?;
        check_finite("normal", normals.iter().map(Vec3::as_slice))?;
        self.normals = Some(normals);
        Ok(self)
    }

    /// Appends a UV set; the first becomes `TEXCOORD_0`.
    ///
    /// # Errors
    ///
    /// A wrong length, or a component that is not finite.
    pub fn with_uv_set(mut self, uvs: Vec<[f64; 2]>) -> Result<Self, MeshError> {
        self.check_length("UV", uvs.len())?;
        check_finite("UV", uvs.iter().map(|uv| &uv[..]))?;
        self.uv_sets.push(uvs);
        Ok(self)
    }

    /// Replaces the parts and materials.
    ///
    /// # Errors
    ///
    /// Parts that do not cover `0..triangles` in order, or that name a material out of range.
    pub fn with_parts(mut self, parts: Vec<Part>, materials: Vec<Material>) -> Result<Self, MeshError> {
        let mut next = 0;
        for (index, part) in parts.iter().enumerate() {
            let Range { start, end } = part.triangles;
            let last = index + 1 == parts.len();
            let covers = start == next
                && end >= start
                && (if last { end == self.triangles.len() } else { end <= self.triangles.len() });
            if !covers || part.material.is_some_and(|m| m >= materials.len()) {
                return Err(MeshError::BadPart {
                    part: index,
                    name: part.name.clone(),
                    start,
                    end,
                    triangles: self.triangles.len(),
                    materials: materials.len(),
                });
            }
            next = end;
        }
        self.parts = parts;
        self.materials = materials;
        Ok(self)
    }

    /// The same surface turned over: triangles in the opposite order, normals negated. Curvature changes its sign.
    #[must_use]
    pub fn flipped(mut self) -> Self {
        self.triangles.iter_mut().for_each(|t| t.swap(1, 2));
        self.normals.iter_mut().flatten().for_each(|n| *n = -*n);
        self
    }

    /// World-space vertex positions, `[n, 3]`.
    #[must_use]
    pub fn positions(&self) -> &[Vec3] {
        &self.positions
    }

    /// Vertex indices of the triangles, `[m, 3]`, counter-clockwise seen from outside.
    #[must_use]
    pub fn triangles(&self) -> &[[u32; 3]] {
        &self.triangles
    }

    /// Vertex normals from the file, `[n, 3]`, not necessarily unit.
    #[must_use]
    pub fn normals(&self) -> Option<&[Vec3]> {
        self.normals.as_deref()
    }

    /// UV sets from the file, each `[n, 2]`, with v up as in OBJ (glTF's v is flipped on reading and writing).
    #[must_use]
    pub fn uv_sets(&self) -> &[Vec<[f64; 2]>] {
        &self.uv_sets
    }

    /// Named runs of triangles. Covers all triangles in order.
    #[must_use]
    pub fn parts(&self) -> &[Part] {
        &self.parts
    }

    /// Materials that the parts name.
    #[must_use]
    pub fn materials(&self) -> &[Material] {
        &self.materials
    }

    /// Positions of the corners of one triangle.
    ///
    /// # Panics
    ///
    /// If `triangle` is out of range.
    #[must_use]
    pub fn corners(&self, triangle: usize) -> [Vec3; 3] {
        self.triangles[triangle].map(|i| self.positions[i as usize])
    }

    /// Lower and upper corner of the axis-aligned bounding box, or `None` without vertices.
    #[must_use]
    pub fn bounds(&self) -> Option<(Vec3, Vec3)> {
        bounds(&self.positions)
    }

    /// Length of the bounding box's diagonal; 0 without vertices.
    #[must_use]
    pub fn bbox_diagonal(&self) -> f64 {
        bbox_diagonal(&self.positions)
    }

    fn check_length(&self, attribute: &'static str, found: usize) -> Result<(), MeshError> {
        let vertices = self.positions.len();
        if found == vertices {
            Ok(())
        } else {
            Err(MeshError::AttributeLength { attribute, found, vertices })
        }
    }
}

fn bounds(points: &[Vec3]) -> Option<(Vec3, Vec3)> {
    let first = *points.first()?;
    Some(points.iter().fold((first, first), |(lo, hi), p| (lo.inf(p), hi.sup(p))))
}

/// `Vector::norm` squares its components and would overflow at 1e155, so the largest one is taken out first.
pub(super) fn bbox_diagonal(points: &[Vec3]) -> f64 {
    bounds(points).map_or(0.0, |(lo, hi)| {
        let half = 0.5 * hi - 0.5 * lo;
        let largest = half.amax();
        if largest == 0.0 { 0.0 } else { 2.0 * largest * (half / largest).norm() }
    })
}

fn check_finite<'a>(attribute: &'static str, rows: impl Iterator<Item = &'a [f64]>) -> Result<(), MeshError> {
    for (vertex, row) in rows.enumerate() {
        if !row.iter().all(|x| x.is_finite()) {
            return Err(MeshError::NotFinite { attribute, vertex, value: row.to_vec() });
        }
    }
    Ok(())
}

#[cfg(test)]
mod tests {
    use super::*;

    fn triangle() -> Mesh {
        let p = vec![Vec3::zeros(), Vec3::x(), Vec3::y()];
        Mesh::new(p, vec![[0, 1, 2]]).unwrap()
    }

    #[test]
    fn rejects_what_later_code_relies_on() {
        let nan = Mesh::new(vec![Vec3::new(0.0, f64::NAN, 0.0)], vec![]).unwrap_err();
        assert!(nan.to_string().contains("vertex 0"), "{nan}");
        let index = Mesh::new(vec![Vec3::zeros()], vec![[0, 0, 1]]).unwrap_err();
        assert_eq!(index.to_string(), "triangle 0 uses vertex 1 of 1");
        assert!(triangle().with_normals(vec![Vec3::x()]).is_err());
        assert!(triangle().with_uv_set(vec![[0.0, f64::INFINITY]; 3]).is_err());
        let gap = Part { name: "gap".into(), triangles: 0..0, material: None };
        assert!(triangle().with_parts(vec![gap], vec![]).is_err());
        let material = Part { name: "m".into(), triangles: 0..1, material: Some(0) };
        assert!(triangle().with_parts(vec![material], vec![]).is_err());
    }

    #[test]
    fn diagonal_survives_extreme_scales() {
        for scale in [1e-150, 1.0, 1e150, 1e300] {
            let p = vec![Vec3::zeros(), Vec3::new(3.0, 4.0, 0.0) * scale];
            let found = Mesh::new(p, vec![]).unwrap().bbox_diagonal();
            assert!((found / scale - 5.0).abs() < 1e-14, "scale {scale}: {found}");
        }
    }
}

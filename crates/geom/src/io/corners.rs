//! Face corners turned into mesh vertices: one vertex per position, UV and normal that occur together.

use std::collections::HashMap;

use crate::{Mesh, MeshError, Vec3};

/// What a face corner says besides its position.
#[derive(Debug, Clone, Copy, PartialEq, Default)]
pub(crate) struct Attributes {
    /// Absent for a corner without texture coordinate.
    pub uv: Option<[f64; 2]>,
    /// Absent for a corner without normal.
    pub normal: Option<Vec3>,
}

/// Equal exactly when the attributes are (`-0.0` equals `0.0`), so that copies of a value under several numbers do not
/// split a vertex.
#[derive(Clone, Copy, PartialEq, Eq, Hash)]
struct Key {
    uv: Option<[u64; 2]>,
    normal: Option<[u64; 3]>,
}

impl Attributes {
    fn key(&self) -> Key {
        let bits = |x: f64| (x + 0.0).to_bits();
        Key {
            uv: self.uv.map(|uv| uv.map(bits)),
            normal: self.normal.map(|n| [bits(n.x), bits(n.y), bits(n.z)]),
        }
    }
}

/// Numbers the mesh vertices. Vertex `i` is position `i` with the attributes it is first used with; further
/// combinations come after all positions, in the order they occur.
#[derive(Debug)]
pub(crate) struct CornerVertices {
    positions: Vec<Vec3>,
    /// Per vertex; `None` for a position that no corner has used yet.
    attributes: Vec<Option<Attributes>>,
    copies: HashMap<(u32, Key), u32>,
}

impl std::fmt::Debug for Key {
    fn fmt(&self, f: &mut std::fmt::Formatter<'_>) -> std::fmt::Result {
        write!(f, "Key({:?}, {:?})", self.uv, self.normal)
    }
}

impl CornerVertices {
    /// Starts with one vertex per position.
    pub fn new(positions: Vec<Vec3>) -> Self {
        let attributes = vec![None; positions.len()];
        Self { positions, attributes, copies: HashMap::new() }
    }

    /// The vertex for a position (in range) with these attributes, or `None` when 32-bit indices run out.
    pub fn vertex(&mut self, position: u32, wanted: Attributes) -> Option<u32> {
        let first = &mut self.attributes[position as usize];
        let Some(found) = first else {
            *first = Some(wanted);
            return Some(position);
        };
        if *found == wanted {
            return Some(position);
        }
        let next = u32::try_from(self.positions.len()).ok()?;
        let vertex = *self.copies.entry((position, wanted.key())).or_insert(next);
        if vertex == next {
            self.positions.push(self.positions[position as usize]);
            self.attributes.push(Some(wanted));
        }
        Some(vertex)
    }

    /// Gives the vertices that no corner has used the attributes of their position, if the file has some.
    pub fn fill_unused(&mut self, attributes: &[Attributes]) {
        for (slot, &own) in self.attributes.iter_mut().zip(attributes) {
            slot.get_or_insert(own);
        }
    }

    /// Position of a vertex in range.
    pub fn position(&self, vertex: u32) -> Vec3 {
        self.positions[vertex as usize]
    }

    /// The mesh, with UVs and normals if any corner has them. Where one is missing beside others that have it, the UV is
    /// `(0, 0)` and the normal zero, which means "unknown".
    pub fn into_mesh(self, triangles: Vec<[u32; 3]>) -> Result<Mesh, MeshError> {
        let known = || self.attributes.iter().flatten();
        let uvs = known()
            .any(|a| a.uv.is_some())
            .then(|| self.attributes.iter().map(|a| a.and_then(|a| a.uv).unwrap_or_default()).collect());
        let normals = known()
            .any(|a| a.normal.is_some())
            .then(|| self.attributes.iter().map(|a| a.and_then(|a| a.normal).unwrap_or_default()).collect());
        let mut mesh = Mesh::new(self.positions, triangles)?;
        if let Some(uvs) = uvs {
            mesh = mesh.with_uv_set(uvs)?;
        }
        if let Some(normals) = normals {
            mesh = mesh.with_normals(normals)?;
        }
        Ok(mesh)
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn first_use_takes_the_slot_and_copies_come_last() {
        let uv = |u| Attributes { uv: Some([u, 0.0]), normal: None };
        let mut corners = CornerVertices::new(vec![Vec3::zeros(), Vec3::x(), Vec3::y()]);
        assert_eq!(corners.vertex(2, uv(0.5)), Some(2));
        assert_eq!(corners.vertex(2, uv(0.7)), Some(3));
        assert_eq!(corners.vertex(0, uv(0.0)), Some(0));
        assert_eq!(corners.vertex(0, uv(-0.0)), Some(0));
        assert_eq!(corners.vertex(2, uv(0.5)), Some(2));
        assert_eq!(corners.vertex(2, uv(0.7)), Some(3));
        assert_eq!(corners.vertex(2, Attributes::default()), Some(4));
        let mesh = corners.into_mesh(vec![[0, 1, 3]]).unwrap();
        assert_eq!(mesh.positions(), &[Vec3::zeros(), Vec3::x(), Vec3::y(), Vec3::y(), Vec3::y()]);
        assert_eq!(mesh.uv_sets()[0], [[0.0, 0.0], [0.0, 0.0], [0.5, 0.0], [0.7, 0.0], [0.0, 0.0]]);
        assert!(mesh.normals().is_none());
    }
}

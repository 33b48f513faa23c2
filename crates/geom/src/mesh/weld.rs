//! The surface under UV and normal seams: split vertices merged by position, with the way back.

use serde::{Deserialize, Serialize};

use super::Mesh;
use crate::Vec3;

/// Which vertices are merged before curvature is estimated.
#[derive(Debug, Clone, Copy, PartialEq, Eq, Default, Serialize, Deserialize)]
#[serde(rename_all = "snake_case")]
pub enum Weld {
    /// Vertices with bitwise equal positions (`-0.0` equals `0.0`). Undoes the splits that seams force on a file.
    #[default]
    Exact,
    /// None: every vertex stands for itself, as libigl sees a mesh.
    Off,
}

/// The geometry of a mesh with its seams removed.
///
/// Surface vertex numbers follow the first mesh vertex of each position, so a mesh without seams keeps its numbering.
#[derive(Debug, Clone)]
pub struct Surface {
    positions: Vec<Vec3>,
    triangles: Vec<[u32; 3]>,
    surface_from_vertex: Vec<u32>,
}

impl Surface {
    /// Merges the vertices of `mesh` as `weld` says. Unused vertices stay; triangles keep their order and orientation,
    /// also those that merging has made degenerate.
    #[must_use]
    pub fn new(mesh: &Mesh, weld: Weld) -> Self {
        match weld {
            Weld::Off => Self {
                positions: mesh.positions().to_vec(),
                triangles: mesh.triangles().to_vec(),
                surface_from_vertex: (0..index_u32(mesh.positions().len())).collect(),
            },
            Weld::Exact => Self::merge_equal_positions(mesh),
        }
    }

    fn merge_equal_positions(mesh: &Mesh) -> Self {
        let source = mesh.positions();
        // Sorting the indices by position needs 4 bytes a vertex, a hash map several times that. The tie on the index
        // makes the first of each run the lowest vertex.
        let mut order: Vec<u32> = (0..index_u32(source.len())).collect();
        order.sort_unstable_by_key(|&i| (position_key(&source[i as usize]), i));
        let mut first_equal: Vec<u32> = vec![0; source.len()];
        let mut first = 0;
        for (rank, &vertex) in order.iter().enumerate() {
            let same = rank > 0
                && position_key(&source[vertex as usize]) == position_key(&source[order[rank - 1] as usize]);
            if !same {
                first = vertex;
            }
            first_equal[vertex as usize] = first;
        }
        let mut positions = Vec::with_capacity(source.len());
        let mut surface_from_vertex = first_equal;
        for vertex in 0..source.len() {
            let first = surface_from_vertex[vertex] as usize;
            // `first <= vertex`, so a copy finds its original's surface vertex already in place.
            surface_from_vertex[vertex] = if first == vertex {
                positions.push(source[vertex]);
                index_u32(positions.len() - 1)
            } else {
                surface_from_vertex[first]
            };
        }
        let triangles = mesh.triangles().iter().map(|t| t.map(|i| surface_from_vertex[i as usize])).collect();
        Self { positions, triangles, surface_from_vertex }
    }

    /// Positions of the surface vertices.
    #[must_use]
    pub fn positions(&self) -> &[Vec3] {
        &self.positions
    }

    /// Triangles over surface vertices, in the mesh's order.
    #[must_use]
    pub fn triangles(&self) -> &[[u32; 3]] {
        &self.triangles
    }

    /// For every mesh vertex, the surface vertex that it is a copy of.
    #[must_use]
    pub fn surface_from_vertex(&self) -> &[u32] {
        &self.surface_from_vertex
    }

    /// Copies one value per surface vertex to every mesh vertex.
    ///
    /// # Panics
    ///
    /// If `values` has not one entry per surface vertex.
    #[must_use]
    pub fn spread<T: Clone>(&self, values: &[T]) -> Vec<T> {
        assert_eq!(values.len(), self.positions.len(), "one value per surface vertex");
        self.surface_from_vertex.iter().map(|&s| values[s as usize].clone()).collect()
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
}

/// Bit patterns that are equal exactly when the coordinates are; adding zero turns `-0.0` into `0.0`.
fn position_key(p: &Vec3) -> [u64; 3] {
    [p.x, p.y, p.z].map(|x| (x + 0.0).to_bits())
}

/// The count as a 32-bit index. `Mesh::new` has checked that it fits.
pub(crate) fn index_u32(count: usize) -> u32 {
    u32::try_from(count).expect("Mesh::new bounds the counts by u32::MAX")
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn merges_copies_and_keeps_the_numbering_of_originals() {
        let p = |x: f64| Vec3::new(x, 0.0, 0.0);
        let mesh =
            Mesh::new(vec![p(2.0), p(0.0), p(1.0), p(-0.0), p(2.0)], vec![[0, 1, 2], [4, 3, 2]]).unwrap();
        let surface = Surface::new(&mesh, Weld::Exact);
        assert_eq!(surface.positions(), &[p(2.0), p(0.0), p(1.0)]);
        assert_eq!(surface.surface_from_vertex(), &[0, 1, 2, 1, 0]);
        assert_eq!(surface.triangles(), &[[0, 1, 2], [0, 1, 2]]);
        assert_eq!(surface.spread(&['a', 'b', 'c']), ['a', 'b', 'c', 'b', 'a']);
        assert_eq!(Surface::new(&mesh, Weld::Off).positions().len(), 5);
    }
}

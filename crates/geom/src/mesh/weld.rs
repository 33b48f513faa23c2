//! The surface under UV and normal seams: split vertices merged by position, with the way back.

use std::borrow::Cow;

use serde::{Deserialize, Serialize};

use super::Mesh;
use super::triangle_mesh::bbox_diagonal;
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
/// Surface vertex numbers follow the first mesh vertex of each position, so a mesh without seams keeps its numbering;
/// such a mesh is borrowed, not copied.
#[derive(Debug, Clone)]
pub struct Surface<'m> {
    positions: Cow<'m, [Vec3]>,
    triangles: Cow<'m, [[u32; 3]]>,
    /// `None` where the numbering is the mesh's own.
    surface_from_vertex: Option<Vec<u32>>,
}

impl<'m> Surface<'m> {
    /// Merges the vertices of `mesh` as `weld` says. Unused vertices stay; triangles keep their order and orientation,
    /// also those that merging has made degenerate.
    #[must_use]
    pub fn new(mesh: &'m Mesh, weld: Weld) -> Self {
        let merged = match weld {
            Weld::Off => None,
            Weld::Exact => first_equal_vertex(mesh.positions()),
        };
        let Some(first_equal) = merged else {
            return Self {
                positions: Cow::Borrowed(mesh.positions()),
                triangles: Cow::Borrowed(mesh.triangles()),
                surface_from_vertex: None,
            };
        };
        let mut positions = Vec::with_capacity(first_equal.len());
        let mut surface_from_vertex = first_equal;
        for (vertex, position) in mesh.positions().iter().enumerate() {
            let first = surface_from_vertex[vertex] as usize;
            // `first <= vertex`, so a copy finds its original's surface vertex already in place.
            surface_from_vertex[vertex] = if first == vertex {
                positions.push(*position);
                index_u32(positions.len() - 1)
            } else {
                surface_from_vertex[first]
            };
        }
        positions.shrink_to_fit();
        let triangles = mesh.triangles().iter().map(|t| t.map(|i| surface_from_vertex[i as usize])).collect();
        Self {
            positions: Cow::Owned(positions),
            triangles: Cow::Owned(triangles),
            surface_from_vertex: Some(surface_from_vertex),
        }
    }

    /// The same surface with a copy of what it borrowed.
    #[must_use]
    pub fn into_owned(self) -> Surface<'static> {
        Surface {
            positions: Cow::Owned(self.positions.into_owned()),
            triangles: Cow::Owned(self.triangles.into_owned()),
            surface_from_vertex: self.surface_from_vertex,
        }
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

    /// The surface vertex that a mesh vertex is a copy of.
    ///
    /// # Panics
    ///
    /// If there are copies and `vertex` is out of range.
    #[must_use]
    pub fn surface_from_vertex(&self, vertex: usize) -> usize {
        self.surface_from_vertex.as_ref().map_or(vertex, |map| map[vertex] as usize)
    }

    /// How many mesh vertices were merged into others.
    #[must_use]
    pub fn merged_vertices(&self) -> usize {
        self.surface_from_vertex.as_ref().map_or(0, |map| map.len() - self.positions.len())
    }

    /// Copies one value per surface vertex to every mesh vertex. Without seams the values come back as they are.
    ///
    /// # Panics
    ///
    /// If `values` has not one entry per surface vertex.
    #[must_use]
    pub fn spread<T: Clone>(&self, values: Vec<T>) -> Vec<T> {
        assert_eq!(values.len(), self.positions.len(), "one value per surface vertex");
        match &self.surface_from_vertex {
            None => values,
            Some(map) => map.iter().map(|&s| values[s as usize].clone()).collect(),
        }
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

    /// Length of the bounding box's diagonal; 0 without vertices.
    #[must_use]
    pub fn bbox_diagonal(&self) -> f64 {
        bbox_diagonal(&self.positions)
    }
}

/// For every vertex the lowest one at the same position; `None` when no two vertices share one.
///
/// A table of vertex numbers, probed linearly and at most half full: 8 to 16 bytes a vertex while it lives, and one
/// pass where sorting the positions took a quarter of a whole bake.
fn first_equal_vertex(positions: &[Vec3]) -> Option<Vec<u32>> {
    const EMPTY: u32 = u32::MAX;
    let capacity = (2 * positions.len()).next_power_of_two();
    let mut table = vec![EMPTY; capacity];
    let mut first_equal: Option<Vec<u32>> = None;
    for (vertex, position) in positions.iter().enumerate() {
        let key = position_key(position);
        let mut slot = hash(key) & (capacity - 1);
        let found = loop {
            match table[slot] {
                EMPTY => break None,
                other if position_key(&positions[other as usize]) == key => break Some(other),
                _ => slot = (slot + 1) & (capacity - 1),
            }
        };
        match found {
            None => table[slot] = index_u32(vertex),
            Some(first) => {
                let all = first_equal.get_or_insert_with(|| (0..index_u32(positions.len())).collect());
                all[vertex] = first;
            }
        }
    }
    first_equal
}

/// Mixes all bits of a position into the low ones (the finaliser of `SplitMix64`, applied coordinate by coordinate).
#[allow(clippy::cast_possible_truncation, reason = "the low bits are as good as any")]
fn hash(key: [u64; 3]) -> usize {
    let mix = |sum: u64, bits: u64| {
        let mut z = (sum ^ bits).wrapping_add(0x9E37_79B9_7F4A_7C15);
        z = (z ^ (z >> 30)).wrapping_mul(0xBF58_476D_1CE4_E5B9);
        z = (z ^ (z >> 27)).wrapping_mul(0x94D0_49BB_1331_11EB);
        z ^ (z >> 31)
    };
    key.into_iter().fold(0, mix) as usize
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
        let map: Vec<usize> = (0..5).map(|v| surface.surface_from_vertex(v)).collect();
        assert_eq!(map, [0, 1, 2, 1, 0]);
        assert_eq!(surface.merged_vertices(), 2);
        assert_eq!(surface.triangles(), &[[0, 1, 2], [0, 1, 2]]);
        assert_eq!(surface.spread(vec!['a', 'b', 'c']), ['a', 'b', 'c', 'b', 'a']);
        assert_eq!(Surface::new(&mesh, Weld::Off).positions().len(), 5);
    }
}

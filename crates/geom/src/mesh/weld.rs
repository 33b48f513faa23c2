//! The surface under UV and normal seams: split vertices merged by position, with the way back.

use std::borrow::Cow;

use rayon::prelude::*;
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
        let triangles = mesh
            .triangles()
            .par_iter()
            .with_min_len(BLOCK)
            .map(|t| t.map(|i| surface_from_vertex[i as usize]))
            .collect();
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
/// The vertices are dealt out by a hash of their position, block by block, and then every hand is searched with a table of its
/// own, probed linearly and at most half full. Hands hold vertices in ascending order, however many threads deal, and their
/// tables are small enough to stay near the processor.
fn first_equal_vertex(positions: &[Vec3]) -> Option<Vec<u32>> {
    let deal = |(block, positions): (usize, &[Vec3])| {
        let mut hands: [Vec<Card>; HANDS] =
            std::array::from_fn(|_| Vec::with_capacity(BLOCK / HANDS * 5 / 4));
        for (index, position) in positions.iter().enumerate() {
            let hash = hash(position_key(position));
            let card = Card { hash, vertex: index_u32(block * BLOCK + index) };
            hands[hash as usize % HANDS].push(card);
        }
        hands
    };
    let blocks: Vec<[Vec<Card>; HANDS]> = positions.par_chunks(BLOCK).enumerate().map(deal).collect();
    let search = |hand: usize| equal_vertices(positions, blocks.iter().map(|hands| &hands[hand][..]));
    let copies: Vec<Vec<[u32; 2]>> = (0..HANDS).into_par_iter().map(search).collect();
    if copies.iter().all(Vec::is_empty) {
        return None;
    }
    let mut first_equal: Vec<u32> = (0..index_u32(positions.len())).collect();
    for [vertex, first] in copies.into_iter().flatten() {
        first_equal[vertex as usize] = first;
    }
    Some(first_equal)
}

/// Vertices that are dealt out by one task.
const BLOCK: usize = 1 << 13;
/// Parts that are searched on their own.
const HANDS: usize = 32;

/// A vertex and the hash of its position.
#[derive(Debug, Clone, Copy, PartialEq)]
struct Card {
    hash: u32,
    vertex: u32,
}

/// Every vertex of a hand that has the position of a lower one, with the lowest such.
fn equal_vertices<'a>(positions: &[Vec3], hand: impl Iterator<Item = &'a [Card]> + Clone) -> Vec<[u32; 2]> {
    const EMPTY: Card = Card { hash: 0, vertex: u32::MAX };
    let count: usize = hand.clone().map(<[Card]>::len).sum();
    let capacity = (2 * count).next_power_of_two();
    let mut table = vec![EMPTY; capacity];
    let mut found = Vec::new();
    for card in hand.flatten() {
        let mut slot = (card.hash as usize / HANDS) & (capacity - 1);
        loop {
            let other = table[slot];
            if other == EMPTY {
                table[slot] = *card;
                break;
            }
            if other.hash == card.hash && equal(positions, other.vertex, card.vertex) {
                found.push([card.vertex, other.vertex]);
                break;
            }
            slot = (slot + 1) & (capacity - 1);
        }
    }
    found
}

fn equal(positions: &[Vec3], a: u32, b: u32) -> bool {
    position_key(&positions[a as usize]) == position_key(&positions[b as usize])
}

/// Mixes all bits of a position into the low ones (the finaliser of `SplitMix64`, applied coordinate by coordinate).
#[allow(clippy::cast_possible_truncation, reason = "the low bits are as good as any")]
fn hash(key: [u64; 3]) -> u32 {
    let mix = |sum: u64, bits: u64| {
        let mut z = (sum ^ bits).wrapping_add(0x9E37_79B9_7F4A_7C15);
        z = (z ^ (z >> 30)).wrapping_mul(0xBF58_476D_1CE4_E5B9);
        z = (z ^ (z >> 27)).wrapping_mul(0x94D0_49BB_1331_11EB);
        z ^ (z >> 31)
    };
    key.into_iter().fold(0, mix) as u32
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

    #[test]
    fn finds_the_lowest_of_many_equal_positions_over_all_blocks() {
        // Each position comes back after 7,001 vertices, in another order of signs of zero.
        let n = 40_000;
        let distinct = 7001;
        let position = |v: usize| {
            let zero = if v.is_multiple_of(2) { 0.0 } else { -0.0 };
            Vec3::new((v % distinct) as f64, zero, ((v % distinct) as f64).sin())
        };
        let positions: Vec<Vec3> = (0..n).map(position).collect();
        let expected: Vec<u32> = (0..n).map(|v| index_u32(v % distinct)).collect();
        assert_eq!(first_equal_vertex(&positions), Some(expected));
        assert_eq!(first_equal_vertex(&positions[..distinct]), None);
    }
}

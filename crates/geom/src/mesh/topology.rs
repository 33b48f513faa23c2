//! How triangles meet: edges, neighbours across them, components, orientation.

use rayon::prelude::*;

use super::weld::index_u32;

/// Marks a triangle side that no other triangle shares.
const BOUNDARY: u32 = u32::MAX;
/// Marks a triangle side that two or more others share.
const NON_MANIFOLD: u32 = u32::MAX - 1;

/// Edges of a triangle mesh and what lies across them.
///
/// Degenerate triangles (a repeated vertex) are no part of it: they have no neighbours and belong to no component.
#[derive(Debug, Clone)]
pub struct Topology {
    /// Half-edge `3 t' + side'` across side `i` of triangle `t` (from corner `i` to corner `i + 1`), or a mark.
    across: Vec<[u32; 3]>,
    /// Undirected edges with one triangle.
    pub boundary_edges: usize,
    /// Undirected edges with three or more triangles.
    pub non_manifold_edges: usize,
    /// Undirected edges with two triangles that run through it in the same direction.
    pub inconsistent_edges: usize,
    /// Undirected edges in all.
    pub edges: usize,
    /// Triangles that name a vertex twice.
    pub degenerate_triangles: usize,
}

/// Whether a mesh has an inside.
#[derive(Debug, Clone, Copy, PartialEq, Eq)]
pub enum Orientation {
    /// Every two triangles that share an edge agree.
    Consistent,
    /// Some do not.
    Inconsistent {
        /// How many edges lie between triangles that disagree.
        edges: usize,
    },
}

impl Topology {
    /// Sorts the triangle sides by their edge: `O(m log m)` time, 84 bytes a triangle while it runs, 12 after.
    ///
    /// # Panics
    ///
    /// If there are more than `u32::MAX / 3` triangles.
    #[must_use]
    pub fn new(triangles: &[[u32; 3]]) -> Self {
        assert!(triangles.len() < (NON_MANIFOLD / 3) as usize, "too many triangles for 32-bit half-edges");
        let proper = |t: &[u32; 3]| t[0] != t[1] && t[1] != t[2] && t[2] != t[0];
        let mut sides: Vec<(u32, u32, u32)> = triangles
            .par_iter()
            .enumerate()
            .filter(|(_, t)| proper(t))
            .flat_map_iter(|(index, t)| {
                (0..3).map(move |i| {
                    let (a, b) = (t[i], t[(i + 1) % 3]);
                    (a.min(b), a.max(b), index_u32(3 * index + i))
                })
            })
            .collect();
        sides.par_sort_unstable();
        let mut topology = Self {
            across: vec![[BOUNDARY; 3]; triangles.len()],
            boundary_edges: 0,
            non_manifold_edges: 0,
            inconsistent_edges: 0,
            edges: 0,
            degenerate_triangles: triangles.iter().filter(|t| !proper(t)).count(),
        };
        let start = |half: u32| triangles[(half / 3) as usize][(half % 3) as usize];
        for edge in sides.chunk_by(|a, b| (a.0, a.1) == (b.0, b.1)) {
            topology.edges += 1;
            match edge {
                [_] => topology.boundary_edges += 1,
                &[(_, _, one), (_, _, two)] => {
                    topology.inconsistent_edges += usize::from(start(one) == start(two));
                    topology.across[(one / 3) as usize][(one % 3) as usize] = two;
                    topology.across[(two / 3) as usize][(two % 3) as usize] = one;
                }
                many => {
                    topology.non_manifold_edges += 1;
                    for &(_, _, half) in many {
                        topology.across[(half / 3) as usize][(half % 3) as usize] = NON_MANIFOLD;
                    }
                }
            }
        }
        topology
    }

    /// The triangle across side `side` (from corner `side` to the next) and which of its sides that is. `None` at the
    /// boundary and at edges with three or more triangles.
    ///
    /// # Panics
    ///
    /// If `triangle` is out of range or `side > 2`.
    #[inline]
    #[must_use]
    pub fn across(&self, triangle: usize, side: usize) -> Option<(usize, usize)> {
        let half = self.across[triangle][side];
        (half < NON_MANIFOLD).then_some(((half / 3) as usize, (half % 3) as usize))
    }

    /// Whether no other triangle shares this side. False at edges with three or more triangles.
    ///
    /// # Panics
    ///
    /// If `triangle` is out of range or `side > 2`.
    #[must_use]
    pub fn is_boundary(&self, triangle: usize, side: usize) -> bool {
        self.across[triangle][side] == BOUNDARY
    }

    /// Whether all neighbours agree on which side is out. Edges with three or more triangles are not judged.
    #[must_use]
    pub fn orientation(&self) -> Orientation {
        match self.inconsistent_edges {
            0 => Orientation::Consistent,
            edges => Orientation::Inconsistent { edges },
        }
    }

    /// Connected components over shared vertices, counted over vertices that proper triangles use.
    #[must_use]
    pub fn components(triangles: &[[u32; 3]], vertex_count: usize) -> usize {
        let mut parent: Vec<u32> = (0..index_u32(vertex_count)).collect();
        let mut used = vec![false; vertex_count];
        for triangle in triangles {
            let root = find(&mut parent, triangle[0]);
            for &vertex in triangle {
                used[vertex as usize] = true;
                let other = find(&mut parent, vertex);
                parent[other as usize] = root;
            }
        }
        (0..vertex_count).filter(|&v| used[v] && parent[v] as usize == v).count()
    }
}

/// Root of `vertex`, halving the path on the way.
fn find(parent: &mut [u32], mut vertex: u32) -> u32 {
    while parent[vertex as usize] != vertex {
        let grandparent = parent[parent[vertex as usize] as usize];
        parent[vertex as usize] = grandparent;
        vertex = grandparent;
    }
    vertex
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn euler_characteristic_and_neighbours() {
        let tetrahedron = [[0, 1, 2], [0, 2, 3], [0, 3, 1], [1, 3, 2]];
        let topology = Topology::new(&tetrahedron);
        assert_eq!((topology.edges, topology.boundary_edges, topology.non_manifold_edges), (6, 0, 0));
        assert_eq!(topology.orientation(), Orientation::Consistent);
        for t in 0..4 {
            for side in 0..3 {
                let (other, back) = topology.across(t, side).unwrap();
                assert_eq!(topology.across(other, back), Some((t, side)));
            }
        }
        let mut flipped = tetrahedron;
        flipped[0].swap(1, 2);
        assert_eq!(Topology::new(&flipped).orientation(), Orientation::Inconsistent { edges: 3 });
        assert_eq!(Topology::components(&[[0, 1, 2], [3, 4, 5], [2, 6, 7]], 9), 2);
        let fins = Topology::new(&[[0, 1, 2], [0, 1, 3], [0, 1, 4], [5, 5, 6]]);
        assert_eq!((fins.non_manifold_edges, fins.boundary_edges, fins.degenerate_triangles), (1, 6, 1));
    }
}

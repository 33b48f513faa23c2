//! The triangles around every vertex: how they are arranged, and which vertices they lead to.

/// How the triangles at one vertex are arranged.
#[derive(Debug, Clone, Copy, PartialEq, Eq)]
pub(crate) enum Fan {
    /// One closed fan.
    Closed,
    /// One open fan.
    Open,
    /// Several fans, an edge with three or more triangles, or disagreeing orientation.
    NonManifold,
    /// No proper triangle.
    Empty,
}

/// Appends the neighbours of a vertex to `ring` and classifies its fan. `edges` is scratch: the triangle sides opposite to
/// the vertex, in the triangles' own direction.
pub(super) fn visit(
    vertex: u32,
    incident: &[u32],
    triangles: &[[u32; 3]],
    edges: &mut Vec<[u32; 2]>,
    ring: &mut Vec<u32>,
) -> Fan {
    edges.clear();
    for &index in incident {
        let [a, b, c] = triangles[index as usize];
        edges.push(if a == vertex {
            [b, c]
        } else if b == vertex {
            [c, a]
        } else {
            [a, b]
        });
    }
    let start = ring.len();
    let proper = |[next, last]: &[u32; 2]| *next != vertex && *last != vertex && next != last;
    let degenerate = !edges.iter().all(proper);
    if degenerate {
        // Neighbours over a degenerate triangle count as neighbours, but the triangle is no part of a fan.
        ring.extend(edges.iter().flatten().filter(|&&v| v != vertex));
        edges.retain(proper);
    }
    let fan = arrange(edges);
    match fan {
        Fan::Closed if !degenerate => ring.extend(edges.iter().map(|e| e[0])),
        _ => ring.extend(edges.iter().flatten()),
    }
    ring[start..].sort_unstable();
    let distinct = drop_repeated(ring, start);
    match fan {
        // A closed walk may still pass through one neighbour twice.
        Fan::Closed if !degenerate && distinct < edges.len() => Fan::NonManifold,
        Fan::Open if !degenerate && distinct < edges.len() + 1 => Fan::NonManifold,
        fan => fan,
    }
}

/// Removes repeated entries of the sorted tail from `start` on; how many are left in it.
fn drop_repeated(ring: &mut Vec<u32>, start: usize) -> usize {
    let mut end = start;
    for index in start..ring.len() {
        if end == start || ring[index] != ring[end - 1] {
            ring[end] = ring[index];
            end += 1;
        }
    }
    ring.truncate(end);
    end - start
}

/// Sorts the edges into one walk where they form one.
fn arrange(edges: &mut [[u32; 2]]) -> Fan {
    let Some(&first) = edges.first() else { return Fan::Empty };
    let mut placed = 1;
    let mut end = first[1];
    while let Some(found) = edges[placed..].iter().position(|e| e[0] == end) {
        edges.swap(placed, placed + found);
        end = edges[placed][1];
        placed += 1;
    }
    if placed == edges.len() && end == first[0] {
        return Fan::Closed;
    }
    // An open fan whose first edge lies inside: place what comes before it, too.
    let mut begin = first[0];
    while let Some(found) = edges[placed..].iter().position(|e| e[1] == begin) {
        edges.swap(placed, placed + found);
        begin = edges[placed][0];
        placed += 1;
    }
    if placed == edges.len() { Fan::Open } else { Fan::NonManifold }
}

#[cfg(test)]
mod tests {
    use super::*;
    use crate::mesh::Adjacency;

    fn visit_all(triangles: &[[u32; 3]], vertex: u32) -> (Fan, Vec<u32>) {
        let incident = Adjacency::triangles_of_vertices(triangles, 8);
        let (mut edges, mut ring) = (Vec::new(), Vec::new());
        let fan = visit(vertex, incident.row(vertex as usize), triangles, &mut edges, &mut ring);
        (fan, ring)
    }

    fn fan(triangles: &[[u32; 3]], vertex: u32) -> Fan {
        visit_all(triangles, vertex).0
    }

    #[test]
    fn fans_of_all_kinds() {
        let tetrahedron = [[0, 1, 2], [0, 2, 3], [0, 3, 1], [1, 3, 2]];
        assert_eq!(fan(&tetrahedron, 0), Fan::Closed);
        assert_eq!(fan(&tetrahedron[..3], 1), Fan::Open);
        assert_eq!(fan(&tetrahedron[1..3], 0), Fan::Open);
        assert_eq!(fan(&[[0, 2, 3], [0, 1, 2], [0, 3, 4]], 0), Fan::Open);
        let bow_tie = [[0, 1, 2], [0, 3, 4]];
        assert_eq!(fan(&bow_tie, 0), Fan::NonManifold);
        let disagreeing = [[0, 1, 2], [0, 3, 2]];
        assert_eq!(fan(&disagreeing, 0), Fan::NonManifold);
        let three_leaves = [[0, 1, 2], [0, 1, 3], [0, 1, 4]];
        assert_eq!(fan(&three_leaves, 0), Fan::NonManifold);
        assert_eq!(fan(&three_leaves, 2), Fan::Open);
        assert_eq!(fan(&[[0, 0, 1]], 0), Fan::Empty);
        let two_tetrahedra_at_a_point = [[0, 1, 2], [0, 2, 3], [0, 3, 1], [0, 4, 5], [0, 5, 6], [0, 6, 4]];
        assert_eq!(fan(&two_tetrahedra_at_a_point, 0), Fan::NonManifold);
        // One walk over all five triangles, but twice through vertex 2.
        let twice = [[0, 1, 2], [0, 2, 3], [0, 3, 2], [0, 2, 4], [0, 4, 1]];
        assert_eq!(fan(&twice, 0), Fan::NonManifold);
    }

    #[test]
    fn neighbours_include_those_over_degenerate_triangles() {
        let triangles = [[0, 1, 2], [0, 2, 3], [3, 3, 1]];
        assert_eq!(visit_all(&triangles, 0), (Fan::Open, vec![1, 2, 3]));
        assert_eq!(visit_all(&triangles, 3), (Fan::Open, vec![0, 1, 2]));
        assert_eq!(visit_all(&triangles, 4), (Fan::Empty, vec![]));
    }
}

//! Splitting long edges, so that flat triangles can follow a bend.

use std::collections::HashMap;

use glam::Vec3;

/// Where the results of a subdivision come from.
pub(super) struct Split {
    /// For each new vertex, the two whose middle it is.
    pub parents: Vec<[u32; 2]>,
    /// For each triangle, the index of the one it is part of.
    pub sources: Vec<u32>,
}

/// Splits edges that are longer than `longest` over the UV plane until none is left, adding vertices at their middles. Whether an
/// edge is split depends on its ends only, so that triangles that share one, also across a tile's border, stay joined.
///
/// Gives up after 12 rounds, when edges are 4096 times shorter.
pub(super) fn subdivide_long_edges(
    vertices: &mut Vec<Vec3>,
    triangles: &[[u32; 3]],
    longest: f32,
) -> (Vec<[u32; 3]>, Split) {
    let mut current: Vec<([u32; 3], u32)> = triangles.iter().copied().zip(0..).collect();
    let mut parents = Vec::new();
    for _ in 0..12 {
        let before = vertices.len();
        let mut middles = HashMap::new();
        let mut next = Vec::with_capacity(current.len());
        for (corners, source) in current {
            let middle = [0, 1, 2].map(|i| {
                let (a, b) = (corners[i], corners[(i + 1) % 3]);
                let (p, q) = (vertices[a as usize], vertices[b as usize]);
                if (p - q).truncate().length() <= longest {
                    return None;
                }
                let key = [a.min(b), a.max(b)];
                Some(*middles.entry(key).or_insert_with(|| {
                    vertices.push(0.5 * (p + q));
                    parents.push(key);
                    u32::try_from(vertices.len() - 1).expect("fewer than 2^32 vertices")
                }))
            });
            split(corners, middle, |t| next.push((t, source)));
        }
        current = next;
        if vertices.len() == before {
            break;
        }
    }
    let (triangles, sources) = current.into_iter().unzip();
    (triangles, Split { parents, sources })
}

/// Cuts a triangle along the middles of the edges `01`, `12` and `20` that are given.
fn split([a, b, c]: [u32; 3], [ab, bc, ca]: [Option<u32>; 3], mut emit: impl FnMut([u32; 3])) {
    match (ab, bc, ca) {
        (None, None, None) => emit([a, b, c]),
        (Some(m), None, None) => [[a, m, c], [m, b, c]].into_iter().for_each(emit),
        (None, Some(m), None) => [[b, m, a], [m, c, a]].into_iter().for_each(emit),
        (None, None, Some(m)) => [[c, m, b], [m, a, b]].into_iter().for_each(emit),
        (Some(m), Some(n), None) => [[m, b, n], [a, m, n], [a, n, c]].into_iter().for_each(emit),
        (None, Some(m), Some(n)) => [[m, c, n], [b, m, n], [b, n, a]].into_iter().for_each(emit),
        (Some(n), None, Some(m)) => [[m, a, n], [c, m, n], [c, n, b]].into_iter().for_each(emit),
        (Some(l), Some(m), Some(n)) => {
            [[a, l, n], [l, b, m], [n, m, c], [l, m, n]].into_iter().for_each(emit);
        }
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn no_long_edge_no_gap_no_loss() {
        let mut vertices: Vec<Vec3> = [(0.0, 0.0), (1.0, 0.0), (1.0, 1.0), (0.0, 1.0), (0.93, 0.4)]
            .map(|(u, v)| Vec3::new(u, v, 0.0))
            .into();
        let triangles = [[0, 1, 4], [1, 2, 4], [2, 3, 4], [3, 0, 4]];
        let (made, split) = subdivide_long_edges(&mut vertices, &triangles, 0.11);
        let at = |i: u32| vertices[i as usize].truncate();
        let mut edges: HashMap<[u32; 2], i32> = HashMap::new();
        let mut areas = [0.0_f32; 4];
        for (t, source) in made.iter().zip(&split.sources) {
            let twice = (at(t[1]) - at(t[0])).perp_dot(at(t[2]) - at(t[0]));
            assert!(twice > 0.0, "{t:?} is turned over");
            areas[*source as usize] += 0.5 * twice;
            for i in 0..3 {
                let (a, b) = (t[i], t[(i + 1) % 3]);
                assert!((at(a) - at(b)).length() <= 0.11);
                *edges.entry([a.min(b), a.max(b)]).or_default() += 1;
            }
        }
        for (area, expected) in areas.iter().zip([0.2, 0.035, 0.3, 0.465]) {
            assert!((area - expected).abs() < 1e-5, "{area} {expected}");
        }
        // Every edge that only one triangle has lies on the square's border.
        for ([a, b], count) in edges {
            let border =
                |p: glam::Vec2, q: glam::Vec2| (0..2).any(|i| p[i] == q[i] && (p[i] == 0.0 || p[i] == 1.0));
            assert!(count == 2 || count == 1 && border(at(a), at(b)), "{count} triangles at {a} {b}");
        }
    }
}

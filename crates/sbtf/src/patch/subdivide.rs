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

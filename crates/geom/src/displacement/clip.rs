//! Cutting a triangle of the tile out of a base triangle.

use super::lattice::{Point, is_left_of_tile_edge, vertex_is_left};

/// A corner of what two triangles have in common, by where it comes from; indices are those of corners and edges, edge `i` from
/// corner `i` to the next.
#[derive(Debug, Clone, Copy, PartialEq, Eq)]
pub(super) enum Cut {
    /// A vertex of the tile.
    Tile(usize),
    /// A vertex of the base.
    Base(usize),
    /// Where edges cross: of the base, of the tile.
    Crossing(usize, usize),
}

/// What a base triangle and a tile's triangle, both counter-clockwise, have in common: a convex polygon, counter-clockwise;
/// nothing is pushed where they have nothing.
///
/// Everything follows from on which sides of the other's edges the vertices are, so that neighbours agree on every point of
/// their common edge.
pub(super) fn common(base: &[Point; 3], tile: &[Point; 3], out: &mut Vec<Cut>) {
    out.clear();
    let next = |i: usize| (i + 1) % 3;
    // `inner[e][k]`: the tile's vertex k is inside the base's edge e; `within[k][e]`: the base's vertex e inside the tile's edge k.
    let inner = [0, 1, 2].map(|e| tile.map(|p| vertex_is_left(base[e], base[next(e)], p)));
    if inner.contains(&[false; 3]) {
        return;
    }
    let within = [0, 1, 2].map(|k| base.map(|a| is_left_of_tile_edge(tile[k], tile[next(k)], a)));
    if within.contains(&[false; 3]) {
        return;
    }
    let base_inside = |e: usize| (0..3).all(|k| within[k][e]);
    let crosses = |e: usize, k: usize| inner[e][k] != inner[e][next(k)] && within[k][e] != within[k][next(e)];
    for k in 0..3 {
        if (0..3).all(|e| inner[e][k]) {
            out.push(Cut::Tile(k));
        }
        // Along the tile's edge one can come in, and then go out.
        out.extend((0..3).filter(|&e| crosses(e, k) && inner[e][next(k)]).map(|e| Cut::Crossing(e, k)));
        let Some(exit) = (0..3).find(|&e| crosses(e, k) && inner[e][k]) else { continue };
        out.push(Cut::Crossing(exit, k));
        // From there the outline follows the base up to where the tile's comes in again.
        let mut corner = next(exit);
        while base_inside(corner) && corner != exit {
            out.push(Cut::Base(corner));
            corner = next(corner);
        }
        if corner == exit && base_inside(exit) {
            out.push(Cut::Base(exit));
        }
    }
    if out.is_empty() && (0..3).all(base_inside) {
        out.extend([Cut::Base(0), Cut::Base(1), Cut::Base(2)]);
    }
}

#[cfg(test)]
mod tests {
    use super::*;
    use crate::displacement::lattice::{cross, zero_between};

    fn area(polygon: &[[f64; 2]]) -> f64 {
        let pairs = polygon.iter().zip(polygon.iter().cycle().skip(1));
        0.5 * pairs.map(|(a, b)| a[0] * b[1] - a[1] * b[0]).sum::<f64>()
    }

    /// Sutherland and Hodgman's clipping with points in floating point: another method for the same area.
    fn clipped_area(base: &[Point; 3], tile: &[Point; 3]) -> f64 {
        let mut polygon: Vec<[f64; 2]> = tile.iter().map(|p| p.map(|x| x as f64)).collect();
        for e in 0..3 {
            let [a, b] = [base[e], base[(e + 1) % 3]].map(|p| p.map(|x| x as f64));
            let side = |p: &[f64; 2]| (b[0] - a[0]) * (p[1] - a[1]) - (b[1] - a[1]) * (p[0] - a[0]);
            let mut kept = Vec::new();
            for (i, p) in polygon.iter().enumerate() {
                let q = &polygon[(i + 1) % polygon.len()];
                let (x, y) = (side(p), side(q));
                if x >= 0.0 {
                    kept.push(*p);
                }
                if (x >= 0.0) != (y >= 0.0) {
                    let s = x / (x - y);
                    kept.push([p[0] + s * (q[0] - p[0]), p[1] + s * (q[1] - p[1])]);
                }
            }
            polygon = kept;
        }
        area(&polygon)
    }

    /// Triangles on a lattice of 7 by 7 points: nearly all coincide somewhere.
    #[test]
    fn the_cut_has_the_common_area_and_turns_the_right_way() {
        let mut state = 1_u64;
        let mut random = || {
            state = state.wrapping_mul(6_364_136_223_846_793_005).wrapping_add(1_442_695_040_888_963_407);
            i64::try_from(state >> 33).unwrap() % 7
        };
        let mut triangle = || loop {
            let t = [[random(), random()], [random(), random()], [random(), random()]];
            if cross(t[0], t[1], t[2]) > 0 {
                return t;
            }
        };
        let mut cut = Vec::new();
        let mut kinds = [0; 9];
        for _ in 0..40_000 {
            let (base, tile) = (triangle(), triangle());
            common(&base, &tile, &mut cut);
            let points: Vec<[f64; 2]> = cut
                .iter()
                .map(|c| match *c {
                    Cut::Tile(k) => tile[k].map(|x| x as f64),
                    Cut::Base(e) => base[e].map(|x| x as f64),
                    Cut::Crossing(e, k) => {
                        let (p, q) = (tile[k], tile[(k + 1) % 3]);
                        let (a, b) = (base[e], base[(e + 1) % 3]);
                        let r = zero_between(cross(a, b, p), cross(a, b, q));
                        [0, 1].map(|i| p[i] as f64 + r * (q[i] - p[i]) as f64)
                    }
                })
                .collect();
            let expected = clipped_area(&base, &tile);
            assert!((area(&points) - expected).abs() < 1e-9, "{base:?} {tile:?}: {cut:?}, area {expected}");
            assert!(cut.is_empty() || (3..=6).contains(&cut.len()), "{cut:?}");
            kinds[cut.len()] += 1;
        }
        assert!(kinds[0] > 0 && kinds[3..=6].iter().all(|&n| n > 100), "{kinds:?}");
    }
}

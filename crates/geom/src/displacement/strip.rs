//! Base triangles without UV area: nothing of the tile lies over them, but their edges are cut.

use std::cmp::Ordering;

use super::build::{Base, Corners, Piece};
use super::lattice::{Point, cross, is_left_of_tile_edge, vertex_is_left};
use super::tile::{Corner, HeightTile};

/// A vertex of the outline and how far it is along the line that the triangle is in UV space.
type Stop = (f64, u32);

/// Fills the outline of a triangle whose UV lie on a line with triangles across. Its edges are those of its neighbours.
pub(super) fn fill(base: &Base<'_>, corners: &Corners, piece: &mut Piece) {
    let points = corners.points;
    let length = |e: usize| {
        let (a, b) = (points[e], points[(e + 1) % 3]);
        ((b[0] - a[0]) as f64).hypot((b[1] - a[1]) as f64)
    };
    let longest = if length(1) > length(0) { 1 } else { 0 };
    let longest = if length(2) > length(longest) { 2 } else { longest };
    let [start, end, other] = [0, 1, 2].map(|i| (longest + i) % 3);
    let along = |p: Point| {
        let [dx, dy] = [0, 1].map(|i| (points[end][i] - points[start][i]) as f64);
        (p[0] - points[start][0]) as f64 * dx + (p[1] - points[start][1]) as f64 * dy
    };
    let chain = |piece: &mut Piece, way: &[usize]| {
        let mut stops: Vec<Stop> = Vec::new();
        for (step, &corner) in way.iter().enumerate() {
            stops.push((along(points[corner]), piece.base(corners, corner)));
            let Some(&next) = way.get(step + 1) else { break };
            let (a, b) = (points[corner], points[next]);
            stops.extend(crossings(base.tile, a, b).into_iter().map(|edge| {
                let (share, vertex) = piece.crossing(base, corners, [corner, next], edge);
                (along(a) + share * (along(b) - along(a)), vertex)
            }));
        }
        stops
    };
    let straight = chain(piece, &[start, end]);
    let bent = chain(piece, &[start, other, end]);
    let (mut i, mut j) = (0, 0);
    while i + 1 < straight.len() || j + 1 < bent.len() {
        let forward = j + 1 == bent.len() || i + 1 < straight.len() && straight[i + 1].0 <= bent[j + 1].0;
        let triangle = if forward {
            i += 1;
            [straight[i - 1].1, straight[i].1, bent[j].1]
        } else {
            j += 1;
            [straight[i].1, bent[j].1, bent[j - 1].1]
        };
        let [a, b, c] = triangle;
        if a != b && b != c && c != a {
            piece.triangles.push(triangle);
        }
    }
}

/// The tile's edges that cross an edge of the base, in their order from `a` to `b`.
fn crossings(tile: &HeightTile, a: Point, b: Point) -> Vec<[Corner; 2]> {
    let mut found = Vec::new();
    if a == b {
        return found;
    }
    tile.bins.near(&[a, b, b], |triangle, copy| {
        let corners = tile.triangles[triangle].map(|c| c.moved(copy));
        for k in 0..3 {
            let (c, d) = (corners[k], corners[(k + 1) % 3]);
            let (p, q) = (tile.point(c), tile.point(d));
            // Each edge is met from both sides; one counts.
            if HeightTile::edge(c, d) == [c, d]
                && vertex_is_left(a, b, p) != vertex_is_left(a, b, q)
                && is_left_of_tile_edge(p, q, a) != is_left_of_tile_edge(p, q, b)
            {
                found.push([c, d]);
            }
        }
    });
    found.sort_by_cached_key(|edge| Order::new(a, b, edge.map(|corner| tile.point(corner))));
    found
}

/// Where an edge of the tile crosses, as a share of the way, and how that changes with the infinitesimal step. All exact, because where several
/// edges meet in a vertex on the way, neighbouring triangles know their order.
#[derive(PartialEq, Eq, PartialOrd, Ord)]
struct Order([Ratio; 3]);

impl Order {
    fn new(a: Point, b: Point, [p, q]: [Point; 2]) -> Self {
        let [dx, dy] = [0, 1].map(|i| i128::from(q[i] - p[i]));
        // The point `a + s (b - a)` is on the line through `p` and `q` moved by `(e, e^2)`.
        let down = cross(p, q, a) - cross(p, q, b);
        Self([cross(p, q, a), dy, -dx].map(|n| Ratio::new(n, down)))
    }
}

/// A quotient with a positive divisor.
struct Ratio(i128, i128);

impl Ratio {
    fn new(n: i128, d: i128) -> Self {
        if d < 0 { Self(-n, -d) } else { Self(n, d) }
    }
}

impl PartialEq for Ratio {
    fn eq(&self, other: &Self) -> bool {
        self.cmp(other) == Ordering::Equal
    }
}
impl Eq for Ratio {}
impl PartialOrd for Ratio {
    fn partial_cmp(&self, other: &Self) -> Option<Ordering> {
        Some(self.cmp(other))
    }
}
impl Ord for Ratio {
    /// By whole parts, and then by the reciprocals of what is left: products would overflow.
    fn cmp(&self, other: &Self) -> Ordering {
        let (mut a, mut b) = ((self.0, self.1), (other.0, other.1));
        loop {
            let whole = a.0.div_euclid(a.1).cmp(&b.0.div_euclid(b.1));
            if whole != Ordering::Equal {
                return whole;
            }
            let left = (a.0.rem_euclid(a.1), b.0.rem_euclid(b.1));
            if left.0 == 0 || left.1 == 0 {
                return left.0.cmp(&left.1);
            }
            (a, b) = ((b.1, left.1), (a.1, left.0));
        }
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn quotients_compare_exactly() {
        for (a, b) in [(3, 7), (-3, 7), (0, 5), (22, 7), (i128::from(u64::MAX), 3)] {
            for (c, d) in [(6, 14), (-5, 7), (1, i128::MAX), (22, -7), (i128::from(u64::MAX) * 2 + 1, 6)] {
                let (x, y) = (Ratio::new(a, b), Ratio::new(c, d));
                let expected = match (a as f64 / b as f64).total_cmp(&(c as f64 / d as f64)) {
                    // Less than f64 can tell.
                    Ordering::Equal if c > i128::from(u64::MAX) => Ordering::Less,
                    other => other,
                };
                assert!(x.cmp(&y) == expected && y.cmp(&x) == expected.reverse(), "{a}/{b} {c}/{d}");
            }
        }
    }
}

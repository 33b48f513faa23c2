//! Points of the UV plane as integers, and on which side of an edge they are, never on it.

/// Lattice steps in a tile.
pub(super) const TILE: i64 = 1 << 24;

/// Largest coordinate, in tiles: differences stay below 2^46 steps, so that their products fit into 128 bits with room.
pub(super) const FARTHEST: f64 = (1_u32 << 20) as f64;

/// A point in lattice steps.
pub(super) type Point = [i64; 2];

/// The nearest lattice point of coordinates in tiles; `None` beyond [`FARTHEST`].
#[allow(clippy::cast_possible_truncation, reason = "below 2^45")]
pub(super) fn snapped(uv: [f64; 2]) -> Option<Point> {
    let inside = uv.iter().all(|x| x.abs() <= FARTHEST);
    inside.then(|| uv.map(|x| (x * TILE as f64).round() as i64))
}

/// `(b - a) x (c - a)`: twice the area, positive if the three turn counter-clockwise.
pub(super) fn cross(a: Point, b: Point, c: Point) -> i128 {
    let [dx, dy] = [0, 1].map(|i| i128::from(b[i] - a[i]));
    dx * i128::from(c[1] - a[1]) - dy * i128::from(c[0] - a[0])
}

/// Whether a tile's vertex `p`, moved by the infinitesimal step `(e, e^2)`, is left of the base edge from `a` to `b`.
pub(super) fn vertex_is_left(a: Point, b: Point, p: Point) -> bool {
    match cross(a, b, p) {
        0 if b[1] != a[1] => b[1] < a[1],
        0 => b[0] > a[0],
        sign => sign > 0,
    }
}

/// Whether the base point `a` is left of the tile's edge from `p` to `q`, moved likewise.
pub(super) fn is_left_of_tile_edge(p: Point, q: Point, a: Point) -> bool {
    match cross(p, q, a) {
        0 if q[1] != p[1] => q[1] > p[1],
        0 => q[0] < p[0],
        sign => sign > 0,
    }
}

/// `x / (x - y)`, where a linear function with the values `x` and `y` at the ends is 0.
pub(super) fn zero_between(x: i128, y: i128) -> f64 {
    x as f64 / (x - y) as f64
}

#[cfg(test)]
mod tests {
    use super::*;

    /// The sides after a step that is small but real: `(64, 1)` on a lattice refined by 4096.
    #[test]
    fn coincidences_are_decided_like_a_small_step() {
        let refine = |p: Point| p.map(|x| x * 4096);
        let moved = |p: Point| [p[0] * 4096 + 64, p[1] * 4096 + 1];
        let points: Vec<Point> = (0..25).map(|i| [i % 5, i / 5]).collect();
        for &a in &points {
            for &b in points.iter().filter(|&&b| b != a) {
                for &p in &points {
                    let real = cross(refine(a), refine(b), moved(p));
                    assert!(real != 0 && (real > 0) == vertex_is_left(a, b, p), "{a:?} {b:?} {p:?}");
                    let real = cross(moved(a), moved(b), refine(p));
                    assert!(real != 0 && (real > 0) == is_left_of_tile_edge(a, b, p), "{a:?} {b:?} {p:?}");
                }
            }
        }
    }
}

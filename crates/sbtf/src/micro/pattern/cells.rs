//! Voronoi cells around scattered points (Worley, "A Cellular Texture Basis Function", SIGGRAPH 1996).

use glam::Vec2;

use super::hash::{hash, unit};
use super::noise::lattice;

/// What [`cells`] knows of a point.
#[derive(Debug, Clone, Copy, PartialEq)]
pub struct Cell {
    /// Hashed bits of the cell that the point lies in.
    pub id: u64,
    /// From the cell's point to this one, in mean cell sizes.
    pub offset: Vec2,
    /// Distance to the cell's point, in mean cell sizes.
    pub f1: f32,
    /// Distance to the second nearest point, in mean cell sizes.
    pub f2: f32,
    /// Distance to the cell's border, in mean cell sizes: 0 on it, about a half in the middle.
    pub border: f32,
}

/// A scattered point near the one that was asked about.
#[derive(Debug, Clone, Copy, PartialEq)]
pub struct Point {
    /// Hashed bits of the point.
    pub id: u64,
    /// From the scattered point to the one asked about, in mean cell sizes.
    pub offset: Vec2,
}

/// The Voronoi cell that a point lies in, of `counts` scattered points. `jitter` in `[0, 1]`: 0 is a regular lattice.
#[must_use]
pub fn cells(uv: Vec2, counts: [u32; 2], jitter: f32, seed: u64) -> Cell {
    let mut nearest = Point { id: 0, offset: Vec2::MAX };
    let mut points = [nearest; 25];
    let (mut f1, mut f2) = (f32::MAX, f32::MAX);
    for (kept, point) in points.iter_mut().zip(scatter(uv, counts, jitter, seed)) {
        *kept = point;
        let distance = point.offset.length();
        if distance < f1 {
            (f2, f1, nearest) = (f1, distance, point);
        } else {
            f2 = f2.min(distance);
        }
    }
    // Distance to the bisector of the nearest point and each other one.
    let to_bisector = |point: Point| {
        let between = nearest.offset - point.offset;
        let length = between.length();
        if length < 1e-6 { f32::MAX } else { -(0.5 * (nearest.offset + point.offset)).dot(between / length) }
    };
    let border = points.into_iter().map(to_bisector).fold(f32::MAX, f32::min).max(0.0);
    Cell { id: nearest.id, offset: nearest.offset, f1, f2, border }
}

/// The scattered points in the five by five lattice cells around a point: all within one and a half mean cell sizes of it, if the
/// lattice cells are square.
pub fn scatter(uv: Vec2, counts: [u32; 2], jitter: f32, seed: u64) -> impl Iterator<Item = Point> {
    let size = Vec2::new(counts[0] as f32, counts[1] as f32);
    let (position, metric) = (uv * size, (size.x * size.y).sqrt() / size);
    let base = position.floor();
    (0..25_u8).map(move |i| {
        let corner = base + Vec2::new(f32::from(i % 5), f32::from(i / 5)) - 2.0;
        let id = hash(seed, lattice(corner.x, counts[0]), lattice(corner.y, counts[1]));
        let inside = 0.5 + jitter * (Vec2::new(unit(id, 1), unit(id, 2)) - 0.5);
        Point { id, offset: (position - corner - inside) * metric }
    })
}

#[cfg(test)]
mod tests {
    use super::*;

    /// All points of a tile and its neighbours, as brute force sees them.
    fn all_points(counts: [u32; 2], jitter: f32, seed: u64) -> Vec<Vec2> {
        let size = Vec2::new(counts[0] as f32, counts[1] as f32);
        let (nx, ny) = (counts[0].cast_signed(), counts[1].cast_signed());
        let mut points = Vec::new();
        for y in -ny..2 * ny {
            for x in -nx..2 * nx {
                let id = hash(seed, x.rem_euclid(nx).cast_unsigned(), y.rem_euclid(ny).cast_unsigned());
                let inside = 0.5 + jitter * (Vec2::new(unit(id, 1), unit(id, 2)) - 0.5);
                points.push((Vec2::new(x as f32, y as f32) + inside) * (size.x * size.y).sqrt() / size);
            }
        }
        points
    }

    #[test]
    fn distances_agree_with_brute_force() {
        let counts = [6, 5];
        let points = all_points(counts, 1.0, 11);
        for i in 0..400_u32 {
            let uv = Vec2::new(unit(hash(1, i, 0), 0), unit(hash(1, i, 1), 0));
            let cell = cells(uv, counts, 1.0, 11);
            let p = uv * 30.0_f32.sqrt();
            let mut distances: Vec<f32> = points.iter().map(|q| q.distance(p)).collect();
            distances.sort_by(f32::total_cmp);
            assert!((cell.f1 - distances[0]).abs() < 1e-4, "{} {}", cell.f1, distances[0]);
            assert!((cell.f2 - distances[1]).abs() < 1e-4, "{} {}", cell.f2, distances[1]);
            // The border is where the two distances are equal: a lower bound of the way there is half their difference.
            assert!(cell.border + 1e-4 >= 0.5 * (cell.f2 - cell.f1) && cell.border <= cell.f2);
        }
    }

    #[test]
    fn the_border_is_where_the_cell_changes() {
        let at = |x: f32| cells(Vec2::new(x, 0.37), [4, 4], 0.8, 3);
        for i in 0..2000_u16 {
            let x = f32::from(i) / 2000.0;
            let (a, b) = (at(x), at(x + 0.0005));
            // A step of 0.0005 UV is 0.002 cells.
            assert!(a.id == b.id || a.border.max(b.border) <= 0.0021, "{x}: {} {}", a.border, b.border);
        }
    }
}

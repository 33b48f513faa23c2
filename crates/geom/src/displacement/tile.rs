//! [`HeightTile`]: a periodic height field as triangles.

use std::collections::HashMap;

use thiserror::Error;

use super::candidates::Bins;
use super::lattice::{Point, TILE, cross, snapped};
use crate::mesh::index_u32;

/// Triangles over one period of UV space, with a height at every vertex, whose copies cover the plane without gaps.
#[derive(Debug, Clone)]
pub struct HeightTile {
    vertices: Vec<Vertex>,
    pub(super) triangles: Vec<[Corner; 3]>,
    pub(super) bins: Bins,
    /// Lengths of all edges, in tiles; each edge counts once.
    edge_length: f64,
}

#[derive(Debug, Clone, Copy)]
struct Vertex {
    /// In `[0, TILE)`.
    at: Point,
    z: f64,
}

/// A vertex in one copy of the tile.
#[derive(Debug, Clone, Copy, PartialEq, Eq, Hash, PartialOrd, Ord)]
pub(super) struct Corner {
    pub vertex: u32,
    pub copy: [i32; 2],
}

impl Corner {
    /// The same in a copy that is that many tiles farther.
    pub fn moved(self, by: [i32; 2]) -> Self {
        Self { copy: [self.copy[0] + by[0], self.copy[1] + by[1]], ..self }
    }
}

/// Why triangles are not a tile.
#[derive(Debug, Clone, PartialEq, Error)]
pub enum TileError {
    /// Not one height for every point.
    #[error("{heights} heights for {points} points")]
    Lengths {
        /// Points.
        points: usize,
        /// Heights.
        heights: usize,
    },
    /// A height above the top, or something that is not finite, or too far away.
    #[error("vertex {vertex} at {point:?} has the height {height}: heights are at most 0, and all is finite")]
    Vertex {
        /// Index of the vertex.
        vertex: usize,
        /// Its place, in tiles.
        point: [f64; 2],
        /// Its height.
        height: f64,
    },
    /// A triangle that is not counter-clockwise on the lattice, or names a vertex that does not exist.
    #[error("triangle {triangle} is not counter-clockwise")]
    Triangle {
        /// Index of the triangle.
        triangle: usize,
    },
    /// Opposite borders that do not fit.
    #[error("the copies of the tile do not join: {reason}")]
    Seam {
        /// Where.
        reason: String,
    },
}

impl HeightTile {
    /// Takes points in tiles, heights in tiles (at most 0), and counter-clockwise triangles. Points that are whole tiles apart are one
    /// vertex; the triangles need not stay inside the unit square.
    ///
    /// # Errors
    ///
    /// Triangles whose copies do not cover the plane exactly once, or with other heights on opposite borders; see [`TileError`].
    pub fn new(points: &[[f64; 2]], heights: &[f64], triangles: &[[u32; 3]]) -> Result<Self, TileError> {
        let (vertices, corner_of) = welded(points, heights)?;
        let mut tile = Self { vertices, triangles: Vec::new(), bins: Bins::default(), edge_length: 0.0 };
        let mut doubled_area = 0;
        for (triangle, corners) in triangles.iter().enumerate() {
            if corners.iter().any(|&c| c as usize >= corner_of.len()) {
                return Err(TileError::Triangle { triangle });
            }
            let corners = corners.map(|c| corner_of[c as usize]);
            let [a, b, c] = corners.map(|c| tile.point(c));
            let area = cross(a, b, c);
            if area <= 0 {
                return Err(TileError::Triangle { triangle });
            }
            doubled_area += area;
            tile.triangles.push(corners);
        }
        if doubled_area != 2 * i128::from(TILE) * i128::from(TILE) {
            let covered = doubled_area as f64 / (2.0 * (TILE as f64).powi(2));
            return Err(TileError::Seam { reason: format!("the triangles cover {covered} of it") });
        }
        tile.edge_length = tile.joined()?;
        let points: Vec<[Point; 3]> =
            tile.triangles.iter().map(|corners| corners.map(|c| tile.point(c))).collect();
        tile.bins = Bins::new(&points);
        Ok(tile)
    }

    /// The same height everywhere: two triangles.
    ///
    /// # Panics
    ///
    /// If the height is positive or not finite.
    #[must_use]
    pub fn level(z: f64) -> Self {
        let points = [[0.0, 0.0], [1.0, 0.0], [1.0, 1.0], [0.0, 1.0]];
        Self::new(&points, &[z; 4], &[[0, 1, 2], [0, 2, 3]]).expect("a height of at most 0")
    }

    /// How many triangles there are.
    #[must_use]
    pub fn triangle_count(&self) -> usize {
        self.triangles.len()
    }

    /// The lowest height, in tiles.
    #[must_use]
    pub fn lowest(&self) -> f64 {
        self.vertices.iter().map(|v| v.z).fold(0.0, f64::min)
    }

    pub(super) fn edge_length(&self) -> f64 {
        self.edge_length
    }

    pub(super) fn z(&self, corner: Corner) -> f64 {
        self.vertices[corner.vertex as usize].z
    }

    pub(super) fn point(&self, corner: Corner) -> Point {
        let at = self.vertices[corner.vertex as usize].at;
        [0, 1].map(|i| at[i] + TILE * i64::from(corner.copy[i]))
    }

    /// The ends of an edge in the order that both of its triangles agree on.
    pub(super) fn edge(a: Corner, b: Corner) -> [Corner; 2] {
        let swapped = (b.vertex, b.copy) < (a.vertex, a.copy);
        if swapped { [b, a] } else { [a, b] }
    }

    /// Checks that every edge has a triangle on either side; the sum of all lengths.
    fn joined(&self) -> Result<f64, TileError> {
        let side = |a: Corner, b: Corner| (a.vertex, b.vertex, [0, 1].map(|i| b.copy[i] - a.copy[i]));
        let mut sides = HashMap::with_capacity(3 * self.triangles.len());
        for corners in &self.triangles {
            for i in 0..3 {
                *sides.entry(side(corners[i], corners[(i + 1) % 3])).or_insert(0) += 1;
            }
        }
        let mut length = 0.0;
        for corners in &self.triangles {
            for i in 0..3 {
                let (a, b) = (corners[i], corners[(i + 1) % 3]);
                let [p, q] = [a, b].map(|c| self.point(c).map(|x| x as f64 / TILE as f64));
                if sides[&side(a, b)] != 1 || sides.get(&side(b, a)) != Some(&1) {
                    let reason =
                        format!("the edge from {p:?} to {q:?} has no triangle beyond it, or several");
                    return Err(TileError::Seam { reason });
                }
                length += 0.5 * (q[0] - p[0]).hypot(q[1] - p[1]);
            }
        }
        Ok(length)
    }
}

/// One vertex for all points that are whole tiles apart, and the corner that each point is.
fn welded(points: &[[f64; 2]], heights: &[f64]) -> Result<(Vec<Vertex>, Vec<Corner>), TileError> {
    if points.len() != heights.len() {
        return Err(TileError::Lengths { points: points.len(), heights: heights.len() });
    }
    let mut vertices: Vec<Vertex> = Vec::new();
    let mut known = HashMap::new();
    let mut corner_of = Vec::with_capacity(points.len());
    for (vertex, (&point, &height)) in points.iter().zip(heights).enumerate() {
        // Also refuses NaN.
        let valid = height.is_finite() && height <= 0.0;
        let at = snapped(point).filter(|_| valid).ok_or(TileError::Vertex { vertex, point, height })?;
        let inside = at.map(|x| x.rem_euclid(TILE));
        let number = *known.entry(inside).or_insert_with(|| {
            vertices.push(Vertex { at: inside, z: height });
            index_u32(vertices.len() - 1)
        });
        let other = vertices[number as usize].z;
        if other.to_bits() != height.to_bits() {
            let reason = format!("at {point:?} one border has the height {height}, the other {other}");
            return Err(TileError::Seam { reason });
        }
        let copy = at.map(|x| i32::try_from(x.div_euclid(TILE)).expect("at most 2^20 tiles from the origin"));
        corner_of.push(Corner { vertex: number, copy });
    }
    Ok((vertices, corner_of))
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn what_does_not_tile_is_refused() {
        let square = [[0.25, 0.25], [1.25, 0.25], [1.25, 1.25], [0.25, 1.25]];
        let triangles = [[0, 1, 2], [0, 2, 3]];
        let of = |heights: &[f64], triangles: &[[u32; 3]]| HeightTile::new(&square, heights, triangles);
        let tile = of(&[-0.5; 4], &triangles).unwrap();
        assert_eq!((tile.vertices.len(), tile.triangle_count(), tile.lowest()), (1, 2, -0.5));
        assert!((tile.edge_length() - (2.0 + 2.0_f64.sqrt())).abs() < 1e-12);
        assert!(matches!(of(&[-0.5; 3], &triangles), Err(TileError::Lengths { .. })));
        assert!(matches!(of(&[-0.5, 0.1, -0.5, -0.5], &triangles), Err(TileError::Vertex { vertex: 1, .. })));
        assert!(matches!(of(&[-0.5, -0.4, -0.5, -0.5], &triangles), Err(TileError::Seam { .. })));
        assert!(matches!(of(&[-0.5; 4], &[[0, 2, 1], [0, 2, 3]]), Err(TileError::Triangle { triangle: 0 })));
        assert!(matches!(of(&[-0.5; 4], &triangles[..1]), Err(TileError::Seam { .. })));
        assert!(matches!(of(&[-0.5; 4], &[[0, 1, 9]]), Err(TileError::Triangle { triangle: 0 })));
        // The right area, but the copies overlap on one side and leave a gap on the other.
        let skewed = [[0.0, 0.0], [1.0, 0.0], [1.0, 0.5], [0.0, 1.5]];
        assert!(matches!(HeightTile::new(&skewed, &[0.0; 4], &triangles), Err(TileError::Seam { .. })));
    }
}

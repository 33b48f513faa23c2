//! [`displace`]: from the cuts to a mesh.

use std::collections::HashMap;

use rayon::prelude::*;
use thiserror::Error;

use super::clip::{Cut, common};
use super::lattice::{Point, cross, is_left_of_tile_edge, snapped, zero_between};
use super::strip;
use super::tile::{Corner, HeightTile};
use crate::mesh::{Adjacency, Part, Surface, Weld, area_weighted_normals, index_u32, smooth_normals};
use crate::{Mesh, MeshError, Vec3};

/// How a tile lies on a mesh.
#[derive(Debug, Clone, Copy, PartialEq)]
pub struct DisplaceOptions {
    /// Tiles per UV unit, along u and v. Default: 1 and 1.
    pub tiles: [f64; 2],
    /// World length that a height of one tile has; positive. Default: 1.
    pub tile_size: f64,
    /// Most triangles that may be made. Default: 16 million, some 2 GB.
    pub most_triangles: usize,
}

impl Default for DisplaceOptions {
    fn default() -> Self {
        Self { tiles: [1.0; 2], tile_size: 1.0, most_triangles: 16_000_000 }
    }
}

/// A displaced mesh.
#[derive(Debug, Clone)]
pub struct Displaced {
    /// The surface: the base's vertices first, in its order, then those of the cuts. Triangles, parts and materials follow the base's order. UV are the
    /// base's; normals are those of the new triangles, weighted by area and joined across seams.
    pub mesh: Mesh,
    /// The base triangle that each triangle lies over.
    pub sources: Vec<u32>,
    /// How far interpolated normals of unit length can be from linear ones inside a base triangle, times the depth: what the
    /// triangles may lie beside the smooth surface for that, world units.
    pub bow: f64,
}

/// Why a mesh cannot be displaced.
#[derive(Debug, Clone, PartialEq, Error)]
pub enum DisplaceError {
    /// There is nowhere to lay the tile.
    #[error("the mesh has no UV, which say where the heights go")]
    NoUv,
    /// A size that is none.
    #[error("{what} is {value}; it must be positive and finite")]
    Size {
        /// What.
        what: &'static str,
        /// Its value.
        value: f64,
    },
    /// UV that the lattice does not reach.
    #[error("vertex {vertex}: the UV {uv:?} are more than 2^20 tiles from the origin")]
    TooFar {
        /// Index of the vertex.
        vertex: usize,
        /// Its UV.
        uv: [f64; 2],
    },
    /// More than the caller wants to hold in memory.
    #[error(
        "about {predicted} triangles, of which {limit} are allowed; take a coarser tolerance, fewer tiles or a coarser mesh"
    )]
    TooMany {
        /// Forecast.
        predicted: usize,
        /// [`DisplaceOptions::most_triangles`].
        limit: usize,
    },
    /// Positions that overflow.
    #[error(transparent)]
    Mesh(#[from] MeshError),
}

/// Lays copies of a height tile over a mesh, along its outward normals: the mesh's own, averaged where vertices share a position,
/// or smooth ones if it has none.
///
/// Where the mesh's UV turn the tile over (mirrored charts), heights are mirrored with them. Triangles without UV area are kept, with edges
/// that fit their neighbours'. Across a UV seam the heights only go on if the UV differ by whole tiles.
///
/// # Errors
///
/// See [`DisplaceError`].
pub fn displace(
    mesh: &Mesh,
    tile: &HeightTile,
    options: &DisplaceOptions,
) -> Result<Displaced, DisplaceError> {
    let base = Base::new(mesh, tile, options)?;
    let predicted = base.predicted();
    if predicted > options.most_triangles {
        return Err(DisplaceError::TooMany { predicted, limit: options.most_triangles });
    }
    let mut joined = Joined::new(&base);
    // In blocks, because loose pieces take several times the memory of the mesh.
    let count = mesh.triangles().len();
    for first in (0..count).step_by(BLOCK) {
        let block = first..(first + BLOCK).min(count);
        let pieces: Vec<Piece> = block.into_par_iter().with_min_len(64).map(|t| base.piece(t)).collect();
        pieces.iter().for_each(|piece| joined.add(piece));
    }
    let Joined { positions, uvs, triangles, sources, ends, .. } = joined;
    let end = |t: usize| t.checked_sub(1).map_or(0, |last| ends[last]);
    let part = |p: &Part| Part { triangles: end(p.triangles.start)..end(p.triangles.end), ..p.clone() };
    let parts = mesh.parts().iter().map(part).collect();
    let bow = base.bow();
    let made =
        Mesh::new(positions, triangles)?.with_uv_set(uvs)?.with_parts(parts, mesh.materials().to_vec())?;
    let normals = normals(&made);
    Ok(Displaced { mesh: made.with_normals(normals)?, sources, bow })
}

/// Base triangles that are cut at a time.
const BLOCK: usize = 1 << 13;

/// Pieces put together.
struct Joined {
    positions: Vec<Vec3>,
    uvs: Vec<[f64; 2]>,
    triangles: Vec<[u32; 3]>,
    sources: Vec<u32>,
    /// Number of triangles after each piece.
    ends: Vec<usize>,
    shared: HashMap<EdgeCut, u32>,
}

impl Joined {
    /// Begins with the base's vertices.
    fn new(base: &Base<'_>) -> Self {
        let raised = |v: usize| base.raised(base.positions[v], base.normals[v], base.z[v]);
        Self {
            positions: (0..base.positions.len()).map(raised).collect(),
            uvs: base.uvs.to_vec(),
            triangles: Vec::new(),
            sources: Vec::new(),
            ends: Vec::new(),
            shared: HashMap::new(),
        }
    }

    fn add(&mut self, piece: &Piece) {
        let Self { positions, uvs, shared, .. } = self;
        let mut push = |position, uv| {
            positions.push(position);
            uvs.push(uv);
            index_u32(positions.len() - 1)
        };
        let number = |vertex: &Made| match *vertex {
            Made::Base(v) => v,
            Made::Inner { position, uv } => push(position, uv),
            Made::Crossing { cut, position, uv } => *shared.entry(cut).or_insert_with(|| push(position, uv)),
        };
        let number: Vec<u32> = piece.vertices.iter().map(number).collect();
        // Where base and tile coincide, cuts are of no area, and their corners often equal to the bit.
        let corners = piece.triangles.iter().map(|t| t.map(|i| number[i as usize]));
        self.triangles.extend(corners.filter(|t| {
            let [a, b, c] = t.map(|i| self.positions[i as usize]);
            a != b && b != c && c != a
        }));
        self.sources.resize(self.triangles.len(), index_u32(self.ends.len()));
        self.ends.push(self.triangles.len());
    }
}

/// Weighted by area, so that the slivers that cuts leave do not count.
fn normals(mesh: &Mesh) -> Vec<Vec3> {
    let surface = Surface::new(mesh, Weld::Exact);
    let (positions, triangles) = (surface.positions(), surface.triangles());
    let incident = Adjacency::triangles_of_vertices(triangles, positions.len());
    surface.spread(area_weighted_normals(positions, triangles, &incident))
}

/// The base mesh as the cuts want it.
pub(super) struct Base<'a> {
    mesh: &'a Mesh,
    pub tile: &'a HeightTile,
    size: f64,
    positions: &'a [Vec3],
    normals: Vec<Vec3>,
    uvs: &'a [[f64; 2]],
    points: Vec<Point>,
    /// Heights at the vertices, in tiles.
    z: Vec<f64>,
    /// Decides which end of an edge comes first; equal for vertices at one position.
    rank: Vec<u32>,
}

/// Corners of a base triangle, in the order in which their UV turn counter-clockwise.
pub(super) struct Corners {
    pub vertices: [u32; 3],
    pub points: [Point; 3],
}

/// What becomes of a base triangle.
#[derive(Default)]
pub(super) struct Piece {
    vertices: Vec<Made>,
    pub triangles: Vec<[u32; 3]>,
    numbers: HashMap<Key, u32>,
}

enum Made {
    Base(u32),
    Inner { position: Vec3, uv: [f64; 2] },
    Crossing { cut: EdgeCut, position: Vec3, uv: [f64; 2] },
}

/// An edge of the base and one of the tile.
type EdgeCut = ([u32; 2], [Corner; 2]);

#[derive(PartialEq, Eq, Hash)]
enum Key {
    Base(u32),
    Tile(Corner),
    Crossing(EdgeCut),
}

impl<'a> Base<'a> {
    fn new(mesh: &'a Mesh, tile: &'a HeightTile, options: &DisplaceOptions) -> Result<Self, DisplaceError> {
        let [u, v] = options.tiles;
        for (what, value) in [("tile_size", options.tile_size), ("tiles (u)", u), ("tiles (v)", v)] {
            if !(value.is_finite() && value > 0.0) {
                return Err(DisplaceError::Size { what, value });
            }
        }
        let uvs = mesh.uv_sets().first().ok_or(DisplaceError::NoUv)?;
        let point = |(vertex, uv): (usize, &[f64; 2])| {
            snapped([uv[0] * u, uv[1] * v]).ok_or(DisplaceError::TooFar { vertex, uv: *uv })
        };
        let points = uvs.iter().enumerate().map(point).collect::<Result<Vec<_>, _>>()?;
        let surface = Surface::new(mesh, Weld::Exact);
        let rank = (0..points.len()).map(|v| index_u32(surface.surface_from_vertex(v))).collect();
        let z = points.par_iter().map(|&p| height(tile, p)).collect();
        let normals = outward(mesh, &surface);
        let positions = mesh.positions();
        Ok(Self { mesh, tile, size: options.tile_size, positions, normals, uvs, points, z, rank })
    }

    /// How many triangles to expect: in the overlay of two triangulations two more for every crossing of edges, of which random
    /// directions make `2 / pi` times the product of the lengths per area.
    #[allow(clippy::cast_possible_truncation, clippy::cast_sign_loss, reason = "a forecast")]
    fn predicted(&self) -> usize {
        let tile_area = |p: &[Point; 3]| {
            0.5 * cross(p[0], p[1], p[2]).abs() as f64 / (super::lattice::TILE as f64).powi(2)
        };
        let length = |a: Point, b: Point| {
            ((b[0] - a[0]) as f64).hypot((b[1] - a[1]) as f64) / super::lattice::TILE as f64
        };
        let (mut area, mut edges) = (0.0, 0.0);
        for corners in self.mesh.triangles() {
            let p = corners.map(|c| self.points[c as usize]);
            area += tile_area(&p);
            edges += 0.5 * (length(p[0], p[1]) + length(p[1], p[2]) + length(p[2], p[0]));
        }
        let crossings = std::f64::consts::FRAC_2_PI * edges * self.tile.edge_length();
        (self.mesh.triangles().len() as f64 + area * self.tile.triangle_count() as f64 + 2.0 * crossings)
            as usize
    }

    /// The largest distance between a unit normal and a linear one in a base triangle, times the depth.
    fn bow(&self) -> f64 {
        let shortfall = |corners: &[u32; 3]| {
            let sum: Vec3 = corners.iter().map(|&c| self.normals[c as usize]).sum();
            1.0 - sum.norm() / 3.0
        };
        let most = self.mesh.triangles().iter().map(shortfall).fold(0.0, f64::max);
        -self.tile.lowest() * self.size * most
    }

    /// A point of the base raised by a height in tiles along a vector of any length.
    fn raised(&self, position: Vec3, along: Vec3, z: f64) -> Vec3 {
        let length = along.norm();
        if length > 0.0 { position + along * (z * self.size / length) } else { position }
    }

    fn piece(&self, triangle: usize) -> Piece {
        let vertices = self.mesh.triangles()[triangle];
        let points = vertices.map(|v| self.points[v as usize]);
        let area = cross(points[0], points[1], points[2]);
        let mut piece = Piece::default();
        let mut corners = Corners { vertices, points };
        if area == 0 {
            strip::fill(self, &corners, &mut piece);
            return piece;
        }
        if area < 0 {
            corners.vertices.swap(1, 2);
            corners.points.swap(1, 2);
        }
        let mut cut = Vec::new();
        let mut polygon = Vec::new();
        self.tile.bins.near(&corners.points, |index, copy| {
            let tile = self.tile.triangles[index].map(|c| c.moved(copy));
            common(&corners.points, &tile.map(|c| self.tile.point(c)), &mut cut);
            polygon.clear();
            polygon.extend(cut.iter().map(|c| match *c {
                Cut::Base(corner) => piece.base(&corners, corner),
                Cut::Tile(k) => piece.inner(self, &corners, tile[k]),
                Cut::Crossing(e, k) => {
                    let edge = HeightTile::edge(tile[k], tile[(k + 1) % 3]);
                    piece.crossing(self, &corners, [e, (e + 1) % 3], edge).1
                }
            }));
            for i in 2..polygon.len() {
                let [a, b, c] = [polygon[0], polygon[i - 1], polygon[i]];
                piece.triangles.push(if area < 0 { [a, c, b] } else { [a, b, c] });
            }
        });
        piece
    }
}

impl Piece {
    /// The number of a corner.
    pub fn base(&mut self, corners: &Corners, corner: usize) -> u32 {
        let vertex = corners.vertices[corner];
        self.number(Key::Base(vertex), || Made::Base(vertex))
    }

    /// The number of a vertex of the tile inside the base triangle.
    fn inner(&mut self, base: &Base<'_>, corners: &Corners, at: Corner) -> u32 {
        self.number(Key::Tile(at), || {
            let (p, [a, b, c]) = (base.tile.point(at), corners.points);
            let area = cross(a, b, c) as f64;
            let weights = [cross(b, c, p), cross(c, a, p), cross(a, b, p)].map(|w| w as f64 / area);
            let vertices = corners.vertices.map(|v| v as usize);
            let blend = |all: &[Vec3]| (0..3).map(|i| all[vertices[i]] * weights[i]).sum::<Vec3>();
            let uv = [0, 1].map(|axis| (0..3).map(|i| weights[i] * base.uvs[vertices[i]][axis]).sum());
            let position = base.raised(blend(base.positions), blend(&base.normals), base.tile.z(at));
            Made::Inner { position, uv }
        })
    }

    /// Where a base edge between two corners and an edge of the tile cross: how far along from the first corner, and the number.
    pub fn crossing(
        &mut self,
        base: &Base<'_>,
        corners: &Corners,
        ends: [usize; 2],
        edge: [Corner; 2],
    ) -> (f64, u32) {
        let [i, j] = ends.map(|corner| corners.vertices[corner]);
        let rank = |v: u32| (base.rank[v as usize], v);
        let swapped = rank(j) < rank(i);
        let ordered = if swapped { [j, i] } else { [i, j] };
        let [a, b] = ordered.map(|v| base.points[v as usize]);
        let [p, q] = edge.map(|c| base.tile.point(c));
        let s = zero_between(cross(p, q, a), cross(p, q, b));
        let number = self.number(Key::Crossing((ordered, edge)), || {
            let r = zero_between(cross(a, b, p), cross(a, b, q));
            let [m, n] = ordered.map(|v| v as usize);
            let blend = |all: &[Vec3]| all[m] + (all[n] - all[m]) * s;
            let [from, to] = edge.map(|c| base.tile.z(c));
            let position = base.raised(blend(base.positions), blend(&base.normals), from + r * (to - from));
            let uv = [0, 1].map(|axis| base.uvs[m][axis] + s * (base.uvs[n][axis] - base.uvs[m][axis]));
            Made::Crossing { cut: (ordered, edge), position, uv }
        });
        (if swapped { 1.0 - s } else { s }, number)
    }

    fn number(&mut self, key: Key, make: impl FnOnce() -> Made) -> u32 {
        let vertices = &mut self.vertices;
        *self.numbers.entry(key).or_insert_with(|| {
            vertices.push(make());
            index_u32(vertices.len() - 1)
        })
    }
}

/// The height of the tile at a point; of several triangles that meet there, in the one that the infinitesimal step chooses.
fn height(tile: &HeightTile, a: Point) -> f64 {
    let mut found = None;
    tile.bins.near(&[a; 3], |triangle, copy| {
        let corners = tile.triangles[triangle].map(|c| c.moved(copy));
        let [p, q, r] = corners.map(|c| tile.point(c));
        if is_left_of_tile_edge(p, q, a) && is_left_of_tile_edge(q, r, a) && is_left_of_tile_edge(r, p, a) {
            let area = cross(p, q, r) as f64;
            let weights = [cross(q, r, a), cross(r, p, a), cross(p, q, a)].map(|w| w as f64 / area);
            found = Some((0..3).map(|i| weights[i] * tile.z(corners[i])).sum());
        }
    });
    found.expect("the triangles cover the plane")
}

/// Unit normals of the base, the same for all vertices at one position.
fn outward(mesh: &Mesh, surface: &Surface<'_>) -> Vec<Vec3> {
    let Some(own) = mesh.normals() else { return smooth_normals(mesh, Weld::Exact) };
    let mut sums = vec![Vec3::zeros(); surface.positions().len()];
    for (vertex, normal) in own.iter().enumerate() {
        sums[surface.surface_from_vertex(vertex)] += normal.try_normalize(0.0).unwrap_or_else(Vec3::zeros);
    }
    sums.iter_mut().for_each(|n| *n = n.try_normalize(1e-12).unwrap_or_else(Vec3::zeros));
    surface.spread(sums)
}

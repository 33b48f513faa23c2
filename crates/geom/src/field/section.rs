//! The curve in which a plane cuts the surface: its pieces, and the first of them. [`Front`](super::front::Front) follows it.
//!
//! Every decision is taken on the sides of the section plane that the corners lie on, where a corner in the plane
//! counts as above it. A triangle then has either no crossed side or exactly two, whatever rounding does, so the walk
//! never meets a special case at a vertex or along an edge and never turns back.

use super::surface_field::{CurvatureField, SurfacePoint};
use crate::Vec3;

/// Why a walk ended.
#[derive(Debug, Clone, Copy, PartialEq, Eq)]
pub enum Stop {
    /// The whole length was walked.
    Length,
    /// The ray came out of the surface again.
    Exit,
    /// The ray is below the material.
    Below,
    /// It met a boundary edge.
    Boundary,
    /// It met an edge with three or more triangles: no way on is more right than another.
    NonManifold,
    /// The direction has no tangential part (or the point no section): nothing was walked.
    NormalIncidence,
    /// It came back to where it started.
    Closed,
    /// It took [`MAX_CROSSINGS`](super::MAX_CROSSINGS) triangles and the length was not reached.
    Budget,
    /// A bound says that the walk cannot matter.
    Skipped,
    /// The filter answers without a walk.
    NoWalk,
}

/// A plane.
#[derive(Debug, Clone, Copy)]
pub(super) struct Section {
    pub origin: Vec3,
    /// Unit.
    pub normal: Vec3,
}

/// Where a section crosses a side of a triangle.
#[derive(Debug, Clone, Copy)]
pub(super) struct Crossing {
    pub side: usize,
    pub point: SurfacePoint,
    pub position: Vec3,
}

/// The section's piece in one triangle.
#[derive(Debug, Clone, Copy)]
pub(super) struct Piece {
    /// In the same triangle as `exit.point`.
    pub from: SurfacePoint,
    pub from_position: Vec3,
    pub exit: Crossing,
}

/// An end of a side that a section crosses.
#[derive(Debug, Clone, Copy)]
pub(super) struct SideEnd {
    /// Of the surface.
    pub vertex: u32,
    pub position: Vec3,
    /// Above the section plane.
    pub height: f64,
    /// Its share in the crossing; those of both ends sum to one.
    pub weight: f64,
}

/// The first piece of a walk along a section.
pub(super) struct Beginning {
    pub section: Section,
    pub piece: Piece,
    /// The ends of the side through which the piece leaves: the next triangle has two of its corners from there.
    pub ends: [SideEnd; 2],
}

impl Beginning {
    /// Starts at a point of the section on the way `forward`; `None` if no triangle there is crossed.
    pub fn new(
        field: &CurvatureField<'_>,
        section: Section,
        start: SurfacePoint,
        forward: Vec3,
    ) -> Option<Self> {
        let (from, exit) = leave_start(field, &section, start, forward)?;
        let piece = Piece { from, from_position: section.origin, exit };
        let (vertices, side) = (field.surface().triangles()[exit.point.triangle], exit.side);
        let ends = [side, (side + 1) % 3].map(|corner| SideEnd {
            weight: exit.point.barycentric[corner],
            ..section.side_end(field, vertices[corner])
        });
        Some(Self { section, piece, ends })
    }

    /// Whether the first piece is no more than rounding: the surface ends there at once.
    pub fn is_speck(&self, field: &CurvatureField<'_>) -> bool {
        let Piece { from, from_position, exit } = &self.piece;
        (exit.position - from_position).norm()
            <= LEAST_PIECE * longest_side(field.surface().corners(from.triangle))
    }
}

/// Length of the longest side of a triangle with these corners.
pub(super) fn longest_side([a, b, c]: [Vec3; 3]) -> f64 {
    [b - a, c - b, a - c].iter().map(Vec3::norm_squared).fold(0.0, f64::max).sqrt()
}

impl Section {
    /// Above the plane.
    pub fn height(&self, p: Vec3) -> f64 {
        self.normal.dot(&(p - self.origin))
    }

    /// With no weight yet.
    pub fn side_end(&self, field: &CurvatureField<'_>, vertex: u32) -> SideEnd {
        let position = field.surface().positions()[vertex as usize];
        SideEnd { vertex, position, height: self.height(position), weight: 0.0 }
    }

    /// The two crossed sides of a triangle, or `None` if all corners lie on one side.
    fn crossings(&self, field: &CurvatureField<'_>, triangle: usize) -> Option<[Crossing; 2]> {
        let corners = field.surface().corners(triangle);
        let heights = corners.map(|p| self.height(p));
        let above = heights.map(|h| h >= 0.0);
        let crossing = |side: usize| {
            let (a, b) = (side, (side + 1) % 3);
            (above[a] != above[b]).then(|| {
                // The heights differ in sign, so the share is in [0, 1] and the division is safe.
                let share = heights[a] / (heights[a] - heights[b]);
                let mut barycentric = [0.0; 3];
                (barycentric[a], barycentric[b]) = (1.0 - share, share);
                let point = SurfacePoint { triangle, barycentric };
                Crossing { side, point, position: corners[a] + (corners[b] - corners[a]) * share }
            })
        };
        let mut found = (0..3).filter_map(crossing);
        Some([found.next()?, found.next()?])
    }
}

/// Of a first piece to the longest side of its triangle: shorter ones are rounding, and have no direction. A plane cuts them off over a
/// corner that it passes through.
const LEAST_PIECE: f64 = 1e-9;

/// The starting point as a point of the triangle in which the walk starts, and the exit from that on the way forward.
///
/// It is the point's own triangle, unless the point lies on a corner or an edge, up to rounding, and the way forward is
/// in a neighbour.
fn leave_start(
    field: &CurvatureField<'_>,
    section: &Section,
    start: SurfacePoint,
    forward: Vec3,
) -> Option<(SurfacePoint, Crossing)> {
    let along = |c: &Crossing| forward.dot(&(c.position - section.origin));
    let behind_and_ahead =
        |[one, two]: [Crossing; 2]| if along(&one) < along(&two) { (one, two) } else { (two, one) };
    let own = section.crossings(field, start.triangle).map(|pair| behind_and_ahead(pair).1);
    let least = LEAST_PIECE * longest_side(field.surface().corners(start.triangle));
    if let Some(exit) = own.filter(|exit| along(exit) > least) {
        return Some((start, exit));
    }
    let corner = (0..3).max_by(|&a, &b| start.barycentric[a].total_cmp(&start.barycentric[b]))?;
    let vertex = field.surface().triangles()[start.triangle][corner];
    let neighbours = fan(field, start.triangle, vertex).into_iter();
    let exits = neighbours.filter_map(|t| section.crossings(field, t)).map(behind_and_ahead);
    let best = exits.filter(|(_, exit)| along(exit) > 0.0).max_by(|a, b| along(&a.1).total_cmp(&along(&b.1)));
    best.map(|(behind, exit)| (behind.point, exit)).or(own.map(|exit| (start, exit)))
}

/// Triangles around a vertex that are reached from one of them over shared edges.
pub(super) fn fan(field: &CurvatureField<'_>, triangle: usize, vertex: u32) -> Vec<usize> {
    let mut fan = vec![triangle];
    let mut head = 0;
    while let Some(&current) = fan.get(head) {
        head += 1;
        for side in 0..3 {
            let Some((next, _)) = field.topology().across(current, side) else { continue };
            if field.surface().triangles()[next].contains(&vertex) && !fan.contains(&next) {
                fan.push(next);
            }
        }
    }
    fan
}

//! [`StrideWalk`]: the walk of [`SectionWalk`], for those who look at the section now and then only.
//!
//! It takes the same decisions from the same numbers, so that it enters the same triangles, and remembers of each crossing what it takes
//! to find UV on the way later. Positions are worked out where they are asked for.

use std::cell::Cell;

use nalgebra::{Matrix2, Vector2};

use super::section::{MAX_CROSSINGS, SectionWalk, SideEnd, Stop};
use super::surface_field::CurvatureField;
use crate::Vec3;

/// An end of the crossed side.
#[derive(Debug, Clone, Copy)]
struct End {
    vertex: u32,
    /// Above the section plane.
    height: f64,
    /// Of the foot on the ray.
    t: f64,
}

/// Where a triangle was left.
#[derive(Debug, Clone, Copy)]
pub(super) struct Exit {
    /// Distance of its foot along the ray.
    pub t: f64,
    triangle: u32,
    side: u32,
    /// From the side's first corner to its second.
    share: f64,
}

/// A walk along a section on which a ray's feet are known.
pub(super) struct StrideWalk<'a, 'f> {
    field: &'a CurvatureField<'f>,
    plane: [Vec3; 2],
    ray: [Vec3; 2],
    ends: [End; 2],
    trail: Vec<Exit>,
    /// UV displacement over the first piece.
    first_uv: Option<[f64; 2]>,
    start_triangle: usize,
    is_closed: bool,
}

/// The sides of a triangle after each, in order.
const AFTER: [[usize; 2]; 3] = [[1, 2], [2, 0], [0, 1]];

thread_local! {
    /// Memory of the last walk's trail, for the next.
    static SPARE: Cell<Vec<Exit>> = const { Cell::new(Vec::new()) };
}

impl Drop for StrideWalk<'_, '_> {
    fn drop(&mut self) {
        SPARE.set(std::mem::take(&mut self.trail));
    }
}

impl<'a, 'f> StrideWalk<'a, 'f> {
    /// Goes on from the first piece of a walk; `ray` is where the ray starts, and its unit direction.
    pub fn new(field: &'a CurvatureField<'f>, walk: &SectionWalk<'a, 'f>, ray: [Vec3; 2]) -> Self {
        let (piece, section) = (walk.piece(), walk.section());
        let foot = |p: &Vec3| ray[1].dot(&(p - ray[0]));
        let end = |e: &SideEnd| End { vertex: e.vertex, height: e.height, t: foot(&e.position) };
        let ends = [end(&walk.ends()[0]), end(&walk.ends()[1])];
        let exit = piece.exit;
        let share = walk.ends()[1].weight;
        let index = crate::mesh::index_u32;
        let (triangle, side) = (index(exit.point.triangle), index(exit.side));
        let mut trail = SPARE.take();
        trail.clear();
        trail.push(Exit { t: foot(&exit.position), triangle, side, share });
        let (from, to) = (piece.from.barycentric, exit.point.barycentric);
        let first_uv = field.corner_uvs(exit.point.triangle).map(|uvs| {
            [0, 1].map(|axis: usize| (0..3).map(|k: usize| (to[k] - from[k]) * uvs[k][axis]).sum::<f64>())
        });
        let start_triangle = piece.from.triangle;
        let plane = [section.origin, section.normal];
        Self { field, plane, ray, ends, trail, first_uv, start_triangle, is_closed: false }
    }

    /// Goes on until the foot of the walk on the ray is so far ahead of where it is now, one triangle at least, or comes back. Where there
    /// is no way on, the walk stays on its last triangle.
    pub fn stride(&mut self, distance: f64) -> Result<(), Stop> {
        let (field, topology) = (self.field, self.field.topology());
        let (triangles, positions) = (field.surface().triangles(), field.surface().positions());
        let mut at = *self.last();
        let mut ends = self.ends;
        let end = at.t + distance;
        loop {
            let (triangle, side) = (at.triangle as usize, at.side as usize);
            let stop = match topology.across(triangle, side) {
                _ if self.is_closed => Stop::Closed,
                _ if self.trail.len() == MAX_CROSSINGS as usize => Stop::Budget,
                None if topology.is_boundary(triangle, side) => Stop::Boundary,
                None => Stop::NonManifold,
                Some((next, entered)) => {
                    let vertices = &triangles[next];
                    let [b, c] = AFTER[entered];
                    let opposite = self.end(vertices[c], &positions[vertices[c] as usize]);
                    // The ends lie on different sides of the plane, the opposite corner with one of them, whose place it takes. Places are
                    // numbers here, not branches: half of those would be foretold wrongly.
                    let first = usize::from(ends[0].vertex != vertices[entered]);
                    let with_first = usize::from((opposite.height >= 0.0) == (ends[first].height >= 0.0));
                    ends[1 - with_first] = ends[first ^ with_first];
                    ends[with_first] = opposite;
                    let [from, to] = &ends;
                    // The heights differ in sign, so the share is in [0, 1] and the division is safe.
                    let share = from.height / (from.height - to.height);
                    let t = from.t + share * (to.t - from.t);
                    let ends_here = t >= end || t <= at.t;
                    #[allow(clippy::cast_possible_truncation, reason = "triangles have 32-bit numbers")]
                    let exit = Exit { t, triangle: next as u32, side: [c, b][with_first] as u32, share };
                    at = exit;
                    self.trail.push(at);
                    self.is_closed = next == self.start_triangle;
                    if !ends_here {
                        continue;
                    }
                    self.ends = ends;
                    return Ok(());
                }
            };
            self.ends = ends;
            return Err(stop);
        }
    }

    /// Goes back to where a stride would have ended that began after so many triangles and was only so long.
    pub fn shorten(&mut self, began: usize, distance: f64) {
        let end = self.trail[began - 1].t + distance;
        let ends_at = |k: &usize| self.trail[*k].t >= end || self.trail[*k].t <= self.trail[*k - 1].t;
        let Some(last) = (began..self.trail.len() - 1).find(ends_at) else { return };
        self.trail.truncate(last + 1);
        self.is_closed = false;
        let Exit { triangle, side, .. } = self.trail[last];
        let (vertices, side) = (self.field.surface().triangles()[triangle as usize], side as usize);
        let positions = self.field.surface().positions();
        self.ends = [side, (side + 1) % 3].map(|k| self.end(vertices[k], &positions[vertices[k] as usize]));
    }

    fn end(&self, vertex: u32, p: &Vec3) -> End {
        let ([origin, normal], [ray_origin, ray]) = (&self.plane, &self.ray);
        End { vertex, height: normal.dot(&(p - origin)), t: ray.dot(&(p - ray_origin)) }
    }

    fn last(&self) -> &Exit {
        self.trail.last().expect("holds the first exit")
    }

    /// Triangles left so far, the first included.
    pub fn passed(&self) -> usize {
        self.trail.len()
    }

    /// Triangles entered after the first.
    #[allow(clippy::cast_possible_truncation, reason = "at most MAX_CROSSINGS")]
    pub fn crossings(&self) -> u32 {
        self.trail.len() as u32 - 1
    }

    /// Where the walk is, and the ends of the side that it crosses there.
    pub fn crossing(&self) -> (Vec3, [SideEnd; 2]) {
        let share = self.last().share;
        let position = |k: usize| self.field.surface().positions()[self.ends[k].vertex as usize];
        let (p, q) = (position(0), position(1));
        let end = |k: usize, position, weight| {
            let End { vertex, height, .. } = self.ends[k];
            SideEnd { vertex, position, height, weight }
        };
        (p + (q - p) * share, [end(0, p, 1.0 - share), end(1, q, share)])
    }

    /// UV displacement over the first piece; `None` without UV.
    pub fn first_uv(&self) -> Option<[f64; 2]> {
        self.first_uv
    }

    /// UV displacement up to the first point of the walk whose foot on the ray is at distance `t`, in the axes of the chart where the
    /// walk starts; `None` without UV.
    ///
    /// Triangle by triangle with the triangle's own UV, so that seams do not matter: UV that go on over a side cancel there, and those of a
    /// chart that lies otherwise are turned.
    pub fn uv_at(&self, t: f64) -> Option<[f64; 2]> {
        let first_uv = self.first_uv?;
        let next = self.trail.iter().position(|p| p.t >= t).unwrap_or(self.trail.len() - 1);
        let share = |from: f64| {
            let share = ((t - from) / (self.trail[next].t - from)).clamp(0.0, 1.0);
            if share.is_nan() { 1.0 } else { share }
        };
        let Some(before) = next.checked_sub(1) else { return Some(first_uv.map(|d| d * share(0.0))) };
        let mut sum = Vector2::from(first_uv);
        let mut axes = Matrix2::identity();
        // Since where the UV go on without a jump.
        let mut since = self.exit_uv(0)?;
        for k in 1..next {
            if self.jumps(k - 1) {
                sum += axes * (self.exit_uv(k - 1)? - since);
                axes *= self.turn_over(k - 1)?;
                since = self.entry_uv(k)?;
            }
        }
        sum += axes * (self.exit_uv(before)? - since);
        if self.jumps(before) {
            axes *= self.turn_over(before)?;
        }
        sum += axes * (self.exit_uv(next)? - self.entry_uv(next)?) * share(self.trail[before].t);
        Some(sum.into())
    }

    /// Turns UV displacements of the chart beyond a crossed side, and mirrors them where it is mirrored, so that the side's own are the
    /// same in both charts but for their length. The identity for a side without extent in UV.
    fn turn_over(&self, k: usize) -> Option<Matrix2<f64>> {
        let (entered, [from, to]) = self.beyond(k)?;
        let left = self.trail[k].triangle as usize;
        let [a, b] = self.crossed(k)?;
        let basis = |along: Vector2<f64>, triangle: usize| {
            let uvs = self.field.corner_uvs(triangle)?.map(Vector2::from);
            let is_mirrored = (uvs[1] - uvs[0]).perp(&(uvs[2] - uvs[0])) < 0.0;
            let x = along.try_normalize(0.0)?;
            let y = if is_mirrored { Vector2::new(x.y, -x.x) } else { Vector2::new(-x.y, x.x) };
            Some(Matrix2::from_columns(&[x, y]))
        };
        let turn = basis(b - a, left).zip(basis(to - from, entered));
        Some(turn.map_or_else(Matrix2::identity, |(old, new)| old * new.transpose()))
    }

    fn jumps(&self, k: usize) -> bool {
        let Exit { triangle, side, .. } = self.trail[k];
        self.field.uv_jumps(triangle as usize, side as usize)
    }

    /// UV of the ends of a crossed side, by the triangle that is left.
    fn crossed(&self, k: usize) -> Option<[Vector2<f64>; 2]> {
        let Exit { triangle, side, .. } = self.trail[k];
        let (uvs, side) = (self.field.corner_uvs(triangle as usize)?, side as usize);
        Some([uvs[side].into(), uvs[(side + 1) % 3].into()])
    }

    /// The triangle beyond a crossed side, and by its corners the UV of the side's ends, in the same order as [`Self::crossed`].
    fn beyond(&self, k: usize) -> Option<(usize, [Vector2<f64>; 2])> {
        let Exit { triangle, side, .. } = self.trail[k];
        let (left, side) = (triangle as usize, side as usize);
        let (entered, e) = self.field.topology().across(left, side)?;
        let triangles = self.field.surface().triangles();
        let uvs = self.field.corner_uvs(entered)?;
        let (a, b) = (uvs[e].into(), uvs[(e + 1) % 3].into());
        let is_same_way = triangles[entered][e] == triangles[left][side];
        Some((entered, if is_same_way { [a, b] } else { [b, a] }))
    }

    /// UV where a triangle is left, by its own corners.
    fn exit_uv(&self, k: usize) -> Option<Vector2<f64>> {
        let [a, b] = self.crossed(k)?;
        Some(a + (b - a) * self.trail[k].share)
    }

    /// UV where a triangle after the first is entered, by its own corners.
    fn entry_uv(&self, k: usize) -> Option<Vector2<f64>> {
        let (_, [a, b]) = self.beyond(k - 1)?;
        Some(a + (b - a) * self.trail[k - 1].share)
    }
}

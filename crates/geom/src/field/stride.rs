//! [`StrideWalk`]: a walk for those who look at the section now and then only.
//!
//! It remembers of each crossing what it takes to find UV on the way later. Positions are worked out where they are asked for.

use std::cell::Cell;

use nalgebra::{Matrix2, Vector2};

use super::front::{Front, FrontEnd};
use super::section::{Beginning, Section, SideEnd, Stop};
use super::surface_field::CurvatureField;
use crate::Vec3;

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
    section: Section,
    ray: [Vec3; 2],
    /// Of its ends it knows where their feet on the ray are.
    front: Front<f64>,
    trail: Vec<Exit>,
    /// UV displacement over the first piece.
    first_uv: Option<[f64; 2]>,
}

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
    /// Goes on from the first piece; `ray` is where the ray starts, and its unit direction.
    pub fn new(field: &'a CurvatureField<'f>, start: &Beginning, ray: [Vec3; 2]) -> Self {
        let front = Front::new(start, |end| foot(&ray, &end.position));
        let (piece, exit) = (&start.piece, &start.piece.exit);
        let mut trail = SPARE.take();
        trail.clear();
        let t = foot(&ray, &exit.position);
        trail.push(Exit { t, triangle: front.triangle, side: front.side, share: front.share });
        let (from, to) = (piece.from.barycentric, exit.point.barycentric);
        let first_uv = field.corner_uvs(exit.point.triangle).map(|uvs| {
            [0, 1].map(|axis: usize| (0..3).map(|k: usize| (to[k] - from[k]) * uvs[k][axis]).sum::<f64>())
        });
        Self { field, section: start.section, ray, front, trail, first_uv }
    }

    /// Goes on until the foot of the walk on the ray is so far ahead of where it is now, one triangle at least, or comes back. Where there
    /// is no way on, the walk stays on its last triangle.
    pub fn stride(&mut self, distance: f64) -> Result<(), Stop> {
        let (field, ray, section) = (self.field, self.ray, self.section);
        let mut front = self.front;
        let mut at = self.last().t;
        let end = at + distance;
        let way = loop {
            if let Err(stop) = front.cross(field, &section, |_, p| foot(&ray, p)) {
                break Err(stop);
            }
            let [from, to] = front.ends.map(|end| end.known);
            let t = from + front.share * (to - from);
            let ends_here = t >= end || t <= at;
            at = t;
            self.trail.push(Exit { t, triangle: front.triangle, side: front.side, share: front.share });
            if ends_here {
                break Ok(());
            }
        };
        self.front = front;
        way
    }

    /// Goes back to where a stride would have ended that began after so many triangles and was only so long.
    pub fn shorten(&mut self, began: usize, distance: f64) {
        let end = self.trail[began - 1].t + distance;
        let ends_at = |k: &usize| self.trail[*k].t >= end || self.trail[*k].t <= self.trail[*k - 1].t;
        let Some(last) = (began..self.trail.len() - 1).find(ends_at) else { return };
        self.trail.truncate(last + 1);
        let Exit { triangle, side, share, .. } = self.trail[last];
        let corners = [side as usize, (side as usize + 1) % 3];
        let (vertices, positions) = (self.field.surface().triangles(), self.field.surface().positions());
        let ends = corners.map(|k| {
            let vertex = vertices[triangle as usize][k];
            let p = &positions[vertex as usize];
            FrontEnd { vertex, height: self.section.height(*p), known: foot(&self.ray, p) }
        });
        let crossings = self.crossings();
        self.front = Front { triangle, side, ends, share, crossings, ..self.front };
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
        let Front { ends, share, .. } = self.front;
        let [p, q] = ends.map(|end| self.field.surface().positions()[end.vertex as usize]);
        let end = |k: usize, position, weight| {
            let FrontEnd { vertex, height, .. } = ends[k];
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

/// Distance along the ray of a point's foot on it.
fn foot([origin, direction]: &[Vec3; 2], p: &Vec3) -> f64 {
    direction.dot(&(p - origin))
}

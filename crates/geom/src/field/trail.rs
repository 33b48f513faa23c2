//! [`Trail`]: the crossings of a section with the sides of triangles, found as far as somebody goes.

use std::cell::Cell;

use nalgebra::{Matrix2, Vector2};

use super::front::Front;
use super::section::{Beginning, Section, SideEnd, Stop};
use super::surface_field::CurvatureField;
use crate::Vec3;

/// Where a triangle was left.
#[derive(Debug, Clone, Copy)]
pub(super) struct Crossed {
    pub position: Vec3,
    triangle: u32,
    side: u32,
    /// From the side's first corner to its second.
    share: f64,
}

/// The way along a section, which several rays in its plane may follow.
pub(super) struct Trail<'a, 'f> {
    field: &'a CurvatureField<'f>,
    section: Section,
    /// Knows where its ends are.
    front: Front<Vec3>,
    crossed: Vec<Crossed>,
    /// Why it does not go on.
    end: Option<Stop>,
    /// UV displacement over the first piece.
    first_uv: Option<[f64; 2]>,
}

thread_local! {
    /// Memory of the last trail, for the next.
    static SPARE: Cell<Vec<Crossed>> = const { Cell::new(Vec::new()) };
}

impl Drop for Trail<'_, '_> {
    fn drop(&mut self) {
        SPARE.set(std::mem::take(&mut self.crossed));
    }
}

impl<'a, 'f> Trail<'a, 'f> {
    /// Knows the end of the first piece.
    pub fn new(field: &'a CurvatureField<'f>, start: &Beginning) -> Self {
        let front = Front::new(start, |end| end.position);
        let (piece, exit) = (&start.piece, &start.piece.exit);
        let mut crossed = SPARE.take();
        crossed.clear();
        let Front { triangle, side, share, .. } = front;
        crossed.push(Crossed { position: exit.position, triangle, side, share });
        let (from, to) = (piece.from.barycentric, exit.point.barycentric);
        let first_uv = field.corner_uvs(exit.point.triangle).map(|uvs| {
            [0, 1].map(|axis: usize| (0..3).map(|k: usize| (to[k] - from[k]) * uvs[k][axis]).sum::<f64>())
        });
        Self { field, section: start.section, front, crossed, end: None, first_uv }
    }

    pub fn field(&self) -> &'a CurvatureField<'f> {
        self.field
    }

    /// Crossings that are known; at least one.
    pub fn known(&self) -> &[Crossed] {
        &self.crossed
    }

    /// Goes on from the last known crossing until `is_far_enough`, or as far as there is a way.
    #[inline(always)]
    pub fn extend(&mut self, mut is_far_enough: impl FnMut(&Vec3) -> bool) -> Result<(), Stop> {
        if let Some(stop) = self.end {
            return Err(stop);
        }
        let (field, section) = (self.field, self.section);
        let mut front = self.front;
        let way = loop {
            if let Err(stop) = front.cross(field, &section, |_, p| *p) {
                break Err(stop);
            }
            let Front { triangle, side, share, ends: [from, to], .. } = front;
            let position = from.known + (to.known - from.known) * share;
            self.crossed.push(Crossed { position, triangle, side, share });
            if is_far_enough(&position) {
                break Ok(());
            }
        };
        self.front = front;
        self.end = way.err();
        way
    }

    /// The ends of a crossed side.
    pub fn ends(&self, k: usize) -> [SideEnd; 2] {
        let Crossed { triangle, side, share, .. } = self.crossed[k];
        let vertices = self.field.surface().triangles()[triangle as usize];
        let end = |corner: u32, weight: f64| {
            let vertex = vertices[corner as usize % 3];
            SideEnd { weight, ..self.section.side_end(self.field, vertex) }
        };
        [end(side, 1.0 - share), end(side + 1, share)]
    }

    /// UV displacement over the first piece; `None` without UV.
    pub fn first_uv(&self) -> Option<[f64; 2]> {
        self.first_uv
    }

    /// Turns UV displacements of the chart beyond a crossed side, and mirrors them where it is mirrored, so that the side's own are the
    /// same in both charts but for their length. The identity for a side without extent in UV.
    pub fn turn_over(&self, k: usize) -> Option<Matrix2<f64>> {
        let (entered, [from, to]) = self.beyond(k)?;
        let left = self.crossed[k].triangle as usize;
        let [a, b] = self.side_uv(k)?;
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

    pub fn jumps(&self, k: usize) -> bool {
        let Crossed { triangle, side, .. } = self.crossed[k];
        self.field.uv_jumps(triangle as usize, side as usize)
    }

    /// UV of the ends of a crossed side, by the triangle that is left.
    fn side_uv(&self, k: usize) -> Option<[Vector2<f64>; 2]> {
        let Crossed { triangle, side, .. } = self.crossed[k];
        let (uvs, side) = (self.field.corner_uvs(triangle as usize)?, side as usize);
        Some([uvs[side].into(), uvs[(side + 1) % 3].into()])
    }

    /// The triangle beyond a crossed side, and by its corners the UV of the side's ends, in the same order as [`Self::side_uv`].
    fn beyond(&self, k: usize) -> Option<(usize, [Vector2<f64>; 2])> {
        let Crossed { triangle, side, .. } = self.crossed[k];
        let (left, side) = (triangle as usize, side as usize);
        let (entered, e) = self.field.topology().across(left, side)?;
        let triangles = self.field.surface().triangles();
        let uvs = self.field.corner_uvs(entered)?;
        let (a, b) = (uvs[e].into(), uvs[(e + 1) % 3].into());
        let is_same_way = triangles[entered][e] == triangles[left][side];
        Some((entered, if is_same_way { [a, b] } else { [b, a] }))
    }

    /// UV where a triangle is left, by its own corners.
    pub fn exit_uv(&self, k: usize) -> Option<Vector2<f64>> {
        let [a, b] = self.side_uv(k)?;
        Some(a + (b - a) * self.crossed[k].share)
    }

    /// UV where a triangle after the first is entered, by its own corners.
    pub fn entry_uv(&self, k: usize) -> Option<Vector2<f64>> {
        let (_, [a, b]) = self.beyond(k - 1)?;
        Some(a + (b - a) * self.crossed[k - 1].share)
    }
}

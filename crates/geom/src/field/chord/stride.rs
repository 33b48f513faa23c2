//! [`StrideWalk`]: a ray's walk along a section, for those who look at the section now and then only.

use std::cell::Cell;

use nalgebra::{Matrix2, Vector2};

use super::way::{SectionPoint, Way};
use crate::Vec3;
use crate::field::section::Stop;

/// A walk on which a ray's feet are known.
pub(super) struct StrideWalk<'t, 'a, 'f> {
    way: &'t mut Way<'a, 'f>,
    ray: [Vec3; 2],
    /// Of the known crossings: how far along the ray their feet are.
    feet: Vec<f64>,
    /// How many of them the walk is past, at least one.
    passed: usize,
}

thread_local! {
    /// Memory of the last walk's feet, for the next.
    static SPARE: Cell<Vec<f64>> = const { Cell::new(Vec::new()) };
}

impl Drop for StrideWalk<'_, '_, '_> {
    fn drop(&mut self) {
        SPARE.set(std::mem::take(&mut self.feet));
    }
}

impl<'t, 'a, 'f> StrideWalk<'t, 'a, 'f> {
    /// Is at the end of the first piece; `ray` is where the ray starts, and its unit direction.
    pub fn new(way: &'t mut Way<'a, 'f>, ray: [Vec3; 2]) -> Self {
        let mut feet = SPARE.take();
        feet.clear();
        feet.extend(way.trail.known().iter().map(|crossed| foot(&ray, &crossed.position)));
        Self { way, ray, feet, passed: 1 }
    }

    /// Goes on until the foot of the walk on the ray is so far ahead of where it is now, one triangle at least, or comes back. Where there
    /// is no way on, the walk stays on its last triangle.
    pub fn stride(&mut self, distance: f64) -> Result<(), Stop> {
        let end = self.feet[self.passed - 1] + distance;
        if let Some(last) = self.first_beyond(end, self.passed..self.feet.len()) {
            self.passed = last + 1;
            return Ok(());
        }
        let Self { way, ray, feet, .. } = self;
        let mut at = feet[feet.len() - 1];
        let goes_on = way.trail.extend(|position| {
            let t = foot(ray, position);
            feet.push(t);
            let is_beyond = t >= end || t <= at;
            at = t;
            is_beyond
        });
        self.passed = self.feet.len();
        goes_on
    }

    /// Goes back to where a stride would have ended that began after so many triangles and was only so long.
    pub fn shorten(&mut self, began: usize, distance: f64) {
        let end = self.feet[began - 1] + distance;
        if let Some(last) = self.first_beyond(end, began..self.passed - 1) {
            self.passed = last + 1;
        }
    }

    /// The first of these crossings where a stride ends: its foot is so far along the ray, or no farther than the one before.
    fn first_beyond(&self, end: f64, mut among: std::ops::Range<usize>) -> Option<usize> {
        among.find(|&k| self.feet[k] >= end || self.feet[k] <= self.feet[k - 1])
    }

    /// Triangles left so far, the first included.
    pub fn passed(&self) -> usize {
        self.passed
    }

    /// Triangles entered after the first.
    #[allow(clippy::cast_possible_truncation, reason = "at most MAX_CROSSINGS")]
    pub fn crossings(&self) -> u32 {
        self.passed as u32 - 1
    }

    /// Where the walk is, on the lifted section.
    pub fn point(&mut self) -> SectionPoint {
        self.way.point(self.passed - 1)
    }

    /// UV displacement over the first piece; `None` without UV.
    pub fn first_uv(&self) -> Option<[f64; 2]> {
        self.way.trail.first_uv()
    }

    /// UV displacement up to the first point of the walk whose foot on the ray is at distance `t`, in the axes of the chart where the
    /// walk starts; `None` without UV.
    ///
    /// Triangle by triangle with the triangle's own UV, so that seams do not matter: UV that go on over a side cancel there, and those of a
    /// chart that lies otherwise are turned.
    pub fn uv_at(&self, t: f64) -> Option<[f64; 2]> {
        let trail = &self.way.trail;
        let first_uv = trail.first_uv()?;
        let next = self.feet[..self.passed].iter().position(|foot| *foot >= t).unwrap_or(self.passed - 1);
        let share = |from: f64| {
            let share = ((t - from) / (self.feet[next] - from)).clamp(0.0, 1.0);
            if share.is_nan() { 1.0 } else { share }
        };
        let Some(before) = next.checked_sub(1) else { return Some(first_uv.map(|d| d * share(0.0))) };
        let mut sum = Vector2::from(first_uv);
        let mut axes = Matrix2::identity();
        // Since where the UV go on without a jump.
        let mut since = trail.exit_uv(0)?;
        for k in 1..next {
            if trail.jumps(k - 1) {
                sum += axes * (trail.exit_uv(k - 1)? - since);
                axes *= trail.turn_over(k - 1)?;
                since = trail.entry_uv(k)?;
            }
        }
        sum += axes * (trail.exit_uv(before)? - since);
        if trail.jumps(before) {
            axes *= trail.turn_over(before)?;
        }
        sum += axes * (trail.exit_uv(next)? - trail.entry_uv(next)?) * share(self.feet[before]);
        Some(sum.into())
    }
}

/// Distance along the ray of a point's foot on it.
fn foot([origin, direction]: &[Vec3; 2], p: &Vec3) -> f64 {
    direction.dot(&(p - origin))
}

//! [`Query`]: what is known of a ray and its section so far, and what a look at the section makes of it.

use super::curve::{Curve, Integrated, Planar, length};
use super::stride::StrideWalk;
use super::way::{SectionPoint, Way};
use super::{Chord, Reach};
use crate::Vec3;
use crate::field::section::Stop;
use crate::field::start::{Start, StartSection};

/// Whether a look at the section may be turned down for what it may have missed.
#[derive(Debug, Clone, Copy, PartialEq, Eq)]
pub(super) enum Rejects {
    No,
    IfUneven,
}

/// What a look at the section says.
pub(super) enum Look {
    GoOn,
    /// The section on the way there is not the curve that its ends suggest.
    TooFar,
    Ended(End),
}

/// How the walk got to a point that was looked at.
#[derive(Debug, Clone, Copy, Default)]
struct Passed {
    t: f64,
    arc: f64,
}

/// Where and why the walk ended.
#[derive(Debug, Clone, Copy)]
pub(super) struct End {
    stop: Stop,
    /// On the first piece the curvature is known without the end point, whose quotient would be 0 / 0 for short chords.
    kappa: Option<f64>,
    at: Passed,
    above: f64,
}

pub(super) struct Query {
    origin: Vec3,
    /// Unit vectors along the ray and across it, away from the material.
    ray: Vec3,
    across: Vec3,
    cosine: f64,
    sine: f64,
    reach: Reach,
    start_kappa: f64,
    /// The first triangle's longest side.
    side: f64,
    integrated: Integrated,
    /// The end of the last piece on the lifted section, without the blend.
    lifted: [f64; 2],
    last: Planar,
    last_passed: Passed,
    /// Looks at the section, the first included.
    looks: u32,
}

impl Query {
    pub fn new(way: &Way<'_, '_>, start: &Start, at: &StartSection, reach: Reach) -> Self {
        let Way { tangent, up, origin, side, .. } = *way;
        let (cosine, sine) = (start.cosine, (1.0 - start.cosine * start.cosine).max(0.0).sqrt());
        let (ray, across) = (tangent * sine - up * cosine, tangent * cosine + up * sine);
        let n = start.normal;
        Self {
            origin,
            ray,
            across,
            cosine,
            sine,
            reach,
            start_kappa: at.kappa,
            side,
            integrated: Integrated::default(),
            lifted: [0.0; 2],
            last: Planar { t: 0.0, above: 0.0, normal: [n.dot(&ray), n.dot(&across)], kappa: at.kappa },
            last_passed: Passed::default(),
            looks: 0,
        }
    }

    /// Where the ray starts, and its unit direction.
    pub fn ray(&self) -> [Vec3; 2] {
        [self.origin, self.ray]
    }

    /// The arc so far, a triangle at least, as the ray passes it.
    pub fn least_stride(&self) -> f64 {
        self.sine * self.last_passed.arc.max(self.side)
    }

    /// Goes on to the end of a piece.
    pub fn look(&mut self, point: &SectionPoint, rejects: Rejects) -> Look {
        let is_first = self.looks == 0;
        let (from, mut to) = (self.last, self.planar(point));
        let before = self.last_passed;
        let lifted = [to.t, to.above];
        let span = length(lifted[0] - self.lifted[0], lifted[1] - self.lifted[1]);
        let turn = 0.5 * (from.kappa + to.kappa) * span;
        // From the chord to its arc.
        let arc = span * (1.0 + turn * turn / 24.0);
        let share = self.lifted_share(before.arc + arc);
        let mut integrated = self.integrated;
        if share < 1.0 {
            integrated.add(span, from.kappa, to.kappa);
            [to.t, to.above] = self.blend(&integrated, to, share);
        }
        let curve = Curve { from, to, span };
        if rejects == Rejects::IfUneven && self.is_uneven(&curve, turn) {
            return Look::TooFar;
        }
        (self.lifted, self.integrated, self.last) = (lifted, integrated, to);
        let after = Passed { t: to.t, arc: before.arc + arc };
        self.last_passed = after;
        self.looks += 1;
        let between = |share: f64, stop| {
            let [t, above] = curve.at(share);
            let at = Passed { t, arc: before.arc + share * arc };
            // The end of an arc of linearly changing curvature lies as if it were all that at a third of the way.
            let kappa = is_first.then_some(from.kappa + (to.kappa - from.kappa) * share / 3.0);
            Look::Ended(End { stop, kappa, at, above })
        };
        let exit = if is_first { self.first_exit(&curve) } else { curve.exit() };
        let stop = match self.reach {
            Reach::Arc(length) if after.arc >= length => {
                let share = if arc > 0.0 { ((length - before.arc) / arc).clamp(0.0, 1.0) } else { 0.0 };
                Some((share, Stop::Length))
            }
            Reach::Depth(depth, most) => self.below(&curve, depth, most),
            Reach::Arc(_) => None,
        };
        match (exit, stop) {
            (Some(exit), Some((share, stop))) if share < exit => between(share, stop),
            (Some(exit), _) => between(exit, Stop::Exit),
            (None, Some((share, stop))) => between(share, stop),
            (None, None) => Look::GoOn,
        }
    }

    /// Whether something may have been missed on a piece that turns by `turn` if its curvature changes evenly: its ends' normals differ
    /// by another angle, or it may come to the ray or below the material in between.
    fn is_uneven(&self, curve: &Curve, turn: f64) -> bool {
        /// Largest turn, radians: parabolas are taken for arcs.
        const MOST: f64 = 0.5;
        /// Of the error in height that the angle stands for, about a twelfth of angle times length, as a share of the height of the ray's
        /// triangle: it goes into the curvature with the same share.
        const TOLERANCE: f64 = 0.01;
        let Curve { from, to, span } = curve;
        let turned = to.normal[0] * from.normal[1] - to.normal[1] * from.normal[0];
        let off = (turned - turn * (1.0 - turn * turn / 6.0)).abs();
        let middle = curve.at(0.5)[1];
        let dips = middle < 0.0 && to.above > 0.0;
        let dives = match self.reach {
            Reach::Depth(depth, _) => middle > to.above && middle > 0.9 * depth * to.normal[1],
            Reach::Arc(_) => false,
        };
        turn.abs() > MOST || off * span > TOLERANCE * self.cosine * to.t || dips || dives
    }

    /// How much of the lifted curve counts at this arc, by the size of a triangle; it only grows with the arc.
    fn lifted_share(&self, arc: f64) -> f64 {
        if arc >= 3.0 * self.side {
            return 1.0;
        }
        let share = (0.5 * (arc / self.side - 1.0)).clamp(0.0, 1.0);
        share * share * (3.0 - 2.0 * share)
    }

    /// Between the integrated and the lifted curve.
    fn blend(&self, integrated: &Integrated, lifted: Planar, share: f64) -> [f64; 2] {
        let Integrated { x, z, .. } = *integrated;
        let smooth = [self.sine * x - self.cosine * z, self.cosine * x + self.sine * z];
        let mix = |a: f64, b: f64| if share == 0.0 { a } else { a + share * (b - a) };
        [mix(smooth[0], lifted.t), mix(smooth[1], lifted.above)]
    }

    /// Share of the first piece at which the ray comes out: on the circle that the section has there, because the height
    /// above the ray is a difference of two small numbers.
    fn first_exit(&self, curve: &Curve) -> Option<f64> {
        let kappa = curve.from.kappa + (curve.to.kappa - curve.from.kappa) / 3.0;
        let arc = 2.0 * self.cosine.asin() / kappa;
        if kappa > 0.0 && arc <= curve.span {
            return Some(if curve.span > 0.0 { arc / curve.span } else { 0.0 });
        }
        (curve.to.above < 0.0 && kappa > 0.0).then_some(1.0)
    }

    /// Share of a piece at which the ray is below the material, measured along the surface normal, or beyond all reach.
    fn below(&self, curve: &Curve, depth: f64, most: f64) -> Option<(f64, Stop)> {
        /// Where the surface turns its side to the ray, the foot of the normal on the ray runs away. A steep ray is followed a
        /// fifth of the depth too far for it.
        const LEAST_FACING: f64 = 0.2;
        let facing = |p: &Planar| p.normal[1].max(LEAST_FACING);
        if curve.to.above >= depth * facing(&curve.to) {
            let depth_at = |p: &Planar| p.above / facing(p);
            let (from, to) = (depth_at(&curve.from), depth_at(&curve.to));
            let share = if to > from { ((depth - from) / (to - from)).clamp(0.0, 1.0) } else { 1.0 };
            // Once more from there, as the section is bent.
            let normal = curve.from.normal[1] + share * (curve.to.normal[1] - curve.from.normal[1]);
            let off = depth - curve.at(share)[1] / normal.max(LEAST_FACING);
            let share = if to > from { share + off / (to - from) } else { share };
            return Some((share.clamp(0.0, 1.0), Stop::Below));
        }
        (curve.to.t >= most).then_some((1.0, Stop::Length))
    }

    /// In the frame of the ray.
    fn planar(&self, point: &SectionPoint) -> Planar {
        let (p, unit) = (point.position - self.origin, &point.normal);
        Planar {
            t: self.ray.dot(&p),
            above: self.across.dot(&p),
            normal: [self.ray.dot(unit), self.across.dot(unit)],
            kappa: point.kappa.unwrap_or(self.last.kappa),
        }
    }

    /// The end of the last piece, with the reason why there is none after it.
    pub fn end_here(&self, stop: Stop) -> End {
        let at = self.last_passed;
        let first = self.start_kappa + (self.last.kappa - self.start_kappa) / 3.0;
        End { stop, kappa: (self.looks == 1).then_some(first), at, above: self.last.above }
    }

    pub fn finish(&self, end: End, walk: &StrideWalk<'_, '_, '_>) -> Chord {
        let (c, s) = (self.cosine, self.sine);
        let t = end.at.t;
        let is_exit = end.stop == Stop::Exit;
        // In the frame of tangent and normal the end is at (s t + c above, s above - c t).
        let (x, z) = (s * t + c * end.above, s * end.above - c * t);
        let squared = x * x + z * z;
        let through_end = if is_exit { 2.0 * c / t } else { -2.0 * z / squared };
        let kappa = end.kappa.unwrap_or(through_end);
        let kappa = if kappa.is_finite() { kappa } else { self.last.kappa };
        let t_exit = is_exit.then(|| if end.kappa.is_some() && kappa > 0.0 { 2.0 * c / kappa } else { t });
        let (uv, arc) = match t_exit {
            // The arc over half of the chord: its angle is the entry's elevation.
            Some(t) if end.kappa.is_none() => {
                (walk.uv_at(0.5 * t), 0.5 * t * if c > 0.0 { c.asin() / c } else { 1.0 })
            }
            // Within one triangle the rate is the same all the way.
            Some(_) => (walk.first_uv(), self.last_passed.arc),
            None => (walk.uv_at(t), arc_over(x, z)),
        };
        let uv_rate = uv.and_then(|uv| {
            let rate = uv.map(|d| d / arc);
            rate.iter().all(|d| d.is_finite()).then_some(rate)
        });
        Chord { kappa, t_exit, uv_rate, length: end.at.arc, crossings: walk.crossings(), stop: end.stop }
    }
}

/// Arc length from the origin to `(x, z)` on the circle that touches the x axis there.
fn arc_over(x: f64, z: f64) -> f64 {
    let (chord, angle) = (x.hypot(z), (-z).atan2(x));
    if angle == 0.0 { chord } else { chord * angle / angle.sin() }
}

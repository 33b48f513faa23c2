//! [`Query`]: what is known of a ray and its section so far, and what a look at the section makes of it.

use super::curve::{Curve, Integrated, Planar, length};
use super::lift::{Patch, lift_on_side};
use super::{Chord, Reach};
use crate::Vec3;
use crate::field::section::{Piece, SideEnd, Stop};
use crate::field::start::{Start, StartSection};
use crate::field::stride::StrideWalk;
use crate::field::surface_field::CurvatureField;

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

pub(super) struct Query<'a, 'f> {
    field: &'a CurvatureField<'f>,
    plane_normal: Vec3,
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

impl<'a, 'f> Query<'a, 'f> {
    pub fn new(
        field: &'a CurvatureField<'f>,
        start: &Start,
        at: &StartSection,
        piece: &Piece,
        reach: Reach,
    ) -> Self {
        let n = start.normal;
        let patch = Patch::new(field, piece.from.triangle);
        let tangent = patch.lifted_tangent(n, piece).unwrap_or(at.forward);
        // The plane normal is `n x forward`, so crossing it with the tangent gives the outward side.
        let up = tangent.cross(&at.plane.normal);
        let (cosine, sine) = (start.cosine, (1.0 - start.cosine * start.cosine).max(0.0).sqrt());
        let (ray, across) = (tangent * sine - up * cosine, tangent * cosine + up * sine);
        Self {
            field,
            plane_normal: at.plane.normal,
            origin: at.plane.origin + n * patch.lift(piece.from.barycentric),
            ray,
            across,
            cosine,
            sine,
            reach,
            start_kappa: at.kappa,
            side: patch.longest_side,
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
    pub fn look(&mut self, position: &Vec3, ends: &[SideEnd; 2], rejects: Rejects) -> Look {
        let is_first = self.looks == 0;
        let (from, mut to) = (self.last, self.planar(position, ends));
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

    /// Where the piece leaves its triangle.
    fn planar(&self, position: &Vec3, ends: &[SideEnd; 2]) -> Planar {
        let (mut sum, mut kappa, mut weight) = (Vec3::zeros(), 0.0, 0.0);
        for end in ends {
            let bend = self.field.bend(end.vertex);
            if bend.is_known {
                sum += bend.normal() * end.weight;
                kappa += bend.section(&self.plane_normal) * end.weight;
                weight += end.weight;
            }
        }
        let sum = if sum == Vec3::zeros() { self.across } else { sum };
        let in_plane = sum - self.plane_normal * self.plane_normal.dot(&sum);
        let kappa = kappa / (weight * self.field.bend_scale());
        let (whole, inside) = (sum.norm(), in_plane.norm());
        // A section that grazes the surface runs along it: the lift's way to the patch within the plane has no limit there.
        let lift = lift_on_side(self.field, ends);
        let (unit, lift, per_sine) = if inside > LEAST_SINE * whole {
            let inverse = 1.0 / inside;
            let per_sine = whole * inverse;
            (in_plane * inverse, lift * per_sine, per_sine)
        } else {
            let unit = in_plane.try_normalize(0.0).unwrap_or(self.across);
            (unit, lift * (inside / whole) / (LEAST_SINE * LEAST_SINE), 1.0 / LEAST_SINE)
        };
        let p = position + unit * lift - self.origin;
        Planar {
            t: self.ray.dot(&p),
            above: self.across.dot(&p),
            normal: [self.ray.dot(&unit), self.across.dot(&unit)],
            // Meusnier: a section that cuts the surface askew is bent more than the surface.
            kappa: if weight > 0.0 { kappa * per_sine } else { self.last.kappa },
        }
    }

    /// The end of the last piece, with the reason why there is none after it.
    pub fn end_here(&self, stop: Stop) -> End {
        let at = self.last_passed;
        let first = self.start_kappa + (self.last.kappa - self.start_kappa) / 3.0;
        End { stop, kappa: (self.looks == 1).then_some(first), at, above: self.last.above }
    }

    pub fn finish(&self, end: End, walk: &StrideWalk<'_, '_>) -> Chord {
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

/// Sine between section plane and surface below which the lift is not followed further: the root of 1 / 20.
const LEAST_SINE: f64 = 0.223_606_797_749_979;

/// Arc length from the origin to `(x, z)` on the circle that touches the x axis there.
fn arc_over(x: f64, z: f64) -> f64 {
    let (chord, angle) = (x.hypot(z), (-z).atan2(x));
    if angle == 0.0 { chord } else { chord * angle / angle.sin() }
}

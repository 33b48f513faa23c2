//! The chord query: the circle that shares entry angle and exit distance with the ray, and the mean UV rate along it.
//!
//! The curvature along the ray says how the surface bends where the ray enters. What a ray near the silhouette meets depends
//! on how far it travels inside: on its chord. With the entry cosine `c` and the exit at distance `t`, the circle with the
//! same entry angle and the same chord has the curvature `2 c / t`. One walk along the section by the ray's plane finds it.
//!
//! The mesh's triangles lie below the surface that they stand for by up to `kappa h^2 / 8` for edges of length `h`, which would
//! spoil every chord that is not much longer than an edge. So the section is lifted onto the quadratic patch over each
//! triangle: a point with the barycentric weights `b` lies `1/2 sum b_i b_j K_ij` above the triangle, where `K_ij` is the
//! second fundamental form along the edge `ij`, the mean of the two corners'. That is exact where the surface is quadratic,
//! and continuous over edges. Its slope still jumps there, by an angle of second order, which is much for a chord that is
//! shorter than an edge. So up to the length of the first triangle's longest side the section is the curve that has the
//! interpolated curvature at every point, from three times that length on it is the lifted one, and in between a blend: the
//! first has no jumps, and the second does not drift. The ray's elevation is taken against the lifted section's own tangent, so that very short
//! chords have the limit that they must have, the curvature along the section.

mod curve;
mod lift;

use curve::{Curve, Integrated, Planar, length};
use lift::{lift, lift_on_side, lifted_tangent, longest_side};

use super::direction::section_curvature;
use super::section::{Piece, SectionWalk, SideEnd, Stop};
use super::start::{Start, StartSection};
use super::surface_field::CurvatureField;
use super::walk_length::WalkLength;
use crate::Vec3;

/// What a chord query found.
#[derive(Debug, Clone, Copy, PartialEq)]
pub struct Chord {
    /// Curvature of the circle that touches the section where the ray enters and passes through its end, 1/length. The end
    /// is where the ray comes out, or else the last point of the walk.
    pub kappa: f64,
    /// Distance along the ray from entry to exit, world units; `None` if it does not come out within reach.
    pub t_exit: Option<f64>,
    /// Mean UV displacement per world unit of arc, the way the ray travels: up to the foot point below the chord's middle, or
    /// to the end of the walk without an exit. `None` without UVs.
    pub uv_rate: Option<[f64; 2]>,
    /// Arc length walked.
    pub length: f64,
    /// Triangles entered after the first.
    pub crossings: u32,
    /// Why the walk ended: [`Stop::Exit`] where the ray came out.
    pub stop: Stop,
}

/// Where the walk ends if the ray does not come out.
#[derive(Debug, Clone, Copy)]
enum Reach {
    Arc(f64),
    /// Depth of the material, and how far along the ray to look at most.
    Depth(f64, f64),
}

pub(super) fn chord(field: &CurvatureField<'_>, start: &Start, length: WalkLength) -> Chord {
    let stay = Chord {
        kappa: start.along,
        t_exit: None,
        uv_rate: None,
        length: 0.0,
        crossings: 0,
        stop: Stop::NormalIncidence,
    };
    let Some(at) = &start.section else { return stay };
    let Some(mut walk) = SectionWalk::new(field, at.plane, start.point, at.forward) else { return stay };
    let reach = match length {
        WalkLength::Fixed(length) => Reach::Arc(length),
        WalkLength::Shell { depth } | WalkLength::ShellAt { depth, .. } => {
            Reach::Depth(depth, field.diagonal())
        }
    };
    let mut query = Query::new(field, start, at, walk.piece(), reach);
    loop {
        if let Some(end) = query.add(walk.piece(), walk.ends()) {
            return query.finish(end, walk.crossings());
        }
        if let Err(stop) = walk.advance() {
            return query.finish(End { stop, ..query.last_end() }, walk.crossings());
        }
    }
}

/// How the walk got to a point.
#[derive(Debug, Clone, Copy, Default)]
struct Passed {
    t: f64,
    arc: f64,
    uv: [f64; 2],
}

/// Where and why the walk ended.
#[derive(Debug, Clone, Copy)]
struct End {
    stop: Stop,
    /// On the first piece the curvature is known without the end point, whose quotient would be 0 / 0 for short chords.
    kappa: Option<f64>,
    at: Passed,
    above: f64,
}

struct Query<'a, 'f> {
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
    /// The ends of the last crossed side: of the next, one is the same.
    corners: [Corner; 2],
    passed: Vec<Passed>,
}

/// What a crossing takes of an end of its side.
#[derive(Debug, Clone, Copy)]
struct Corner {
    vertex: u32,
    /// Normal of the fitted surface and curvature of the section there; `None` without an estimate.
    estimate: Option<(Vec3, f64)>,
}

impl Corner {
    /// Before the first crossing.
    const NONE: Self = Self { vertex: u32::MAX, estimate: None };

    fn new(field: &CurvatureField<'_>, vertex: u32, plane_normal: &Vec3) -> Self {
        let estimate = field.principal(vertex).map(|p| (p.normal(), section_curvature(p, plane_normal)));
        Self { vertex, estimate }
    }
}

/// Pieces that most walks have at most.
const USUAL_PIECES: usize = 63;

impl<'a, 'f> Query<'a, 'f> {
    fn new(
        field: &'a CurvatureField<'f>,
        start: &Start,
        at: &StartSection,
        piece: &Piece,
        reach: Reach,
    ) -> Self {
        let n = start.normal;
        let tangent = lifted_tangent(field, n, piece).unwrap_or(at.forward);
        // The plane normal is `n x forward`, so crossing it with the tangent gives the outward side.
        let up = tangent.cross(&at.plane.normal);
        let (cosine, sine) = (start.cosine, (1.0 - start.cosine * start.cosine).max(0.0).sqrt());
        let (ray, across) = (tangent * sine - up * cosine, tangent * cosine + up * sine);
        let mut passed = Vec::with_capacity(USUAL_PIECES + 1);
        passed.push(Passed::default());
        Self {
            field,
            plane_normal: at.plane.normal,
            origin: at.plane.origin + n * lift(field, piece.from),
            ray,
            across,
            cosine,
            sine,
            reach,
            start_kappa: at.kappa,
            side: longest_side(field, piece.from.triangle),
            integrated: Integrated::default(),
            lifted: [0.0; 2],
            last: Planar { t: 0.0, above: 0.0, normal: [n.dot(&ray), n.dot(&across)], kappa: at.kappa },
            corners: [Corner::NONE; 2],
            passed,
        }
    }

    /// Goes over a piece; where the walk ends if it ends there.
    fn add(&mut self, piece: &Piece, ends: &[SideEnd; 2]) -> Option<End> {
        let is_first = self.passed.len() == 1;
        let (from, mut to) = (self.last, self.planar(piece, ends));
        let before = *self.passed.last().expect("holds the start");
        let span = length(to.t - self.lifted[0], to.above - self.lifted[1]);
        self.lifted = [to.t, to.above];
        let share = self.lifted_share(before.arc + span);
        if share < 1.0 {
            self.integrated.add(span, from.kappa, to.kappa);
            [to.t, to.above] = self.blend(to, share);
        }
        let uv = uv_step(self.field, piece).unwrap_or_default();
        let after =
            Passed { t: to.t, arc: before.arc + span, uv: [before.uv[0] + uv[0], before.uv[1] + uv[1]] };
        self.last = to;
        self.passed.push(after);
        let curve = Curve { from, to, span };
        let between = |share: f64, stop| {
            let [t, above] = curve.at(share);
            let mix = |a: f64, b: f64| a + share * (b - a);
            let uv = [mix(before.uv[0], after.uv[0]), mix(before.uv[1], after.uv[1])];
            let at = Passed { t, arc: mix(before.arc, after.arc), uv };
            // The end of an arc of linearly changing curvature lies as if it were all that at a third of the way.
            let kappa = is_first.then_some(from.kappa + (to.kappa - from.kappa) * share / 3.0);
            End { stop, kappa, at, above }
        };
        let exit = if is_first { self.first_exit(&curve) } else { curve.exit() };
        let stop = match self.reach {
            Reach::Arc(length) if after.arc >= length => {
                let share = if span > 0.0 { ((length - before.arc) / span).clamp(0.0, 1.0) } else { 0.0 };
                Some((share, Stop::Length))
            }
            Reach::Depth(depth, most) => self.below(&curve, depth, most),
            Reach::Arc(_) => None,
        };
        match (exit, stop) {
            (Some(exit), Some((share, stop))) if share < exit => Some(between(share, stop)),
            (Some(exit), _) => Some(between(exit, Stop::Exit)),
            (None, Some((share, stop))) => Some(between(share, stop)),
            (None, None) => None,
        }
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
    fn blend(&self, lifted: Planar, share: f64) -> [f64; 2] {
        let Integrated { x, z, .. } = self.integrated;
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
            let share = if to > from { (depth - from) / (to - from) } else { 1.0 };
            return Some((share.clamp(0.0, 1.0), Stop::Below));
        }
        (curve.to.t >= most).then_some((1.0, Stop::Length))
    }

    /// Where the piece leaves its triangle.
    fn planar(&mut self, piece: &Piece, ends: &[SideEnd; 2]) -> Planar {
        let known = self.corners;
        self.corners = ends.map(|end| {
            let same = known.into_iter().find(|corner| corner.vertex == end.vertex);
            same.unwrap_or_else(|| Corner::new(self.field, end.vertex, &self.plane_normal))
        });
        let (mut sum, mut kappa, mut weight) = (Vec3::zeros(), 0.0, 0.0);
        for (corner, end) in self.corners.iter().zip(ends) {
            if let Some((normal, curvature)) = corner.estimate {
                sum += normal * end.weight;
                kappa += curvature * end.weight;
                weight += end.weight;
            }
        }
        let sum = if sum == Vec3::zeros() { self.across } else { sum };
        let in_plane = sum - self.plane_normal * self.plane_normal.dot(&sum);
        let kappa = if weight == 1.0 { kappa } else { kappa / weight };
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
        let p = piece.exit.position + unit * lift - self.origin;
        Planar {
            t: self.ray.dot(&p),
            above: self.across.dot(&p),
            normal: [self.ray.dot(&unit), self.across.dot(&unit)],
            // Meusnier: a section that cuts the surface askew is bent more than the surface.
            kappa: if weight > 0.0 { kappa * per_sine } else { self.last.kappa },
        }
    }

    /// The end of the last piece.
    fn last_end(&self) -> End {
        let at = *self.passed.last().expect("holds the start");
        let first = self.start_kappa + (self.last.kappa - self.start_kappa) / 3.0;
        End {
            stop: Stop::Length,
            kappa: (self.passed.len() == 2).then_some(first),
            at,
            above: self.last.above,
        }
    }

    fn finish(&self, end: End, crossings: u32) -> Chord {
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
        let uv_rate = self.field.corner_uvs(0).and_then(|_| {
            let (uv, arc) = match t_exit {
                // The arc over half of the chord: its angle is the entry's elevation.
                Some(t) if end.kappa.is_none() => {
                    (self.foot(0.5 * t), 0.5 * t * if c > 0.0 { c.asin() / c } else { 1.0 })
                }
                // Within one triangle the rate is the same all the way.
                Some(_) => (self.passed[1].uv, self.passed[1].arc),
                None => (end.at.uv, arc_over(x, z)),
            };
            let rate = uv.map(|d| d / arc);
            rate.iter().all(|d| d.is_finite()).then_some(rate)
        });
        Chord { kappa, t_exit, uv_rate, length: end.at.arc, crossings, stop: end.stop }
    }

    /// UV displacement up to the first point of the section whose foot on the ray is at distance `t`.
    fn foot(&self, t: f64) -> [f64; 2] {
        let next = self.passed.iter().position(|p| p.t >= t).unwrap_or(self.passed.len() - 1).max(1);
        let (from, to) = (self.passed[next - 1], self.passed[next]);
        let share = ((t - from.t) / (to.t - from.t)).clamp(0.0, 1.0);
        let share = if share.is_nan() { 1.0 } else { share };
        [0, 1].map(|k| from.uv[k] + share * (to.uv[k] - from.uv[k]))
    }
}

/// Sine between section plane and surface below which the lift is not followed further: the root of 1 / 20.
const LEAST_SINE: f64 = 0.223_606_797_749_979;

/// Arc length from the origin to `(x, z)` on the circle that touches the x axis there.
fn arc_over(x: f64, z: f64) -> f64 {
    let (chord, angle) = (x.hypot(z), (-z).atan2(x));
    if angle == 0.0 { chord } else { chord * angle / angle.sin() }
}

/// UV displacement over a piece, with the UVs that its own triangle has at its corners.
fn uv_step(field: &CurvatureField<'_>, piece: &Piece) -> Option<[f64; 2]> {
    let uvs = field.corner_uvs(piece.from.triangle)?;
    let (from, to) = (piece.from.barycentric, piece.exit.point.barycentric);
    Some([0, 1].map(|axis| (0..3).map(|k| (to[k] - from[k]) * uvs[k][axis]).sum()))
}

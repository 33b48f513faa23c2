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
//!
//! The walk passes every triangle, but the section is looked at only now and then, at steps that grow with the arc ([`PACE`]): between
//! two looks it is taken for a curve of linearly changing curvature. Where its ends contradict that (the normals turn by another angle, or
//! the section may come to the ray or the material's floor in between), the walk goes back and steps shorter, down to one triangle.

mod curve;
mod lift;
mod query;
mod stride;
mod way;

use query::{Look, Query, Rejects};
use stride::StrideWalk;
pub(super) use way::Way;

use super::section::{Beginning, Stop};
use super::start::{Start, StartSection};
use super::surface_field::CurvatureField;
use super::walk_length::WalkLength;

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

/// How far it is from one look at the section to the next, as a share of the arc so far.
///
/// On a torus of 480 by 240 quads and a material as deep as 5 % of its diagonal, 99 % of the curvatures are within 5e-4, 9e-4 and 1.6e-3 of
/// those of looks in every triangle (times the depth) with 0.3, 0.5 and 0.8.
pub(super) const PACE: f64 = 0.6;

/// The chord of a ray. With a `pace` of 0 the section is looked at in every triangle.
pub(super) fn chord(field: &CurvatureField<'_>, start: &Start, length: WalkLength, pace: f64) -> Chord {
    let Some(at) = &start.section else {
        return Chord::still(start.along(field), Stop::NormalIncidence);
    };
    match Beginning::new(field, at.plane, start.point, at.forward) {
        None => Chord::still(start.along(field), Stop::NormalIncidence),
        Some(begun) if begun.is_speck(field) => Chord::still(at.kappa, Stop::Boundary),
        Some(begun) => chord_from(&mut Way::new(field, start, at, &begun), start, at, length, pace),
    }
}

impl Chord {
    /// Without a walk.
    fn still(kappa: f64, stop: Stop) -> Self {
        Self { kappa, t_exit: None, uv_rate: None, length: 0.0, crossings: 0, stop }
    }
}

/// The chord of a ray, on the way that it shares with others of its plane.
pub(super) fn chord_from(
    way: &mut Way<'_, '_>,
    start: &Start,
    at: &StartSection,
    length: WalkLength,
    pace: f64,
) -> Chord {
    let reach = match length {
        WalkLength::Fixed(length) => Reach::Arc(length),
        WalkLength::Shell { depth } | WalkLength::ShellAt { depth, .. } => {
            Reach::Depth(depth, way.trail.field().diagonal())
        }
    };
    let mut query = Query::new(way, start, at, reach);
    let mut walk = StrideWalk::new(way, query.ray());
    // Where the stride began, and how long it was meant to be.
    let (mut began, mut distance) = (walk.passed(), 0.0);
    loop {
        let rejects = if walk.passed() > began + 1 { Rejects::IfUneven } else { Rejects::No };
        match query.look(&walk.point(), rejects) {
            Look::Ended(end) => return query.finish(end, &walk),
            Look::TooFar => {
                distance *= 0.4;
                walk.shorten(began, distance);
            }
            Look::GoOn => {
                began = walk.passed();
                distance = pace * query.least_stride();
                let way = walk.stride(distance);
                if let Err(stop) = way
                    && walk.passed() == began
                {
                    return query.finish(query.end_here(stop), &walk);
                }
            }
        }
    }
}

/// Where the walk ends if the ray does not come out.
#[derive(Debug, Clone, Copy)]
enum Reach {
    Arc(f64),
    /// Depth of the material, and how far along the ray to look at most.
    Depth(f64, f64),
}

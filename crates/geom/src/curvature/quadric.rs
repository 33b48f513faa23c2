//! The quadric fit done right: distance-scaled, weighted, with the exact shape operator and an error estimate.

use super::estimate::{Prepared, Scratch};
use super::moments::{Moments, Points, Solution};
use super::shape_operator::{Frame, curvatures_of_height, principal_of_height};
use super::{Neighbourhood, Principal, Status, VertexCurvature};
use crate::Vec3;

/// A fit has five coefficients; one more neighbour leaves a residual to judge it by.
const LEAST_NEIGHBOURS: usize = 6;

/// Below this share of unexplained column (see [`Moments::solve`]) the neighbours lie on two lines or a conic as
/// far as the fit can tell. Smaller: coefficients carry more than 1e-9 of rounding, magnified geometry errors long
/// before that. Larger: anisotropic but sound neighbourhoods (aspect 30) would be enlarged.
const LEAST_PIVOT: f64 = 1e-7;

/// Steepest slope of a fit against the vertex normal. Beyond it the fitted surface stands on edge: the part of its normal along
/// the vertex's comes near rounding, and which side is outside is lost. Meshes that are anything stay below 1e3.
const STEEPEST: f64 = 1e7;

/// How many times a neighbourhood that does not determine the fit is enlarged. A two-row strip needs one; a long one-
/// triangle-wide ribbon would go on to its end.
const ENLARGEMENTS: u32 = 6;

/// Squared relative distance that divides the inner neighbours from the outer ones: the inner ones are the first of two
/// rings, or the first three of five.
const INNER: f64 = 0.5;

/// Standard errors taken as the bound for noise in the worse of two curvatures. Together with the bias estimate this is on
/// the safe side: on jittered tori, clean and with noise, the stated error held at 99 % of the vertices and more.
const CONFIDENCE: f64 = 2.2;

pub(crate) fn estimate_vertex(
    prepared: &Prepared<'_>,
    vertex: u32,
    neighbourhood: Neighbourhood,
    scratch: &mut Scratch<'_>,
) -> VertexCurvature {
    let normal = prepared.normals[vertex as usize];
    if normal == Vec3::zeros() {
        return VertexCurvature::undetermined(Status::Isolated);
    }
    let frame = Frame::around(normal);
    let mut status = Status::FewNeighbours;
    let mut previous = 0;
    for step in 0..=ENLARGEMENTS {
        let gathered = gather(vertex, neighbourhood.enlarged(step), scratch);
        if gathered == previous {
            break; // The component is exhausted.
        }
        previous = gathered;
        let inner = weigh(prepared, vertex, &frame, scratch);
        if scratch.points.len() < LEAST_NEIGHBOURS {
            continue;
        }
        status = Status::RankDeficient;
        let Some(length) = scratch.points.extent() else { continue };
        if let Some((principal, error)) = fit(&scratch.points, inner, length, &frame) {
            let error = error + prepared.rounding_error(vertex, length);
            return VertexCurvature { principal: Some(principal), error, status: Status::Ok };
        }
    }
    VertexCurvature::undetermined(status)
}

/// Fills the walker's members; how many there are.
fn gather(vertex: u32, neighbourhood: Neighbourhood, scratch: &mut Scratch<'_>) -> usize {
    let walker = &mut scratch.walker;
    match neighbourhood {
        Neighbourhood::Rings(rings) => walker.rings(vertex, rings).len(),
        Neighbourhood::Radius(radius) | Neighbourhood::MeanEdges(radius) => {
            walker.within(vertex, radius).len()
        }
        Neighbourhood::Nearest(count) => walker.within_at_least(vertex, 0.0, count as usize + 1).len(),
    }
}

/// Writes the members as weighted points, the inner ones first; how many of those there are.
///
/// The weight falls with distance as `1 - 0.9 r^2`, so that far neighbours, whose heights deviate most from a quadric,
/// count least. In a ring neighbourhood `r` is the ring over the number of rings: on a stretched mesh that follows the
/// stretch, as the fit itself does, while a weight by length would let the fourth derivatives along the long axis leak
/// into the curvature across it (measured: 4-17 % more error on an ellipsoid). In a radius neighbourhood `r` is the
/// distance over the farthest one. The weight also falls with the angle between normals and is zero for a neighbour that faces
/// away, so that the other side of a thin sheet does not take part.
///
/// The price is noise: a fit that leans on near neighbours averages over fewer, so on noisy data it is worse than an
/// unweighted one on as many rings (by a third to a half where noise dominates). More rings make up for it.
fn weigh(prepared: &Prepared<'_>, vertex: u32, frame: &Frame, scratch: &mut Scratch<'_>) -> usize {
    let Scratch { walker, points, .. } = scratch;
    let origin = prepared.positions[vertex as usize];
    let members = walker.members();
    let offset = |member: u32| prepared.positions[member as usize] - origin;
    let push = |points: &mut Points, member: u32, squared: f64| {
        let facing = frame.n.dot(&prepared.normals[member as usize]);
        if facing > 0.0 {
            points.push(&offset(member), facing * (1.0 - 0.9 * squared));
        }
    };
    points.clear(members.len());
    let mut inner = 0;
    if let Some((&seed_end, ring_ends)) = walker.ring_ends().split_first() {
        let mut start = seed_end;
        for (index, &end) in ring_ends.iter().enumerate() {
            let relative = (index + 1) as f64 / ring_ends.len() as f64;
            members[start..end].iter().for_each(|&member| push(points, member, relative * relative));
            start = end;
            if relative * relative < INNER {
                inner = points.len();
            }
        }
        return inner;
    }
    let others = &members[1..];
    let largest = others.iter().map(|&m| offset(m).amax()).fold(0.0, f64::max);
    let squared = |member: u32| (offset(member) / largest).norm_squared();
    let farthest = others.iter().map(|&m| squared(m)).fold(0.0, f64::max);
    for near in [true, false] {
        for &member in others {
            let relative = squared(member) / farthest;
            if (relative < INNER) == near {
                push(points, member, relative);
            }
        }
        if near {
            inner = points.len();
        }
    }
    inner
}

/// The curvature of all points together and its estimated error, 1/length; `None` if they do not determine it.
fn fit(points: &Points, inner: usize, length: f64, frame: &Frame) -> Option<(Principal, f64)> {
    let near = Moments::accumulate(points, 0..inner, frame, length);
    let all = near.plus(&Moments::accumulate(points, inner..points.len(), frame, length));
    let solution = all.solve(LEAST_PIVOT)?;
    if solution.height.d.hypot(solution.height.e) > STEEPEST {
        return None;
    }
    let principal = principal_of_height(&solution.height, length, frame);
    if !(principal.kappa_max.is_finite() && principal.kappa_min.is_finite()) {
        return None;
    }
    let noise = CONFIDENCE * standard_error(&all, &solution, points.len()) / length;
    let bias = near.solve(LEAST_PIVOT).map_or(0.0, |solution| {
        let (max, min) = curvatures_of_height(&solution.height, length);
        let change = (principal.kappa_max - max).abs().max((principal.kappa_min - min).abs());
        let (reach, near_reach) = (all.reach_squared(), near.reach_squared());
        // Without outer points there is nothing to compare with, as without inner ones.
        if reach > near_reach { change * reach / (reach - near_reach) } else { 0.0 }
    });
    Some((principal, noise.hypot(bias)))
}

/// One standard error of the worse curvature in units of the neighbourhood, from the residuals of the fit, for heights
/// that carry independent noise. The vertex's own noise moves all heights together, since the fit passes through it.
fn standard_error(all: &Moments, solution: &Solution, count: usize) -> f64 {
    let freedom = 1.0 - 5.0 / count as f64;
    let variance = solution.squares_left / (all.weight() * freedom);
    let shift = all.response_to_shift(solution);
    let directions = [[2.0, 0.0, 0.0], [0.0, 0.0, 2.0], [1.0, 1.0, 1.0], [1.0, -1.0, 1.0]];
    let worst = directions
        .iter()
        .map(|direction| {
            let common: f64 = std::iter::zip(direction, shift).map(|(d, s)| d * s).sum();
            solution.variance_along(*direction) + common * common
        })
        .fold(0.0, f64::max);
    (variance * worst).sqrt()
}

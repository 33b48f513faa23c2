//! The quadric fit done right: distance-scaled, weighted, with the exact shape operator and an error estimate.

use super::estimate::{Prepared, Scratch};
use super::moments::{Moments, Points, Solution};
use super::shape_operator::{Frame, curvatures_of_height, principal_of_height};
use super::support::{Attempt, enlarging};
use super::{Neighbourhood, VertexCurvature};

/// A fit has five coefficients; one more neighbour leaves a residual to judge it by.
pub(super) const LEAST_NEIGHBOURS: usize = 6;

/// Below this share of unexplained column (see [`Moments::solve`]) the neighbours lie on two lines or a conic as
/// far as the fit can tell. Smaller: coefficients carry more than 1e-9 of rounding, magnified geometry errors long
/// before that. Larger: anisotropic but sound neighbourhoods (aspect 30) would be enlarged.
pub(super) const LEAST_PIVOT: f64 = 1e-7;

/// Squared relative distance that divides the inner neighbours from the outer ones: the inner ones are the first of two
/// rings, or the first three of five.
pub(super) const INNER: f64 = 0.5;

/// Fewer inner neighbours than coefficients determine nothing. Their last pivot is zero, and rounding that smaller pivots before it
/// have magnified must not say otherwise.
pub(super) const LEAST_INNER: usize = 5;

/// Standard errors taken as the bound for noise in the worse of two curvatures. Together with the bias estimate this is on
/// the safe side: on jittered tori, clean and with noise, the stated error held at 99 % of the vertices and more.
pub(super) const CONFIDENCE: f64 = 2.2;

pub(crate) fn estimate_vertex(
    prepared: &Prepared<'_>,
    vertex: u32,
    neighbourhood: Neighbourhood,
    scratch: &mut Scratch<'_>,
) -> VertexCurvature {
    let frame = Frame::around(prepared.normal(vertex));
    enlarging(prepared, vertex, neighbourhood, |neighbourhood| {
        let gathered = scratch.walker.gather(vertex, neighbourhood).len();
        let inner = weigh(prepared, vertex, &frame, scratch);
        let attempt = if scratch.points.len() < LEAST_NEIGHBOURS {
            Attempt::TooFew
        } else {
            fit(&scratch.points, inner, &frame).unwrap_or(Attempt::Undetermined)
        };
        (gathered, attempt)
    })
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
    let origin = prepared.position(vertex);
    let members = walker.members();
    let offset = |member: u32| prepared.position(member) - origin;
    let push = |points: &mut Points, member: u32, squared: f64| {
        let facing = frame.n.dot(&prepared.normal(member));
        if facing > 0.0 {
            points.push(&offset(member), facing * weight(squared));
        }
    };
    points.clear(members.len());
    let mut inner = 0;
    if let Some((&seed_end, ring_ends)) = walker.ring_ends().split_first() {
        let mut start = seed_end;
        for (index, &end) in ring_ends.iter().enumerate() {
            let (squared, _) = ring_weight(index + 1, ring_ends.len());
            members[start..end].iter().for_each(|&member| push(points, member, squared));
            start = end;
            if squared < INNER {
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

/// Squared relative distance of the members of a ring, and their weight before they face anywhere.
pub(super) fn ring_weight(ring: usize, rings: usize) -> (f64, f64) {
    let relative = ring as f64 / rings as f64;
    (relative * relative, weight(relative * relative))
}

fn weight(squared: f64) -> f64 {
    1.0 - 0.9 * squared
}

/// The curvature of all points together and its estimated error; `None` if they do not determine it.
fn fit(points: &Points, inner: usize, frame: &Frame) -> Option<Attempt> {
    let length = points.extent()?;
    let near = Moments::accumulate(points, 0..inner, frame, length);
    let all = near.plus(&Moments::accumulate(points, inner..points.len(), frame, length));
    let solution = all.solve(LEAST_PIVOT)?;
    let principal = principal_of_height(&solution.height, length, frame);
    if !(principal.kappa_max.is_finite() && principal.kappa_min.is_finite()) {
        return None;
    }
    let noise = CONFIDENCE * standard_error(&all, &solution, points.len()) / length;
    let near_solution = if inner < LEAST_INNER { None } else { near.solve(LEAST_PIVOT) };
    let bias = near_solution.map_or(0.0, |solution| {
        let (max, min) = curvatures_of_height(&solution.height, length);
        let change = (principal.kappa_max - max).abs().max((principal.kappa_min - min).abs());
        let (reach, near_reach) = (all.reach_squared(), near.reach_squared());
        // Without outer points there is nothing to compare with, as without inner ones.
        if reach > near_reach { change * reach / (reach - near_reach) } else { 0.0 }
    });
    Some(Attempt::Fitted { principal, error: noise.hypot(bias), length })
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

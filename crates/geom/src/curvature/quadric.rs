//! The quadric fit done right: distance-scaled, weighted, with the exact shape operator.

use super::estimate::{Prepared, Scratch};
use super::moments::{Coefficients, NormalEquations, Solution};
use super::shape_operator::{Frame, principal_of_height};
use super::{Neighbourhood, Status, VertexCurvature};

/// A fit has five coefficients; one more neighbour leaves a residual to judge it by.
const LEAST_NEIGHBOURS: usize = 6;

/// Below this share of unexplained column (see [`NormalEquations::solve`]) the neighbours lie on two lines or a conic as
/// far as the fit can tell. Smaller: coefficients carry more than 1e-9 of rounding, magnified geometry errors long
/// before that. Larger: anisotropic but sound neighbourhoods (aspect 30) would be enlarged.
const LEAST_PIVOT: f64 = 1e-7;

/// How many times a neighbourhood that does not determine the fit is enlarged. A two-row strip needs one; a long one-
/// triangle-wide ribbon would go on to its end.
const ENLARGEMENTS: u32 = 6;

pub(crate) fn estimate_vertex(
    prepared: &Prepared<'_>,
    vertex: usize,
    neighbourhood: Neighbourhood,
    scratch: &mut Scratch<'_>,
) -> VertexCurvature {
    let normal = prepared.normals[vertex];
    if normal == crate::Vec3::zeros() {
        return VertexCurvature::undetermined(Status::Isolated);
    }
    let frame = Frame::around(normal);
    let mut status = Status::FewNeighbours;
    let mut previous = 0;
    for step in 0..=ENLARGEMENTS {
        let gathered = gather(prepared, vertex, neighbourhood, step, scratch);
        if gathered == previous {
            break; // The component is exhausted.
        }
        previous = gathered;
        let Some(length) = project(prepared, vertex, &frame, scratch) else { continue };
        if scratch.points.len() < LEAST_NEIGHBOURS {
            continue;
        }
        status = Status::RankDeficient;
        if let Some(solution) = NormalEquations::accumulate(&scratch.points).solve(LEAST_PIVOT) {
            let principal = principal_of_height(&solution.coefficients, length, &frame);
            if principal.kappa_max.is_finite() && principal.kappa_min.is_finite() {
                let error = standard_error(&solution, scratch.points.len(), length);
                return VertexCurvature { principal: Some(principal), error, status: Status::Ok };
            }
        }
    }
    VertexCurvature::undetermined(status)
}

/// Fills the walker's members, enlarged by `step`; how many there are.
fn gather(
    prepared: &Prepared<'_>,
    vertex: usize,
    neighbourhood: Neighbourhood,
    step: u32,
    scratch: &mut Scratch<'_>,
) -> usize {
    let seed = crate::mesh::index_u32(vertex);
    let growth = 1.5_f64.powi(i32::try_from(step).expect("few steps"));
    match neighbourhood {
        Neighbourhood::Rings(rings) => scratch.walker.rings(seed, rings.saturating_add(step)).len(),
        Neighbourhood::Radius(radius) => scratch.walker.within(seed, radius * growth).len(),
        Neighbourhood::MeanEdges(edges) => {
            scratch.walker.within(seed, edges * prepared.mean_edge * growth).len()
        }
    }
}

/// Writes the members as points in the frame, in units of the distance to the farthest one, which is returned; `None`
/// when all coincide.
///
/// The weight falls with distance, `1 - r^2 / (4/3)` with `r` in `[0, 1]`, so that far neighbours, whose heights deviate
/// most from a quadric, count least; it also falls with the angle between normals and is zero for a neighbour that faces
/// away, so that the other side of a thin sheet or a sharp crease does not take part.
fn project(prepared: &Prepared<'_>, vertex: usize, frame: &Frame, scratch: &mut Scratch<'_>) -> Option<f64> {
    let origin = prepared.positions[vertex];
    let members = &scratch.walker.members()[1..];
    let offset = |&member: &u32| prepared.positions[member as usize] - origin;
    // Divided by the largest component before squaring: lengths of 1e-170 and 1e170 have finite squares only then.
    let largest = members.iter().map(|m| offset(m).amax()).fold(0.0, f64::max);
    if largest == 0.0 || !largest.is_finite() {
        return None;
    }
    let farthest = members.iter().map(|m| (offset(m) / largest).norm_squared()).fold(0.0, f64::max).sqrt();
    let length = farthest * largest;
    let points = &mut scratch.points;
    points.clear();
    for member in members {
        let local = offset(member) / length;
        let facing = frame.n.dot(&prepared.normals[*member as usize]);
        if facing > 0.0 {
            let weight = facing * (1.0 - 0.75 * local.norm_squared());
            points.push(local.dot(&frame.t), local.dot(&frame.s), local.dot(&frame.n), weight);
        }
    }
    Some(length)
}

/// One standard error of the worse curvature, 1/length, from the residuals of the fit.
///
/// Residuals hold both noise and the surface's own terms of third and higher order, so on clean data the estimate is
/// larger than the true error, which comes from the fourth order only. Slopes of the frame are not taken into account.
fn standard_error(solution: &Solution, count: usize, length: f64) -> f64 {
    let variance = solution.squares_left / (count - 5) as f64;
    let directions = [
        Coefficients::new(2.0, 0.0, 0.0, 0.0, 0.0),
        Coefficients::new(0.0, 0.0, 2.0, 0.0, 0.0),
        Coefficients::new(1.0, 1.0, 1.0, 0.0, 0.0),
        Coefficients::new(1.0, -1.0, 1.0, 0.0, 0.0),
    ];
    let worst = directions.iter().map(|d| solution.variance_along(d)).fold(0.0, f64::max);
    (variance * worst).sqrt() / length
}

//! Polynomial fits of a fixed degree on a fixed neighbourhood.

use super::error_bar::{error_bar, next_guess};
use super::estimate::{Prepared, Scratch};
use super::local_fit::{Guess, LocalFit};
use super::support::{Reach, gather, reference_normal, shorten};
use super::{Neighbourhood, Status, VertexCurvature};
use crate::Vec3;

/// Points of the first, flat fit: two rings of a regular mesh. The neighbourhood then grows by this factor a fit, each
/// bent by the curvature of the one before.
const FIRST_POINTS: usize = 19;
const GROWTH: usize = 2;
/// Degree of those fits.
const BENDING_DEGREE: usize = 2;

/// How many times a neighbourhood that does not determine the fit is enlarged.
const ENLARGEMENTS: u32 = 6;

pub(super) fn estimate_vertex(
    prepared: &Prepared<'_>,
    vertex: u32,
    degree: usize,
    neighbourhood: Neighbourhood,
    scratch: &mut Scratch<'_>,
) -> VertexCurvature {
    if prepared.normals[vertex as usize] == Vec3::zeros() {
        return VertexCurvature::undetermined(Status::Isolated);
    }
    let mut previous = 0;
    let mut status = Status::FewNeighbours;
    for step in 0..=ENLARGEMENTS {
        let whole = gather(prepared, vertex, neighbourhood.enlarged(step), scratch);
        if whole.count == previous {
            break; // The component is exhausted.
        }
        previous = whole.count;
        if whole.count <= LocalFit::unknowns(degree) {
            continue;
        }
        status = Status::RankDeficient;
        if let Some(estimate) = fit(scratch, whole, degree) {
            let rounding = prepared.rounding_error(vertex, estimate.1);
            let error = estimate.0.error + rounding;
            return VertexCurvature { error, ..estimate.0 };
        }
    }
    VertexCurvature::undetermined(status)
}

/// Fits ever larger parts of the cloud; the last fit's curvature with its error, and its length.
fn fit(scratch: &Scratch<'_>, whole: Reach, degree: usize) -> Option<(VertexCurvature, f64)> {
    let cloud = &scratch.cloud;
    let mut guess = Guess::from_normal(reference_normal(cloud, whole.count.min(7))?);
    let mut points = FIRST_POINTS;
    loop {
        let reach = shorten(scratch, whole, points);
        // The first fit is flat.
        let near = LocalFit::new(cloud, reach.count, reach.farthest, BENDING_DEGREE, &guess);
        guess = near.and_then(|fit| next_guess(&fit, BENDING_DEGREE)).unwrap_or(guess);
        points *= GROWTH;
        if points >= whole.count {
            break;
        }
    }
    // One degree more where there are enough points: the change tells the error.
    let check = if whole.count > LocalFit::unknowns(degree + 1) { (degree + 1).min(4) } else { degree };
    let fit = LocalFit::new(cloud, whole.count, whole.farthest, check, &guess)?;
    let principal = fit.principal(degree).filter(|_| fit.faces(degree, &cloud.normal(0)))?;
    let error = error_bar(&fit, degree)?.stated();
    Some((VertexCurvature { principal: Some(principal), error, status: Status::Ok }, fit.length))
}

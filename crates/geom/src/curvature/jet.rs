//! Polynomial fits of a fixed degree on a fixed neighbourhood.

use super::error_bar::{error_bar, next_guess};
use super::estimate::{Prepared, Scratch};
use super::local_fit::{Guess, LocalFit};
use super::support::{Attempt, NEAREST, Reach, enlarging_cloud, reference_normal, shorten};
use super::{Neighbourhood, VertexCurvature};

/// Points of the first, flat fit: two rings of a regular mesh. The neighbourhood then grows by this factor a fit, each
/// bent by the curvature of the one before.
const FIRST_POINTS: usize = 19;
const GROWTH: usize = 2;
/// Degree of those fits.
const BENDING_DEGREE: usize = 2;

pub(super) fn estimate_vertex(
    prepared: &Prepared<'_>,
    vertex: u32,
    degree: usize,
    neighbourhood: Neighbourhood,
    scratch: &mut Scratch<'_>,
) -> VertexCurvature {
    let least = LocalFit::unknowns(degree) + 1;
    enlarging_cloud(prepared, vertex, neighbourhood, least, scratch, |scratch, whole| {
        fit(scratch, whole, degree)
    })
}

/// Fits ever larger parts of the cloud; what the last fit says.
fn fit(scratch: &Scratch<'_>, whole: Reach, degree: usize) -> Option<Attempt> {
    let cloud = &scratch.cloud;
    let mut guess = Guess::from_normal(reference_normal(cloud, whole.count.min(NEAREST)));
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
    // One degree more where there is one, and enough points: the change tells the error.
    let higher = (degree + 1).min(4);
    let highest = if whole.count > LocalFit::unknowns(higher) { higher } else { degree };
    let fit = LocalFit::new(cloud, whole.count, whole.farthest, highest, &guess)?;
    let principal = fit.principal(degree)?;
    let error = error_bar(&fit, degree)?.stated();
    Some(Attempt::Fitted { principal, error, length: fit.length })
}

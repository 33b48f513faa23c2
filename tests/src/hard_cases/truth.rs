//! What is known about a vertex of a hard case, and whether an estimate meets it.

use osculate_geom::curvature::VertexCurvature;

use super::Outcome;

/// What is known about a vertex. Curvatures are `[kappa_max, kappa_min]`, 1/length; tolerances are absolute.
#[derive(Debug, Clone, Copy, PartialEq)]
pub enum Truth {
    /// Both curvatures lie within the tolerance.
    Known {
        /// The exact curvatures.
        kappa: [f64; 2],
        /// Largest deviation of either.
        tolerance: f64,
    },
    /// Right or honest: within the tolerance, or no estimate, or a stated error of at least half the true one.
    Honest {
        /// The exact curvatures.
        kappa: [f64; 2],
        /// Largest deviation of an estimate whose stated error is smaller.
        tolerance: f64,
    },
    /// The data determines no curvature: there must be no estimate.
    Undetermined,
    /// Nothing but the invariants.
    Free,
}

impl Truth {
    /// Whether an estimate is what it should be.
    #[must_use]
    pub fn is_met_by(&self, estimate: &VertexCurvature) -> bool {
        let off = |[max, min]: [f64; 2]| {
            let found = estimate.principal?;
            Some((found.kappa_max - max).abs().max((found.kappa_min - min).abs()))
        };
        match *self {
            Self::Known { kappa, tolerance } => off(kappa).is_some_and(|off| off <= tolerance),
            Self::Honest { kappa, tolerance } => {
                off(kappa).is_none_or(|off| off <= tolerance.max(2.0 * estimate.error))
            }
            Self::Undetermined => estimate.principal.is_none(),
            Self::Free => true,
        }
    }
}

/// How many vertices have a truth and how many of those meet it.
#[must_use]
pub fn verdict(estimates: &[VertexCurvature], truths: &[Truth]) -> (usize, usize) {
    let judged = std::iter::zip(estimates, truths).filter(|(_, truth)| **truth != Truth::Free);
    judged.fold((0, 0), |(all, met), (e, truth)| (all + 1, met + usize::from(truth.is_met_by(e))))
}

/// Checks all truths of an outcome; the message names the first vertex that is off.
pub(super) fn meets(outcome: &Outcome<'_>, truths: &[Truth], share: f64) -> Result<(), String> {
    assert_eq!(truths.len(), outcome.estimates.len(), "one truth per vertex");
    let (all, met) = verdict(&outcome.estimates, truths);
    if met as f64 >= share * all as f64 {
        return Ok(());
    }
    let (vertex, (estimate, truth)) = std::iter::zip(&outcome.estimates, truths)
        .enumerate()
        .find(|(_, (estimate, truth))| !truth.is_met_by(estimate))
        .expect("some truth is not met");
    Err(format!("{met} of {all} vertices are right; vertex {vertex}: expected {truth:?}, found {estimate:?}"))
}

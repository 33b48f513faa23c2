//! How far an estimate is from what it should be.

use serde::Serialize;

use super::Quantiles;
use crate::Vec3;
use crate::curvature::{Status, VertexCurvature};

/// What one vertex should have.
#[derive(Debug, Clone, Copy, PartialEq)]
pub enum Expected {
    /// These curvatures.
    Known {
        /// Larger curvature.
        kappa_max: f64,
        /// Smaller curvature.
        kappa_min: f64,
        /// Direction of the larger one, of any length and sign, where there is one.
        d1: Option<Vec3>,
        /// Condition number of the reference's fit, where recorded.
        condition: Option<f64>,
    },
    /// Nothing to compare with.
    Skip(SkipReason),
}

/// Why a vertex is not compared.
#[derive(Debug, Clone, Copy, PartialEq, Eq, Serialize)]
#[serde(rename_all = "snake_case")]
pub enum SkipReason {
    /// libigl lists the vertex as bad, or returned NaN there.
    BadInReference,
    /// The reference's own fit is too ill-conditioned for its digits to mean anything.
    IllConditioned,
    /// The reference has no such position.
    Unmatched,
    /// Nothing was estimated here, and the reference has all zeros without a direction: its own way to have no answer.
    NoAnswerInEither,
}

/// Largest condition number up to which a reference is held to be right by default.
///
/// The estimator solves normal equations of scaled columns and so do others; the digits that survive are about
/// `1e-16 cond^2` in the worst case, which is 1e-6 here, with typical losses far below.
pub const DEFAULT_CONDITION_LIMIT: f64 = 1e5;

/// How large differences may be.
#[derive(Debug, Clone, Copy, PartialEq, Serialize)]
pub struct Bounds {
    /// Of either curvature, relative to `|kappa| + 1 / (bounding box diagonal)`.
    pub curvature: f64,
    /// Of the direction of `kappa_max`, radians.
    pub angle: f64,
}

/// What is compared, and what passes.
#[derive(Debug, Clone, Copy, PartialEq)]
pub struct CompareOptions {
    /// How large differences may be.
    pub bounds: Bounds,
    /// Diagonal of the mesh's bounding box; its reciprocal is the curvature that counts as nothing.
    pub bbox_diagonal: f64,
    /// Directions are compared where the two expected curvatures differ by more than this share of the scale. 0.01:
    /// nearer to an umbilic the direction is made of rounding errors.
    pub distinct: f64,
    /// Fits of a larger condition number are counted and listed, and do not decide.
    pub condition_limit: f64,
    /// How many of the worst vertices to list.
    pub list: usize,
}

impl CompareOptions {
    /// The usual thresholds with these bounds.
    #[must_use]
    pub fn new(bounds: Bounds, bbox_diagonal: f64) -> Self {
        Self { bounds, bbox_diagonal, distinct: 0.01, condition_limit: DEFAULT_CONDITION_LIMIT, list: 10 }
    }
}

/// The result of a comparison.
#[derive(Debug, Clone, PartialEq, Serialize)]
pub struct Comparison {
    /// Whether every compared vertex is within the bounds, none lacks an estimate that the reference has, none is
    /// unmatched, and at least one was compared.
    pub passed: bool,
    /// The bounds.
    pub bounds: Bounds,
    /// Vertices compared.
    pub compared: usize,
    /// Relative differences of `kappa_max`.
    pub kappa_max: Quantiles,
    /// Relative differences of `kappa_min`.
    pub kappa_min: Quantiles,
    /// Angles between the directions of `kappa_max`, radians, where the curvatures are distinct.
    pub angle: Quantiles,
    /// Vertices over a bound.
    pub over_bound: usize,
    /// Vertices that have an estimate in the reference and none here.
    pub undetermined_here: usize,
    /// Vertices not compared.
    pub skipped: Skipped,
    /// The worst vertices, worst first: those without an estimate, then by their share of the bound.
    pub worst: Vec<WorstVertex>,
    /// For every vertex the larger of its relative curvature differences, for pictures. `None` where not compared.
    #[serde(skip)]
    pub differences: Vec<Option<f64>>,
}

/// Vertices not compared, by reason.
#[derive(Debug, Clone, Copy, PartialEq, Eq, Default, Serialize)]
pub struct Skipped {
    /// See [`SkipReason::BadInReference`].
    pub bad_in_reference: usize,
    /// See [`SkipReason::IllConditioned`].
    pub ill_conditioned: usize,
    /// See [`SkipReason::Unmatched`].
    pub unmatched: usize,
    /// See [`SkipReason::NoAnswerInEither`].
    pub no_answer_in_either: usize,
}

/// A vertex that stands out.
#[derive(Debug, Clone, PartialEq, Serialize)]
pub struct WorstVertex {
    /// Index in the file.
    pub vertex: usize,
    /// Status of the estimate.
    pub status: Status,
    /// What is wrong, in words and numbers.
    pub reason: String,
    /// Larger relative difference of the two curvatures; `None` without an estimate.
    pub curvature_difference: Option<f64>,
    /// Angle between the directions, radians; `None` where not compared.
    pub angle: Option<f64>,
    /// Condition number of the reference's fit, where recorded.
    pub condition: Option<f64>,
}

/// Compares estimates with what they should be, vertex by vertex.
///
/// # Panics
///
/// If both have not the same length.
#[must_use]
pub fn compare(found: &[VertexCurvature], expected: &[Expected], options: &CompareOptions) -> Comparison {
    assert_eq!(found.len(), expected.len(), "one expectation per vertex");
    let mut tally = Tally { differences: vec![None; found.len()], ..Tally::default() };
    for (vertex, (found, expected)) in found.iter().zip(expected).enumerate() {
        tally.add(vertex, found, expected, options);
    }
    tally.finish(found, options)
}

/// One compared vertex.
#[derive(Debug, Clone, Copy)]
struct Difference {
    vertex: usize,
    kappa: [f64; 2],
    found: [f64; 2],
    expected: [f64; 2],
    angle: Option<f64>,
    condition: Option<f64>,
}

impl Difference {
    fn curvature(&self) -> f64 {
        // `f64::max` would drop a NaN.
        if self.kappa[0].total_cmp(&self.kappa[1]).is_ge() { self.kappa[0] } else { self.kappa[1] }
    }

    /// Share of the bound; above 1 is a failure.
    fn severity(&self, bounds: &Bounds) -> f64 {
        let share = |difference: f64, bound: f64| {
            if difference <= bound {
                difference / bound.max(f64::MIN_POSITIVE)
            } else {
                (difference / bound).max(1.0 + f64::EPSILON)
            }
        };
        share(self.curvature(), bounds.curvature)
            .max(self.angle.map_or(0.0, |angle| share(angle, bounds.angle)))
    }

    fn is_within(&self, bounds: &Bounds) -> bool {
        self.kappa.iter().all(|&k| k <= bounds.curvature)
            && self.angle.is_none_or(|angle| angle <= bounds.angle)
    }
}

#[derive(Default)]
struct Tally {
    compared: Vec<Difference>,
    undetermined: Vec<(usize, Option<f64>)>,
    ill_conditioned: Vec<Difference>,
    skipped: Skipped,
    differences: Vec<Option<f64>>,
}

impl Tally {
    fn add(&mut self, vertex: usize, found: &VertexCurvature, expected: &Expected, options: &CompareOptions) {
        let &Expected::Known { kappa_max, kappa_min, d1, condition } = expected else {
            let Expected::Skip(reason) = expected else { return };
            return self.skip(*reason);
        };
        let ill_conditioned = condition.is_some_and(|c| c > options.condition_limit);
        let Some(principal) = &found.principal else {
            if ill_conditioned {
                self.skip(SkipReason::IllConditioned);
            } else if d1.is_none() && kappa_max == 0.0 && kappa_min == 0.0 {
                self.skip(SkipReason::NoAnswerInEither);
            } else {
                self.undetermined.push((vertex, condition));
            }
            return;
        };
        let flat = 1.0 / options.bbox_diagonal;
        let relative = |found: f64, expected: f64| (found - expected).abs() / (expected.abs() + flat);
        let scale = kappa_max.abs().max(kappa_min.abs()) + flat;
        let distinct = (kappa_max - kappa_min).abs() > options.distinct * scale;
        let difference = Difference {
            vertex,
            kappa: [relative(principal.kappa_max, kappa_max), relative(principal.kappa_min, kappa_min)],
            found: [principal.kappa_max, principal.kappa_min],
            expected: [kappa_max, kappa_min],
            angle: d1.filter(|_| distinct).map(|d1| angle_between_lines(&d1, &principal.d1)),
            condition,
        };
        self.differences[vertex] = Some(difference.curvature());
        if ill_conditioned {
            self.skipped.ill_conditioned += 1;
            self.ill_conditioned.push(difference);
        } else {
            self.compared.push(difference);
        }
    }

    fn skip(&mut self, reason: SkipReason) {
        *match reason {
            SkipReason::BadInReference => &mut self.skipped.bad_in_reference,
            SkipReason::IllConditioned => &mut self.skipped.ill_conditioned,
            SkipReason::Unmatched => &mut self.skipped.unmatched,
            SkipReason::NoAnswerInEither => &mut self.skipped.no_answer_in_either,
        } += 1;
    }

    fn finish(mut self, found: &[VertexCurvature], options: &CompareOptions) -> Comparison {
        let bounds = &options.bounds;
        let over_bound = self.compared.iter().filter(|d| !d.is_within(bounds)).count();
        let quantiles = |k: usize| Quantiles::new(self.compared.iter().map(|d| d.kappa[k]).collect());
        let (kappa_max, kappa_min) = (quantiles(0), quantiles(1));
        let angle = Quantiles::new(self.compared.iter().filter_map(|d| d.angle).collect());
        let worst = worst(&mut self, found, options);
        Comparison {
            passed: over_bound == 0
                && self.undetermined.is_empty()
                && self.skipped.unmatched == 0
                && !self.compared.is_empty(),
            bounds: *bounds,
            compared: self.compared.len(),
            kappa_max,
            kappa_min,
            angle,
            over_bound,
            undetermined_here: self.undetermined.len(),
            skipped: self.skipped,
            worst,
            differences: self.differences,
        }
    }
}

fn worst(tally: &mut Tally, found: &[VertexCurvature], options: &CompareOptions) -> Vec<WorstVertex> {
    let bounds = &options.bounds;
    let missing = tally.undetermined.iter().map(|&(vertex, condition)| WorstVertex {
        vertex,
        status: found[vertex].status,
        reason: format!("no estimate here ({}), but one in the reference", found[vertex].status.label()),
        curvature_difference: None,
        angle: None,
        condition,
    });
    let mut list: Vec<_> = missing.take(options.list).collect();
    let by_severity = |a: &Difference, b: &Difference| {
        b.severity(bounds).total_cmp(&a.severity(bounds)).then(a.vertex.cmp(&b.vertex))
    };
    tally.compared.sort_unstable_by(by_severity);
    tally.ill_conditioned.sort_unstable_by(by_severity);
    let ill_conditioned = tally.ill_conditioned.iter().filter(|d| !d.is_within(bounds));
    for difference in tally.compared.iter().chain(ill_conditioned) {
        if list.len() >= options.list {
            break;
        }
        list.push(WorstVertex {
            vertex: difference.vertex,
            status: found[difference.vertex].status,
            reason: describe(difference, options),
            curvature_difference: Some(difference.curvature()),
            angle: difference.angle,
            condition: difference.condition,
        });
    }
    list
}

fn describe(difference: &Difference, options: &CompareOptions) -> String {
    let k = usize::from(difference.kappa[1] > difference.kappa[0]);
    let name = ["kappa_max", "kappa_min"][k];
    let mut text = format!("{name} is {:.9e}, expected {:.9e}", difference.found[k], difference.expected[k]);
    if let Some(angle) = difference.angle.filter(|&angle| angle > options.bounds.angle) {
        text += &format!("; direction off by {angle:.2e} rad");
    }
    if let Some(condition) = difference.condition.filter(|&c| c > options.condition_limit) {
        text += &format!("; the reference's fit has condition number {condition:.1e} and does not count");
    }
    text
}

/// Angle in `[0, pi/2]` between the lines along two non-zero vectors; small angles keep their digits.
fn angle_between_lines(a: &Vec3, b: &Vec3) -> f64 {
    a.cross(b).norm().atan2(a.dot(b).abs())
}

#[cfg(test)]
mod tests {
    use super::*;
    use crate::curvature::Principal;

    fn found(kappa_max: f64, kappa_min: f64, angle: f64) -> VertexCurvature {
        let d1 = Vec3::new(angle.cos(), angle.sin(), 0.0);
        let principal = Principal { kappa_max, kappa_min, d1, d2: Vec3::z().cross(&d1) };
        VertexCurvature { principal: Some(principal), error: 0.0, status: Status::Ok }
    }

    fn known(kappa_max: f64, kappa_min: f64) -> Expected {
        Expected::Known { kappa_max, kappa_min, d1: Some(-Vec3::x()), condition: Some(10.0) }
    }

    fn options(curvature: f64, angle: f64) -> CompareOptions {
        CompareOptions::new(Bounds { curvature, angle }, 1.0)
    }

    #[test]
    fn measures_relative_to_curvature_and_size() {
        let result = compare(&[found(1.1, -0.25, 0.2)], &[known(1.0, 0.0)], &options(0.3, 0.3));
        assert!((result.kappa_max.max - 0.05).abs() < 1e-15, "0.1 of |1| + 1/1: {:?}", result.kappa_max);
        assert!((result.kappa_min.max - 0.25).abs() < 1e-15, "0.25 of 0 + 1/1");
        assert!((result.angle.max - 0.2).abs() < 1e-15, "the sign of a direction means nothing");
        assert!(result.passed);
        assert_eq!(result.differences, [Some(0.25)]);
        assert!(!compare(&[found(1.1, -0.25, 0.2)], &[known(1.0, 0.0)], &options(0.24, 0.3)).passed);
        assert!(!compare(&[found(1.1, -0.25, 0.2)], &[known(1.0, 0.0)], &options(0.3, 0.19)).passed);
    }

    #[test]
    fn umbilics_have_no_direction_to_compare() {
        let result = compare(&[found(1.0, 0.995, 1.5)], &[known(1.0, 0.99)], &options(0.1, 1e-4));
        assert_eq!(result.angle.count, 0);
        assert!(result.passed);
    }

    #[test]
    fn what_is_missing_here_fails_and_what_is_bad_there_does_not() {
        let none = VertexCurvature::undetermined(Status::RankDeficient);
        let bad = Expected::Skip(SkipReason::BadInReference);
        let zeros = Expected::Known { kappa_max: 0.0, kappa_min: 0.0, d1: None, condition: None };
        let fine = [found(1.0, 0.0, 0.0), none, found(5.0, 5.0, 0.0), none];
        let result = compare(&fine, &[known(1.0, 0.0), bad, bad, zeros], &options(1e-9, 1e-9));
        assert!(result.passed && result.compared == 1);
        assert_eq!((result.skipped.bad_in_reference, result.skipped.no_answer_in_either), (2, 1));
        let result = compare(&[found(1.0, 0.0, 0.0), none], &[known(1.0, 0.0); 2], &options(1e-9, 1e-9));
        assert!(!result.passed);
        assert_eq!((result.undetermined_here, result.worst[0].vertex), (1, 1));
        let unmatched = Expected::Skip(SkipReason::Unmatched);
        assert!(!compare(&fine[..2], &[known(1.0, 0.0), unmatched], &options(1e-9, 1e-9)).passed);
        assert!(!compare(&[], &[], &options(1.0, 1.0)).passed, "nothing compared proves nothing");
    }

    #[test]
    fn ill_conditioned_fits_are_listed_and_do_not_decide() {
        let shaky = Expected::Known { kappa_max: 2.0, kappa_min: 0.0, d1: None, condition: Some(1e9) };
        let both = [found(1.0, 0.0, 0.0), found(1.0, 0.0, 0.0)];
        let result = compare(&both, &[known(1.0, 0.0), shaky], &options(1e-9, 1e-9));
        assert!(result.passed);
        assert_eq!(result.skipped.ill_conditioned, 1);
        assert!(result.worst[1].reason.contains("condition number 1.0e9"), "{:?}", result.worst);
    }

    #[test]
    fn nan_never_passes() {
        let result = compare(&[found(f64::NAN, 0.0, 0.0)], &[known(1.0, 0.0)], &options(1e9, 1e9));
        assert!(!result.passed && result.over_bound == 1 && result.kappa_max.max.is_nan());
    }
}

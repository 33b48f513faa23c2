//! The error bars of polynomial fits.
//!
//! Two things make a fit wrong. **Noise** moves its coefficients by a standard error that the residuals and the
//! normal equations tell. **Bias** is what the polynomial cannot follow; it does not show in the residuals of a dense
//! neighbourhood. Where a higher degree was fitted to the same points, the change to it shows the bias of the lower one.
//! For the highest degree there is no such witness; its bias is taken as the change from the degree below, times the rate
//! at which the expansion converges: terms of degree `d + 2` over those of `d` are about the squared ratio of the
//! neighbourhood's radius to the radius of curvature, or, where the surface is flat, as large as the change over the curvature.
//!
//! A bar serves two ends. To choose among fits, bias is taken at its typical size and noise at 1.5 standard errors. To be stated,
//! both are scaled to what the error stays below at 95 % of the vertices. The factors come from random
//! and irregular meshes of seven closed forms at 2,000 to 10,000 vertices, without noise and with noise of 0.1 to 20 % of an edge.

use super::local_fit::{Guess, LocalFit};

/// Standard errors (of the whole second fundamental form) that count as the noise of a fit when fits are compared. More keep outliers
/// down, fewer the median: 1.5 is where both stay beside the best of other programs.
const STANDARD_ERRORS: f64 = 1.5;
/// Convergence rate over the squared ratio of radii, and its bound. Smaller: degree 4 is kept where the neighbourhood is too
/// large for it. Larger: degree 3 is taken where 4 is better.
const OF_RATE: f64 = 0.35;
const LARGEST_RATE: f64 = 0.25;
/// Bias over the error of the curvature that heights were bent by, times the fourth power of the ratio of radii.
const OF_BENDING: f64 = 0.2;
/// What the bias of the highest degree is stated as, over its typical size.
const STATED_UNSEEN: f64 = 4.3;
/// What the bias of a lower degree is stated as, over the change to the highest.
const STATED_SEEN: f64 = 1.85;
/// What noise is stated as, over what fits are compared by: the comparison rather takes bias than noise, since outliers come of
/// noise.
const STATED_NOISE: f64 = 0.73;

/// The two parts of an error bar, 1/length.
#[derive(Debug, Clone, Copy, PartialEq)]
pub(super) struct ErrorBar {
    /// What noise does, [`STANDARD_ERRORS`] times its standard error.
    pub(super) noise: f64,
    /// What bias typically is.
    pub(super) bias: f64,
    /// Whether a higher degree was there to show the bias.
    pub(super) seen: bool,
}

impl ErrorBar {
    /// What fits are compared by.
    pub(super) fn typical(&self) -> f64 {
        self.noise.hypot(self.bias)
    }

    /// What the error stays below at 95 % of the vertices.
    pub(super) fn stated(&self) -> f64 {
        (STATED_NOISE * self.noise).hypot(self.bias * if self.seen { STATED_SEEN } else { STATED_UNSEEN })
    }
}

/// The error bar of a degree of a fit; `None` if there is no such polynomial.
pub(super) fn error_bar(fit: &LocalFit, degree: usize) -> Option<ErrorBar> {
    let noise = STANDARD_ERRORS * fit.standard_error(degree)?;
    let witness = (degree + 1..=4).rev().find_map(|higher| fit.change(degree, higher));
    let bias = match witness {
        Some(change) => change,
        None => {
            // Degree 2 has none below it: then its own curvature is the change from a plane.
            let change = if degree > 2 { fit.change(degree - 1, degree)? } else { fit.curvature(2)? };
            change * rate(fit, degree, change) + of_bending(fit, degree)
        }
    };
    Some(ErrorBar { noise, bias, seen: witness.is_some() })
}

/// How much smaller the next terms of the expansion are.
fn rate(fit: &LocalFit, degree: usize, change: f64) -> f64 {
    let curvature = fit.curvature(degree).unwrap_or(0.0);
    let ratio = (curvature * fit.length).powi(2);
    let relative = if change > 0.0 { change / (change + curvature) } else { 0.0 };
    (OF_RATE * (ratio + relative)).min(LARGEST_RATE)
}

/// What is wrong because heights were bent by a curvature that the fit then corrects: that leaves a term of degree 6 that is as
/// far off as the curvature was.
fn of_bending(fit: &LocalFit, degree: usize) -> f64 {
    let curvature = fit.curvature(degree).unwrap_or(0.0);
    let ratio = (curvature * fit.length).powi(2);
    OF_BENDING * ratio * ratio * (fit.bent_by() - curvature).abs()
}

/// What the next fit starts from. Curvature that is not known to its own size is trusted less, by the part of its square that
/// is not error.
pub(super) fn next_guess(fit: &LocalFit, degree: usize) -> Option<Guess> {
    let curvature = fit.curvature(degree)?;
    let noise = fit.standard_error(degree)?;
    let squared = (noise / curvature).powi(2);
    let trust = if squared.is_finite() { 1.0 / (1.0 + squared) } else { 0.0 };
    fit.guess(degree, trust.sqrt())
}

#[cfg(test)]
mod tests {
    use super::super::local_fit::Cloud;
    use super::*;
    use crate::Vec3;

    /// A fit of points over the unit disc, of a paraboloid of this curvature with heights off by up to `noise`.
    fn fit(curvature: f64, noise: f64) -> LocalFit {
        let mut cloud = Cloud::default();
        cloud.reserve(40);
        for i in 0..40 {
            let t = f64::from(i);
            let (radius, angle) = ((t / 40.0).sqrt(), 2.4 * t);
            let (x, y) = (radius * angle.cos(), radius * angle.sin());
            let z = -0.5 * curvature * (x * x + y * y) + noise * (78.233 * t * t).sin();
            cloud.push(&Vec3::new(x, y, z), &Vec3::z(), radius * radius);
        }
        LocalFit::new(&cloud, cloud.len(), 1.0, 4, &Guess::from_normal(Vec3::z())).unwrap()
    }

    #[test]
    fn curvature_that_noise_made_is_not_bent_by_in_full() {
        let trust = |fit: &LocalFit| next_guess(fit, 4).unwrap().tensor.norm() / fit.curvature(4).unwrap();
        let (clean, noisy) = (fit(0.1, 1e-6), fit(0.0, 0.02));
        assert!(trust(&clean) > 0.98, "{}", trust(&clean));
        assert!(trust(&noisy) < 0.9, "{}", trust(&noisy));
    }

    #[test]
    fn noise_is_told_from_bias() {
        let bar = |fit: &LocalFit, degree| error_bar(fit, degree).unwrap();
        let noisy = fit(0.1, 0.01);
        // Each degree more costs certainty; ten times the noise is ten times the bar.
        assert!(bar(&noisy, 2).noise < bar(&noisy, 4).noise);
        let ratio = bar(&fit(0.1, 0.1), 4).noise / bar(&noisy, 4).noise;
        assert!((ratio - 10.0).abs() < 0.1, "{ratio}");
        assert!(bar(&noisy, 2).seen && bar(&noisy, 3).seen && !bar(&noisy, 4).seen);
    }
}

//! Adam, and `a += f b`, compiled for each instruction set.
#![allow(unsafe_code, reason = "calling functions compiled for an instruction set requires it")]

use super::dispatch::dispatch;

/// Decay of the mean of gradients.
const BETA1: f32 = 0.9;
/// Decay of the mean of squared gradients.
const BETA2: f32 = 0.999;
/// Kept from dividing by zero: gradients are means over a batch, far above it wherever a sample falls.
const EPSILON: f32 = 1e-8;

/// One step of Adam (Kingma and Ba, "Adam: a method for stochastic optimization", ICLR 2015), bias corrected.
#[derive(Debug, Clone, Copy)]
pub(crate) struct AdamStep {
    rate: f32,
    inverse_root: f32,
}

impl AdamStep {
    /// The `step`-th step, from 1.
    #[allow(clippy::cast_possible_truncation, reason = "to the precision of the parameters")]
    pub(crate) fn new(rate: f64, step: u64) -> Self {
        let left = |beta: f32| 1.0 - f64::from(beta).powf(step as f64);
        Self { rate: (rate / left(BETA1)) as f32, inverse_root: (1.0 / left(BETA2).sqrt()) as f32 }
    }
}

dispatch!(
    /// Updates values and moments by a gradient; all of one length.
    adam = adam_body(
        step: AdamStep, values: &mut [f32], means: &mut [f32], squares: &mut [f32], gradient: &[f32],
    )
);
dispatch!(
    /// `sum += factor (a + b)`; all of one length.
    accumulate = accumulate_body(factor: f32, a: &[f32], b: &[f32], sum: &mut [f32])
);

#[inline(always)]
fn adam_body(step: AdamStep, values: &mut [f32], means: &mut [f32], squares: &mut [f32], gradient: &[f32]) {
    let moments = means.iter_mut().zip(squares);
    for ((value, (mean, square)), &g) in values.iter_mut().zip(moments).zip(gradient) {
        *mean += (1.0 - BETA1) * (g - *mean);
        *square += (1.0 - BETA2) * (g * g - *square);
        *value -= step.rate * *mean / (square.sqrt() * step.inverse_root + EPSILON);
    }
}

#[inline(always)]
fn accumulate_body(factor: f32, a: &[f32], b: &[f32], sum: &mut [f32]) {
    for ((sum, a), b) in sum.iter_mut().zip(a).zip(b) {
        *sum += factor * (a + b);
    }
}

#[cfg(test)]
mod tests {
    use super::super::InstructionSet;
    use super::*;

    /// The first step moves each value by the rate against the sign of its gradient, however large that is.
    #[test]
    fn the_first_step_is_the_rate() {
        for set in InstructionSet::present() {
            let (mut values, mut means, mut squares) = (vec![0.5; 40], vec![0.0; 40], vec![0.0; 40]);
            let gradient: Vec<f32> = (0..40_i16).map(|i| f32::from(i - 20) * 1e-3).collect();
            adam(set, AdamStep::new(0.01, 1), &mut values, &mut means, &mut squares, &gradient);
            for (value, g) in values.iter().zip(&gradient) {
                let expected = if *g == 0.0 { 0.5 } else { 0.5 - 0.01 * g.signum() };
                assert!((value - expected).abs() < 1e-6, "{set:?}: {value} for gradient {g}");
            }
        }
    }

    /// Constant gradients: the bias-corrected moments stay what the gradient is, so that each step is the rate.
    #[test]
    fn steps_stay_the_rate_under_a_constant_gradient() {
        let (mut values, mut means, mut squares) = ([1.0; 3], [0.0; 3], [0.0; 3]);
        for step in 1..=100 {
            adam(
                InstructionSet::best(),
                AdamStep::new(1e-3, step),
                &mut values,
                &mut means,
                &mut squares,
                &[2.0, -0.1, 7.0],
            );
        }
        for (value, expected) in values.iter().zip([0.9, 1.1, 0.9]) {
            assert!((value - expected).abs() < 1e-4, "{value} {expected}");
        }
    }
}

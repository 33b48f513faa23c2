//! Ranges and ticks with round numbers.

/// Which numbers a colour map spans.
#[derive(Debug, Clone, Copy, PartialEq)]
pub struct Axis {
    /// Value at the lower end; positive on a logarithmic axis.
    pub lower: f32,
    /// Value at the upper end.
    pub upper: f32,
    /// How values between are placed.
    pub scale: AxisScale,
}

/// How values are placed on an axis.
#[derive(Debug, Clone, Copy, PartialEq, Eq, Default)]
pub enum AxisScale {
    /// In proportion.
    #[default]
    Linear,
    /// In proportion to their logarithm.
    Logarithmic,
}

/// A labelled position.
#[derive(Debug, Clone, PartialEq)]
pub(super) struct Tick {
    /// In `[0, 1]`.
    pub position: f32,
    pub label: String,
}

impl Axis {
    /// From `-r` to `r`, where `r` is the smallest round number that covers the share `quantile` of the magnitudes.
    pub(super) fn symmetric(values: impl Iterator<Item = f32>, quantile: f64) -> Self {
        let upper = rounded_up(magnitude_quantile(values, quantile));
        Self { lower: -upper, upper, scale: AxisScale::Linear }
    }

    /// From 0 to the smallest round number that covers the share `quantile` of the magnitudes.
    pub(super) fn from_zero(values: impl Iterator<Item = f32>, quantile: f64) -> Self {
        Self { lower: 0.0, upper: rounded_up(magnitude_quantile(values, quantile)), scale: AxisScale::Linear }
    }

    /// Whole decades that cover the share `quantile` of the positive magnitudes, eight at most.
    pub(super) fn decades(values: impl Iterator<Item = f32>, quantile: f64) -> Self {
        let positive: Vec<f32> = values.map(f32::abs).filter(|v| *v > 0.0).collect();
        let top = magnitude_quantile(positive.iter().copied(), quantile).log10().ceil();
        let bottom = magnitude_quantile(positive.iter().copied(), 1.0 - quantile).log10().floor();
        let lower = bottom.max(top - 8.0).min(top - 1.0);
        Self { lower: 10.0_f32.powf(lower), upper: 10.0_f32.powf(top), scale: AxisScale::Logarithmic }
    }

    /// Where a value lies, 0 at the lower end, 1 at the upper one, also outside.
    pub(super) fn position(&self, value: f32) -> f32 {
        match self.scale {
            AxisScale::Linear => (value - self.lower) / (self.upper - self.lower),
            AxisScale::Logarithmic => {
                let ratio = value.max(f32::MIN_POSITIVE) / self.lower;
                ratio.ln() / (self.upper / self.lower).ln()
            }
        }
    }

    pub(super) fn ticks(&self) -> Vec<Tick> {
        match self.scale {
            AxisScale::Linear => (0..=4_u8)
                .map(|i| {
                    let position = f32::from(i) / 4.0;
                    let value = self.lower + position * (self.upper - self.lower);
                    Tick { position, label: number(value, self.upper.abs().max(self.lower.abs())) }
                })
                .collect(),
            AxisScale::Logarithmic => {
                let decades = (self.upper / self.lower).log10().round();
                #[allow(
                    clippy::cast_possible_truncation,
                    clippy::cast_sign_loss,
                    reason = "at most eight decades"
                )]
                let count = decades as u8;
                let tick = |i: u8| {
                    let exponent = self.lower.log10().round() + f32::from(i);
                    Tick { position: f32::from(i) / decades, label: format!("1e{exponent}") }
                };
                (0..=count).map(tick).collect()
            }
        }
    }
}

/// A number as short as its neighbours on the axis allow.
fn number(value: f32, largest: f32) -> String {
    if value == 0.0 {
        return "0".into();
    }
    if !(1e-3..1e5).contains(&largest) {
        return format!("{value:.2e}");
    }
    // Three significant digits of the largest tick, without trailing zeros.
    #[allow(clippy::cast_possible_truncation, clippy::cast_sign_loss, reason = "between 0 and 6")]
    let digits = (3.0 - largest.log10().floor()).clamp(0.0, 6.0) as usize;
    let text = format!("{value:.digits$}");
    if text.contains('.') { text.trim_end_matches('0').trim_end_matches('.').into() } else { text }
}

/// The smallest of 1, 1.6, 2, 3, 4, 6, 8 times a power of ten that is at least `x`; 1 for 0 and what is not finite.
fn rounded_up(x: f32) -> f32 {
    if !(x.is_finite() && x > 0.0) {
        return 1.0;
    }
    let power = f64::from(x).log10().floor();
    let mantissa = f64::from(x) / 10.0_f64.powf(power);
    let round = [1.0, 1.6, 2.0, 3.0, 4.0, 6.0, 8.0, 10.0].into_iter().find(|r| mantissa <= r * (1.0 + 1e-6));
    #[allow(clippy::cast_possible_truncation, reason = "an axis in f32")]
    let result = (round.unwrap_or(10.0) * 10.0_f64.powf(power)) as f32;
    if result > 0.0 { result } else { x }
}

fn magnitude_quantile(values: impl Iterator<Item = f32>, quantile: f64) -> f32 {
    let mut magnitudes: Vec<f32> = values.map(f32::abs).filter(|v| v.is_finite()).collect();
    if magnitudes.is_empty() {
        return 0.0;
    }
    #[allow(clippy::cast_possible_truncation, clippy::cast_sign_loss, reason = "an index into the values")]
    let rank = ((magnitudes.len() - 1) as f64 * quantile).round() as usize;
    *magnitudes.select_nth_unstable_by(rank, f32::total_cmp).1
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn axes_are_round_and_robust() {
        let values = (0_u8..100).map(f32::from).chain([1e9, f32::NAN]);
        let axis = Axis::symmetric(values, 0.95);
        assert_eq!((axis.lower, axis.upper), (-100.0, 100.0));
        let labels: Vec<String> = axis.ticks().into_iter().map(|t| t.label).collect();
        assert_eq!(labels, ["-100", "-50", "0", "50", "100"]);
        assert_eq!(Axis::symmetric(std::iter::empty(), 0.95).upper, 1.0);
        assert_eq!(rounded_up(3.1e-7), 4e-7);
        let log = Axis::decades([1e-6, 3e-5, 0.02].into_iter(), 1.0);
        assert!((log.lower - 1e-6).abs() < 1e-9 && (log.upper - 0.1).abs() < 1e-6, "{log:?}");
        assert_eq!(log.ticks().len(), 6);
        assert!((log.position(1e-3) - 0.6).abs() < 1e-3);
    }
}

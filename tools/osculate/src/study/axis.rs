//! Axes of plots: from numbers to places, and the lines of the grid.

/// One axis; its range is that of the data.
#[derive(Debug, Clone)]
pub struct Axis {
    /// Quantity and unit.
    pub label: String,
    /// How numbers become places.
    pub scale: Scale,
}

/// How numbers become places.
#[derive(Debug, Clone, Copy, PartialEq, Eq)]
pub enum Scale {
    /// Equal differences are equally far apart; the range includes 0.
    Linear,
    /// Equal ratios are. Points at or below zero are left out.
    Log,
}

impl Scale {
    /// Whether a number has a place on an axis of this scale.
    pub(super) fn shows(self, value: f64) -> bool {
        value.is_finite() && (self == Self::Linear || value > 0.0)
    }
}

/// A range of numbers along an axis, in the axis's own scale.
#[derive(Debug)]
pub(super) struct Range {
    scale: Scale,
    low: f64,
    high: f64,
}

/// A line of the grid.
#[derive(Debug)]
pub(super) struct Tick {
    /// Where, from 0 to 1.
    pub(super) share: f64,
    /// `None` for the fine lines.
    pub(super) text: Option<String>,
}

impl Range {
    pub(super) fn new(scale: Scale, values: impl Iterator<Item = f64>) -> Self {
        let own = |v: f64| if scale == Scale::Log { v.log10() } else { v };
        let (mut low, mut high) =
            values.map(own).fold((f64::INFINITY, f64::NEG_INFINITY), |(l, h), v| (l.min(v), h.max(v)));
        if low > high {
            (low, high) = (0.0, 1.0);
        }
        if scale == Scale::Linear {
            (low, high) = (low.min(0.0), high.max(0.0));
        }
        // A single value, or data on the frame's edge, would be hard to read.
        let pad =
            (0.05 * (high - low)).max(if scale == Scale::Log { 0.1 } else { 1e-3 * high.abs().max(1e-9) });
        let low = if scale == Scale::Linear && low == 0.0 { 0.0 } else { low - pad };
        Self { scale, low, high: high + pad }
    }

    pub(super) fn share(&self, value: f64) -> Option<f64> {
        let own = if self.scale == Scale::Log { value.log10() } else { value };
        self.scale.shows(value).then(|| (own - self.low) / (self.high - self.low))
    }

    pub(super) fn ticks(&self) -> Vec<Tick> {
        match self.scale {
            Scale::Log => self.log_ticks(),
            Scale::Linear => self.linear_ticks(),
        }
    }

    fn log_ticks(&self) -> Vec<Tick> {
        // With few decades in sight, 2 and 5 are named too.
        let named: &[u32] = match self.high - self.low {
            span if span < 1.0 => &[1, 2, 3, 5, 7],
            span if span < 2.5 => &[1, 2, 5],
            _ => &[1],
        };
        let mut ticks = Vec::new();
        #[expect(clippy::cast_possible_truncation, reason = "a logarithm of an f64 is small")]
        let decades = self.low.floor() as i32..=self.high.ceil() as i32;
        for decade in decades {
            for digit in 1..10 {
                let value = f64::from(digit) * 10_f64.powi(decade);
                let text = named.contains(&digit).then(|| tick_text(value));
                ticks.extend(
                    self.share(value).filter(|s| (0.0..=1.0).contains(s)).map(|share| Tick { share, text }),
                );
            }
        }
        ticks
    }

    fn linear_ticks(&self) -> Vec<Tick> {
        let rough = (self.high - self.low) / 6.0;
        let decade = 10_f64.powf(rough.log10().floor());
        let step =
            [1.0, 2.0, 5.0, 10.0].map(|m| m * decade).into_iter().find(|s| *s >= rough).unwrap_or(rough);
        let first = (self.low / step).ceil();
        (0..20)
            .map(|i| (first + f64::from(i)) * step)
            .take_while(|v| *v <= self.high)
            .filter_map(|v| Some(Tick { share: self.share(v)?, text: Some(tick_text(v)) }))
            .collect()
    }
}

/// `0.002`, `50`, `10k`, `2M`, and powers of ten where a plain number would be long.
fn tick_text(value: f64) -> String {
    let magnitude = value.abs();
    let trimmed = |x: f64| {
        let text = format!("{x:.6}");
        text.trim_end_matches('0').trim_end_matches('.').to_owned()
    };
    match magnitude {
        0.0 => "0".into(),
        m if m < 0.999e-4 => {
            let exponent = m.log10().floor();
            let digit = (m / 10_f64.powf(exponent)).round();
            format!("{digit}e{exponent}")
        }
        m if m < 9_999.0 => trimmed(value),
        m if m < 1e6 => format!("{}k", trimmed(value / 1e3)),
        m if m < 1e9 => format!("{}M", trimmed(value / 1e6)),
        _ => format!("{value:.0e}"),
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn ticks_are_named_as_people_write_numbers() {
        for (value, text) in [
            (0.002, "0.002"),
            (50.0, "50"),
            (1e4, "10k"),
            (2e6, "2M"),
            (3e-6, "3e-6"),
            (0.0, "0"),
            (-0.5, "-0.5"),
        ] {
            assert_eq!(tick_text(value), text);
        }
    }
}

//! Whether a height map repeats without a jump.

use serde::Serialize;

use super::Grid;

/// How a map continues across one pair of borders.
#[derive(Debug, Clone, Copy, PartialEq, Serialize)]
pub struct Seam {
    /// Root mean square of the jumps between the texels on both sides of the border.
    pub across: f32,
    /// Root mean square of the jumps between neighbours inside, along the same axis.
    pub inside: f32,
    /// The first over the second: about 1 where the map tiles. 1 where both are 0, infinite where only the second is.
    pub ratio: f32,
}

/// Both pairs of borders of a map.
#[derive(Debug, Clone, Copy, PartialEq, Serialize)]
pub struct SeamReport {
    /// Between the last column and the first.
    pub u: Seam,
    /// Between the last row and the first.
    pub v: Seam,
}

impl SeamReport {
    /// Measures the seams. A side of one texel has none: it counts as tiling.
    #[must_use]
    pub fn new(grid: &Grid<f32>) -> Self {
        let (w, h) = (grid.width(), grid.height());
        let u = seam(w, h, |along, aside| grid.texel(along, aside));
        let v = seam(h, w, |along, aside| grid.texel(aside, along));
        Self { u, v }
    }
}

fn seam(length: usize, lines: usize, value: impl Fn(usize, usize) -> f32) -> Seam {
    let jump = |from: usize, to: usize| {
        (0..lines).map(|line| f64::from(value(to, line) - value(from, line)).powi(2)).sum::<f64>()
    };
    let across = (jump(length - 1, 0) / lines as f64).sqrt();
    let pairs = (lines * (length - 1)).max(1) as f64;
    let inside = ((1..length).map(|i| jump(i - 1, i)).sum::<f64>() / pairs).sqrt();
    let ratio = if across == 0.0 { if inside == 0.0 { 1.0 } else { 0.0 } } else { across / inside };
    #[allow(clippy::cast_possible_truncation, reason = "a report")]
    Seam { across: across as f32, inside: inside as f32, ratio: ratio as f32 }
}

#[cfg(test)]
mod tests {
    use super::*;
    use std::f32::consts::TAU;

    #[test]
    fn a_wave_tiles_and_a_ramp_does_not() {
        let wave = Grid::from_fn(64, 48, |p| (TAU * p.x).sin() + (2.0 * TAU * p.y + 0.4).cos());
        let report = SeamReport::new(&wave);
        // A sine's slope at the border is its largest, sqrt(2) times the root mean square.
        assert!((report.u.ratio - 2.0_f32.sqrt()).abs() < 0.02, "{report:?}");
        assert!(report.v.ratio < 1.5, "{report:?}");
        let ramp = SeamReport::new(&Grid::from_fn(64, 48, |p| p.x));
        assert!((ramp.u.ratio - 63.0).abs() < 0.01, "{ramp:?}");
        assert_eq!(ramp.v.ratio, 1.0, "constant along v");
        let step = SeamReport::new(&Grid::new(2, 1, vec![0.0, 1.0]));
        assert_eq!((step.u.ratio, step.v.ratio), (1.0, 1.0));
    }
}

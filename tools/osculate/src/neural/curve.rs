//! The training curve as a plot.

use osculate_sbtf::train::{CurvePoint, Stage, TrainReport};

use crate::study::axis::{Axis, Scale};
use crate::study::plot::{Line, Mark, Plot, Point, Series};

/// Held-out errors and losses of both parts over their steps, on logarithmic axes.
pub fn curve_plot(report: &TrainReport) -> Plot {
    let series =
        |name: &str, colour: usize, line: Line, stage: Stage, value: fn(&CurvePoint) -> f64| Series {
            name: name.to_owned(),
            colour,
            mark: Mark::None,
            line,
            points: report
                .curve
                .iter()
                .filter(|point| point.stage == stage)
                .map(|point| Point {
                    x: point.step as f64,
                    y: value(point),
                    hint: String::new(),
                    label: None,
                })
                .collect(),
        };
    let held_out: fn(&CurvePoint) -> f64 = |point| point.held_out.error;
    let loss: fn(&CurvePoint) -> f64 = |point| point.loss;
    Plot {
        title: "Training".to_owned(),
        x: Axis { label: "step".to_owned(), scale: Scale::Log },
        y: Axis { label: "error, loss".to_owned(), scale: Scale::Log },
        series: vec![
            series("opacity, held-out error", 0, Line::Thick, Stage::Opacity, held_out),
            series("opacity, loss", 0, Line::Dashed, Stage::Opacity, loss),
            series("appearance, held-out error", 1, Line::Thick, Stage::Appearance, held_out),
            series("appearance, loss", 1, Line::Dashed, Stage::Appearance, loss),
        ],
    }
}

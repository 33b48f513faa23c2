//! Plots of time, memory and error against the number of vertices.

use super::figures::Figure;
use super::rows::Row;
use crate::study::axis::{Axis, Scale};
use crate::study::plot::{Line, Mark, Plot, Point, Series};

type Value = fn(&Row) -> Option<f64>;

/// The figures; none without rows about growth.
pub fn growth(rows: &[Row]) -> Vec<Figure> {
    let rows: Vec<&Row> = rows.iter().filter(|r| r.purpose == "scaling").collect();
    if rows.is_empty() {
        return Vec::new();
    }
    let mut time =
        plot(&rows, "Time against size", "seconds", |r| Some(r.us_per_vertex? * r.vertices as f64 * 1e-6));
    let on_all = lines(&rows, |r| Some(r.us_per_vertex_all_threads? * r.vertices as f64 * 1e-6));
    time.series.extend(on_all.into_iter().filter(|s| !s.points.is_empty()).map(|s| Series {
        name: format!("{}, all threads", s.name),
        mark: Mark::None,
        line: Line::Dashed,
        ..s
    }));
    let mut memory =
        plot(&rows, "Memory against size", "bytes a vertex beyond the mesh", |r| r.bytes_per_vertex);
    memory.y.scale = Scale::Linear;
    let figure = |name: &str, plot: Plot, caption: &str| Figure {
        name: name.to_owned(),
        plot,
        caption: caption.to_owned(),
    };
    vec![
        figure(
            "scaling_time",
            time,
            "Tori of random points. On these axes work in proportion to the vertices is a line of slope 1.",
        ),
        figure(
            "scaling_memory",
            memory,
            "Ours counted at the allocator; the others as the growth of resident memory, which is coarse on small meshes and misses what the program had kept from before.",
        ),
        figure(
            "scaling_error",
            plot(&rows, "Error against size", "median of |kappa - exact| times radius", |r| r.median),
            "The same tori without noise: an estimator of order p falls with slope -p/2 against the number of vertices.",
        ),
    ]
}

fn plot(rows: &[&Row], title: &str, label: &str, value: Value) -> Plot {
    Plot {
        title: title.to_owned(),
        x: Axis { label: "vertices".to_owned(), scale: Scale::Log },
        y: Axis { label: label.to_owned(), scale: Scale::Log },
        series: lines(rows, value),
    }
}

/// A series per setting, ours as filled discs.
fn lines(rows: &[&Row], value: Value) -> Vec<Series> {
    const MARKS: [Mark; 4] = [Mark::Circle, Mark::Square, Mark::Diamond, Mark::Triangle];
    let mut names: Vec<(String, Mark)> = Vec::new();
    for row in rows {
        if !names.iter().any(|(name, _)| *name == row.name()) {
            let mark = if row.is_ours() { Mark::Disc } else { MARKS[names.len() % MARKS.len()] };
            names.push((row.name(), mark));
        }
    }
    let series = names.into_iter().enumerate().map(|(colour, (name, mark))| {
        let own = rows.iter().filter(|r| r.name() == name);
        let points = own.filter_map(|r| {
            let y = value(r)?;
            let hint = format!("{name}, {} vertices: {y:.3e}", r.vertices);
            Some(Point { x: r.vertices as f64, y, hint, label: None })
        });
        Series { points: points.collect(), name, colour, mark, line: Line::Thin }
    });
    series.collect()
}

//! The plots of the study. Those about growth with the mesh are in `growth`.

use super::growth::growth;
use super::rows::Row;
use super::summary::{Mean, front, means, noises, shapes};
use super::tables::{is_everyday, percent};
use crate::study::axis::{Axis, Scale};
use crate::study::plot::{COLOURS, Line, Mark, Plot, Point, Series};

/// A plot with its place in files and words below it.
#[derive(Debug)]
pub struct Figure {
    /// Name of its file, without the extension.
    pub name: String,
    /// What is drawn.
    pub plot: Plot,
    /// What to see in it.
    pub caption: String,
}

/// All figures, for files.
pub fn all(rows: &[Row]) -> Vec<Figure> {
    let mut figures = fronts(rows);
    figures.extend(everyday_fronts(rows));
    figures.extend(by_noise(rows));
    figures.extend(growth(rows));
    figures
}

/// Error against time over all analytic shapes, one figure a noise level and quantile.
pub fn fronts(rows: &[Row]) -> Vec<Figure> {
    let rows: Vec<Row> = accuracy(rows).filter(|r| !is_everyday(&r.shape)).cloned().collect();
    let count = shapes(&rows).len();
    let mut figures = Vec::new();
    for noise in noises(&rows) {
        let means = means(&rows, noise);
        for (quantile, words, error) in [("median", "half", median as fn(&Mean) -> f64), ("p95", "95 %", p95)]
        {
            figures.push(Figure {
                name: format!("{quantile}_noise_{noise}"),
                plot: front_plot(format!("Error against time, noise {}", percent(noise)), quantile, &means, error),
                caption: format!(
                    "Every point is a setting: geometric mean over {count} shapes of the error that {words} of the vertices stay below. Lower left is better; the dashed line joins the settings of all programs that none beats in both. Rest the pointer on a point for its name."
                ),
            });
        }
    }
    figures
}

/// The same for each everyday mesh, clean and with 1 % noise, median only.
pub fn everyday_fronts(rows: &[Row]) -> Vec<Figure> {
    let rows: Vec<Row> = accuracy(rows).filter(|r| is_everyday(&r.shape)).cloned().collect();
    let mut figures = Vec::new();
    for shape in shapes(&rows) {
        let of_shape: Vec<Row> = rows.iter().filter(|r| r.shape == shape).cloned().collect();
        let vertices = of_shape.first().map_or(0, |r| r.vertices);
        for noise in noises(&of_shape).into_iter().filter(|n| *n <= 0.0 || (*n - 0.01).abs() < 1e-12) {
            let title = format!("{}, noise {}", readable(&shape), percent(noise));
            figures.push(Figure {
                name: format!("{shape}_noise_{noise}"),
                plot: front_plot(title, "median", &means(&of_shape, noise), median),
                caption: format!(
                    "{vertices} vertices on a limit surface whose curvature is exact at vertices of valence 6; the others are not counted."
                ),
            });
        }
    }
    figures
}

fn median(m: &Mean) -> f64 {
    m.median
}

fn p95(m: &Mean) -> f64 {
    m.p95
}

fn accuracy(rows: &[Row]) -> impl Iterator<Item = &Row> {
    rows.iter().filter(|r| r.purpose == "accuracy")
}

/// `spot_refined` as `Spot refined`.
pub fn readable(shape: &str) -> String {
    let spaced = shape.replace('_', " ");
    let mut letters = spaced.chars();
    letters.next().map_or_else(String::new, |first| first.to_uppercase().chain(letters).collect())
}

fn front_plot(title: String, quantile: &str, means: &[Mean], error: fn(&Mean) -> f64) -> Plot {
    let places: Vec<(f64, f64)> = means.iter().map(|m| (m.us, error(m))).collect();
    let best = front(&places);
    let mut series = vec![Series {
        name: "best of all".into(),
        colour: 7,
        mark: Mark::None,
        line: Line::Dashed,
        points: best.iter().map(|&i| Point { x: places[i].0, y: places[i].1, ..Point::default() }).collect(),
    }];
    for (name, colour, mark) in families(means.iter().map(|m| &m.row), Row::curve) {
        let members = means.iter().enumerate().filter(|(_, m)| m.row.curve() == name);
        let points = members.map(|(i, m)| Point {
            x: m.us,
            y: error(m),
            hint: format!("{}: {:.2} µs a vertex, error {:.3e}", m.row.name(), m.us, error(m)),
            label: best.contains(&i).then(|| m.row.setting.clone()).filter(|s| !s.is_empty()),
        });
        let line = if mark == Mark::Disc { Line::Thin } else { Line::None };
        series.push(Series { name: name.clone(), colour, mark, line, points: points.collect() });
    }
    Plot {
        title,
        x: Axis { label: "microseconds a vertex, one thread".into(), scale: Scale::Log },
        y: Axis { label: format!("{quantile} of |kappa - exact| times radius"), scale: Scale::Log },
        series,
    }
}

/// Families in the order of their first row, ours first, with colour and mark. Ours are filled discs.
fn families<'a>(rows: impl Iterator<Item = &'a Row>, of: fn(&Row) -> String) -> Vec<(String, usize, Mark)> {
    let (mut ours, mut theirs): (Vec<String>, Vec<String>) = (Vec::new(), Vec::new());
    for row in rows {
        let list = if row.is_ours() { &mut ours } else { &mut theirs };
        let name = of(row);
        if !list.contains(&name) {
            list.push(name);
        }
    }
    let marks = [Mark::Circle, Mark::Square, Mark::Diamond, Mark::Triangle];
    let ours = ours.into_iter().enumerate().map(|(i, name)| (name, i, Mark::Disc));
    let theirs = theirs
        .into_iter()
        .enumerate()
        .map(|(i, name)| (name, i + 2, marks[(i + i / COLOURS.len()) % marks.len()]));
    ours.chain(theirs).collect()
}

/// Error against noise: the best setting of each method of ours, and of all others, at each level.
pub fn by_noise(rows: &[Row]) -> Option<Figure> {
    let rows: Vec<Row> = accuracy(rows).filter(|r| !is_everyday(&r.shape)).cloned().collect();
    let levels: Vec<(f64, Vec<Mean>)> =
        noises(&rows).into_iter().filter(|n| *n > 0.0).map(|n| (n, means(&rows, n))).collect();
    if levels.len() < 2 {
        return None;
    }
    let best = |name: String, colour: usize, mark: Mark, line: Line, wanted: &dyn Fn(&Row) -> bool| {
        let at = |(noise, means): &(f64, Vec<Mean>)| {
            let own = means.iter().filter(|m| wanted(&m.row));
            let best = own.min_by(|a, b| a.median.total_cmp(&b.median))?;
            let hint = format!("{}: {:.3e}", best.row.name(), best.median);
            let label = Some(if line == Line::Dashed { best.row.name() } else { best.row.setting.clone() });
            Some(Point { x: *noise, y: best.median, hint, label })
        };
        Series { name, colour, mark, line, points: levels.iter().filter_map(at).collect() }
    };
    let ours = families(levels[0].1.iter().map(|m| &m.row).filter(|r| r.is_ours()), Row::family);
    let mut series: Vec<Series> = ours
        .into_iter()
        .map(|(name, colour, mark)| best(name.clone(), colour, mark, Line::Thick, &|r| r.family() == name))
        .collect();
    let peers = best("best other program".into(), 7, Mark::Circle, Line::Dashed, &|r| !r.is_ours());
    series.extend(Some(peers).filter(|s| !s.points.is_empty()));
    Some(Figure {
        name: "error_by_noise".into(),
        plot: Plot {
            title: "Error against noise, best setting at each level".into(),
            x: Axis { label: "standard deviation of the noise, mean edges".into(), scale: Scale::Log },
            y: Axis { label: "median of |kappa - exact| times radius".into(), scale: Scale::Log },
            series,
        },
        caption: "A line a method; each point is the setting of it that does best at this noise, written beside it, mean over the analytic shapes.".into(),
    })
}

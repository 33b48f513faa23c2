//! The study of filters as CSV, plots and a page.

use std::fmt::Write as _;

use super::measure::{Effort, MeshResult, Row, Spread};
use crate::console::number;
use crate::study::axis::{Axis, Scale};
use crate::study::page::{Block, Cell, Page, Section, Table, Tone};
use crate::study::plot::{Line, Mark, Plot, Point, Series};

/// What the page says about the run.
#[derive(Debug)]
pub struct Context {
    /// As it was typed.
    pub command: String,
    /// Processor.
    pub machine: String,
    /// How much was measured.
    pub effort: Effort,
}

/// A plot and the file it goes to.
#[derive(Debug)]
pub struct NamedPlot {
    /// Name without directories.
    pub file: String,
    /// The picture.
    pub svg: String,
}

/// Where an error that is only rounding is drawn.
const FLOOR: f64 = 1e-6;

/// One line per filter, setting and mesh.
pub fn csv(results: &[MeshResult]) -> String {
    let mut text = "mesh,triangles,filter,setting,nanoseconds,lower_quartile,upper_quartile,rays,error_median,error_p99,error_max,skipped,crossings,preparation_seconds,bytes_per_vertex\n".to_owned();
    for result in results {
        for row in &result.rows {
            let error = |value: fn(&Spread) -> f64| {
                row.error.as_ref().map_or_else(String::new, |spread| format!("{:e}", value(spread)))
            };
            let _ = writeln!(
                text,
                "{},{},{},{},{:.1},{:.1},{:.1},{:.3},{},{},{},{:.4},{:.2},{:.4},{}",
                result.name,
                result.triangles,
                row.filter,
                row.setting,
                row.nanoseconds,
                row.range[0],
                row.range[1],
                row.nanoseconds / result.ray_nanoseconds,
                error(|e| e.median),
                error(|e| e.p99),
                error(|e| e.max),
                row.skipped,
                row.crossings,
                row.preparation,
                row.bytes_per_vertex
            );
        }
    }
    text
}

/// Error against time, one plot per mesh.
pub fn plots(results: &[MeshResult]) -> Vec<NamedPlot> {
    let file = |name: &str| {
        format!("filter_{}.svg", name.replace(|c: char| !c.is_ascii_alphanumeric(), "_").to_lowercase())
    };
    results.iter().map(|r| NamedPlot { file: file(&r.name), svg: plot(r).svg() }).collect()
}

fn plot(result: &MeshResult) -> Plot {
    let series = |name: &str, colour, mark, line, keep: &dyn Fn(&Row) -> bool| Series {
        name: name.to_owned(),
        colour,
        mark,
        line,
        points: result.rows.iter().filter(|row| keep(row)).filter_map(|row| point(result, row)).collect(),
    };
    let is = |filter: &'static str, plain: bool| {
        move |row: &Row| row.filter == filter && row.setting.is_empty() == plain
    };
    Plot {
        title: format!("{}: error against time of a query", result.name),
        x: Axis { label: "time of a query in ray casts".to_owned(), scale: Scale::Log },
        y: Axis { label: "relative error, 99 % of the rays".to_owned(), scale: Scale::Log },
        series: vec![
            series("baked, 4 to 32 azimuths", 0, Mark::Disc, Line::Thin, &is("baked", false)),
            series("march, walks skipped", 1, Mark::Disc, Line::Thin, &is("march", false)),
            series("march", 2, Mark::Square, Line::None, &is("march", true)),
            series("point", 3, Mark::Diamond, Line::None, &is("point", true)),
        ],
    }
}

fn point(result: &MeshResult, row: &Row) -> Option<Point> {
    let error = row.error?;
    let label = row.setting.split_whitespace().find(|word| word.parse::<f64>().is_ok());
    Some(Point {
        x: row.nanoseconds / result.ray_nanoseconds,
        y: error.p99.max(FLOOR),
        hint: format!("{} {}: {:.0} ns, error {:.1e}", row.filter, row.setting, row.nanoseconds, error.p99),
        label: label.map(str::to_owned),
    })
}

/// The page.
pub fn page(results: &[MeshResult], plots: &[NamedPlot], context: &Context) -> String {
    let mut sections = vec![advice(results)];
    for (result, plot) in results.iter().zip(plots) {
        sections.push(mesh_section(result, plot));
    }
    sections.push(method(context));
    let page = Page {
        title: "Curvature filters: what they cost and how exact they are".to_owned(),
        lead: vec![
            "A material on a curved surface is asked with one curvature per ray. The curvature at the point where the ray enters is cheap, but what counts near a silhouette is the surface past that point. A filter looks there. This page says what each filter costs, and how close it comes.".to_owned(),
        ],
        sections,
    };
    page.html()
}

fn find<'a>(result: &'a MeshResult, filter: &str, setting: &str) -> Option<&'a Row> {
    result.rows.iter().find(|row| row.filter == filter && row.setting.starts_with(setting))
}

/// The least and the largest ratio to a ray cast over the meshes.
fn ratios(results: &[MeshResult], filter: &str, setting: &str) -> String {
    let ratio = |r: &MeshResult| find(r, filter, setting).map(|row| row.nanoseconds / r.ray_nanoseconds);
    let all: Vec<f64> = results.iter().filter_map(ratio).collect();
    let (low, high) = all.iter().fold((f64::INFINITY, 0.0_f64), |(l, h), &x| (l.min(x), h.max(x)));
    format!("{low:.1} to {high:.1} ray casts")
}

fn errors(results: &[MeshResult], filter: &str, setting: &str, value: fn(&Spread) -> f64) -> String {
    let error = |r: &MeshResult| Some(value(find(r, filter, setting)?.error.as_ref()?));
    let all: Vec<f64> = results.iter().filter_map(error).collect();
    let (low, high) = all.iter().fold((f64::INFINITY, 0.0_f64), |(l, h), &x| (l.min(x), h.max(x)));
    match (percent(low), percent(high)) {
        (low, high) if low == high => low,
        (low, high) => format!("{low} to {high}"),
    }
}

fn percent(x: f64) -> String {
    if x < 1e-8 { "0 % (rounding)".to_owned() } else { format!("{} %", number(100.0 * round2(x))) }
}

/// Two significant digits.
fn round2(x: f64) -> f64 {
    format!("{x:.1e}").parse().unwrap_or(x)
}

fn advice(results: &[MeshResult]) -> Section {
    let take = |filter: &str, setting: &str, what: &str| {
        format!(
            "{what} A query costs {}. Half of the rays are off by no more than {}, 99 % by no more than {} (each over the meshes below).",
            ratios(results, filter, setting),
            errors(results, filter, setting, |e| e.median),
            errors(results, filter, setting, |e| e.p99)
        )
    };
    Section {
        title: "What to take when".to_owned(),
        blocks: vec![
            Block::List(vec![
                take("march", "", "`march`, the exact minimum past the point: take it unless it shows up in a profile. It is the default."),
                take("baked", "16", "`baked` with 16 azimuths, a table of the same minimum: take it when time counts more than the worst rays. Its time does not depend on how far the filter looks. It is far off where the curvature is close to zero, because errors are relative, and at creases that are as fine as the triangles."),
                take("point", "", "`point`, no filter: take it where the material is shallow against all radii of the surface, or for comparison."),
                format!("`chord`, the circle with the ray's own entry angle and exit distance: take it for silhouettes. It is another quantity than the minimum, so it has no error against that; it also returns the UV rate along the ray. A query costs {}.", ratios(results, "chord", "")),
                take("baked_chord", "12", "`baked_chord`, a table of chords in 12 azimuths and at six elevations: take it for long renderings. Its errors are against the chord."),
            ]),
            Block::Text("A bound baked per triangle lets `march` leave out a walk where it can change the curvature by no more than a tolerance. The tables below show how often that is so. The bound is proved, so it is cautious: on meshes that bend everywhere it leaves out few walks.".to_owned()),
        ],
    }
}

fn mesh_section(result: &MeshResult, plot: &NamedPlot) -> Section {
    let best = |value: fn(&Row) -> f64| result.rows.iter().map(value).fold(f64::INFINITY, f64::min);
    let fastest = best(|row| row.nanoseconds);
    let rows = result.rows.iter().map(|row| {
        let error = |value: f64| Cell::new(percent(value));
        let none = || Cell::new("");
        vec![
            Cell::new(format!("`{}` {}", row.filter, row.setting)),
            Cell::toned(
                format!("{:.0}", row.nanoseconds),
                if row.nanoseconds <= fastest { Tone::Good } else { Tone::Plain },
            ),
            Cell::new(format!("{:.0} to {:.0}", row.range[0], row.range[1])),
            Cell::new(format!("{:.2}", row.nanoseconds / result.ray_nanoseconds)),
            row.error.map_or_else(none, |e| error(e.median)),
            row.error.map_or_else(none, |e| error(e.p99)),
            row.error.map_or_else(none, |e| error(e.max)),
            Cell::new(format!("{:.0} %", 100.0 * row.skipped)),
            Cell::new(format!("{:.1}", row.crossings)),
            Cell::new(format!("{:.0}", 1e3 * row.preparation)),
            Cell::new(row.bytes_per_vertex.to_string()),
        ]
    });
    let head = [
        "filter",
        "ns",
        "quartiles",
        "ray casts",
        "error, median",
        "99 %",
        "worst",
        "skipped",
        "crossings",
        "made in ms",
        "bytes a vertex",
    ];
    let table = Table {
        caption: format!(
            "{} triangles; a ray cast takes {:.0} ns; material {} deep, diagonal {}. Errors are relative to |kappa| + 1 / diagonal.",
            result.triangles,
            result.ray_nanoseconds,
            number(round2(result.depth)),
            number(round2(result.diagonal))
        ),
        head: head.map(str::to_owned).to_vec(),
        rows: rows.collect(),
    };
    let mut blocks = vec![
        Block::Plot {
            svg: plot.svg.clone(),
            caption: "Down and to the left is better. Numbers beside points are azimuths, or the tolerance times the diagonal. What is exact but for rounding is drawn at 1e-6.".to_owned(),
        },
        Block::Table(table),
    ];
    if let Some(chord) = &result.chord {
        blocks.push(Block::Text(format!(
            "`chord` against a ray cast through the triangles from inside, chords of four mean edges and more ({} rays): curvature differs by {} (median), {} (99 %). Part of that is the triangles', which lie below the surface that they stand for.",
            chord.count,
            percent(chord.median),
            percent(chord.p99)
        )));
    }
    Section { title: result.name.clone(), blocks }
}

fn method(context: &Context) -> Section {
    Section {
        title: "How it was measured".to_owned(),
        blocks: vec![
            Block::Code(context.command.clone()),
            Block::Text(format!(
                "On one thread of {}. {} rays a mesh: points even over the area, directions even over the hemisphere. Times are medians of {} runs in which all filters and the ray casts take turns, taken in blocks of 250 queries, because other programs ran too. The ray casts are rays from far off to the same points, against the eight-wide hierarchy of `osculate-geom`.",
                context.machine, context.effort.queries, context.effort.runs
            )),
            Block::Text(String::from(
                "The truth for the minimum is found by slicing the whole mesh with the plane of ray and normal, without a walk. Every filter of the minimum looks as far as a ray with the cosine 0.2 to the normal can be in the material: a table knows no elevations. `chord` looks until the ray comes out or is below the material.",
            )),
            Block::Text(
                "`filter.csv` beside this page has all numbers, and every plot is there as SVG.".to_owned(),
            ),
        ],
    }
}

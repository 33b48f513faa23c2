//! The study of renderings as CSV, plots and a page.

use std::fmt::Write as _;

use osculate_geom::field::FilterKind;

use super::measure::{Effort, Results, Row};
use super::settings::{FINEST, Shown};
use crate::console::number;
use crate::study::axis::{Axis, Scale};
use crate::study::page::{Block, Page, Section, Table};
use crate::study::plot::{Line, Mark, Plot, Point, Series};

/// What the page says about the run.
#[derive(Debug)]
pub struct Context {
    /// As it was typed.
    pub command: String,
    /// Processor.
    pub machine: String,
    /// Threads that traced.
    pub threads: usize,
    /// The material.
    pub micro: String,
    /// How much was measured.
    pub effort: Effort,
}

/// One line per setting.
pub fn csv(results: &Results) -> String {
    let mut text =
        "form,knob,spp,error,flip,seconds,fastest,slowest,preparation_seconds,triangles,bytes\n".to_owned();
    for row in &results.rows {
        let shown = row.setting.shown;
        let _ = writeln!(
            text,
            "{},{},{},{:.5},{:.4},{:.4},{:.4},{:.4},{:.4},{},{}",
            shown.name(),
            shown.knob(),
            row.setting.spp,
            row.error,
            row.flip,
            row.seconds,
            row.range[0],
            row.range[1],
            row.preparation_seconds,
            row.triangles,
            row.bytes
        );
    }
    text
}

/// The most samples that any setting has for its form's default.
fn most(results: &Results) -> u32 {
    let other = |row: &&Row| matches!(row.setting.shown, Shown::Flat);
    results.rows.iter().find(other).map_or(1, |row| row.setting.spp)
}

/// Error against time, error against samples at knobs, error against memory, with the names of their files.
pub fn plots(results: &Results) -> Vec<(String, String)> {
    let most = most(results);
    let time: fn(&Row) -> f64 = |row| row.seconds;
    let memory: fn(&Row) -> f64 = |row| row.bytes as f64 / 1e6;
    let samples = vec![
        series(results, "neural, 1 sample and more", 0, Mark::Disc, &time, &|r| is_default(r), &by_samples),
        series(
            results,
            "displaced, 1 sample and more",
            1,
            Mark::Square,
            &time,
            &|r| r.setting.shown == FINEST,
            &by_samples,
        ),
    ];
    let knobs = |x: fn(&Row) -> f64| {
        let of = |name: &'static str, colour, mark| {
            series(
                results,
                name,
                colour,
                mark,
                &x,
                &move |r: &Row| r.setting.shown.name() == name && r.setting.spp == most,
                &by_knob,
            )
        };
        vec![
            of("neural", 0, Mark::Disc),
            of("displaced", 1, Mark::Square),
            of("march", 2, Mark::Diamond),
            of("oracle", 3, Mark::Triangle),
            of("flat", 7, Mark::Circle),
        ]
    };
    let plot = |title: String, x: &str, series| {
        let x = Axis { label: x.to_owned(), scale: Scale::Log };
        let y = Axis { label: "relative error of the pixels".to_owned(), scale: Scale::Log };
        Plot { title, x, y, series }.svg()
    };
    vec![
        (
            "render_samples.svg".to_owned(),
            plot("Error against time: samples".to_owned(), "seconds of tracing", samples),
        ),
        (
            "render_knobs.svg".to_owned(),
            plot(
                format!("Error against time: forms and their knobs, {most} samples"),
                "seconds of tracing",
                knobs(time),
            ),
        ),
        (
            "render_memory.svg".to_owned(),
            plot(
                format!("Error against memory, {most} samples"),
                "megabytes of geometry and material",
                knobs(memory),
            ),
        ),
    ]
}

fn is_default(row: &Row) -> bool {
    row.setting.shown == (Shown::Neural { filter: FilterKind::Chord })
}

fn by_samples(row: &Row) -> String {
    row.setting.spp.to_string()
}

fn by_knob(row: &Row) -> String {
    row.setting.shown.knob()
}

fn series(
    results: &Results,
    name: &str,
    colour: usize,
    mark: Mark,
    x: &dyn Fn(&Row) -> f64,
    keep: &dyn Fn(&Row) -> bool,
    label: &dyn Fn(&Row) -> String,
) -> Series {
    let point = |row: &Row| Point {
        x: x(row),
        y: row.error,
        hint: format!(
            "{} {}, {} samples: {:.2} s, error {:.4}",
            row.setting.shown.name(),
            row.setting.shown.knob(),
            row.setting.spp,
            row.seconds,
            row.error
        ),
        label: Some(label(row)),
    };
    let mut points: Vec<Point> = results.rows.iter().filter(|row| keep(row)).map(point).collect();
    // Samples follow each other; knobs of different kinds do not.
    let line = if name.contains(',') { Line::Thin } else { Line::None };
    points.sort_by(|a, b| a.x.total_cmp(&b.x));
    Series { name: name.to_owned(), colour, mark, line, points }
}

/// The page.
pub fn page(results: &Results, plots: &[(String, String)], context: &Context) -> String {
    let captions = [
        "Numbers are samples per pixel. A curve falls with the noise and levels off at what the form itself is off by; the reference has the displaced form's triangles, so that its curve levels off at the reference's noise.",
        "Every form with its knob turned. Points beside each other differ in time, above each other in error; noise is part of all errors alike.",
        "Triangles with their normals and UV, and the material: a model, or maps. The hierarchy over the triangles comes on top, in proportion to them.",
    ];
    let plot = |(i, (_, svg)): (usize, &(String, String))| Block::Plot {
        svg: svg.clone(),
        caption: captions[i].to_owned(),
    };
    let mut blocks: Vec<Block> = plots.iter().enumerate().map(plot).collect();
    blocks.push(Block::Table(table(results)));
    let page = Page {
        title: format!("Rendering {}: error, time and memory", context.micro),
        lead: lead(results),
        sections: vec![Section { title: "What was measured".to_owned(), blocks }, method(results, context)],
    };
    page.html()
}

/// The answer in sentences made of the numbers.
fn lead(results: &Results) -> Vec<String> {
    let most = most(results);
    let at =
        |keep: &dyn Fn(&Row) -> bool| results.rows.iter().find(|row| row.setting.spp == most && keep(row));
    let (Some(neural), Some(displaced)) = (at(&is_default), at(&|row| row.setting.shown == FINEST)) else {
        return Vec::new();
    };
    let mut text = vec![format!(
        "At {most} samples the neural material is off by {:.1} % of the mean, noise included, in {:.2} s of tracing after {:.2} s of preparation, with {} MB. Displaced triangles of the reference's own tolerance are off by {:.1} %, which is all noise, in {:.2} s after {:.1} s, with {} MB.",
        100.0 * neural.error,
        neural.seconds,
        neural.preparation_seconds,
        number((neural.bytes as f64 / 1e5).round() / 10.0),
        100.0 * displaced.error,
        displaced.seconds,
        displaced.preparation_seconds,
        number((displaced.bytes as f64 / 1e5).round() / 10.0)
    )];
    let coarse = results.rows.iter().filter(|row| {
        matches!(row.setting.shown, Shown::Displaced { .. })
            && row.setting.spp == most
            && row.error <= neural.error
    });
    if let Some(row) = coarse.min_by_key(|row| row.bytes) {
        text.push(format!(
            "The coarsest displaced mesh that is no worse (tolerance {}) traces in {:.2} s after {:.1} s, with {} MB and {} triangles.",
            row.setting.shown.knob(),
            row.seconds,
            row.preparation_seconds,
            number((row.bytes as f64 / 1e5).round() / 10.0),
            row.triangles
        ));
    }
    text
}

fn table(results: &Results) -> Table {
    let cells = |row: &Row| {
        vec![
            format!("{} {}", row.setting.shown.name(), row.setting.shown.knob()),
            row.setting.spp.to_string(),
            format!("{:.2} %", 100.0 * row.error),
            format!("{:.4}", row.flip),
            format!("{:.3}", row.seconds),
            format!("{:.3} to {:.3}", row.range[0], row.range[1]),
            format!("{:.2}", row.preparation_seconds),
            row.triangles.to_string(),
            format!("{:.1}", row.bytes as f64 / 1e6),
        ]
    };
    let head =
        ["form", "samples", "error", "FLIP", "tracing, s", "runs", "preparation, s", "triangles", "MB"];
    Table::of_texts(
        "Error is the root mean square over pixels, relative to the reference's mean.",
        &head,
        results.rows.iter().map(cells),
    )
}

fn method(results: &Results, context: &Context) -> Section {
    let Effort { pixels, reference_spp, runs, .. } = context.effort;
    Section {
        title: "How it was measured".to_owned(),
        blocks: vec![
            Block::Code(context.command.clone()),
            Block::Text(format!(
                "On {}, {} threads. The torus of the paper's protocol under 6 by 3 tiles of {}, {pixels} by {pixels} pixels, elevation 35 degrees, a sun and an even sky. The reference is the displaced mesh at {reference_spp} samples, with a noise of {:.2} %. Every setting was rendered {runs} times with other noise: errors are root mean squares and times medians over the runs.",
                context.machine,
                context.threads,
                context.micro,
                100.0 * results.reference_noise
            )),
            Block::Text("`neural` names its filter: `chord` is asked by the chord query, `march` and `point` by the paper's. `march` and `oracle` are asked by the chord query too; the march has direct light only below the surface, and the others interreflection. Paths between objects go on in all of them.".to_owned()),
            Block::Text("`render.csv` beside this page has all numbers, and every plot is there as SVG.".to_owned()),
        ],
    }
}

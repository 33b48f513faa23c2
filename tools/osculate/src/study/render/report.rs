//! The study of renderings as CSV, plots and a page.

use std::fmt::Write as _;

use super::measure::{Effort, NetworkSize, Results, Row};
use super::settings::{DEFAULT, Setting, Shown};
use crate::console::{count, number};
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
        "form,knob,spp,error,bias,bias_error,flip,seconds,fastest,slowest,preparation_seconds,triangles,bytes\n".to_owned();
    for row in &results.rows {
        let _ = writeln!(
            text,
            "{},{},{},{:.5},{:.5},{:.5},{:.4},{:.4},{:.4},{:.4},{:.4},{},{}",
            row.setting.shown.name(),
            row.knob,
            row.setting.spp,
            row.error,
            row.bias,
            row.bias_error,
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

/// Error against time over samples; bias against time and against memory over knobs, with the names of their files.
pub fn plots(results: &Results, effort: &Effort) -> Vec<(String, String)> {
    let most = effort.extent.most;
    let (error, bias): (Number, Number) =
        (|row| row.error, |row| if is_seen(row) { row.bias } else { f64::NAN });
    let (time, memory): (Number, Number) = (|row| row.seconds, |row| row.bytes as f64 / 1e6);
    let finest = effort.extent.finest();
    let series = |name: &str, look, numbers, keep: &dyn Fn(&Row) -> bool, label| {
        series(results, name, look, numbers, keep, label)
    };
    let samples = vec![
        series(
            "neural",
            (0, Mark::Disc, Line::Thin),
            (time, error),
            &|r| r.setting.shown == DEFAULT,
            by_samples,
        ),
        series(
            "displaced",
            (1, Mark::Square, Line::Thin),
            (time, error),
            &|r| r.setting.shown == finest,
            by_samples,
        ),
    ];
    let knobs = |x: Number| {
        let of = |name: &'static str, colour, mark| {
            let keep = move |r: &Row| r.setting.shown.name() == name && r.setting.spp == most;
            series(name, (colour, mark, Line::None), (x, bias), &keep, by_knob)
        };
        vec![
            of("neural", 0, Mark::Disc),
            of("network", 5, Mark::Circle),
            of("displaced", 1, Mark::Square),
            of("march", 2, Mark::Diamond),
            of("oracle", 3, Mark::Triangle),
            of("flat", 7, Mark::Circle),
        ]
        .into_iter()
        .filter(|series| !series.points.is_empty())
        .collect()
    };
    let plot = |title: String, x: &str, y: &str, series| {
        let axis = |label: &str| Axis { label: label.to_owned(), scale: Scale::Log };
        Plot { title, x: axis(x), y: axis(y), series }.svg()
    };
    let tracing = format!("seconds of tracing, {most} samples");
    vec![
        (
            "render_samples.svg".to_owned(),
            plot(
                "Error against time, by samples per pixel".to_owned(),
                "seconds of tracing",
                "error, relative",
                samples,
            ),
        ),
        (
            "render_knobs.svg".to_owned(),
            plot("Bias against time, by form and knob".to_owned(), &tracing, "bias, relative", knobs(time)),
        ),
        (
            "render_memory.svg".to_owned(),
            plot(
                "Bias against memory, by form and knob".to_owned(),
                "megabytes of geometry and material",
                "bias, relative",
                knobs(memory),
            ),
        ),
    ]
}

/// Whether a bias stands out of the noise.
fn is_seen(row: &Row) -> bool {
    row.bias > 2.0 * row.bias_error
}

/// A bias in words, or what it is certainly below.
fn bias_words(row: &Row) -> String {
    if is_seen(row) {
        format!("{} ± {:.2}", percent(row.bias), 100.0 * row.bias_error)
    } else {
        format!("under {}", percent(row.bias + 2.0 * row.bias_error))
    }
}

type Number = fn(&Row) -> f64;

fn by_samples(row: &Row) -> String {
    row.setting.spp.to_string()
}

fn by_knob(row: &Row) -> String {
    row.knob.clone()
}

fn series(
    results: &Results,
    name: &str,
    (colour, mark, line): (usize, Mark, Line),
    (x, y): (Number, Number),
    keep: &dyn Fn(&Row) -> bool,
    label: fn(&Row) -> String,
) -> Series {
    let point = |row: &Row| Point {
        x: x(row),
        y: y(row),
        hint: format!(
            "{} {}, {} samples: {:.2} s, error {:.4}, bias {:.4}",
            row.setting.shown.name(),
            row.knob,
            row.setting.spp,
            row.seconds,
            row.error,
            row.bias
        ),
        label: Some(label(row)),
    };
    let mut points: Vec<Point> = results.rows.iter().filter(|row| keep(row)).map(point).collect();
    points.sort_by(|a, b| a.x.total_cmp(&b.x));
    Series { name: name.to_owned(), colour, mark, line, points }
}

/// The page.
pub fn page(results: &Results, plots: &[(String, String)], context: &Context) -> String {
    let captions = [
        "Numbers are samples per pixel. A curve falls with the noise and levels off at the form's bias. The reference has the displaced form's triangles, so that its curve goes on to the reference's own noise.",
        "Every form with its knob turned. Bias is what more samples do not remove. Displaced triangles of the reference's own tolerance have none and are not in the picture; where noise hides a bias, its point is missing too.",
        "Triangles with their normals and UV, and the material: a model, or maps. The hierarchy over the triangles comes on top, in proportion to them.",
    ];
    let plot = |i: usize| Block::Plot { svg: plots[i].1.clone(), caption: captions[i].to_owned() };
    let section = |title: &str, blocks| Section { title: title.to_owned(), blocks };
    let mut sections =
        vec![section("Samples", vec![plot(0)]), section("Forms and their knobs", vec![plot(1), plot(2)])];
    sections.push(section("Size of the networks", networks(results, context)));
    sections.push(section("All numbers", vec![Block::Table(table(results))]));
    sections.push(method(results, context));
    let title = format!("Rendering {}: error, time and memory", context.micro);
    Page { title, lead: lead(results, &context.effort), sections }.html()
}

/// What the models are, and what they come to.
fn networks(results: &Results, context: &Context) -> Vec<Block> {
    let most = context.effort.extent.most;
    let shown = |i: usize| i.checked_sub(1).map_or(DEFAULT, |index| Shown::Network { index });
    let cells = |(i, size): (usize, &NetworkSize)| {
        let of = results.rows.iter().find(|row| row.setting == Setting { shown: shown(i), spp: most })?;
        Some(vec![
            size.name().to_owned(),
            format!("{} x {}", size.hidden[1], size.hidden[0]),
            format!("{}, {}", size.taps[0], size.taps[1]),
            format!("{}, {}", size.texture[0], size.texture[1]),
            size.products.to_string(),
            format!("{:.3}", size.bytes as f64 / 1e6),
            bias_words(of),
            percent(of.error),
            format!("{:.3}", of.seconds),
        ])
    };
    let head = [
        "model",
        "hidden layers",
        "taps",
        "texels, features",
        "products",
        "MB",
        "bias",
        "error",
        "tracing, s",
    ];
    let caption = "The first is the model under study. Taps of opacity and offset; texels along a side and features of the colour's texture; multiplications of a full query.";
    let rows = results.networks.iter().enumerate().filter_map(cells);
    let mut blocks = vec![Block::Table(Table::of_texts(caption, &head, rows))];
    if results.networks.len() == 1 {
        blocks.push(Block::Text(
            "No other model was given (`--also MODEL.sbtf`), so that this page says nothing about the size of networks.".to_owned(),
        ));
    }
    blocks
}

fn percent(x: f64) -> String {
    format!("{:.2} %", 100.0 * x)
}

fn megabytes(row: &Row) -> String {
    number((row.bytes as f64 / 1e5).round() / 10.0)
}

/// The answer in sentences made of the numbers.
fn lead(results: &Results, effort: &Effort) -> Vec<String> {
    let most = effort.extent.most;
    let at = |shown: Shown| results.rows.iter().find(|row| row.setting == Setting { shown, spp: most });
    let (Some(neural), Some(displaced)) = (at(DEFAULT), at(effort.extent.finest())) else {
        return Vec::new();
    };
    let mut text = vec![format!(
        "At {most} samples the neural material is off by {} of the mean, and by {} without noise, in {:.2} s of tracing after {:.2} s of preparation, with {} MB. Displaced triangles of the reference's own tolerance are off by {}, all of it noise, in {:.2} s after {:.1} s, with {} MB.",
        percent(neural.error),
        bias_words(neural),
        neural.seconds,
        neural.preparation_seconds,
        megabytes(neural),
        percent(displaced.error),
        displaced.seconds,
        displaced.preparation_seconds,
        megabytes(displaced)
    )];
    let coarse = results.rows.iter().filter(|row| {
        matches!(row.setting.shown, Shown::Displaced { .. })
            && row.setting.spp == most
            && row.bias <= neural.bias
    });
    if let Some(row) = coarse.min_by_key(|row| row.bytes) {
        text.push(format!(
            "The coarsest displaced mesh with no more bias (tolerance {}) traces in {:.2} s after {:.1} s, with {} MB and {} triangles.",
            row.knob,
            row.seconds,
            row.preparation_seconds,
            megabytes(row),
            row.triangles
        ));
    }
    text
}

fn table(results: &Results) -> Table {
    let cells = |row: &Row| {
        vec![
            format!("{} {}", row.setting.shown.name(), row.knob),
            row.setting.spp.to_string(),
            percent(row.error),
            bias_words(row),
            format!("{:.4}", row.flip),
            format!("{:.3}", row.seconds),
            format!("{:.3} to {:.3}", row.range[0], row.range[1]),
            format!("{:.2}", row.preparation_seconds),
            row.triangles.to_string(),
            format!("{:.1}", row.bytes as f64 / 1e6),
        ]
    };
    let head = [
        "form",
        "samples",
        "error",
        "bias",
        "FLIP",
        "tracing, s",
        "runs",
        "preparation, s",
        "triangles",
        "MB",
    ];
    Table::of_texts(
        "Error is the root mean square over pixels and channels, relative to the reference's mean; bias is what is left of it without noise, with one standard deviation.",
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
                "On {}, {}. The torus of the paper's protocol under 6 by 3 tiles of {}, {pixels} by {pixels} pixels, elevation 35 degrees, a sun and an even sky. The reference is the displaced mesh (tolerance {} depths) at {reference_spp} samples, in two halves, with a noise of {:.2} %. Every setting was rendered {runs} times with other noise: errors are root mean squares and times medians over the runs. The bias is the root of the mean product of the differences of two runs, each to another half of the reference, in which noise averages out.",
                context.machine,
                count(context.threads, "thread"),
                context.micro,
                context.effort.extent.finest,
                100.0 * results.reference_noise
            )),
            Block::Text("`neural` names its filter: `chord` and its table, `baked_chord`, are asked by the chord query, `march` and `point` by the paper's. `network` is another model of the same microstructure, by the chord query. `march` and `oracle` are asked by the chord query too; the march has direct light only below the surface, and the others interreflection. Paths between objects go on in all of them.".to_owned()),
            Block::Text("`render.csv` beside this page has all numbers, and every plot is there as SVG.".to_owned()),
        ],
    }
}

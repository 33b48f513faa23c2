//! The study of materials as CSV, plots and a page.

use std::fmt::Write as _;

use super::measure::{Effort, Row};
use super::settings::Knob;
use crate::console::{bytes, number};
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
    /// The material.
    pub micro: String,
    /// How much was measured.
    pub effort: Effort,
}

/// One line per model.
pub fn csv(rows: &[Row]) -> String {
    let mut text =
        "knob,value,steps,left,psnr,flip,batched_nanoseconds,single_nanoseconds,bytes,training_seconds\n"
            .to_owned();
    for row in rows {
        let _ = writeln!(
            text,
            "{},{},{},{:.5},{:.3},{:.4},{:.1},{:.1},{},{:.2}",
            name(row.knob),
            row.value,
            row.steps,
            row.left,
            row.psnr,
            row.flip,
            row.batched_nanoseconds,
            row.single_nanoseconds,
            row.bytes,
            row.training_seconds
        );
    }
    text
}

fn name(knob: Knob) -> &'static str {
    match knob {
        Knob::Default => "default",
        Knob::Taps => "taps",
        Knob::Width => "width",
        Knob::Resolution => "resolution",
        Knob::Channels => "channels",
        Knob::Steps => "steps",
        Knob::Bits => "bits",
    }
}

const KNOBS: [(Knob, Mark); 6] = [
    (Knob::Taps, Mark::Disc),
    (Knob::Width, Mark::Square),
    (Knob::Resolution, Mark::Diamond),
    (Knob::Channels, Mark::Triangle),
    (Knob::Steps, Mark::Circle),
    (Knob::Bits, Mark::Circle),
];

/// Silhouette and appearance against what they cost, with the names of their files.
pub fn plots(rows: &[Row]) -> Vec<(String, String)> {
    let plot = |title: &str, x: (&str, fn(&Row) -> f64), y: (&str, Scale, fn(&Row) -> f64)| {
        let series = |knob: Knob, colour: usize, mark: Mark, title: &str| Series {
            name: title.to_owned(),
            colour,
            mark,
            line: Line::Thin,
            points: rows
                .iter()
                .filter(|row| row.knob == knob)
                .map(|row| Point {
                    x: x.1(row),
                    y: y.2(row),
                    hint: format!("{title} {}: {}", row.value, number(y.2(row))),
                    label: Some(row.value.clone()),
                })
                .collect(),
        };
        let mut all = vec![series(Knob::Default, 6, Mark::Disc, "default form")];
        all.extend(KNOBS.iter().enumerate().map(|(i, &(knob, mark))| series(knob, i, mark, name(knob))));
        let axis = |label: &str, scale| Axis { label: label.to_owned(), scale };
        Plot { title: title.to_owned(), x: axis(x.0, Scale::Log), y: axis(y.0, y.1), series: all }.svg()
    };
    let time = ("nanoseconds of a query in a batch", (|r| r.batched_nanoseconds) as fn(&Row) -> f64);
    let training = ("seconds of training", (|r| r.training_seconds) as fn(&Row) -> f64);
    let size = ("bytes", (|r| r.bytes as f64) as fn(&Row) -> f64);
    let left = ("share of the silhouette's error left", Scale::Log, (|r| r.left) as fn(&Row) -> f64);
    let psnr = ("PSNR, dB", Scale::Linear, (|r| r.psnr) as fn(&Row) -> f64);
    vec![
        ("silhouette_time.svg".to_owned(), plot("Silhouette against the time of a query", time, left)),
        ("silhouette_training.svg".to_owned(), plot("Silhouette against training", training, left)),
        ("silhouette_size.svg".to_owned(), plot("Silhouette against size", size, left)),
        ("appearance_time.svg".to_owned(), plot("Appearance against the time of a query", time, psnr)),
    ]
}

/// The page.
pub fn page(rows: &[Row], plots: &[(String, String)], context: &Context) -> String {
    let cells = |row: &Row| {
        vec![
            format!("{} {}", name(row.knob), row.value),
            format!("{:.3}", row.left),
            format!("{:.1}", row.psnr),
            format!("{:.3}", row.flip),
            format!("{:.0}", row.batched_nanoseconds),
            format!("{:.0}", row.single_nanoseconds),
            bytes(row.bytes as u64),
            format!("{:.0}", row.training_seconds),
        ]
    };
    let head =
        ["model", "error left", "PSNR, dB", "FLIP", "batched, ns", "single, ns", "size", "training, s"];
    let table = Table::of_texts("One model a row", &head, rows.iter().map(cells));
    let captions = [
        "Lower is better, and further left is cheaper. Each series turns one knob of the default form.",
        "What longer training buys.",
        "What larger textures buy, and what fewer bits cost.",
        "Higher is better.",
    ];
    let pictures = plots
        .iter()
        .zip(captions)
        .map(|((_, svg), caption)| Block::Plot { svg: svg.clone(), caption: caption.to_owned() });
    let method = vec![
        Block::Code(context.command.clone()),
        Block::Text(format!(
            "{}; times of queries are medians on one thread, training is on all. {} steps of {} samples for each part, seed {}. The silhouette is judged by {} rays at each of six curvatures, appearance by pictures of {} pixels a side at five.",
            context.machine,
            context.effort.steps,
            context.effort.batch,
            context.effort.seed,
            context.effort.rays,
            context.effort.size
        )),
    ];
    let page = Page {
        title: format!("What a neural material costs: {}", context.micro),
        lead: vec![format!(
            "One microstructure, `{}`, many models: each turns one knob of the default form. The silhouette's figure is the share of the error of an opaque bounding surface that is left.",
            context.micro
        )],
        sections: vec![
            Section { title: "All models".to_owned(), blocks: vec![Block::Table(table)] },
            Section { title: "What costs what".to_owned(), blocks: pictures.collect() },
            Section { title: "How it was measured".to_owned(), blocks: method },
        ],
    };
    page.html()
}

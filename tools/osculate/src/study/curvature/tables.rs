//! The tables of the study.

use osculate_geom::shapes::study::StudyShape;

use super::exponents::exponents;
use super::figures::readable;
use super::rows::Row;
use super::settings::Setting;
use super::summary::{Mean, fastest_within, means, most_accurate, most_robust, noises, shapes};
use crate::study::page::{Cell, Table, Tone};

/// How much worse than the best peer in hindsight an error of ours may be.
pub const ALLOWED: f64 = 1.2;

/// Whether a shape is the limit surface of an everyday mesh.
pub fn is_everyday(shape: &str) -> bool {
    !StudyShape::ALL.iter().any(|s| s.name() == shape)
}

/// `0.001` as `0.1 %`.
pub fn percent(share: f64) -> String {
    let text = format!("{:.2}", 100.0 * share);
    format!("{} %", text.trim_end_matches('0').trim_end_matches('.'))
}

fn error(x: f64) -> String {
    if x >= 0.001 { format!("{x:.4}") } else { format!("{x:.1e}") }
}

fn analytic(rows: &[Row]) -> Vec<Row> {
    rows.iter().filter(|r| r.purpose == "accuracy" && !is_everyday(&r.shape)).cloned().collect()
}

fn arguments(mean: &Mean, settings: &[Setting]) -> String {
    let own = settings.iter().find(|s| s.method == mean.row.method && s.knobs == mean.row.setting);
    own.map_or_else(|| mean.row.name(), |s| format!("`{}`", s.arguments))
}

/// Which setting to take for which need, derived from the rows.
pub fn recommendations(rows: &[Row], settings: &[Setting]) -> Table {
    let rows = analytic(rows);
    let mut body: Vec<Vec<String>> = Vec::new();
    let mut add = |need: String, mean: Option<&Mean>| {
        if let Some(mean) = mean {
            let us = format!("{:.2}", mean.us);
            let all = mean.us_all.map_or_else(String::new, |us| format!("{us:.2}"));
            body.push(vec![need, arguments(mean, settings), error(mean.median), error(mean.p95), us, all]);
        }
    };
    for noise in noises(&rows) {
        let means: Vec<Mean> = means(&rows, noise).into_iter().filter(|m| m.row.is_ours()).collect();
        let ours: Vec<&Mean> = means.iter().collect();
        let kind = match noise {
            n if n <= 0.0 => "no noise (CAD, simulation, formula)".to_owned(),
            n => format!("noise of {} of an edge", percent(n)),
        };
        let best = most_accurate(ours.iter().copied());
        let quick = fastest_within(&ours, ALLOWED);
        let fastest = ours.iter().copied().filter(|_| noise <= 0.0).min_by(|a, b| a.us.total_cmp(&b.us));
        let names = [best, quick, fastest].map(|m| m.map(|m| m.row.name()));
        add(format!("{kind}: most accurate"), best);
        if names[1] != names[0] {
            add(format!("{kind}: at most {ALLOWED} times that error, faster"), quick);
        }
        if names[2] != names[0] && names[2] != names[1] {
            add(format!("{kind}: fastest of all"), fastest);
        }
    }
    if let Some((mean, factor)) = most_robust(&rows) {
        add(format!("noise unknown: at worst {factor:.1} times the best for the noise"), Some(&mean));
    }
    let clean = means(&rows, 0.0);
    let is_default = |m: &&Mean| m.row.is_ours() && m.row.method == "libigl" && m.row.setting == "5 rings";
    add("libigl's own numbers, to rounding".into(), clean.iter().find(is_default));
    Table::of_texts(
        "Means over the analytic shapes; those of the last two rows without noise. Error is that of the worse curvature times the shape's radius; time in microseconds a vertex.",
        &["need", "setting", "median", "95 %", "time, 1 thread", "all threads"],
        body,
    )
}

/// An error that a row has.
type Error = fn(&Row) -> Option<f64>;

/// Our best error over that of the best peer, in hindsight on both sides, shape by shape and noise by noise: one table for the
/// median, one for 95 %. None without peers.
pub fn against_peers(rows: &[Row]) -> Vec<Table> {
    let rows: Vec<Row> = rows.iter().filter(|r| r.purpose == "accuracy").cloned().collect();
    if rows.iter().all(Row::is_ours) {
        return Vec::new();
    }
    let kinds: [(&str, Error); 2] = [("median", |r| r.median), ("95 %", |r| r.p95)];
    kinds.map(|(words, value)| ratios(&rows, words, value)).into()
}

fn ratios(rows: &[Row], words: &str, value: Error) -> Table {
    let mut body = Vec::new();
    for shape in shapes(rows) {
        for noise in noises(rows) {
            let here = || rows.iter().filter(|r| r.shape == shape && r.noise.total_cmp(&noise).is_eq());
            let best = |ours: bool| {
                let known = here().filter(|r| r.is_ours() == ours).filter_map(|r| Some((value(r)?, r)));
                known.min_by(|a, b| a.0.total_cmp(&b.0))
            };
            let (Some(own), Some(peer)) = (best(true), best(false)) else { continue };
            let ratio = own.0 / peer.0;
            let tone = if ratio <= ALLOWED { Tone::Good } else { Tone::Bad };
            let texts = [
                readable(&shape),
                percent(noise),
                error(own.0),
                own.1.short_name(),
                error(peer.0),
                peer.1.name(),
            ];
            let mut cells = texts.map(Cell::new).to_vec();
            cells.push(Cell::toned(format!("{ratio:.2}"), tone));
            body.push(cells);
        }
    }
    let good = body.iter().filter(|row| row.last().is_some_and(|c| c.tone == Tone::Good)).count();
    let head = ["shape", "noise", "ours", "by", "best other", "by", "ratio"];
    Table {
        caption: format!(
            "Error that {} of the vertices stay below. Green: at most {ALLOWED} times the best other program, {good} of {}.",
            if words == "median" { "half" } else { words },
            body.len()
        ),
        head: head.map(str::to_owned).to_vec(),
        rows: body,
    }
}

/// How honest the stated errors are.
pub fn calibration(rows: &[Row]) -> Table {
    let rows: Vec<Row> = rows.iter().filter(|r| r.is_ours() && r.purpose == "accuracy").cloned().collect();
    let levels = noises(&rows);
    let mut names: Vec<String> = Vec::new();
    for row in &rows {
        if !names.contains(&row.short_name()) {
            names.push(row.short_name());
        }
    }
    let body = names.into_iter().map(|name| {
        let mut cells = vec![Cell::new(name.clone())];
        for noise in &levels {
            let own = rows.iter().filter(|r| r.short_name() == name && r.noise.total_cmp(noise).is_eq());
            let (covered, ratios): (Vec<f64>, Vec<f64>) =
                own.filter_map(|r| Some((r.covered?, r.stated_over_true?))).unzip();
            let count = covered.len().max(1) as f64;
            let share = covered.iter().sum::<f64>() / count;
            let ratio = (ratios.iter().map(|r| r.max(1e-300).ln()).sum::<f64>() / count).exp();
            let tone = if share >= 0.9 && ratio <= 10.0 { Tone::Good } else { Tone::Plain };
            cells.push(Cell::toned(format!("{:.0} %, {ratio:.1}x", 100.0 * share), tone));
        }
        cells
    });
    let head =
        std::iter::once("setting".to_owned()).chain(levels.iter().map(|n| format!("noise {}", percent(*n))));
    Table {
        caption: "Share of the vertices whose true error is at most the stated one, and the median of stated over true error; over all shapes. Green: 90 % are covered and the statement is within ten times the truth.".into(),
        head: head.collect(),
        rows: body.collect(),
    }
}

/// Growth of time and memory with the mesh.
pub fn growth_table(rows: &[Row]) -> Table {
    let body = exponents(rows).into_iter().map(|e| {
        let own = rows.iter().filter(|r| {
            r.purpose == "scaling"
                && (&r.program, &r.method, &r.setting) == (&e.program, &e.method, &e.setting)
        });
        let largest = own.filter(|r| r.us_per_vertex.is_some()).max_by_key(|r| r.vertices);
        let of_largest = |value: &dyn Fn(&Row) -> Option<f64>, digits: usize| {
            largest.and_then(value).map_or_else(String::new, |x| format!("{x:.digits$}"))
        };
        let power = |p: Option<f64>| p.map_or_else(String::new, |p| format!("{p:.3}"));
        vec![
            largest.map_or_else(|| e.method.clone(), Row::name),
            largest.map_or_else(String::new, |r| r.vertices.to_string()),
            of_largest(&|r| r.us_per_vertex, 2),
            of_largest(&|r| r.us_per_vertex_all_threads, 2),
            of_largest(&|r| r.bytes_per_vertex, 0),
            power(e.seconds),
            power(e.seconds_all_threads),
            power(e.bytes),
            power(e.error),
        ]
    });
    Table::of_texts(
        "Left: at the largest mesh that was measured. Right: exponents of the laws that fit all of the meshes best (least squares of logarithms), also in growth.csv. 1 is time or memory in proportion to the vertices; the error of an estimator of order p falls with exponent -p/2.",
        &[
            "setting",
            "vertices",
            "µs a vertex, 1 thread",
            "all threads",
            "bytes a vertex",
            "exponent of time, 1 thread",
            "all threads",
            "of memory",
            "of error",
        ],
        body.collect::<Vec<_>>(),
    )
}

/// All settings at one noise level, most accurate first.
pub fn everything(rows: &[Row], noise: f64) -> Table {
    let mut means = means(&analytic(rows), noise);
    means.sort_by(|a, b| a.score().total_cmp(&b.score()));
    let body = means.iter().map(|m| {
        let bytes = m.row.bytes_per_vertex.map_or_else(String::new, |b| format!("{b:.0}"));
        vec![m.row.name(), error(m.median), error(m.p95), format!("{:.2}", m.us), bytes]
    });
    Table::of_texts(
        &format!(
            "Noise {}, means over the analytic shapes; settings that failed on a shape are missing.",
            percent(noise)
        ),
        &["setting", "median", "95 %", "µs a vertex", "bytes a vertex"],
        body.collect::<Vec<_>>(),
    )
}

/// What did not give an answer.
pub fn failures(rows: &[Row]) -> Vec<String> {
    let told = rows.iter().filter(|r| !r.note.is_empty());
    told.map(|r| format!("{} on {}: {}", r.name(), r.mesh, r.note)).collect()
}

//! What came of it: lines for a person, and a page with pictures.

use std::fmt::Write as _;

use anyhow::Result;
use osculate_geom::field::FilterKind;
use osculate_render::output::png_bytes;
use osculate_render::scene::QueryForm;

use super::figures::Captioned;
use super::flicker::{FlickerRow, Motion};
use super::silhouettes::SilhouetteRow;
use crate::commands::eval_scenes::{Comparison, Split};
use crate::console::Console;
use crate::study::page::{Block, Page, Section, Table};
use crate::study::run::processor;

/// Prints the tables.
pub fn print(results: &[Comparison], console: &Console) {
    for result in results {
        console.result(format_args!("{} on {}, depth {}", result.name, result.scene, result.depth));
        console.result(
            "  form    asked by      curvature    IoU      band     left     10      35      60 deg   seconds",
        );
        for row in &result.silhouettes {
            console.result(format_args!(
                "  {:<7} {:<12}  {:<9}  {:.5}  {:.5}  {:>6.3}  {}   {:>6.2}",
                row.form,
                asked_by(row.filter),
                if row.exact_curvature { "exact" } else { "mesh" },
                row.iou,
                row.band_iou,
                row.left,
                row.left_by_camera.iter().map(|l| format!("{l:>6.3}")).collect::<Vec<_>>().join("  "),
                row.seconds,
            ));
        }
        console.result(format_args!("  split   {}", split_words(&result.split)));
        if !result.pictures.is_empty() {
            console.result("  form        PSNR     SSIM     FLIP    tracing   prepared   triangles   geometry   material");
        }
        for p in &result.pictures {
            console.result(format_args!(
                "  {:<10} {:>5.2}   {:.4}   {:.4}   {:>6.2} s   {:>6.2} s   {:>9}   {:>5.1} MB   {:>5.1} MB",
                p.form,
                p.psnr,
                p.ssim,
                p.flip,
                p.tracing_seconds,
                p.preparation_seconds,
                p.cost.triangles,
                p.cost.geometry_bytes as f64 / 1e6,
                p.material_bytes as f64 / 1e6,
            ));
        }
        for row in &result.flicker {
            console.result(format_args!(
                "  flicker, turning {:<6}  {:<10} {}, {} of the truth's",
                motion_name(row.motion),
                row.form,
                plus_minus(row.flicker, row.error, 5),
                ratio_words(row)
            ));
        }
    }
}

fn split_words(split: &Split) -> String {
    let mut words = format!("query and form {:.3}, fit {:+.3}", split.form, split.fit);
    if let Some(curvature) = split.curvature {
        let _ = write!(words, ", curvature {curvature:+.3}");
    }
    words
}

fn plus_minus(value: f64, error: f64, digits: usize) -> String {
    format!("{value:.digits$} ± {error:.digits$}")
}

fn ratio_words(row: &FlickerRow) -> String {
    match row.ratio.zip(row.ratio_error) {
        Some((ratio, error)) => plus_minus(ratio, error, 3),
        None => "an unknown share".to_owned(),
    }
}

fn motion_name(motion: Motion) -> &'static str {
    match motion {
        Motion::Camera => "camera",
        Motion::Light => "sun",
    }
}

fn asked_by(filter: Option<FilterKind>) -> &'static str {
    match filter {
        None => "-",
        Some(FilterKind::Baked) => "paper, table",
        Some(FilterKind::BakedChord) => "chord, table",
        Some(filter) => match QueryForm::of_filter(filter) {
            QueryForm::Paper => "paper",
            QueryForm::Chord => "chord",
        },
    }
}

/// The page: all materials at a glance, the tables, then pictures of each.
pub fn page(
    results: &[Comparison],
    overview: Option<&Captioned>,
    pictures: &[Vec<Captioned>],
    command: &str,
) -> Result<String> {
    let shown = |(caption, picture): &Captioned| {
        anyhow::Ok(Block::Picture { png: png_bytes(picture)?, caption: caption.clone() })
    };
    let mut sections = Vec::new();
    if let Some(overview) = overview {
        sections.push(Section { title: "At a glance".into(), blocks: vec![shown(overview)?] });
    }
    sections.push(Section {
        title: "Silhouettes".into(),
        blocks: vec![
            Block::Text("`left` is the share of the opaque mesh's error that remains, (1 - IoU) / (1 - IoU of the base), over all cameras together. `band` is the IoU among the samples between the mesh and the lowest height. The oracle traces every query exactly: what it leaves is what the query and the model's form cost, and the model's difference to it is the fit.".into()),
            Block::Table(silhouette_table(results)),
        ],
    });
    if results.iter().any(|r| !r.pictures.is_empty()) {
        let texts = "Against the displaced mesh under the same light, means over the cameras. The displaced row compares two renderings of it with other seeds: its noise.";
        sections.push(Section {
            title: "Pictures".into(),
            blocks: vec![Block::Text(texts.into()), Block::Table(picture_table(results))],
        });
    }
    if results.iter().any(|r| !r.flicker.is_empty()) {
        let text = "Root mean square of the second difference of luminance from frame to frame, under a camera that turns and under a sun that turns by so many degrees a frame. Each sequence is rendered twice, and the product of both stands for the square, so that noise does not count; what it does to the result is one standard deviation after the ±. The motion is the same in all forms: the ratio to the truth says what a form adds. It is unknown where noise drowns the truth's.";
        sections.push(Section {
            title: "Flicker".into(),
            blocks: vec![Block::Text(text.into()), Block::Table(flicker_table(results))],
        });
    }
    for (result, of_result) in results.iter().zip(pictures) {
        let blocks = of_result.iter().map(shown).collect::<Result<_>>()?;
        sections.push(Section { title: format!("{} on {}", result.name, result.scene), blocks });
    }
    let page = Page {
        title: "Neural materials on curved meshes, against displaced truth".into(),
        lead: vec![format!("Made by `{command}` on {}.", processor())],
        sections,
    };
    Ok(page.html())
}

fn silhouette_table(results: &[Comparison]) -> Table {
    let find = |r: &Comparison, form: &str, query: QueryForm, exact: bool| -> String {
        let of = |row: &&SilhouetteRow| {
            row.form == form && row.query == Some(query) && row.exact_curvature == exact
        };
        r.silhouettes.iter().find(of).map_or_else(|| "-".into(), |row| format!("{:.3}", row.left))
    };
    let row = |r: &Comparison| {
        let chord =
            r.silhouettes.iter().find(|row| row.form == "model" && row.query == Some(QueryForm::Chord));
        let number = |x: Option<f64>| x.map_or_else(|| "-".into(), |x| format!("{x:.4}"));
        vec![
            r.name.clone(),
            r.scene.clone(),
            format!("{}", r.depth),
            number(r.silhouettes.first().map(|row| row.iou)),
            number(chord.map(|row| row.iou)),
            number(chord.map(|row| row.band_iou)),
            find(r, "model", QueryForm::Paper, false),
            find(r, "model", QueryForm::Chord, false),
            find(r, "oracle", QueryForm::Paper, false),
            find(r, "oracle", QueryForm::Chord, false),
            find(r, "oracle", QueryForm::Chord, true),
        ]
    };
    let head = [
        "model",
        "mesh",
        "depth",
        "base IoU",
        "IoU (chord)",
        "band IoU",
        "left, paper",
        "left, chord",
        "oracle, paper",
        "oracle, chord",
        "exact curvature",
    ];
    Table::of_texts("Share of the base error left", &head, results.iter().map(row))
}

fn picture_table(results: &[Comparison]) -> Table {
    let head = [
        "model",
        "form",
        "PSNR, dB",
        "SSIM",
        "FLIP",
        "tracing, s",
        "preparation, s",
        "triangles",
        "geometry, MB",
        "material, MB",
    ];
    let rows = results.iter().flat_map(|r| {
        r.pictures.iter().map(|p| {
            vec![
                format!("{} on {}", r.name, r.scene),
                p.form.to_owned(),
                format!("{:.2}", p.psnr),
                format!("{:.4}", p.ssim),
                format!("{:.4}", p.flip),
                format!("{:.2}", p.tracing_seconds),
                format!("{:.2}", p.preparation_seconds),
                p.cost.triangles.to_string(),
                format!("{:.1}", p.cost.geometry_bytes as f64 / 1e6),
                format!("{:.1}", p.material_bytes as f64 / 1e6),
            ]
        })
    });
    Table::of_texts("Appearance, time and memory", &head, rows)
}

fn flicker_table(results: &[Comparison]) -> Table {
    let rows = results.iter().flat_map(|r| {
        r.flicker.iter().map(|row| {
            vec![
                format!("{} on {}", r.name, r.scene),
                format!("{}, {}°", motion_name(row.motion), row.step),
                row.form.to_owned(),
                plus_minus(row.flicker, row.error, 5),
                if row.ratio.is_some() { ratio_words(row) } else { "-".to_owned() },
            ]
        })
    });
    Table::of_texts("Flicker", &["model", "turning", "form", "flicker", "of the truth's"], rows)
}

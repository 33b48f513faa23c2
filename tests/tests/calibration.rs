//! The error bar of `auto` against the truth, shape by shape, and the table of it in `docs/curvature.md`.
//!
//! The random numbers of meshes and noise played no part in the choice of any constant.

use std::fmt::Write;
use std::path::Path;

use osculate_geom::curvature::CurvatureOptions;
use osculate_geom::shapes::study::StudyShape;
use osculate_tests::samples::{Sample, covered, looseness, samples};

/// In mean edges, as the studies have them.
const NOISE: [f64; 5] = [0.0, 0.001, 0.01, 0.05, 0.2];
const VERTICES: usize = 4000;
const SEEDS: [u64; 2] = [271_828, 182_845];

/// Lines of the document that stand around the table.
const BEGIN: &str = "<!-- made by the test calibration: begin -->\n";
const END: &str = "<!-- made by the test calibration: end -->\n";

/// How far a figure may be from the document's before that is out of date: share, and factor of the ratio. Other processors and
/// compilers round differently, and 0.3 % of the vertices are a dozen.
const SAME_SHARE: f64 = 0.003;
const SAME_RATIO: f64 = 1.05;

/// Share of the vertices whose error is at most the stated one, and median of stated over true error.
#[derive(Debug, Clone, Copy, PartialEq)]
struct Cell {
    covered: f64,
    ratio: f64,
}

impl Cell {
    fn new(samples: &[Sample]) -> Self {
        Self { covered: covered(samples), ratio: looseness(samples) }
    }

    fn text(self) -> String {
        format!("{:.1} %, {:.1}", 100.0 * self.covered, self.ratio)
    }

    fn parse(text: &str) -> Option<Self> {
        let (share, ratio) = text.trim().split_once(" %, ")?;
        Some(Self { covered: share.parse::<f64>().ok()? / 100.0, ratio: ratio.parse().ok()? })
    }

    /// But for the digits of the document.
    fn is_like(self, other: Self) -> bool {
        let ratio = (self.ratio.max(other.ratio) - 0.05) / (self.ratio.min(other.ratio) + 0.05);
        (self.covered - other.covered).abs() < SAME_SHARE + 5e-4 && ratio < SAME_RATIO
    }
}

/// A row a shape, and one of all shapes together; a column a noise level.
struct Table(Vec<(String, Vec<Cell>)>);

impl Table {
    fn measure() -> Self {
        let of_shape = |shape: StudyShape| {
            NOISE.map(|noise| samples(shape, VERTICES, SEEDS, noise, &CurvatureOptions::default()))
        };
        let all = StudyShape::ALL.map(|shape| (shape.name().replace('_', " "), of_shape(shape)));
        let together = |level: usize| all.iter().flat_map(|(_, levels)| &levels[level]).copied().collect();
        let together: Vec<Vec<Sample>> = (0..NOISE.len()).map(together).collect();
        let cells = |levels: &[Vec<Sample>]| levels.iter().map(|samples| Cell::new(samples)).collect();
        let mut rows: Vec<_> = all.iter().map(|(name, levels)| (name.clone(), cells(levels))).collect();
        rows.push(("all".to_owned(), cells(&together)));
        Self(rows)
    }

    fn text(&self) -> String {
        let mut text = "| shape |".to_owned();
        for noise in NOISE {
            write!(text, " noise {} % |", 100.0 * noise).expect("strings take all");
        }
        text.push_str("\n|---|---|---|---|---|---|\n");
        for (name, cells) in &self.0 {
            let cells: Vec<String> = cells.iter().map(|cell| cell.text()).collect();
            writeln!(text, "| {name} | {} |", cells.join(" | ")).expect("strings take all");
        }
        text
    }

    /// The rows of a text; without those that are none.
    fn parse(text: &str) -> Self {
        let row = |line: &str| {
            let mut cells = line.trim_matches(['|', ' ']).split(" | ");
            let name = cells.next()?.to_owned();
            let cells: Vec<Cell> = cells.map(Cell::parse).collect::<Option<_>>()?;
            (!cells.is_empty()).then_some((name, cells))
        };
        Self(text.lines().filter_map(row).collect())
    }

    fn is_like(&self, other: &Self) -> bool {
        let rows = std::iter::zip(&self.0, &other.0);
        let mut cells = rows.clone().flat_map(|(a, b)| std::iter::zip(&a.1, &b.1));
        let shape = |table: &Self| -> Vec<(String, usize)> {
            table.0.iter().map(|(name, cells)| (name.clone(), cells.len())).collect()
        };
        shape(self) == shape(other) && cells.all(|(a, b)| a.is_like(*b))
    }
}

#[test]
fn error_bar_of_auto_holds_shape_by_shape() {
    let table = Table::measure();
    println!("{}", table.text());
    let (_, together) = table.0.last().expect("a row of all shapes");
    for (noise, cell) in std::iter::zip(NOISE, together) {
        // The promise of a ratio below 5 is for all noise levels together (the test accuracy); clean meshes alone come to 5.3.
        assert!(cell.covered > 0.95 && cell.ratio < 6.0, "noise {noise}: {cell:?}");
    }
    for (name, cells) in &table.0 {
        for (noise, cell) in std::iter::zip(NOISE, cells) {
            assert!(cell.covered > 0.9, "{name}, noise {noise}: {cell:?}");
            // The clean torus is 10: it converges faster than the bar knows.
            assert!(cell.ratio < 13.0, "{name}, noise {noise}: {cell:?}");
        }
    }
    the_document_is_up_to_date(&table);
}

fn the_document_is_up_to_date(table: &Table) {
    let path = Path::new(env!("CARGO_MANIFEST_DIR")).join("../docs/curvature.md");
    let document = std::fs::read_to_string(&path).expect("the document is there");
    let (before, rest) = document.split_once(BEGIN).expect("the document marks the table's begin");
    let (found, after) = rest.split_once(END).expect("the document marks the table's end");
    if std::env::var_os("UPDATE_DOCS").is_some() {
        std::fs::write(&path, [before, BEGIN, &table.text(), END, after].concat()).expect("a file to write");
        return;
    }
    let hint = "docs/curvature.md is out of date; run this test with UPDATE_DOCS=1";
    assert!(table.is_like(&Table::parse(found)), "{hint}; now it is\n{}", table.text());
}

#[test]
fn a_changed_figure_is_noticed() {
    let text = "| shape | noise 0 % |\n|---|---|\n| torus | 95.0 %, 4.0 |\n";
    let like = |other: &str| Table::parse(text).is_like(&Table::parse(other));
    assert!(like(text) && like(&text.replace("95.0", "95.2")) && like(&text.replace("4.0", "4.1")));
    for (from, to) in [("95.0", "94.4"), ("4.0", "4.5"), ("torus", "ring"), ("95.0 %, 4.0", "?")] {
        assert!(!like(&text.replace(from, to)), "{from} {to}");
    }
}

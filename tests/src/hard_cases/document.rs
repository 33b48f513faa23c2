//! `docs/hard-cases.md`, made from the table of cases and the recorded verdicts on other tools.

use std::collections::HashMap;
use std::fmt::Write;

use osculate_geom::curvature::Method;

use super::{HardCase, hard_cases, other_cases};

/// Recorded by `tools/reference/hard_case_peers.py`.
const PEERS: &str = include_str!("../../data/hard_case_peers.csv");

/// The whole document.
///
/// # Panics
///
/// If the recorded verdicts are no table, which a test would show.
#[must_use]
pub fn hard_cases_document() -> String {
    let (provenance, tools, verdicts) = peers();
    let mut text = HEAD.to_owned();
    let mut row = |cells: Vec<String>| writeln!(text, "| {} |", cells.join(" | ")).expect("strings take all");
    let head = ["case", "what is hard", "what every estimator returns"].map(str::to_owned);
    row([&head[..], &tools].concat());
    row(vec!["---".to_owned(); head.len() + tools.len()]);
    for case in hard_cases() {
        let verdicts =
            verdicts.get(case.name).cloned().unwrap_or_else(|| vec!["not run".to_owned(); tools.len()]);
        row([vec![format!("`{}`", case.name), case.what.to_owned(), expectation(&case)], verdicts].concat());
    }
    text.push_str(&format!("\n{PEERS_HEAD}\n{provenance}\n{OTHER_HEAD}"));
    for case in other_cases() {
        writeln!(text, "| `{}` | {} | {} |", case.name, case.what, case.expect).expect("strings take all");
    }
    text
}

/// The expectation, and which estimators it is not asked of.
fn expectation(case: &HardCase) -> String {
    let exempt = case.exempted().map(|(method, why)| format!(" (not asked of `{}`: {why})", name(method)));
    format!("{}{}", case.expect, exempt.collect::<String>())
}

/// A method as the command line has it.
fn name(method: Method) -> String {
    format!("{method:?}").to_lowercase()
}

/// The comment lines of the record as text, its tools, and the verdicts on them by case.
fn peers() -> (String, Vec<String>, HashMap<&'static str, Vec<String>>) {
    let (comments, rows): (Vec<&str>, Vec<&str>) = PEERS.lines().partition(|line| line.starts_with('#'));
    let provenance: String =
        comments.iter().map(|line| format!("{}\n", line.trim_start_matches(['#', ' ']))).collect();
    let mut rows = rows.into_iter().map(|line| line.split(','));
    let tools = rows.next().expect("a heading").skip(1).map(str::to_owned).collect();
    let verdicts = rows.map(|mut cells| {
        let case = cells.next().expect("splitting gives a first cell");
        (case, cells.map(str::to_owned).collect())
    });
    (provenance, tools, verdicts.collect())
}

const HEAD: &str = "\
# Hard cases

Made from the tests by `UPDATE_DOCS=1 cargo test --release -p osculate-tests --test hard_cases`; the same test fails when this
page is out of date. Every row is a test of that name, run with every estimator in its default neighbourhood (`libigl` on two rings).

Besides what its row says, every estimator must keep these on every mesh, and does:

- one row a vertex of the input, in its order;
- finite curvatures with `kappa_min <= kappa_max`, unit and orthogonal directions (to 1e-14) that turn counter-clockwise around the
  outward normal of at least one triangle there, an error estimate that is not negative;
- a vertex without an estimate has an infinite error and a status that says why;
- the same bits on one thread and on three.

Property tests put random triangle soups through the same checks (`any_soup_keeps_the_invariants`, with coordinates up to
1e150, coinciding and collinear points), and move one vertex anywhere to see that only its own neighbourhood
notices (`a_stray_vertex_is_a_local_matter`).

The last columns say what other tools make of the same vertices and faces.

";

const PEERS_HEAD: &str = "\
*right*: every vertex with a known curvature is within the tolerance that Osculate's own estimators are held to, and none is
made up where the data determines nothing. *wrong at x*: a finite number that is off, or made up, without a word, at this share
of those vertices. *NaN at x*: the same, and not all of it numbers. *finite*: the case asks for no value. *other rows*: the
answer has not one row a vertex. *crash* and *hang* (30 s) are of the whole process. *error*: refused with a message. A
tool is forgiven the order of the two curvatures.
";

const OTHER_HEAD: &str = "\
## Rays and files

| case | what is hard | what comes of it |
| --- | --- | --- |
";

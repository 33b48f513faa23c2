//! The page of the study: the answer first, then what it rests on.

use super::exponents::{Exponents, exponents};
use super::rows::Row;
use super::settings::Setting;
use super::summary::{means, most_accurate, noises, shapes};
use super::{figures, growth, tables};
use crate::study::page::{Block, Page, Section};

/// What the rows do not say.
#[derive(Debug)]
pub struct Context {
    /// What made the page, to be run again.
    pub command: String,
    /// Processor and threads.
    pub machine: String,
    /// Where the rows of other programs come from.
    pub peers: PeersOrigin,
    /// The settings that were measured.
    pub settings: Vec<Setting>,
}

/// Where the rows of other programs come from.
#[derive(Debug, Clone, Copy, PartialEq, Eq)]
pub enum PeersOrigin {
    /// There are none.
    None,
    /// Measured in this run.
    ThisRun,
    /// From a file of an earlier run, whose times may be of another machine.
    File,
}

/// The page.
pub fn page(rows: &[Row], context: &Context) -> Page {
    let has = |purpose: &str| rows.iter().any(|r| r.purpose == purpose);
    let (mut sections, mut words) = (Vec::new(), Vec::new());
    if has("accuracy") {
        words = lead(rows, context);
        sections.extend([recommendation(rows, context), fronts(rows, context)]);
        sections.extend(peers(rows));
        sections.extend(everyday(rows));
        sections.push(noise_and_honesty(rows));
    }
    if has("scaling") {
        words.push(lead_on_growth(rows));
        sections.push(size(rows));
    }
    if has("accuracy") {
        sections.push(everything(rows));
    }
    sections.push(method(rows, context));
    Page { title: "Curvature: error against time".into(), lead: words, sections }
}

/// The largest exponents of ours.
fn lead_on_growth(rows: &[Row]) -> String {
    let all: Vec<Exponents> = exponents(rows).into_iter().filter(|e| e.program == "osculate").collect();
    let most = |value: fn(&Exponents) -> Option<f64>| {
        all.iter().filter_map(value).max_by(f64::total_cmp).map_or_else(String::new, |p| format!("{p:.3}"))
    };
    format!(
        "Growth from {} to {} vertices: time as n to the power of {} at most, memory {} (1 is in proportion).",
        all.iter().map(|e| e.least_vertices).min().unwrap_or(0),
        all.iter().map(|e| e.most_vertices).max().unwrap_or(0),
        most(|e| e.seconds),
        most(|e| e.bytes)
    )
}

fn lead(rows: &[Row], context: &Context) -> Vec<String> {
    let accuracy: Vec<Row> =
        rows.iter().filter(|r| r.purpose == "accuracy" && !tables::is_everyday(&r.shape)).cloned().collect();
    let vertices = accuracy.first().map_or(0, |r| r.vertices);
    let first = format!(
        "How far is an estimated principal curvature from the true one, and what does it cost? This page measures every estimator of Osculate at every setting on {} surfaces with known curvature (about {vertices} vertices each, irregular on purpose), without and with noise{}. Errors are relative: 0.01 means off by one part in a hundred of the curvature of a ball as large as the shape's tightest bend.",
        shapes(&accuracy).len(),
        if context.peers == PeersOrigin::None { "" } else { ", beside other programs" },
    );
    let best = |noise: f64| {
        let means: Vec<_> = means(&accuracy, noise).into_iter().filter(|m| m.row.is_ours()).collect();
        most_accurate(&means).map(|m| {
            format!(
                "`{}` with noise {} (median error {:.1e}, {:.1} µs a vertex)",
                m.row.short_name(),
                tables::percent(noise),
                m.median,
                m.us
            )
        })
    };
    let answers: Vec<String> = noises(&accuracy).into_iter().filter_map(best).collect();
    vec![first, format!("Most accurate here: {}.", answers.join("; "))]
}

fn plot(figure: &figures::Figure) -> Block {
    Block::Plot { svg: figure.plot.svg(), caption: figure.caption.clone() }
}

fn recommendation(rows: &[Row], context: &Context) -> Section {
    Section {
        title: "Which setting to take".into(),
        blocks: vec![
            Block::Text("Give these to `osculate bake`. The first column says what you have and what matters to you. Noise is what a scanner adds: the standard deviation of the vertices' positions, in mean edge lengths.".into()),
            Block::Table(tables::recommendations(rows, &context.settings)),
        ],
    }
}

fn fronts(rows: &[Row], context: &Context) -> Section {
    let figures = figures::fronts(rows);
    let (medians, tails): (Vec<_>, Vec<_>) = figures.iter().partition(|f| f.name.starts_with("median"));
    let marks = if context.peers == PeersOrigin::None {
        ""
    } else {
        " Filled discs are Osculate's, hollow marks the others'."
    };
    let mut blocks = vec![Block::Text(format!(
        "Time goes right, error goes up, both in powers of ten, so the best place is the lower left corner.{marks} With noise the fast settings on the left lose: they see too few vertices to tell the surface from the noise."
    ))];
    blocks.extend(medians.into_iter().map(plot));
    blocks.push(Block::Details {
        summary: "The same for the error that 95 % of the vertices stay below".into(),
        blocks: tails.into_iter().map(plot).collect(),
    });
    Section { title: "Error against time".into(), blocks }
}

fn peers(rows: &[Row]) -> Option<Section> {
    let comparisons = tables::against_peers(rows);
    if comparisons.is_empty() {
        return None;
    }
    let failures = tables::failures(rows);
    let mut blocks = vec![
        Block::Text("Every other program gets the benefit of hindsight: for each shape and noise its best setting is picked after the fact. So do we. A ratio below 1 means that we are closer to the truth.".into()),
    ];
    blocks.extend(comparisons.into_iter().map(Block::Table));
    if !failures.is_empty() {
        blocks.push(Block::Details {
            summary: format!("{} measurements without an answer", failures.len()),
            blocks: vec![Block::List(failures)],
        });
    }
    Some(Section { title: "Beside other programs".into(), blocks })
}

fn everyday(rows: &[Row]) -> Option<Section> {
    let figures = figures::everyday_fronts(rows);
    if figures.is_empty() {
        return None;
    }
    let mut blocks = vec![Block::Text("Everyday meshes have no formula. Here their vertices are moved onto the smooth surface that Loop subdivision makes of them in the limit; at every vertex with six neighbours that surface is a box spline, so its curvature is known exactly, and the connectivity is the modeller's own. The radius is one over the median of the stronger curvature.".into())];
    blocks.extend(figures.iter().map(plot));
    Some(Section { title: "Everyday meshes".into(), blocks })
}

fn noise_and_honesty(rows: &[Row]) -> Section {
    let mut blocks: Vec<Block> = figures::by_noise(rows).iter().map(plot).collect();
    blocks.push(Block::Text("Every estimate comes with a statement of its own error (`_CURVATURE_ERROR` in files). This is how far to trust it:".into()));
    blocks.push(Block::Table(tables::calibration(rows)));
    Section { title: "Noise, and how honest the stated errors are".into(), blocks }
}

fn size(rows: &[Row]) -> Section {
    let mut blocks = vec![Block::Table(tables::growth_table(rows))];
    blocks.extend(growth::growth(rows).iter().map(plot));
    Section { title: "Memory, and growth with the mesh".into(), blocks }
}

fn everything(rows: &[Row]) -> Section {
    let levels = noises(&rows.iter().filter(|r| r.purpose == "accuracy").cloned().collect::<Vec<_>>());
    let blocks = levels.into_iter().map(|noise| Block::Details {
        summary: format!("Noise {}", tables::percent(noise)),
        blocks: vec![Block::Table(tables::everything(rows, noise))],
    });
    Section { title: "All settings".into(), blocks: blocks.collect() }
}

fn method(rows: &[Row], context: &Context) -> Section {
    let origin = match context.peers {
        PeersOrigin::None => "No other program was measured.",
        PeersOrigin::ThisRun => {
            "The other programs ran in the same run on the same meshes, each measurement in a process of its own."
        }
        PeersOrigin::File => {
            "The other programs' rows come from a file of an earlier run on these meshes; their times are of that run."
        }
    };
    let sizes = rows.iter().filter(|r| r.purpose == "scaling").map(|r| r.vertices).max().unwrap_or(0);
    Section {
        title: "How it was measured".into(),
        blocks: vec![
            Block::Code(context.command.clone()),
            Block::List(vec![
                format!("Machine: {}.", context.machine),
                "Error: the larger of |kappa_max - exact| and |kappa_min - exact|, times the radius: the sphere's or tube's, the shortest half-axis, the catenoid's waist, the bump's width squared over its height. A vertex without an estimate counts as infinitely wrong. Vertices on a boundary count like all others.".into(),
                "Sphere, ellipsoid and torus are Delaunay triangulations of random points on the surface, slivers and all; catenoid, bump, monkey saddle and cylinder are grids whose vertices are moved by up to a quarter cell and whose cells are cut along random diagonals.".into(),
                "Noise moves every vertex by an isotropic gaussian; the truth is that of the clean point.".into(),
                format!("Time: median of the runs of the estimate alone, adjacency and normals included, file access not; ours reuse the memory of the run before. Growth is measured on tori up to {sizes} vertices."),
                "Memory: the most that is allocated at a time beyond the mesh, all threads together.".into(),
                origin.into(),
                "All rows are in `curvature.csv`, the plots beside it as SVG.".into(),
            ]),
        ],
    }
}

//! `osculate inspect`

use std::path::{Path, PathBuf};

use anyhow::{Context, Result};
use clap::Args;
use osculate_geom::bake::{Facing, NormalSource, Provenance};
use osculate_geom::inspect::{CurvatureReport, MeshReport, Range};
use osculate_geom::mesh::Weld;
use osculate_geom::reference::ReferenceFile;
use osculate_sbtf::file::ModelFile;
use serde::Serialize;

use crate::cli::Outcome;
use crate::console::{Console, count, number};
use crate::estimate::describe;
use crate::filter::describe_walk;
use crate::input::{self, Input};
use crate::model_report::ModelReport;
use crate::output::extension;
use crate::report::Reporter;

/// Show what is inside a mesh, a baked mesh, a recorded reference or a model.
#[derive(Debug, Args)]
#[command(after_help = "\
Examples:
  osculate inspect cow.glb
  osculate inspect scan.ply --json - | jq .mesh.boundary_edges
  osculate inspect tests/data/reference/spot.npz
  osculate inspect tests/data/models/taps.sbtf")]
pub struct InspectArgs {
    /// .obj, .ply, .stl, .gltf, .glb, .npz or .sbtf
    #[arg(value_name = "FILE")]
    file: PathBuf,
}

#[derive(Serialize)]
struct Report {
    file: String,
    kind: Kind,
    #[serde(skip_serializing_if = "Option::is_none")]
    mesh: Option<MeshReport>,
    #[serde(skip_serializing_if = "Option::is_none")]
    curvature: Option<CurvatureReport>,
    #[serde(skip_serializing_if = "Option::is_none")]
    provenance: Option<Provenance>,
    #[serde(skip_serializing_if = "Option::is_none")]
    reference: Option<ReferenceReport>,
    #[serde(skip_serializing_if = "Option::is_none")]
    model: Option<ModelReport>,
}

#[derive(Serialize)]
#[serde(rename_all = "snake_case")]
enum Kind {
    Mesh,
    BakedMesh,
    Reference,
    Model,
}

#[derive(Serialize)]
struct ReferenceReport {
    vertices: usize,
    triangles: usize,
    settings: Vec<SettingReport>,
    meta: serde_json::Value,
}

#[derive(Serialize)]
struct SettingReport {
    name: String,
    bad: usize,
    kappa_max: Option<Range>,
    kappa_min: Option<Range>,
    largest_condition: Option<f64>,
}

/// Runs the command.
pub fn run(args: &InspectArgs, console: &Console, reporter: &Reporter) -> Result<Outcome> {
    let report = examine(&args.file, console)?;
    console.result(format_args!("{}", report.file));
    if let Some(mesh) = &report.mesh {
        print_mesh(mesh, console);
    }
    if let Some(curvature) = &report.curvature {
        print_curvature(curvature, console);
    }
    if let Some(provenance) = &report.provenance {
        print_provenance(provenance, console);
    }
    if let Some(reference) = &report.reference {
        print_reference(reference, console);
    }
    if let Some(model) = &report.model {
        model.print(console);
    }
    reporter.write("inspect", 1, &report)?;
    Ok(Outcome::Done)
}

fn examine(path: &Path, console: &Console) -> Result<Report> {
    let file = path.display().to_string();
    let empty = |kind| Report {
        file,
        kind,
        mesh: None,
        curvature: None,
        provenance: None,
        reference: None,
        model: None,
    };
    if extension(path) == "sbtf" {
        let model = ModelReport::new(ModelFile::read(path)?);
        return Ok(Report { model: Some(model), ..empty(Kind::Model) });
    }
    if extension(path) == "npz" {
        let reference = ReferenceFile::read(path).with_context(|| path.display().to_string())?;
        return Ok(Report { reference: Some(reference_report(reference)), ..empty(Kind::Reference) });
    }
    match input::read(path, console)? {
        Input::Raw(mesh) => Ok(Report { mesh: Some(MeshReport::new(&mesh)), ..empty(Kind::Mesh) }),
        Input::Baked(baked) => Ok(Report {
            mesh: Some(MeshReport::new(baked.mesh())),
            curvature: Some(CurvatureReport::new(baked.curvature())),
            provenance: Some(baked.provenance),
            ..empty(Kind::BakedMesh)
        }),
    }
}

fn reference_report(file: ReferenceFile) -> ReferenceReport {
    let finite = |values: &[f64]| Range::new(values.iter().copied().filter(|x| x.is_finite()).collect());
    ReferenceReport {
        vertices: file.positions.len(),
        triangles: file.triangles.len(),
        settings: file
            .settings
            .into_iter()
            .map(|(name, setting)| SettingReport {
                name,
                bad: setting.bad.iter().filter(|&&bad| bad).count(),
                kappa_max: finite(&setting.kappa_max),
                kappa_min: finite(&setting.kappa_min),
                largest_condition: setting.condition.as_deref().and_then(finite).map(|range| range.max),
            })
            .collect(),
        meta: file.meta,
    }
}

fn print_mesh(mesh: &MeshReport, console: &Console) {
    console.result(format_args!("  vertices   {} at {} positions", mesh.vertices, mesh.positions));
    console.result(format_args!(
        "  triangles  {} in {} and {}",
        mesh.triangles,
        count(mesh.parts.len(), "part"),
        count(mesh.components, "component")
    ));
    for part in mesh.parts.iter().filter(|part| !part.name.is_empty()) {
        let material = part.material.and_then(|m| mesh.materials.get(m)).filter(|name| !name.is_empty());
        let material = material.map_or_else(String::new, |name| format!(", material {name:?}"));
        console.result(format_args!("    {:?}: {}{material}", part.name, count(part.triangles, "triangle")));
    }
    if let Some([lo, hi]) = mesh.bounds {
        let corner = |p: [f64; 3]| p.map(number).join(", ");
        console.result(format_args!("  bounds     ({}) to ({})", corner(lo), corner(hi)));
        console.result(format_args!("  diagonal   {}", number(mesh.bbox_diagonal)));
    }
    console.result(format_args!("  surface    {}", surface(mesh)));
    console.result(format_args!("  normals    {}", if mesh.has_normals { "in the file" } else { "none" }));
    for (set, uv) in mesh.uv_sets.iter().enumerate() {
        let scale =
            uv.uv_scale.map_or_else(|| "no area".to_owned(), |s| format!("one unit is {} long", number(s)));
        let corner = |p: [f64; 2]| p.map(number).join(", ");
        console.result(format_args!(
            "  UV set {set}   ({}) to ({}), {scale}",
            corner(uv.min),
            corner(uv.max)
        ));
    }
}

fn surface(mesh: &MeshReport) -> String {
    if mesh.closed && mesh.unused_vertices == 0 && mesh.degenerate_triangles == 0 {
        return "closed, manifold, consistently oriented".to_owned();
    }
    let mut words = vec![if mesh.closed { "closed" } else { "not closed" }.to_owned()];
    for (n, noun) in [
        (mesh.boundary_edges, "boundary edge"),
        (mesh.non_manifold_edges, "non-manifold edge"),
        (mesh.inconsistent_edges, "edge where the orientation changes"),
        (mesh.degenerate_triangles, "degenerate triangle"),
        (mesh.unused_vertices, "unused vertex"),
    ] {
        if n > 0 {
            let words_for = if noun.contains("where") && n > 1 {
                format!("{n} edges where the orientation changes")
            } else {
                count(n, noun)
            };
            words.push(words_for);
        }
    }
    words.join(", ")
}

/// The lines about curvature that `bake` prints too.
pub fn print_curvature(curvature: &CurvatureReport, console: &Console) {
    for (name, range) in [
        ("kappa_max ", &curvature.kappa_max),
        ("kappa_min ", &curvature.kappa_min),
        ("error     ", &curvature.error),
    ] {
        if let Some(Range { min, median, max }) = *range {
            let (min, median, max) = (number(min), number(median), number(max));
            console.result(format_args!("  {name} {min} to {max}, median {median}"));
        }
    }
    if curvature.umbilic > 0 {
        let umbilic = count(curvature.umbilic, "vertex");
        console.result(format_args!("  umbilic    {umbilic}: both curvatures equal within the error"));
    }
    let statuses = curvature.statuses.iter().map(|s| format!("{} {}", s.vertices, s.status.label()));
    let statuses = statuses.collect::<Vec<_>>().join(", ");
    let without = match curvature.undetermined {
        0 => String::new(),
        n => format!("; {} without an estimate", count(n, "vertex")),
    };
    console.result(format_args!("  status     {statuses}{without}"));
}

fn print_provenance(provenance: &Provenance, console: &Console) {
    let weld = match provenance.weld {
        Weld::Exact => "equal positions merged",
        Weld::Off => "nothing merged",
    };
    let facing = match provenance.facing {
        Facing::Kept => "",
        Facing::Flipped => ", turned over",
    };
    let normals = match provenance.normals {
        NormalSource::File => "from the source",
        NormalSource::Computed => "computed",
    };
    console.result(format_args!("  method     {}, {weld}{facing}", describe(&provenance.curvature)));
    print_filter(provenance, console);
    console.result(format_args!("  baked      by {}, normals {normals}", provenance.tool));
    console.result(format_args!(
        "  source     {} (SHA-256 {})",
        provenance.source.file, provenance.source.sha256
    ));
}

/// The lines about a baked filter that `bake` prints too.
pub fn print_filter(provenance: &Provenance, console: &Console) {
    let Some(filter) = &provenance.filter else { return };
    console.result(format_args!(
        "  filter     {} azimuths, {}; bounds for walks up to {}",
        filter.azimuths,
        describe_walk(&filter.walk),
        number(filter.bound_length)
    ));
    let Some(error) = &filter.error else { return };
    let proved =
        error.proved.map_or_else(|| "no bound is proved".to_owned(), |p| format!("{} is proved", number(p)));
    console.result(format_args!(
        "             off by {} (median), {} (99 %), {} (worst of {} rays); {proved}",
        number(error.median),
        number(error.p99),
        number(error.max),
        error.queries
    ));
}

fn print_reference(reference: &ReferenceReport, console: &Console) {
    let word = |key: &str| reference.meta.get(key).and_then(|v| v.as_str()).unwrap_or("unknown").to_owned();
    console.result(format_args!("  reference  libigl {} on {}", word("libigl"), word("source")));
    console.result(format_args!("  vertices   {}", reference.vertices));
    console.result(format_args!("  triangles  {}", reference.triangles));
    for setting in &reference.settings {
        let range = |range: &Option<Range>| {
            range.map_or_else(|| "none".to_owned(), |r| format!("{} to {}", number(r.min), number(r.max)))
        };
        let condition = setting
            .largest_condition
            .map_or_else(String::new, |c| format!(", largest condition {}", number(c)));
        console.result(format_args!(
            "  {:<9}  kappa_max {}, kappa_min {}, {} bad{condition}",
            setting.name,
            range(&setting.kappa_max),
            range(&setting.kappa_min),
            setting.bad
        ));
    }
    console.result(format_args!("  command    {}", word("command")));
}

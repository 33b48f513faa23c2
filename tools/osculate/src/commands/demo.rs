//! `osculate demo`

use std::path::{Path, PathBuf};
use std::sync::Arc;

use anyhow::{Context, Result};
use clap::Args;
use glam::Vec3;
use osculate_geom::bake::{self, BakeOptions, BakedMesh, Source};
use osculate_geom::curvature::{CurvatureOptions, Method};
use osculate_geom::inspect::CurvatureReport;
use osculate_geom::io::{no_files, read_obj};
use osculate_geom::reference::{Bounds, CompareOptions, Comparison, ReferenceFile};
use osculate_render::false_colour::{Quantity, curvature_picture};
use osculate_render::output::write_png;
use osculate_render::scene::PreviewOptions;
use osculate_render::{MeshInstance, RenderOptions, Scene, StopRule, picture, plan};
use serde::Serialize;

use super::render::{self, RenderReport};
use super::{inspect, verify};
use crate::cli::Outcome;
use crate::console::{Console, bytes, count};
use crate::estimate::describe;
use crate::output;
use crate::report::Reporter;

/// Show the main job on a shipped mesh: bake Spot the cow, verify against recorded libigl output, render both pictures.
#[derive(Debug, Args)]
#[command(after_help = "\
Examples:
  osculate demo
  osculate demo -o /tmp/spot --spp 256

Spot is by Keenan Crane and in the public domain. Needs no other file and no network.")]
pub struct DemoArgs {
    /// Directory for the results; made if need be
    #[arg(short, long, value_name = "DIR", default_value = "out/demo")]
    output: PathBuf,
    /// Samples per pixel of the shaded picture
    #[arg(long, value_name = "N", default_value_t = 32, value_parser = clap::value_parser!(u32).range(1..=1_000_000))]
    spp: u32,
    /// Where all random choices of the renderer come from
    #[arg(long, value_name = "S", default_value_t = 0)]
    seed: u64,
}

/// The mesh and its reference are part of the program, so that a moved binary works.
pub const SPOT: &[u8] = include_bytes!("../../../../assets/meshes/spot.obj");
const REFERENCE: &[u8] = include_bytes!("../../../../tests/data/reference/spot.npz");
const SETTING: &str = "r5";

#[derive(Serialize)]
struct Report {
    files: Vec<String>,
    curvature: CurvatureReport,
    against: verify::Against,
    comparison: Comparison,
    render: RenderReport,
}

/// Runs the command.
pub fn run(args: &DemoArgs, console: &Console, reporter: &Reporter) -> Result<Outcome> {
    let directory = &args.output;
    std::fs::create_dir_all(directory).with_context(|| directory.display().to_string())?;
    let [glb, shaded, curvature] =
        ["spot.glb", "spot.png", "spot_curvature.png"].map(|name| directory.join(name));
    for path in [&glb, &shaded, &curvature] {
        output::check(path)?;
    }
    let baked = bake_spot(CurvatureOptions::default())?;
    bake::write_glb(&glb, &baked).with_context(|| glb.display().to_string())?;
    let summary = CurvatureReport::new(baked.curvature());
    console.result(format_args!(
        "1. Baked Spot the cow ({}, {}) with {}",
        count(baked.mesh().positions().len(), "vertex"),
        count(baked.mesh().triangles().len(), "triangle"),
        describe(&baked.provenance.curvature)
    ));
    inspect::print_curvature(&summary, console);

    let (against, comparison) = verify_spot()?;
    console.result("2. Verified the libigl method, in 64 bits, against what libigl itself returned");
    verify::print_against(&against, console);
    verify::print_comparison(&comparison, console);

    console.result("3. Rendered");
    let scene = studio(baked);
    let render = render_shaded(&scene, args, &shaded, console)?;
    let picture = curvature_picture(&scene, Quantity::Mean)?;
    write_png(&curvature, &picture).with_context(|| curvature.display().to_string())?;

    let cost = reporter.cost();
    let memory =
        cost.peak_memory_bytes.map_or_else(String::new, |n| format!(", {} of memory at most", bytes(n)));
    console.result(format_args!("Took {:.1} s on {}{memory}.", cost.seconds, count(cost.threads, "thread")));
    for (path, what) in [
        (&glb, "baked mesh, for any glTF viewer"),
        (&shaded, "shaded picture"),
        (&curvature, "mean curvature in colours"),
    ] {
        console.result(format_args!("  {}: {what}", path.display()));
    }
    let files = [&glb, &shaded, &curvature].map(|path| path.display().to_string()).to_vec();
    let passed = comparison.passed;
    reporter.write("demo", 1, &Report { files, curvature: summary, against, comparison, render })?;
    Ok(if passed { Outcome::Done } else { Outcome::CheckFailed })
}

fn bake_spot(curvature: CurvatureOptions) -> Result<BakedMesh> {
    let mesh = read_obj(SPOT, &no_files).context("spot.obj")?.mesh;
    let options = BakeOptions { curvature, ..BakeOptions::default() };
    Ok(bake::bake(mesh, Source::from_bytes("spot.obj", SPOT), &options)?)
}

fn verify_spot() -> Result<(verify::Against, Comparison)> {
    let reference = ReferenceFile::from_bytes(REFERENCE).context("spot.npz")?;
    let neighbourhood = ReferenceFile::neighbourhood(SETTING);
    let baked = bake_spot(CurvatureOptions { method: Method::Libigl, neighbourhood, ..Default::default() })?;
    let bounds = Bounds { curvature: 1e-9, angle: 1e-4 };
    let options = CompareOptions::new(bounds, baked.mesh().bbox_diagonal());
    Ok(verify::with_reference(baked.mesh(), baked.curvature(), "spot.npz", &reference, SETTING, &options))
}

fn studio(baked: BakedMesh) -> Scene {
    let (mesh, curvature) = baked.into_parts();
    let object = MeshInstance { curvature: Some(Arc::from(curvature)), ..MeshInstance::new(Arc::new(mesh)) };
    // Spot looks along -z, away from where the studio's camera stands.
    let towards_viewer = Vec3::new(-0.8, 0.35, -1.0);
    Scene::preview(vec![object], &PreviewOptions { towards_viewer, ..PreviewOptions::default() })
}

fn render_shaded(scene: &Scene, args: &DemoArgs, path: &Path, console: &Console) -> Result<RenderReport> {
    let options =
        RenderOptions { stop: StopRule::Samples(args.spp), seed: args.seed, ..RenderOptions::default() };
    let rendering = render::trace(scene, &options, console)?;
    let picture = picture(scene.width, scene.height, &rendering.film.radiance(), scene.exposure);
    write_png(path, &picture).with_context(|| path.display().to_string())?;
    let report = render::report(&rendering, &plan(scene, options.max_depth));
    render::print(path, scene, Some(&report), console);
    Ok(report)
}

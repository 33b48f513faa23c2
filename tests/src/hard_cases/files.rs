//! Hard numbers on their way through files.

use std::fmt::Write;
use std::path::Path;

use osculate_geom::Mesh;
use osculate_geom::bake::{self, BakeOptions, BakedMesh, Precision, Source, read_baked};
use osculate_geom::curvature::VertexCurvature;
use osculate_geom::io::read_mesh;

use super::meshes::{moved, torus};
use super::{OtherCase, ensure};

pub(super) fn cases() -> Vec<OtherCase> {
    vec![
        OtherCase {
            name: "scales_through_files",
            what: "the torus in units from 1e-9 to 1e9 of its radius, through text (OBJ) and back out of a bake in double and in single precision",
            expect: "curvature over the scale to 1e-10 of kappa_max from .ply in f64, to 2e-7 from .ply and .glb in f32",
            check: scales,
        },
        OtherCase {
            name: "single_precision_input",
            what: "the same torus read from a file with 32-bit coordinates",
            expect: "what that rounding (6e-8 of the radius, 5e-7 of an edge) leaves: 1e-4 of kappa_max, at every scale",
            check: single_precision,
        },
        OtherCase {
            name: "too_large_for_a_file",
            what: "a torus of radius 1e150 on its way to 32-bit floats",
            expect: "an error that names the attribute, the vertex and the value; no file. In f64 it passes",
            check: too_large,
        },
    ]
}

const SCALES: [f64; 7] = [1e-9, 1e-6, 1e-3, 1.0, 1e3, 1e6, 1e9];

fn scaled(scale: f64) -> Mesh {
    moved(&torus(), |p| p * scale)
}

fn obj(mesh: &Mesh) -> String {
    let mut text = String::new();
    for p in mesh.positions() {
        writeln!(text, "v {:e} {:e} {:e}", p.x, p.y, p.z).expect("strings take all");
    }
    for [a, b, c] in mesh.triangles() {
        writeln!(text, "f {} {} {}", a + 1, b + 1, c + 1).expect("strings take all");
    }
    text
}

fn baked(mesh: Mesh) -> BakedMesh {
    let source = Source::from_bytes("torus", b"");
    bake::bake(mesh, source, &BakeOptions::default()).expect("the defaults are valid")
}

fn temporary() -> tempfile::TempDir {
    tempfile::tempdir().expect("a temporary directory")
}

/// Largest deviation of the curvatures times the scale, relative to 2.5.
fn deviation(found: &[VertexCurvature], base: &[VertexCurvature], scale: f64) -> Result<f64, String> {
    ensure(found.len() == base.len(), || format!("{} rows for {}", found.len(), base.len()))?;
    let mut worst = 0.0_f64;
    for (vertex, (found, base)) in std::iter::zip(found, base).enumerate() {
        let (Some(found), Some(base)) = (found.principal, base.principal) else {
            return Err(format!("vertex {vertex} has no estimate"));
        };
        let off = (found.kappa_max * scale - base.kappa_max)
            .abs()
            .max((found.kappa_min * scale - base.kappa_min).abs());
        worst = worst.max(off / 2.5);
    }
    Ok(worst)
}

fn scales() -> Result<(), String> {
    let directory = temporary();
    let path = |name: &str| directory.path().join(name);
    let base = baked(torus());
    let text = |error: &dyn std::fmt::Display| error.to_string();
    for scale in SCALES {
        std::fs::write(path("in.obj"), obj(&scaled(scale))).map_err(|e| text(&e))?;
        let read = read_mesh(&path("in.obj")).map_err(|e| text(&e))?.mesh;
        ensure(read == scaled(scale), || format!("OBJ loses bits at scale {scale:e}"))?;
        let bake = baked(read);
        bake::write_ply(&path("f64.ply"), &bake, Precision::F64).map_err(|e| text(&e))?;
        bake::write_ply(&path("f32.ply"), &bake, Precision::F32).map_err(|e| text(&e))?;
        bake::write_glb(&path("f32.glb"), &bake).map_err(|e| text(&e))?;
        // Half a unit in the last place of a 32-bit float is 6e-8.
        for (name, bound) in [("f64.ply", 1e-10), ("f32.ply", 2e-7), ("f32.glb", 2e-7)] {
            let back = read_baked(&path(name)).map_err(|e| text(&e))?;
            let off = deviation(back.curvature(), base.curvature(), scale)?;
            ensure(off <= bound, || format!("{name} at scale {scale:e} is off by {off:e}"))?;
        }
    }
    Ok(())
}

fn single_precision() -> Result<(), String> {
    let directory = temporary();
    let path = directory.path().join("f32.ply");
    let base = baked(torus());
    for scale in SCALES {
        let bake = baked(scaled(scale));
        bake::write_ply(&path, &bake, Precision::F32).map_err(|e| e.to_string())?;
        let read = read_mesh(&path).map_err(|e| e.to_string())?.mesh;
        let off = deviation(baked(read).curvature(), base.curvature(), scale)?;
        ensure(off <= 1e-4, || format!("scale {scale:e} is off by {off:e}"))?;
    }
    Ok(())
}

fn too_large() -> Result<(), String> {
    let directory = temporary();
    let bake = baked(scaled(1e150));
    let refused = |path: &Path, written: Result<(), bake::WriteError>| {
        let message = written.err().map(|e| e.to_string()).unwrap_or_default();
        let named = ["position", "vertex 0", "does not fit"].iter().all(|word| message.contains(word));
        ensure(named && !path.exists(), || format!("{}: {message:?}", path.display()))
    };
    let (ply, glb) = (directory.path().join("x.ply"), directory.path().join("x.glb"));
    refused(&ply, bake::write_ply(&ply, &bake, Precision::F32))?;
    refused(&glb, bake::write_glb(&glb, &bake))?;
    bake::write_ply(&ply, &bake, Precision::F64).map_err(|e| e.to_string())?;
    let back = read_baked(&ply).map_err(|e| e.to_string())?;
    ensure(back.mesh().positions()[0] == bake.mesh().positions()[0], || "not the same positions".to_owned())
}

//! `osculate verify`, through the real binary.

mod common;

use common::{Workspace, repository};
use osculate_geom::shapes;

#[test]
fn spot_agrees_with_libigl_from_every_kind_of_file() {
    let w = Workspace::new();
    let spot = repository("assets/meshes/spot.obj").display().to_string();
    let reference = repository("tests/data/reference/spot.npz").display().to_string();
    for setting in ["r2", "r5", "r8", "s5"] {
        let run = w.ok(&format!("verify {spot} --reference {reference} --setting {setting}"));
        assert!(run.stdout.contains("PASS"), "{run:?}");
    }
    w.ok(&format!("bake {spot} -o spot.glb --method libigl"));
    w.ok(&format!("verify spot.glb --reference {reference} --json report.json"));
    let report = w.json("report.json");
    assert_eq!(report["against"]["setting"], "r5", "what the file was baked with");
    assert_eq!(report["comparison"]["compared"], 3605);
    assert_eq!(report["comparison"]["bounds"]["curvature"], 1e-6, "32-bit floats");
    assert!(
        report["comparison"]["kappa_max"]["max"].as_f64().unwrap() < 6e-8,
        "half a unit in the last place"
    );
    assert_eq!(w.run(&format!("verify spot.glb --reference {reference} --bound 1e-9")).code, 1);
    w.ok(&format!("bake {spot} -o spot.ply --method libigl --rings 2 --precision f64"));
    w.ok(&format!("verify spot.ply --reference {reference} --json report.json"));
    let report = w.json("report.json");
    assert_eq!(report["against"]["setting"], "r2");
    assert_eq!(report["comparison"]["bounds"]["curvature"], 1e-9, "64-bit floats");
}

#[test]
fn another_method_is_compared_and_said() {
    let w = Workspace::new();
    w.ok(&format!("bake {} -o spot.glb", repository("assets/meshes/spot.obj").display()));
    let run = w.run(&format!(
        "verify spot.glb --reference {}",
        repository("tests/data/reference/spot.npz").display()
    ));
    assert_eq!(run.code, 1);
    assert!(run.stdout.contains("FAIL") && run.stdout.contains("vertex "), "{run:?}");
    assert!(run.stderr.contains("--method libigl"), "{run:?}");
}

#[test]
fn closed_forms() {
    let w = Workspace::new();
    w.write_obj("sphere.obj", &shapes::icosphere(2.0, 4));
    w.write_obj("torus.obj", &shapes::torus(1.0, 0.45, 96, 48));
    w.write_obj("cylinder.obj", &shapes::cylinder(0.5, 2.0, 64, 32));
    w.write_obj("saddle.obj", &shapes::saddle(64, 64));
    w.write_obj("plane.obj", &shapes::plane(8, 8));
    for (file, shape) in [
        ("sphere.obj", "sphere:2"),
        ("torus.obj", "torus:1,0.45"),
        ("cylinder.obj", "cylinder:0.5"),
        ("saddle.obj", "saddle"),
        ("plane.obj", "plane"),
    ] {
        let run = w.ok(&format!("verify {file} --analytic {shape}"));
        assert!(run.stdout.contains(shape) && run.stdout.contains("PASS"), "{run:?}");
    }
    let run = w.run("verify sphere.obj --analytic sphere:2 --bound 1e-9");
    assert_eq!(run.code, 1);
    assert!(run.stdout.contains("over a bound"), "{run:?}");
    w.refuses("verify sphere.obj --analytic sphere:2.1", &["sphere.obj", "vertex", "away from"]);
    w.refuses("verify sphere.obj --reference torus.obj", &["torus.obj", "libigl_curvature.py"]);
    w.refuses("verify sphere.obj --reference none.npz", &["none.npz"]);
    for usage in
        ["verify sphere.obj", "verify sphere.obj --analytic cube:1", "verify sphere.obj --setting r5"]
    {
        assert_eq!(w.run(usage).code, 2, "{usage}");
    }
}

#[test]
fn reordered_and_different_meshes_are_told() {
    let w = Workspace::new();
    let reference = repository("tests/data/reference/spot.npz").display().to_string();
    let spot = std::fs::read_to_string(repository("assets/meshes/spot.obj")).unwrap();
    // Without its last face: two triangles of three vertices are missing, so neighbourhoods change around them.
    let faces: Vec<_> = spot.lines().filter(|l| l.starts_with("f ")).collect();
    let cut = spot.replace(faces[faces.len() - 1], "");
    w.write("cut.obj", &cut);
    let run = w.run(&format!("verify cut.obj --reference {reference}"));
    assert_eq!(run.code, 1);
    assert!(run.stdout.contains("differ: 0 only here, 1 only in the reference"), "{run:?}");
    w.write_obj("other.obj", &shapes::icosphere(1.0, 2));
    let run = w.run(&format!("verify other.obj --reference {reference}"));
    assert_eq!(run.code, 1);
    assert!(run.stdout.contains("no such position in the reference"), "{run:?}");
    w.refuses(
        &format!("verify other.obj --reference {reference} --setting r3"),
        &["spot.npz", "\"r3\"", "r2, r5, r8, s5"],
    );
    w.ok("bake other.obj -o other.glb");
    w.refuses("verify other.glb --analytic sphere:1 --method libigl", &["other.glb", "is baked already"]);
}

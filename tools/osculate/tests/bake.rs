//! `osculate bake` and `osculate inspect`, through the real binary.

mod common;

use common::{Workspace, repository};
use osculate_geom::bake::read_baked;
use osculate_geom::shapes;

#[test]
fn bakes_a_mesh_and_reports_it() {
    let w = Workspace::new();
    w.write_obj("torus.obj", &shapes::torus(1.0, 0.4, 96, 48));
    let run = w.ok("bake torus.obj --tolerance 0.02 -o torus.glb --json report.json");
    assert!(run.stdout.contains("4608 vertices (0 merged), 9216 triangles"), "{run:?}");
    assert!(run.stdout.contains("auto, tolerance 0.02, at most 16 rings"), "{run:?}");
    assert_eq!(run.stderr, "", "no progress bar in a pipe");
    let report = w.json("report.json");
    assert_eq!(report["schema"], "osculate.bake/1");
    assert_eq!(report["mesh"]["closed"], true);
    assert_eq!(report["curvature"]["statuses"][0]["status"], "ok");
    assert_eq!(report["provenance"]["source"]["file"], "torus.obj");
    let kappa_max = report["curvature"]["kappa_max"]["median"].as_f64().unwrap();
    assert!((kappa_max - 2.5).abs() < 0.01, "1 / 0.4: {kappa_max}");
    let baked = read_baked(&w.path("torus.glb")).unwrap();
    assert_eq!(baked.mesh().positions().len(), 4608);

    let run = w.ok("inspect torus.glb");
    for part in ["closed, manifold", "kappa_max", "4608 ok", "equal positions merged", "SHA-256"] {
        assert!(run.stdout.contains(part), "{part}: {run:?}");
    }
}

#[test]
fn what_is_over_the_tolerance_is_explained() {
    let w = Workspace::new();
    // An icosahedron has nothing to tell an error bar from.
    w.write_obj("coarse.obj", &shapes::icosphere(1.0, 1));
    let run = w.ok("bake coarse.obj -o out.glb --tolerance 0.001 --json report.json");
    assert!(run.stdout.contains("tolerance  0.1 % of the curvature is not reached at "), "{run:?}");
    assert!(run.stdout.contains(" of 42 vertices: there the stated error is "), "{run:?}");
    let over = &w.json("report.json")["over_tolerance"];
    assert!(over["vertices"].as_u64().unwrap() > 0 && over["error_over_curvature"].as_f64().unwrap() > 0.001);
    let run = w.ok("bake coarse.obj -o out.glb --tolerance 1e6 --json report.json");
    assert!(!run.stdout.contains("not reached"), "{run:?}");
    assert!(w.json("report.json")["over_tolerance"].is_null());
}

#[test]
fn json_on_standard_output_is_alone_there() {
    let w = Workspace::new();
    w.write_obj("ball.obj", &shapes::icosphere(1.0, 2));
    let run = w.ok("bake ball.obj -o ball.ply --json -");
    let report: serde_json::Value = serde_json::from_str(&run.stdout).unwrap();
    assert_eq!(report["output"], "ball.ply");
    let run = w.ok("inspect ball.ply --json - -v");
    let report: serde_json::Value = serde_json::from_str(&run.stdout).unwrap();
    assert_eq!(report["kind"], "baked_mesh");
    assert!(w.ok("bake ball.obj -o ball.ply --quiet").stdout.is_empty());
}

#[test]
fn the_same_bits_for_any_number_of_threads() {
    let w = Workspace::new();
    w.write_obj("torus.obj", &shapes::torus(1.0, 0.4, 150, 60));
    for method in ["auto", "jet", "quadric", "algebraic", "normals", "libigl"] {
        w.ok(&format!("bake torus.obj -o one.glb --threads 1 --method {method}"));
        w.ok(&format!("bake torus.obj -o two.glb --threads 2 --method {method}"));
        assert!(w.read("one.glb") == w.read("two.glb"), "{method}");
        w.ok(&format!("bake torus.obj -o one.ply --threads 1 --precision f64 --method {method}"));
        w.ok(&format!("bake torus.obj -o two.ply --threads 2 --precision f64 --method {method}"));
        assert!(w.read("one.ply") == w.read("two.ply"), "{method}");
    }
}

#[test]
fn the_options_reach_the_estimator() {
    let w = Workspace::new();
    w.write_obj("ball.obj", &shapes::icosphere(1.0, 3));
    w.ok("bake ball.obj -o out.ply --method libigl --mean-edges 3 --weld off --flip --precision f64");
    let baked = read_baked(&w.path("out.ply")).unwrap();
    let record = serde_json::to_value(&baked.provenance).unwrap();
    assert_eq!(record["curvature"]["method"], "libigl");
    assert_eq!(record["curvature"]["neighbourhood"]["mean_edges"], 3.0);
    assert_eq!((&record["weld"], &record["facing"]), (&"off".into(), &"flipped".into()));
    let kappa = baked.curvature()[0].principal.unwrap().kappa_max;
    assert!(kappa < -0.9, "a ball turned inside out is concave: {kappa}");
    w.ok("bake ball.obj -o out.ply --radius 0.4");
    w.ok("bake ball.obj -o out.ply --rings 3");
}

#[test]
fn a_seam_does_not_tear_the_curvature() {
    let w = Workspace::new();
    w.ok(&format!("bake {} -o spot.glb", repository("assets/meshes/spot.obj").display()));
    let baked = read_baked(&w.path("spot.glb")).unwrap();
    assert_eq!(baked.mesh().positions().len(), 3605);
    let mut by_position = std::collections::HashMap::new();
    for (p, c) in baked.mesh().positions().iter().zip(baked.curvature()) {
        let key = [p.x, p.y, p.z].map(f64::to_bits);
        assert_eq!(
            by_position.entry(key).or_insert(*c).principal.map(|p| p.kappa_max),
            c.principal.map(|p| p.kappa_max)
        );
    }
    assert_eq!(by_position.len(), 2930);
}

#[test]
fn bad_usage_is_refused_before_any_work() {
    let w = Workspace::new();
    w.write_obj("ball.obj", &shapes::icosphere(1.0, 1));
    w.refuses("bake missing.obj -o out.glb", &["missing.obj"]);
    w.refuses("bake ball.obj -o out.fbx", &["out.fbx", ".glb and .ply"]);
    w.refuses("bake ball.obj -o nowhere/out.glb", &["nowhere/out.glb", "does not exist"]);
    w.refuses("bake ball.obj -o out.glb --precision f64", &["out.glb", "32-bit"]);
    w.refuses("bake ball.obj -o out.glb --json nowhere/report.json", &["nowhere/report.json"]);
    w.refuses("bake ball.obj -o .", &["is a directory"]);
    w.refuses("inspect ball.txt", &["ball.txt"]);
    for usage in
        ["bake ball.obj", "bake ball.obj -o a.glb --rings 0", "bake ball.obj -o a.glb --radius -1", "sing"]
    {
        let run = w.run(usage);
        assert_eq!((run.code, run.stdout.as_str()), (2, ""), "{usage}: {run:?}");
    }
    w.run("bake ball.obj -o a.glb --rings 2 --radius 1");
    assert_eq!(w.files(), ["ball.obj"]);
    w.ok("bake ball.obj -o ball.glb");
    w.refuses("bake ball.glb -o ball.glb", &["is the input too"]);
}

#[test]
fn a_value_that_32_bits_cannot_hold_names_its_vertex() {
    let w = Workspace::new();
    w.write("far.obj", "v 0 0 0\nv 1e39 0 0\nv 0 1e39 0\nf 1 2 3\n");
    w.refuses("bake far.obj -o far.glb", &["far.obj", "vertex 1", "1e39", "64-bit"]);
    w.ok("bake far.obj -o far.ply --precision f64");
}

#[test]
fn readable_meshes_with_defects_are_baked_and_flagged() {
    let w = Workspace::new();
    let defects =
        "v 0 0 0\nv 1 0 0\nv 0 1 0\nv 9 9 9\nv 2 0 0\nv 0 0 1\nf 1 2 3\nf 1 2 5\nf 1 1 2\nf 1 2 3\nf 1 2 6\n";
    w.write("defects.obj", defects);
    w.ok("bake defects.obj -o defects.glb --json report.json");
    let report = w.json("report.json");
    assert_eq!(report["mesh"]["vertices"], 6);
    let statuses: Vec<_> =
        report["curvature"]["statuses"].as_array().unwrap().iter().map(|s| s["status"].clone()).collect();
    assert!(
        statuses.contains(&"isolated".into()) && statuses.contains(&"non_manifold".into()),
        "{statuses:?}"
    );
}

/// A limit on the file size kills the process in the middle of its write, as a full disk or a power cut would end it.
#[cfg(unix)]
#[test]
fn an_interrupted_write_leaves_the_old_file() {
    let w = Workspace::new();
    w.write_obj("torus.obj", &shapes::torus(1.0, 0.4, 100, 60));
    for name in ["torus.glb", "torus.ply"] {
        w.ok(&format!("bake torus.obj -o {name}"));
        let old = w.read(name);
        let script =
            format!("ulimit -f 64; exec '{}' bake torus.obj -o {name}", env!("CARGO_BIN_EXE_osculate"));
        let mut shell = std::process::Command::new("sh");
        let status = shell.args(["-c", &script]).current_dir(w.path("")).output().unwrap().status;
        assert!(!status.success(), "the limit must end the run");
        assert!(w.read(name) == old, "{name} is untouched");
    }
}

#[test]
fn filters_are_baked_shown_and_used() {
    let w = Workspace::new();
    w.write_obj("torus.obj", &shapes::torus(1.0, 0.4, 40, 20));
    for file in ["torus.glb", "torus.ply"] {
        let run =
            w.ok(&format!("bake torus.obj -o {file} --filter-azimuths 8 --filter-depth 0.05 --json r.json"));
        assert!(
            run.stdout.contains("8 azimuths, as far as a ray of cosine 0.2 is in a material 0.05 deep"),
            "{run:?}"
        );
        let record = &w.json("r.json")["provenance"]["filter"];
        assert_eq!((&record["azimuths"], &record["walk"]["shell_at"]["depth"]), (&8.into(), &0.05.into()));
        let [median, p99, max, proved] =
            ["median", "p99", "max", "proved"].map(|k| record["error"][k].as_f64().unwrap());
        assert!(median <= p99 && p99 <= max && max <= proved, "{record}");
        assert!(w.ok(&format!("inspect {file}")).stdout.contains("8 azimuths"), "{file}");
        assert_eq!(read_baked(&w.path(file)).unwrap().filter().unwrap().azimuths(), 8);
        for filter in ["point", "march", "baked", "chord"] {
            w.ok(&format!("render {file} -o k.png --size 32x24 --aov filtered --filter {filter}"));
        }
    }
    w.ok("bake torus.obj -o one.glb --threads 1 --filter-azimuths 4 --filter-length 0.2");
    w.ok("bake torus.obj -o two.glb --threads 2 --filter-azimuths 4 --filter-length 0.2");
    assert!(w.read("one.glb") == w.read("two.glb"));
    w.refuses("bake torus.obj -o a.glb --filter-depth 0.1", &["--filter-azimuths"]);
    assert_eq!(w.run("bake torus.obj -o a.glb --filter-azimuths 7").code, 2);
    // Tables of the file are for its length; others are made.
    let picture = |input: &str| {
        w.ok(&format!("render {input} -o k.png --size 32x24 --aov filtered --filter baked"));
        w.read("k.png")
    };
    let from_file = picture("torus.glb");
    assert!(from_file == picture("torus.glb --filter-depth 0.05"), "as the file has it");
    assert!(from_file != picture("torus.glb --filter-depth 0.4"), "as the command has it");
    assert!(from_file != picture("torus.obj --filter-depth 0.05"), "sixteen azimuths instead of eight");
}

#[test]
fn the_filter_study_writes_its_page_and_numbers() {
    let w = Workspace::new();
    let run = w.ok("study filter -o study --quick --runs 1 --json r.json");
    assert!(run.stdout.contains("study/index.html"), "{run:?}");
    let page = String::from_utf8(w.read("study/index.html")).unwrap();
    assert!(page.contains("What to take when") && page.contains("<svg") && !page.contains("NaN"));
    let results = w.json("r.json")["results"].clone();
    for result in results.as_array().unwrap() {
        for row in result["rows"].as_array().unwrap() {
            if row["filter"] == "march" && row["setting"] == "" {
                assert!(row["error"]["max"].as_f64().unwrap() < 1e-9, "{row}");
            }
            if row["filter"] == "baked_chord" {
                assert!(row["error"]["median"].as_f64().unwrap() < 0.05, "{row}");
            }
        }
    }
    assert_eq!(String::from_utf8(w.read("study/filter.csv")).unwrap().lines().count(), 1 + 4 * 11);
    w.write("file", "");
    w.refuses("study filter -o file", &["file: is a file"]);
}

//! `osculate study`, through the real binary.
#![allow(clippy::unwrap_used, reason = "a test that cannot read its files must stop")]

mod common;

use common::Workspace;
use osculate_geom::shapes;

/// Columns of the CSV that do not depend on the clock or the allocator.
fn errors(w: &Workspace, csv: &str) -> Vec<String> {
    let text = String::from_utf8(w.read(csv)).unwrap();
    let columns: Vec<&str> = text.lines().next().unwrap().split(',').collect();
    let kept = |name: &&str| !name.starts_with("us_") && !name.starts_with("bytes_");
    let keep: Vec<bool> = columns.iter().map(kept).collect();
    let cells = |line: &str| {
        let kept = line.split(',').zip(&keep).filter(|(_, keep)| **keep).map(|(cell, _)| cell);
        kept.collect::<Vec<_>>().join(",")
    };
    text.lines().map(cells).collect()
}

#[test]
fn quick_study_writes_page_table_and_plots() {
    let w = Workspace::new();
    let run = w.ok("study curvature -o out --quick --json report.json");
    assert!(run.stdout.contains("index.html"), "{run:?}");
    let page = String::from_utf8(w.read("out/index.html")).unwrap();
    for part in
        ["Which setting to take", "--method auto --tolerance 0.005", "<svg", "study curvature -o out --quick"]
    {
        assert!(page.contains(part), "{part} is missing");
    }
    for outside in ["<script", "src=", "@import", "url(", "<link"] {
        assert!(!page.contains(outside), "{outside}: the page must stand alone");
    }
    let report = w.json("report.json");
    assert_eq!(report["schema"], "osculate.study_curvature/1");
    let rows = report["rows"].as_array().unwrap();
    assert_eq!(String::from_utf8(w.read("out/curvature.csv")).unwrap().lines().count(), rows.len() + 1);
    for name in report["files"].as_array().unwrap() {
        assert!(!w.read(&format!("out/{}", name.as_str().unwrap())).is_empty(), "{name}");
    }
    // The numbers make sense: two rings beat five on the clean torus, and noise hurts two rings.
    let median = |noise: f64, setting: &str| {
        let found = rows.iter().find(|r| {
            r["shape"] == "torus"
                && r["purpose"] == "accuracy"
                && r["noise"] == noise
                && r["method"] == "quadric"
                && r["setting"] == setting
        });
        found.unwrap()["median"].as_f64().unwrap()
    };
    let (two, five, noisy) = (median(0.0, "2 rings"), median(0.0, "5 rings"), median(0.01, "2 rings"));
    assert!(two > 0.0 && two < 0.5 * five && noisy > two, "{two} {five} {noisy}");
    for row in rows {
        assert!(
            row["us_per_vertex"].as_f64().unwrap() > 0.0 && row["bytes_per_vertex"].as_f64().unwrap() > 80.0,
            "{row}"
        );
    }
}

#[test]
fn growth_alone_is_fitted_per_method() {
    let w = Workspace::new();
    w.ok("study curvature -o out --quick --part growth --json report.json");
    let report = w.json("report.json");
    assert!(report["rows"].as_array().unwrap().iter().all(|row| row["purpose"] == "scaling"));
    let growth = report["growth"].as_array().unwrap();
    let methods: Vec<&str> = growth.iter().map(|law| law["method"].as_str().unwrap()).collect();
    assert_eq!(methods, ["libigl", "quadric", "jet", "algebraic", "normals", "auto"]);
    for law in growth {
        assert_eq!((law["meshes"].as_u64(), law["most_vertices"].as_u64()), (Some(3), Some(2000)));
        assert!(law["seconds"].is_number() && law["seconds_all_threads"].is_number(), "{law}");
        // What does not depend on the size counts on meshes this small, so less than in proportion; never more.
        let bytes = law["bytes"].as_f64().unwrap();
        assert!((0.3..1.05).contains(&bytes), "{law}");
    }
    assert_eq!(String::from_utf8(w.read("out/growth.csv")).unwrap().lines().count(), 7);
    let page = String::from_utf8(w.read("out/index.html")).unwrap();
    assert!(page.contains("Growth from 500 to 2000 vertices") && !page.contains("Which setting to take"));
    w.ok("study curvature -o errors --quick --vertices 300 --part accuracy --json report.json");
    assert_eq!(w.json("report.json")["growth"], serde_json::json!([]));
    assert!(!w.path("errors/growth.csv").exists());
}

#[test]
fn errors_depend_on_the_seed_and_on_nothing_else() {
    let w = Workspace::new();
    w.ok("study curvature -o a --quick --vertices 300 --threads 1");
    w.ok("study curvature -o b --quick --vertices 300 --threads 2");
    w.ok("study curvature -o c --quick --vertices 300 --seed 2");
    assert_eq!(errors(&w, "a/curvature.csv"), errors(&w, "b/curvature.csv"));
    assert_ne!(errors(&w, "a/curvature.csv"), errors(&w, "c/curvature.csv"));
}

#[test]
fn bad_input_is_refused_before_any_work() {
    let w = Workspace::new();
    w.write_obj("open.obj", &shapes::plane(4, 4));
    w.write("peers.csv", "mesh,shape\n");
    w.write("file", "");
    w.refuses("study curvature -o out --quick --mesh open.obj", &["open", "edge", "closed manifold"]);
    w.refuses("study curvature -o out --quick --mesh none.obj", &["none.obj"]);
    w.refuses("study curvature -o out --quick --peers peers.csv", &["peers.csv", "line 1", "peers.py"]);
    w.refuses("study curvature -o file --quick", &["file"]);
    w.refuses(
        "study curvature -o out --quick --python python3",
        &["tools/reference/peers.py", "--peers-script"],
    );
    for usage in
        ["study", "study curvature", "study curvature -o out --vertices 9", "study curvature -o out --cgal ."]
    {
        assert_eq!(w.run(usage).code, 2, "{usage}");
    }
    assert_eq!(w.files(), ["file", "open.obj", "peers.csv"]);
}

/// A stand-in for Python that checks what it is given and writes one row.
#[cfg(unix)]
#[test]
fn peers_measured_in_the_run_are_in_table_and_plots() {
    use std::os::unix::fs::PermissionsExt;

    let w = Workspace::new();
    w.write(
        "python",
        "#!/bin/sh\n\
         [ \"$1\" = -c ] && exit 0\n\
         [ -f \"$2/torus_1000_0.obj\" ] && [ \"$3\" = -o ] && [ \"$5 $6 $7 $8\" = '--ponca ponca --runs 1' ] || exit 1\n\
         echo 'peers 1 1 done' >&2\n\
         echo 'mesh,shape,vertices,noise,peer,setting,median,p95,direction_median_deg,direction_p95_deg,us_per_vertex,bytes_per_vertex,undetermined,note' > $4\n\
         for s in torus bump; do echo ${s}_1000_0,$s,1000,0,ponca,aso5,0.5,0.6,1,2,3,4,0, >> $4; done\n\
         echo torus_1000_0,torus,1000,0,cgal,icc,,,,,,,,ended with code 1 >> $4\n",
    );
    std::fs::set_permissions(w.path("python"), std::fs::Permissions::from_mode(0o755)).unwrap();
    w.write("peers.py", "");
    let python = w.path("python").display().to_string();
    w.ok(&format!("study curvature -o out --quick --python {python} --peers-script peers.py --ponca ponca"));
    let page = String::from_utf8(w.read("out/index.html")).unwrap();
    for part in ["Ponca ASO", "Beside other programs", "ended with code 1"] {
        assert!(page.contains(part), "{part} is missing");
    }
    let exact = w.read("out/meshes/torus_1000_0.exact");
    assert_eq!(exact.len(), 1000 * 5 * 8);
    // The tube's curvature, 1 / 0.4, is the larger one everywhere.
    assert!((f64::from_le_bytes(exact[..8].try_into().unwrap()) - 2.5).abs() < 1e-12);
    let list = String::from_utf8(w.read("out/meshes/meshes.csv")).unwrap();
    assert!(
        list.starts_with("mesh,shape,vertices,noise,radius,use\ntorus_1000_0,torus,1000,0,0.4,accuracy\n"),
        "{list}"
    );
}

/// The model stands beside itself as if it were another network: the same questions with the same noise have the same answers.
#[test]
fn a_quick_study_of_renderings_tells_bias_from_noise() {
    let w = Workspace::new();
    let stone = common::repository("assets/materials/stone-1.sbtf");
    let run = format!("study render {} -o out --quick", stone.display());
    w.ok(&format!("{run} --also {} --json report.json", stone.display()));
    let report = w.json("report.json");
    assert_eq!(report["schema"], "osculate.study.render/2");
    let rows = report["rows"].as_array().unwrap();
    let number = |form: &str, knob: &str, spp: u64, field: &str| {
        let found = rows.iter().find(|r| r["form"] == form && r["knob"] == knob && r["spp"] == spp);
        found.unwrap_or_else(|| panic!("{form} {knob} {spp}"))[field].as_f64().unwrap()
    };
    for field in ["error", "bias", "flip", "bytes"] {
        assert_eq!(number("neural", "chord", 4, field), number("network", "stone-1", 4, field), "{field}");
    }
    // A flat mesh is wrong whatever its noise; the reference's own triangles are noisy and right, as far as two runs of 4 samples tell:
    // to the root of the noise's square over the root of 1728 numbers, a sixth of the noise.
    let (flat, finest) = (number("flat", "", 4, "bias"), number("displaced", "0.1 depths", 4, "bias"));
    let neural = number("neural", "chord", 4, "bias");
    assert!(finest < 0.5 * flat && neural < 0.7 * flat, "{finest} {neural} {flat}");
    let noise = |spp| number("displaced", "0.1 depths", spp, "error");
    assert!(noise(4) < 0.8 * noise(1) && noise(4) > 2.0 * finest, "{} {} {finest}", noise(1), noise(4));
    assert_eq!(report["networks"].as_array().unwrap().len(), 2);
    assert_eq!(report["networks"][1]["hidden"], serde_json::json!([24, 3]));
    let page = String::from_utf8(w.read("out/index.html")).unwrap();
    assert!(page.contains("<svg") && page.contains("Size of the networks") && !page.contains("<script"));
    assert_eq!(String::from_utf8(w.read("out/render.csv")).unwrap().lines().count(), rows.len() + 1);
    let shell = common::repository("assets/materials/shell.sbtf");
    let refused = format!("study render {} -o other --quick --also {}", stone.display(), shell.display());
    w.refuses(&refused, &["shell.sbtf", "another microstructure"]);
}

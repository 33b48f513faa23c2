//! `osculate render` and `osculate demo`, through the real binary.

mod common;

use common::Workspace;
use osculate_geom::shapes;

const PNG: &[u8] = b"\x89PNG";
const EXR: &[u8] = b"\x76\x2f\x31\x01";

#[test]
fn pictures_of_baked_and_raw_meshes() {
    let w = Workspace::new();
    w.write_obj("torus.obj", &shapes::torus(1.0, 0.4, 32, 16));
    w.ok("bake torus.obj -o torus.glb");
    w.ok("render torus.glb -o a.png --size 48x32 --spp 2 --threads 1");
    w.ok("render torus.glb -o b.png --size 48x32 --spp 2 --threads 2 --json report.json");
    assert!(w.read("a.png").starts_with(PNG) && w.read("a.png") == w.read("b.png"), "the same bits");
    let report = w.json("report.json");
    assert_eq!(
        (&report["size"][0], &report["render"]["samples_range"]),
        (&48.into(), &serde_json::json!([2, 2]))
    );
    assert_eq!(report["render"]["samples_per_pixel"].as_f64(), Some(2.0));
    assert_eq!(report["render"]["contradictions"], serde_json::json!([]));
    assert_eq!(report["render"]["counters"]["discarded_samples"], 0);
    for aov in ["curvature", "kappa_min", "gaussian", "along_ray", "filtered", "error"] {
        w.ok(&format!("render torus.obj -o k.png --size 48x32 --aov {aov}"));
        assert!(w.read("k.png").starts_with(PNG), "{aov}");
    }
    w.ok("render torus.obj -o all.exr --size 48x32 --spp 1 --aov all");
    assert!(w.read("all.exr").starts_with(EXR));
    let run = w.ok("render torus.glb --explain");
    assert!(run.stdout.contains("interreflection"), "{run:?}");
}

#[test]
fn scenes_name_what_is_wrong() {
    let w = Workspace::new();
    w.write_obj("ball.obj", &shapes::icosphere(1.0, 1));
    w.write("scene.toml", "[image]\nwidth = 24\nheight = 16\n[[mesh]]\nfile = \"ball.obj\"\n");
    w.ok("render scene.toml -o scene.png --spp 1");
    let scene = |curvature: &str| {
        format!("{curvature}\n[image]\nwidth = 24\nheight = 16\n[[mesh]]\nfile = \"ball.obj\"\n")
    };
    w.write("chord.toml", &scene("[curvature]\nfilter = \"chord\"\ndepth = 0.1"));
    let show = "render chord.toml -o chord.exr --spp 1 --aov kappa_filtered --explain";
    assert!(w.ok(show).stdout.contains("by `chord` for 1 objects"));
    assert!(w.ok(&format!("{show} --filter point")).stdout.contains("by `point` for 1 objects"));
    w.write("deep.toml", &scene("[curvature]\ndepth = -1.0"));
    w.refuses("render deep.toml -o out.png", &["deep.toml", "curvature.depth", "-1"]);
    w.write("both.toml", &scene("[curvature]\ndepth = 1.0\nlength = 2.0"));
    w.refuses("render both.toml -o out.png", &["both.toml", "curvature.length"]);
    w.write("typo.toml", "[image]\nwidht = 24\n");
    w.refuses("render typo.toml -o out.png", &["typo.toml", "widht"]);
    w.write("missing.toml", "[[mesh]]\nfile = \"none.obj\"\n");
    w.refuses("render missing.toml -o out.png", &["missing.toml", "none.obj"]);
    w.write("far.obj", "v 0 0 0\nv 1e30 0 0\nv 0 1e30 0\nf 1 2 3\n");
    w.refuses("render far.obj -o out.png", &["far.obj", "vertex 1", "1e30", "single precision"]);
    w.write("far.toml", "[[mesh]]\nshape = \"torus:1e20,0.4e20\"\n");
    w.refuses("render far.toml -o out.png", &["far.toml", "object 0", "1.4e20", "single precision"]);
    w.refuses("render ball.obj -o out.jpg", &["out.jpg", ".png and .exr"]);
    w.refuses("render ball.obj -o out.png --aov depth", &["out.png", "depth"]);
    w.refuses("render ball.obj -o out.png --aov mean,error", &["out.png", ".exr"]);
    for usage in [
        "render ball.obj",
        "render ball.obj -o a.png --size 0x5",
        "render ball.obj -o a.png --spp 1 --time 1",
        "render ball.obj -o a.png --time 0",
        "render ball.obj -o a.png --time -1",
        "render ball.obj -o a.png --time nan",
        "render ball.obj -o a.png --time inf",
        "render ball.obj -o a.png --time 5parsecs",
    ] {
        assert_eq!(w.run(usage).code, 2, "{usage}");
    }
    for time in ["0.01", "10ms", "1e-2", "9ms1ms"] {
        w.ok(&format!("render scene.toml -o timed.png --time {time}"));
    }
}

#[test]
fn a_heat_map_is_drawn_and_the_check_still_decides() {
    let w = Workspace::new();
    w.write_obj("ball.obj", &shapes::icosphere(1.0, 2));
    assert_eq!(w.run("verify ball.obj --analytic sphere:1 --bound 1e-6 --heatmap heat.png").code, 1);
    assert!(w.read("heat.png").starts_with(PNG));
    w.refuses("verify ball.obj --analytic sphere:1 --heatmap heat.jpg", &["heat.jpg"]);
}

#[test]
fn the_demo_needs_nothing_but_the_binary() {
    let w = Workspace::new();
    let run = w.ok("demo -o results/here --spp 1 --json report.json");
    assert!(run.stdout.contains("PASS"), "{run:?}");
    for name in ["spot.glb", "spot.png", "spot_curvature.png"] {
        assert!(w.path("results/here").join(name).is_file(), "{name}");
    }
    assert_eq!(w.json("report.json")["comparison"]["passed"], true);
}

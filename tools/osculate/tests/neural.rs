//! `train`, `eval`, `inspect` and `render` of neural materials, through the real binary.
#![allow(clippy::unwrap_used, reason = "a test that cannot read its files must stop")]

mod common;

use common::Workspace;

/// A few steps: the model is poor, but everything happens that happens in a long run.
const SHORT: &str = "train shell --steps 60 --texture 16 --precision u8";

#[test]
fn a_material_is_trained_shown_judged_and_rendered() {
    let w = Workspace::new();
    w.ok(&format!("{SHORT} -o shell.sbtf --curve curve.svg --json train.json"));
    assert!(!w.path("shell.sbtf.checkpoint").exists(), "nothing is left to go on from");
    assert!(String::from_utf8(w.read("curve.svg")).unwrap().contains("<svg"));
    let report = w.json("train.json");
    assert_eq!(report["schema"], "osculate.train/1");
    assert_eq!(report["options"]["opacity_steps"], 60);
    let error = report["scores"]["opacity"]["error"].as_f64().unwrap();
    assert!(error < 1.0, "{error}: no better than an opaque surface");

    assert!(w.ok("inspect shell.sbtf").stdout.contains("shell"));

    w.ok("eval shell.sbtf --rays 2000 --spp 1 --sheet sheet.png --json eval.json");
    let left = w.json("eval.json")["models"][0]["left"].as_f64().unwrap();
    assert!(left > 0.0 && left < 1.0, "{left}");
    assert!(!w.read("sheet.png").is_empty());
    let failed = w.run(&format!("eval shell.sbtf --rays 2000 --silhouettes-only --require {}", 0.5 * left));
    assert_eq!(failed.code, 1, "{failed:?}");

    w.write(
        "scene.toml",
        "[image]\nwidth = 48\nheight = 32\n[[mesh]]\nshape = 'torus:1,0.45'\nmaterial = 'm'\n[material.m]\nmodel = 'shell.sbtf'\n\
         tiles = [6.0, 3.0]\ntile_size = 1.0\n[environment]\nradiance = [1.0, 1.0, 1.0]\n",
    );
    let run = w.ok("render scene.toml -o a.png --spp 2 --explain --json r.json");
    assert!(run.stdout.contains("silhouettes          yes"), "{run:?}");
    let counters = w.json("r.json")["render"]["counters"].clone();
    for counter in ["opacity_queries", "reflectance_queries", "pass_throughs"] {
        assert!(counters[counter].as_u64().unwrap() > 0, "{counter}: {counters}");
    }
}

/// The torus has some 29,000 vertices: a table of chords pays from 2.9 million samples on, one of minima from 1.7.
#[test]
fn walks_come_from_a_table_where_that_pays_or_it_is_asked_for() {
    let w = Workspace::new();
    let model = concat!(env!("CARGO_MANIFEST_DIR"), "/../../assets/materials/stone-1.sbtf");
    let scene = |curvature: &str, told: &str| {
        format!(
            "[image]\nwidth = 200\nheight = 100\n[[mesh]]\nshape = 'torus:1,0.45'\nmaterial = 'm'\n[material.m]\nmodel = '{model}'\n\
             tiles = [6.0, 3.0]\ntile_size = 1.0\n{told}\n[curvature]\n{curvature}\n[environment]\nradiance = [1.0, 1.0, 1.0]\n"
        )
    };
    w.write("free.toml", &scene("", ""));
    w.write("named.toml", &scene("filter = 'chord'", ""));
    w.write("paper.toml", &scene("query = 'paper'", ""));
    w.write("march.toml", &scene("query = 'paper'\nfilter = 'march'", ""));
    w.write("mean.toml", &scene("", "curvature = 'mean'"));
    let filter = |command: &str| {
        let shown = w.ok(command).stdout;
        shown.lines().find(|line| line.starts_with("curvature filter")).unwrap().to_owned()
    };
    for (command, wanted) in [
        ("render free.toml --explain --spp 140", "`chord` for 1 objects"),
        ("render free.toml --explain --spp 150", "`baked_chord` for 1 objects"),
        ("render free.toml --explain --time 1e4", "`baked_chord` for 1 objects"),
        ("render free.toml --explain --noise 0.01", "`chord` for 1 objects"),
        ("render named.toml --explain --spp 100000", "`chord` for 1 objects"),
        ("render free.toml --explain --spp 1 --filter baked_chord", "`baked_chord` for 1 objects"),
        ("render paper.toml --explain --spp 85", "`march` for 1 objects"),
        ("render paper.toml --explain --spp 90", "`baked` for 1 objects"),
        ("render march.toml --explain --spp 100000", "`march` for 1 objects"),
        ("render mean.toml --explain", "taken at the point"),
    ] {
        let shown = filter(command);
        assert!(shown.contains(wanted), "{command}: {shown}");
    }
}

/// Two straps, one above the other, with holes between: its opacity is a share of rays, which `eval` counts.
#[test]
fn a_see_through_mesh_is_trained_and_judged_by_its_holes() {
    let w = Workspace::new();
    let strap = |z: f32, a: [f32; 4]| {
        format!("v {0} {1} {z}\nv {2} {1} {z}\nv {2} {3} {z}\nv {0} {3} {z}\n", a[0], a[1], a[2], a[3])
    };
    let (over, under) = (strap(0.1, [0.0, 0.2, 1.0, 0.6]), strap(0.0, [0.3, 0.0, 0.7, 1.0]));
    w.write("m.obj", &format!("{over}{under}f 1 2 3 4\nf 5 6 7 8\n"));
    w.write("m.toml", "mesh = \"m.obj\"\nup = \"z\"\n");
    w.ok("train m.toml -o m.sbtf --steps 50 --texture 32 --precision u8");
    let shown =
        w.ok("eval m.sbtf --micro m.toml --rays 4000 --spp 1 --silhouettes-only --json eval.json").stdout;
    assert!(shown.contains("IoU of passing rays"), "{shown}");
    let coverage = w.json("eval.json")["models"][0]["coverage"].clone();
    let all = |key: &str| coverage["all"][key].as_f64().unwrap();
    // On a flat surface (1 - 0.4)(1 - 0.4) of the tile is open from everywhere: straps have no thickness. Five standard deviations.
    let flat = &coverage["by_kappa"][2];
    let open = flat["open"].as_f64().unwrap();
    assert!(flat["kappa"] == 0.0 && (open - 0.36).abs() < 0.038, "{coverage}");
    assert!(all("opaque_iou") > 0.8 && all("hole_iou") > 0.5, "{coverage}");
    assert_eq!(coverage["by_kappa"].as_array().unwrap().len(), 7);
}

#[test]
fn the_same_steps_give_the_same_numbers_on_any_number_of_threads() {
    let w = Workspace::new();
    // The header says how long the run took; all else is the same.
    let tensors = |threads: u32| {
        w.ok(&format!("{SHORT} -o {threads}.sbtf --threads {threads}"));
        let bytes = w.read(&format!("{threads}.sbtf"));
        let header = usize::try_from(u64::from_le_bytes(bytes[..8].try_into().unwrap())).unwrap();
        bytes[8 + header..].to_vec()
    };
    assert!(tensors(1) == tensors(2), "other numbers with other threads");
}

#[test]
fn a_quick_study_shows_what_each_knob_buys() {
    let w = Workspace::new();
    w.ok("study material shell -o out --quick --steps 20 --json report.json");
    let report = w.json("report.json");
    let rows = report["rows"].as_array().unwrap();
    for knob in ["default", "taps", "width", "resolution", "channels", "steps", "bits"] {
        assert!(rows.iter().any(|row| row["knob"] == knob), "{knob}");
    }
    let value = |knob: &str, value: &str, field: &str| {
        let row = rows.iter().find(|row| row["knob"] == knob && row["value"] == value);
        row.unwrap()[field].as_f64().unwrap()
    };
    // What must hold after however little training: fewer taps make smaller networks, fewer bits smaller textures.
    assert!(value("taps", "1", "bytes") < value("default", "", "bytes"));
    assert!(value("taps", "1", "batched_nanoseconds") > 0.0);
    assert!(value("bits", "u8", "bytes") < 0.5 * value("default", "", "bytes"));
    let page = String::from_utf8(w.read("out/index.html")).unwrap();
    assert!(page.contains("<svg") && page.contains("study material shell -o out --quick"));
}

/// A flat square, where exact queries have no error: all that differs is what a form leaves out.
#[test]
fn one_word_changes_what_stands_for_a_microstructure() {
    let w = Workspace::new();
    w.write(
        "square.obj",
        "v -1 -1 0\nv 1 -1 0\nv 1 1 0\nv -1 1 0\nvt 0 0\nvt 1 0\nvt 1 1\nvt 0 1\nf 1/1 2/2 3/3\nf 1/1 3/3 4/4\n",
    );
    let scene = |micro: &str| {
        format!(
            "[image]\nwidth = 48\nheight = 48\n[camera]\nposition = [0.5, -0.8, 2.0]\ntarget = [0.0, 0.0, 0.0]\nfov_y = 16.0\n\
             [[mesh]]\nfile = 'square.obj'\nmaterial = 'm'\n[material.m]\nmicro = '{micro}'\ntiles = [2.0, 2.0]\ntile_size = 1.0\n\
             [[light]]\ntype = 'directional'\ndirection = [-0.7, -0.2, -0.5]\nirradiance = [2.0, 2.0, 2.0]\n"
        )
    };
    w.write("scene.toml", &scene("shell"));
    let mean = |form: &str| {
        w.ok(&format!("render scene.toml -o {form}.png --spp 16 --as {form}"));
        let picture = image::load_from_memory(&w.read(&format!("{form}.png"))).unwrap().into_rgb8();
        picture.iter().map(|&x| f64::from(x)).sum::<f64>() / picture.len() as f64
    };
    let [displaced, oracle, march, flat] = ["displaced", "oracle", "march", "flat"].map(mean);
    // Four bounces for eight.
    assert!((oracle / displaced - 1.0).abs() < 0.02, "{oracle} {displaced}");
    // Without light from rib to rib it is darker, and flat ribs hide nothing of the dark between them.
    assert!(march < 0.95 * displaced && march > 0.8 * displaced, "{march} {displaced}");
    assert!(flat < 0.98 * march, "{flat} {march}");
    w.refuses("render scene.toml -o a.png --as neumip", &["scene.toml: material.m.as = neumip", "baseline"]);
    let usage = w.run("render scene.toml -o a.png --as round");
    assert!(
        usage.code == 2 && usage.stderr.contains("round") && usage.stderr.contains("displaced"),
        "{usage:?}"
    );
    w.refuses("render square.obj -o a.png --as flat", &["square.obj", "--as flat"]);
    // What a model was trained on, but deeper.
    let model = concat!(env!("CARGO_MANIFEST_DIR"), "/../../assets/materials/stone-1.sbtf");
    let named = format!("model = '{model}'\nas = 'march'\nmicro_depth = 0.2");
    w.write("deep.toml", &scene("stone-1").replace("micro = 'stone-1'", &named));
    w.ok("render deep.toml -o deep.png --spp 1");
    w.write("weave.toml", &scene("basket-weave"));
    w.refuses("render weave.toml -o a.png --as displaced", &["basket-weave is a see-through mesh"]);
}

#[test]
fn what_does_not_fit_is_one_message() {
    let w = Workspace::new();
    w.write("bad.sbtf", "no model");
    for (args, part) in [
        ("train tweed -o a.sbtf", "tweed"),
        ("train shell -o a.png", "a.png: the extension must be .sbtf"),
        ("train shell -o a.sbtf --minutes 0", "--minutes 0"),
        ("train shell -o a.sbtf --depth 7", "--depth 7"),
        ("train shell -o a.sbtf --resume", "a.sbtf.checkpoint: there is no checkpoint"),
        ("train basket-weave -o a.sbtf --head silhouette", "--head silhouette"),
        ("train shell -o a.sbtf --form neumip --head direct", "--head"),
        ("eval bad.sbtf", "bad.sbtf"),
        ("eval bad.sbtf --scenes torus -o out", "bad.sbtf"),
        ("eval bad.sbtf --scenes torus --sheet a.png", "--sheet"),
        ("eval none.sbtf", "none.sbtf"),
        ("study render bad.sbtf -o out", "bad.sbtf"),
    ] {
        w.refuses(args, &[part]);
    }
    let usage = w.run("eval bad.sbtf --baseline bad.sbtf");
    assert!(usage.code == 2 && usage.stderr.contains("--scenes"), "{usage:?}");
    let usage = w.run("eval bad.sbtf --scenes torus --frames 2");
    assert!(usage.code == 2 && usage.stderr.contains("flicker is of 3 to 1000 frames"), "{usage:?}");
    let usage = w.run("eval bad.sbtf --scenes torus --frames 3 --turn 1,0");
    assert!(usage.code == 2 && usage.stderr.contains("two numbers of degrees"), "{usage:?}");
    let usage = w.run("train shell -o a.sbtf --width 3");
    assert!(usage.code == 2 && usage.stderr.contains("4..=128"), "{usage:?}");
}

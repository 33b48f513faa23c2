//! `train`, `eval`, `inspect` and `render` of neural materials, as a user calls them.

mod common;

use common::Fresh;

/// A few steps: the model is poor, but everything happens that happens in a long run.
const SHORT: [&str; 6] = ["--steps", "60", "--texture", "16", "--precision", "u8"];

fn train(folder: &Fresh, out: &str, more: &[&str]) {
    let mut args = vec!["train", "shell", "-o", out];
    args.extend(SHORT);
    args.extend(more);
    folder.osculate(&args).succeeds();
}

#[test]
fn a_material_is_trained_shown_judged_and_rendered() {
    let folder = Fresh::new();
    train(&folder, "shell.sbtf", &["--curve", "curve.svg", "--json", "train.json"]);
    assert!(!folder.path("shell.sbtf.checkpoint").exists(), "nothing is left to go on from");
    assert!(folder.read("curve.svg").contains("<svg"));
    let report = folder.json("train.json");
    assert_eq!(report["schema"], "osculate.train/1");
    assert_eq!(report["options"]["opacity_steps"], 60);
    assert!(report["scores"]["opacity"]["error"].as_f64().unwrap() < 1.0, "better than an opaque surface");

    let shown = folder.osculate(&["inspect", "shell.sbtf"]).succeeds();
    assert!(shown.contains("shell"), "{shown}");

    let args =
        ["eval", "shell.sbtf", "--rays", "2000", "--spp", "1", "--sheet", "sheet.png", "--json", "eval.json"];
    folder.osculate(&args).succeeds();
    let report = folder.json("eval.json");
    let left = report["models"][0]["left"].as_f64().unwrap();
    assert!(left > 0.0 && left < 1.0, "{left}");
    assert!(folder.path("sheet.png").exists());
    let bound = (0.5 * left).to_string();
    let args = ["eval", "shell.sbtf", "--rays", "2000", "--silhouettes-only", "--require", &bound];
    folder.osculate(&args).fails_with(1);

    folder.write(
        "scene.toml",
        "[image]\nwidth = 48\nheight = 32\n[[mesh]]\nshape = 'torus:1,0.45'\nmaterial = 'm'\n[material.m]\nmodel = 'shell.sbtf'\n\
         tiles = [6.0, 3.0]\ntile_size = 1.0\n[environment]\nradiance = [1.0, 1.0, 1.0]\n",
    );
    let said = folder
        .osculate(&["render", "scene.toml", "-o", "a.png", "--spp", "2", "--explain", "--json", "r.json"])
        .succeeds();
    assert!(said.contains("silhouettes          yes"), "{said}");
    let counters = folder.json("r.json")["render"]["counters"].clone();
    for counter in ["opacity_queries", "reflectance_queries", "pass_throughs"] {
        assert!(counters[counter].as_u64().unwrap() > 0, "{counter}: {counters}");
    }
}

#[test]
fn the_same_steps_give_the_same_bytes_on_any_number_of_threads() {
    let folder = Fresh::new();
    train(&folder, "a.sbtf", &["--threads", "1"]);
    train(&folder, "b.sbtf", &["--threads", "2"]);
    // The file says how long the run took; all else is the same.
    let tensors = |name: &str| {
        let bytes = std::fs::read(folder.path(name)).unwrap();
        let header = usize::try_from(u64::from_le_bytes(bytes[..8].try_into().unwrap())).unwrap();
        bytes[8 + header..].to_vec()
    };
    assert!(tensors("a.sbtf") == tensors("b.sbtf"), "other bits with other threads");
}

#[test]
fn what_does_not_fit_is_one_message() {
    let folder = Fresh::new();
    folder.write("bad.sbtf", "no model");
    for (args, expected) in [
        (vec!["train", "tweed", "-o", "a.sbtf"], "tweed"),
        (vec!["train", "shell", "-o", "a.png"], "a.png: the extension must be .sbtf"),
        (vec!["train", "shell", "-o", "a.sbtf", "--minutes", "-1"], "minutes"),
        (vec!["train", "shell", "-o", "a.sbtf", "--depth", "7"], "--depth 7"),
        (vec!["train", "shell", "-o", "a.sbtf", "--resume"], "a.sbtf.checkpoint: there is no checkpoint"),
        (vec!["train", "basket-weave", "-o", "a.sbtf", "--head", "silhouette"], "--head silhouette"),
        (vec!["eval", "bad.sbtf"], "bad.sbtf"),
        (vec!["eval", "none.sbtf"], "none.sbtf"),
    ] {
        let said = folder.osculate(&args).fails_with(2);
        assert!(said.contains(expected), "{args:?}: {said}");
    }
    assert!(!folder.path("a.sbtf").exists());
}

//! Leaving an effect out changes nothing: for every effect of a plan, scenes that do without it, as planned and with everything forced on.

#[path = "support/pairs.rs"]
mod pairs;
mod support;

use std::sync::Arc;

use osculate_render::scene::{
    LoadRequest, LoadedMesh, QueryForm, SceneFile, SilhouetteMaterial, SurfaceSource,
};
use osculate_render::{EFFECTS, Effects, Material, Queries, RenderOptions, Rendering, StopRule, plan};
use osculate_sbtf::file::{ModelFile, Provenance};
use osculate_sbtf::infer::{self, Precision, StoredModel};
use osculate_sbtf::model::{Architecture, Model};
use pairs::{ALL_BUT_A_SUN, Case, forcing, pair};
use support::run;

fn planned(case: &Case, queries: Queries) -> RenderOptions {
    RenderOptions {
        stop: StopRule::Samples(4),
        max_depth: case.max_depth,
        queries,
        ..RenderOptions::default()
    }
}

/// Effects whose scenes make a forced render do what the planned one leaves out; the rest are asked for by something in the scene that
/// is not there to be forced.
const SEEN_TO_BE_DONE: [&str; 4] = ["silhouette opacity", "parallax offset", "curvature", "curvature filter"];

/// Largest difference of a pixel, relative to the brightest.
fn apart(a: &Rendering, b: &Rendering) -> f32 {
    let (a, b) = (a.film.radiance(), b.film.radiance());
    let brightest = a.iter().map(|p| p.max_element()).fold(0.0, f32::max);
    std::iter::zip(&a, &b).map(|(a, b)| (*a - *b).abs().max_element() / brightest).fold(0.0, f32::max)
}

/// What walks find on a plane differs from what is known of it by rounding.
const ROUNDING: f32 = 1e-3;

#[test]
fn every_effect_that_is_left_out_could_not_change_a_bit() {
    for effect in EFFECTS {
        let pair = pair(effect).unwrap_or_else(|| panic!("no scenes with and without {effect}"));
        let decided = |case: &Case| plan(&case.scene, case.max_depth).decision(effect).map(|d| d.needed);
        assert_eq!(decided(&pair.with), Some(true), "{effect}");
        let with = run(&pair.with.scene, &planned(&pair.with, Queries::default()));
        let contradictions = plan(&pair.with.scene, 4).contradictions(&with.counters);
        assert_eq!(contradictions, Vec::<String>::new(), "{effect}");
        let mut was_done = false;
        for (k, case) in pair.without.iter().enumerate() {
            assert_eq!(decided(case), Some(false), "{effect}, case {k}");
            for queries in [Queries::default(), Queries::Single] {
                let done = forcing_changes_nothing(
                    effect,
                    case,
                    queries,
                    &format!("{effect}, case {k}, {queries:?}"),
                );
                was_done |= done;
            }
        }
        assert_eq!(was_done, SEEN_TO_BE_DONE.contains(&effect), "{effect}");
    }
}

/// Surfaces without a model have the same bits in both programs, whatever the scene calls for.
#[test]
fn ordinary_paths_side_by_side_are_paths_one_by_one_to_the_bit() {
    let mut compared = 0;
    for effect in EFFECTS.into_iter().chain([ALL_BUT_A_SUN]) {
        let pair = pair(effect).unwrap_or_else(|| panic!("no scenes with and without {effect}"));
        for case in pair.without.iter().chain([&pair.with]) {
            if plan(&case.scene, case.max_depth).effects().silhouettes {
                continue;
            }
            let one = run(&case.scene, &planned(case, Queries::Single));
            let many = run(&case.scene, &planned(case, Queries::Batched { paths: 100 }));
            assert_eq!(one.film.radiance(), many.film.radiance(), "{effect}");
            assert_eq!(one.counters, many.counters, "{effect}");
            compared += 1;
        }
    }
    assert!(compared > 10, "{compared} scenes");
}

/// Whether forcing did anything of an effect that the plan left out.
fn forcing_changes_nothing(effect: &str, case: &Case, queries: Queries, name: &str) -> bool {
    let options = planned(case, queries);
    let plan = plan(&case.scene, case.max_depth);
    let rendering = run(&case.scene, &options);
    assert_eq!(plan.contradictions(&rendering.counters), Vec::<String>::new(), "{name}");
    let bound = if case.is_exact { 0.0 } else { ROUNDING };
    let done = [Effects::ALL, forcing(effect, plan.effects())].map(|force| {
        let forced = run(&case.scene, &RenderOptions { force: Some(force), ..options });
        let apart = apart(&rendering, &forced);
        assert!(apart <= bound, "{name}: {apart}");
        plan.contradictions(&forced.counters).iter().any(|message| message.starts_with(&format!("{effect}:")))
    });
    done.contains(&true)
}

#[test]
fn a_plan_decides_on_every_effect_in_order() {
    for effect in EFFECTS.into_iter().chain([ALL_BUT_A_SUN]) {
        let pair = pair(effect).unwrap_or_else(|| panic!("no scenes with and without {effect}"));
        for case in pair.without.iter().chain([&pair.with]) {
            let plan = plan(&case.scene, case.max_depth);
            let names: Vec<&str> = plan.decisions.iter().map(|d| d.effect).collect();
            assert_eq!(names, EFFECTS);
            assert!(
                plan.decisions.iter().all(|d| !d.reason.is_empty() && (d.relative_cost > 0.0) == d.needed)
            );
        }
    }
    // The least that shows anything calls for one effect.
    let least = pair(ALL_BUT_A_SUN).expect("a pair");
    let plan = plan(&least.without[0].scene, least.without[0].max_depth);
    let needed: Vec<&str> = plan.decisions.iter().filter(|d| d.needed).map(|d| d.effect).collect();
    assert_eq!(needed, ["directional lights"]);
}

/// Stones in the paper's form, asked as the paper does, over a floor that they cast shadows on.
fn shadowed() -> Case {
    let mut case = pair("curvature filter").expect("a pair").with;
    let floor = pair("environment").expect("a pair").with.scene.objects[1].clone();
    case.scene.objects.push(floor);
    case
}

fn with_silhouette(case: &mut Case, change: impl FnOnce(&mut SilhouetteMaterial)) {
    let SurfaceSource::Material(Material { silhouette: Some(material), .. }) =
        &mut case.scene.objects[0].surface
    else {
        panic!("a material with silhouettes")
    };
    change(material);
}

#[test]
fn shadow_rays_from_steeply_above_need_no_curvature() {
    let mut case = shadowed();
    with_silhouette(&mut case, |material| material.query = QueryForm::Paper);
    for queries in [Queries::default(), Queries::Single] {
        let options = planned(&case, queries);
        let rendering = run(&case.scene, &options);
        let forced = run(&case.scene, &RenderOptions { force: Some(Effects::ALL), ..options });
        assert!(rendering.film.radiance() == forced.film.radiance(), "{queries:?}");
        let (counted, all) = (rendering.counters, forced.counters);
        let skips = counted.curvature_skips;
        assert!(skips > 100 && 10 * skips > counted.shadow_rays / 10, "{counted:?}");
        assert_eq!(counted.curvature_evaluations + skips, all.curvature_evaluations);
        assert_eq!((counted.filter_walks + skips, all.curvature_skips), (all.filter_walks, 0));
        assert!(counted.opacity_queries + skips == all.opacity_queries);
    }
    let reasons = |case: &Case| plan(&case.scene, 4).objects[0].curvature_reason.clone();
    assert!(reasons(&case).contains("rays to lights"), "{}", reasons(&case));
    // The chord query has the ray's cosine from the walk.
    assert_eq!(reasons(&shadowed()), "bent");
    assert_eq!(run(&shadowed().scene, &planned(&case, Queries::default())).counters.curvature_skips, 0);
}

#[test]
fn materials_that_make_nothing_of_curvature_are_told_none() {
    let model = StoredModel::new(&Model::untrained(Architecture::neumip(0.1), 5), Precision::F16);
    for (query, needed) in [(QueryForm::Paper, false), (QueryForm::Chord, true)] {
        let mut case = shadowed();
        with_silhouette(&mut case, |material| {
            material.btf = Arc::new(infer::Material::new(&model));
            material.query = query;
        });
        let plan = plan(&case.scene, case.max_depth);
        let decided = |effect: &str| plan.decision(effect).map(|d| d.needed);
        assert_eq!((decided("curvature"), decided("curvature filter")), (Some(needed), Some(needed)));
        assert_eq!(plan.objects[0].curvature, needed, "{}", plan.objects[0].curvature_reason);
        for queries in [Queries::default(), Queries::Single] {
            let options = planned(&case, queries);
            let rendering = run(&case.scene, &options);
            let forced = run(&case.scene, &RenderOptions { force: Some(Effects::ALL), ..options });
            assert!(rendering.film.radiance() == forced.film.radiance(), "{query:?}, {queries:?}");
            assert_eq!(rendering.counters.filter_walks > 0, needed);
            assert!(forced.counters.filter_walks > 1000);
        }
    }
}

/// A model of the baseline's form is asked as the baseline is, whichever key of a scene names it, and its mesh needs no curvature.
#[test]
fn one_form_of_model_is_asked_in_one_way() {
    let folder = tempfile::tempdir().expect("a folder");
    let write = |name: &str, form: Architecture| {
        let model = StoredModel::new(&Model::untrained(form, 5), Precision::U8);
        let file = ModelFile { model, provenance: Provenance::default(), sampler: None };
        file.write(&folder.path().join(name)).expect("a file");
    };
    write("neumip.sbtf", Architecture::neumip(0.1));
    write("paper.sbtf", Architecture::paper(0.1));
    let object = shadowed().scene.objects[0].clone();
    let build = |line: &str| {
        let text = format!(
            "[image]\nwidth = 40\nheight = 30\n[environment]\nradiance = [1.0, 1.0, 1.0]\n\
             [[mesh]]\nshape = \"torus:1,0.45\"\nmaterial = \"m\"\n[material.m]\n{line}\ntiles = [6.0, 3.0]\n"
        );
        let mut wanted = false;
        let mut load = |request: &LoadRequest<'_>| {
            wanted = request.shell.is_some();
            let field = object.field.clone().filter(|_| wanted);
            Ok(LoadedMesh { mesh: Arc::clone(&object.mesh), curvature: None, field })
        };
        let file = SceneFile::parse(&text, "scene.toml").expect("a scene");
        let scene = file.build(&folder.path().join("scene.toml"), &mut load).expect("its mesh");
        (Case { scene, max_depth: 4, is_exact: true }, wanted)
    };
    let [model, baseline] = ["model", "baseline"].map(|key| build(&format!("{key} = \"neumip.sbtf\"")));
    assert!(!model.1 && !baseline.1 && build("model = \"paper.sbtf\"").1);
    let shown = |case: &Case| run(&case.scene, &planned(case, Queries::default()));
    let (model, baseline) = (shown(&model.0), shown(&baseline.0));
    assert!(model.film.radiance() == baseline.film.radiance());
    assert_eq!((model.counters.curvature_evaluations, model.counters), (0, baseline.counters));
    assert!(model.counters.reflectance_queries > 1000);
}

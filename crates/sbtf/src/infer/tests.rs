//! Every way to ask a [`Material`] against the definition in `model`, for every kind of model, precision and instruction set.

mod limits;

use glam::{Vec2, Vec3};

use super::*;
use crate::model::{Architecture, CurvatureInput, Model, OffsetForm, OpacityHead, TextureShape};
use crate::silhouette::largest_cosine;
use crate::{Answer, Entry, Incidence, Query, SilhouetteBtf};

const INSTRUCTIONS: [Instructions; 3] = [Instructions::Avx512, Instructions::Avx2, Instructions::Portable];

/// Small textures of odd sizes, which differ.
fn small(form: Architecture) -> Architecture {
    Architecture {
        opacity_texture: TextureShape { width: 13, height: 5, ..form.opacity_texture },
        offset_texture: TextureShape { width: 4, height: 1, ..form.offset_texture },
        colour_texture: TextureShape { width: 8, height: 9, ..form.colour_texture },
        ..form
    }
}

/// One of each kind.
fn forms() -> Vec<(&'static str, Architecture)> {
    let paper = small(Architecture::paper(0.1));
    let channels = |form: &Architecture, channels| Architecture {
        opacity_texture: TextureShape { channels, ..form.opacity_texture },
        offset_texture: TextureShape { channels: channels + 1, ..form.offset_texture },
        colour_texture: TextureShape { channels: channels + 3, ..form.colour_texture },
        ..form.clone()
    };
    vec![
        ("taps", small(Architecture::taps(0.1))),
        ("neumip", small(Architecture::neumip(0.1))),
        ("direct", Architecture { opacity: OpacityHead::Direct, ..paper.clone() }),
        ("see-through", small(Architecture::see_through(0.1))),
        ("no curvature", Architecture { curvature: CurvatureInput::Absent, ..paper.clone() }),
        ("offset taps", Architecture { offset_taps: vec![0.0, 0.5, 1.0], ..paper.clone() }),
        ("along the ray", Architecture { offset: OffsetForm::AlongRay, ..paper.clone() }),
        ("along the reach", Architecture { offset: OffsetForm::AlongReach, ..paper.clone() }),
        ("few channels", channels(&paper, 3)),
        ("many channels", channels(&paper, 19)),
        ("wide and deep", Architecture { width: 100, hidden_layers: 4, ..paper.clone() }),
        ("narrow and shallow", Architecture { width: 5, hidden_layers: 1, ..paper.clone() }),
        ("no hidden layer", Architecture { hidden_layers: 0, ..paper.clone() }),
        ("paper", paper),
    ]
}

/// Queries of every kind, most of them grazing enough to need the opacity network.
fn queries(count: usize, depth: f32) -> Vec<Query> {
    let fraction =
        |i: usize, k: usize| (i as f32 * [0.618_034, 0.754_878, 0.569_84, 0.819_17, 0.671_04][k]).fract();
    let query = |i: usize| {
        let kappa_hat = fraction(i, 0) * 6.0 - 2.5;
        let largest = largest_cosine(kappa_hat.max(0.3), depth);
        let cosine = fraction(i, 1) * if i.is_multiple_of(3) { 1.1 } else { largest } - 0.05;
        let (sine, angle) = ((1.0 - cosine * cosine).max(0.0).sqrt(), fraction(i, 2) * 6.3);
        let wi = Vec3::new(fraction(i, 3) - 0.5, fraction(i, 4) - 0.5, fraction(i, 1) - 0.5).normalize();
        Query {
            uv: Vec2::new(fraction(i, 3) * 5.0 - 2.0, fraction(i, 4) * 3.0 - 1.0),
            wo: Vec3::new(sine * angle.cos(), sine * angle.sin(), cosine),
            wi,
            kappa_hat,
        }
    };
    (0..count).map(query).collect()
}

/// How far two answers are apart, relative to 1 + rgb; `None` where one hits and the other misses.
fn distance(a: &Answer, b: &Answer) -> Option<f32> {
    if (a.alpha > 0.0) != (b.alpha > 0.0) {
        return None;
    }
    Some(((a.rgb - b.rgb) / (Vec3::ONE + b.rgb)).abs().max_element().max((a.alpha - b.alpha).abs()))
}

/// Sums of at most 150 products in another order, over up to five layers and with features looked up at positions that
/// differ by rounding, which offsets along the ray enlarge up to 20 times: measured 9e-5 at most; a wrong index or lane makes 0.1.
const CLOSE: f32 = 3e-4;

/// Steps of the silhouette head that rounding may turn over: their cosine would have to be within 1e-6 of the step's.
const TURNED_OVER: usize = 1;

fn assert_close(answers: &[Answer], wanted: &[Answer], name: &str) {
    let distances: Vec<_> = answers.iter().zip(wanted).map(|(a, b)| distance(a, b)).collect();
    let over = distances.iter().filter(|d| d.is_none()).count();
    assert!(over <= TURNED_OVER, "{name}: {over} of {} hit on one side only", answers.len());
    let worst = distances.iter().flatten().copied().fold(0.0, f32::max);
    assert!(worst < CLOSE, "{name}: off by {worst}");
}

/// Answers differ with the curvature where the form says that they do, and nowhere else.
#[test]
fn forms_know_whether_they_use_curvature() {
    let blind = small(Architecture::neumip(0.1));
    let mut forms = forms();
    forms.extend([
        ("blind but for offset taps", Architecture { offset_taps: vec![0.0, 0.5], ..blind.clone() }),
        ("blind but for the reach", Architecture { offset: OffsetForm::AlongReach, ..blind.clone() }),
        ("blind but for the input", Architecture { curvature: CurvatureInput::Given, ..blind.clone() }),
        ("blind but for holes", Architecture { opacity: OpacityHead::Direct, ..blind.clone() }),
        (
            "blind but for holes with taps",
            Architecture { opacity: OpacityHead::Direct, opacity_taps: vec![0.0, 1.0], ..blind },
        ),
    ]);
    let mut blind = 0;
    for (name, form) in forms {
        let uses = form.uses_curvature();
        let material = Material::new(&StoredModel::new(&Model::untrained(form, 7), Precision::F16));
        let at = |query: &Query, kappa_hat| material.eval(&Query { kappa_hat, ..*query });
        let differs = |q: &Query| [-1.0, 0.4, 2.4, 9.0].iter().any(|&kappa| at(q, kappa) != at(q, 0.0));
        assert_eq!(queries(203, 0.1).iter().any(differs), uses, "{name}");
        blind += usize::from(!uses);
    }
    assert_eq!(blind, 2, "with nothing blind the test says little");
}

#[test]
fn every_way_to_ask_gives_what_the_model_defines() {
    let queries = queries(203, 0.1);
    for (name, form) in forms() {
        let model = Model::untrained(form, 7);
        for precision in Precision::ALL {
            let stored = StoredModel::new(&model, precision);
            let rounded = stored.to_model();
            let wanted: Vec<Answer> = queries.iter().map(|query| rounded.eval(query)).collect();
            let misses = wanted.iter().filter(|a| a.alpha == 0.0).count();
            assert!(misses > 5 && misses < 200, "{name}: {misses} misses test nothing");
            for instructions in INSTRUCTIONS {
                let Some(material) = Material::with_instructions(&stored, instructions) else { continue };
                let name = format!("{name}, {precision:?}, {instructions:?}");
                let mut answers = vec![Answer::default(); queries.len()];
                let report = material.eval_reported(&queries, &mut answers);
                assert_close(&answers, &wanted, &format!("{name}, batch"));
                assert_eq!(report.queries, 203);
                let outside = queries.iter().filter(|q| q.kappa_hat > 2.5 || q.kappa_hat < -2.5).count();
                assert_eq!(report.clamped, outside as u64);
                let single: Vec<_> = queries.iter().map(|query| material.eval(query)).collect();
                assert_close(&single, &wanted, &format!("{name}, single"));
                for (query, answer) in queries.iter().zip(&single) {
                    assert_eq!(material.alpha(query.uv, query.wo, query.kappa_hat), answer.alpha);
                }
            }
        }
    }
}

#[test]
fn an_answer_does_not_depend_on_its_neighbours() {
    let queries = queries(150, 0.1);
    let material = Material::new(&StoredModel::new(
        &Model::untrained(small(Architecture::taps(0.1)), 3),
        Precision::F16,
    ));
    let mut all = vec![Answer::default(); 150];
    material.eval_batch(&queries, &mut all);
    for start in 0..150 {
        let mut few = [Answer::default(); 3];
        let end = (start + 3).min(150);
        material.eval_batch(&queries[start..end], &mut few[..end - start]);
        assert_eq!(few[..end - start], all[start..end], "{start}");
    }
}

#[test]
fn arrays_and_structures_get_the_same_bits() {
    let queries = queries(77, 0.1);
    let material = Material::new(&StoredModel::new(
        &Model::untrained(small(Architecture::paper(0.1)), 3),
        Precision::F32,
    ));
    let mut answers = vec![Answer::default(); 77];
    let report = material.eval_reported(&queries, &mut answers);
    let row = |value: fn(&Query) -> f32| queries.iter().map(value).collect::<Vec<f32>>();
    let (u, v, kappa_hat) = (row(|q| q.uv.x), row(|q| q.uv.y), row(|q| q.kappa_hat));
    let wo = [row(|q| q.wo.x), row(|q| q.wo.y), row(|q| q.wo.z)];
    let wi = [row(|q| q.wi.x), row(|q| q.wi.y), row(|q| q.wi.z)];
    let (mut r, mut g, mut b, mut alpha) = (vec![0.0; 77], vec![0.0; 77], vec![0.0; 77], vec![0.0; 77]);
    let rows = QueryRows {
        uv: [&u, &v],
        wo: wo.each_ref().map(Vec::as_slice),
        wi: wi.each_ref().map(Vec::as_slice),
        kappa_hat: &kappa_hat,
    };
    let in_rows =
        material.eval_rows(&rows, &mut AnswerRows { rgb: [&mut r, &mut g, &mut b], alpha: &mut alpha });
    assert_eq!(report, in_rows);
    for (k, answer) in answers.iter().enumerate() {
        assert_eq!(*answer, Answer { rgb: Vec3::new(r[k], g[k], b[k]), alpha: alpha[k] }, "{k}");
    }
}

#[test]
fn several_lights_at_one_hit_are_as_single_queries() {
    let queries = queries(60, 0.1);
    let material =
        Material::new(&StoredModel::new(&Model::untrained(small(Architecture::taps(0.1)), 5), Precision::U8));
    for query in &queries {
        let hit = material.begin(query.uv, query.wo, query.kappa_hat);
        let wi = [query.wi, -query.wi, Vec3::Z];
        let wanted = wi.map(|wi| material.eval(&Query { wi, ..*query }));
        let Some(hit) = hit else {
            assert!(wanted.iter().all(|answer| *answer == Answer::default()));
            continue;
        };
        let mut rgb = [Vec3::ZERO; 3];
        hit.rgb_of(&wi, &mut rgb);
        assert_eq!(rgb, wanted.map(|answer| answer.rgb));
        assert_eq!(hit.clamped(), !(-2.5..=2.5).contains(&query.kappa_hat));
    }
}

#[test]
fn what_lights_share_gives_the_bits_of_whole_queries() {
    for (name, form) in forms() {
        let depth = form.depth;
        let material = Material::new(&StoredModel::new(&Model::untrained(form, 5), Precision::F16));
        for query in queries(200, depth) {
            let whole = material.eval(&query);
            if whole.alpha > 0.0 {
                let entry = material.enter(query.uv, query.wo, query.kappa_hat);
                assert_eq!(material.rgb(&entry, query.wi), whole.rgb, "{name} {query:?}");
            }
        }
    }
}

/// In every form, whatever the batch's size: part by part the same bits as whole queries in a batch.
#[test]
fn parts_in_batches_give_the_bits_of_whole_batches() {
    for (name, form) in forms() {
        let depth = form.depth;
        let stored = StoredModel::new(&Model::untrained(form, 5), Precision::F16);
        for instructions in INSTRUCTIONS {
            let Some(material) = Material::with_instructions(&stored, instructions) else { continue };
            let queries = queries(203, depth);
            let mut wanted = vec![Answer::default(); queries.len()];
            material.eval_batch(&queries, &mut wanted);
            for size in [1, 31, 203] {
                let found: Vec<Answer> =
                    queries.chunks(size).flat_map(|queries| in_parts(&material, queries)).collect();
                assert_eq!(found, wanted, "{name}, {instructions:?}, {size} at a time");
            }
        }
    }
}

/// Textures that leave the caches are asked for ahead of time, block by block and tap by tap: the same bits as part by part, where nothing is.
/// Steep queries of their own, grazing ones of their own, and both mixed, fill blocks in every order.
#[test]
fn looking_ahead_changes_nothing() {
    for form in [Architecture::paper(0.1), Architecture::taps(0.1).with_direct_head()] {
        let depth = form.depth;
        let stored = StoredModel::new(&Model::untrained(form, 5), Precision::F32);
        let mut all = queries(1500, depth);
        all[..300].iter_mut().for_each(|query| query.wo = Vec3::Z);
        all[300..600].iter_mut().for_each(|query| query.wo = Vec3::new(0.8, 0.6, 0.01).normalize());
        let mut before: Option<Vec<Answer>> = None;
        for instructions in INSTRUCTIONS {
            let Some(material) = Material::with_instructions(&stored, instructions) else { continue };
            assert!(material.is_large, "with textures that stay near the test says nothing");
            let mut found = vec![Answer::default(); all.len()];
            material.eval_batch(&all, &mut found);
            assert_eq!(found, in_parts(&material, &all), "{instructions:?}");
            // The portable kernels round products before adding.
            if instructions != Instructions::Portable {
                assert!(before.is_none_or(|before| before == found), "AVX2 as AVX-512");
                before = Some(found);
            }
        }
    }
}

/// Opacities first; entries and colours of those that hit.
fn in_parts(material: &Material, queries: &[Query]) -> Vec<Answer> {
    let ray = |q: &Query| Incidence { uv: q.uv, wo: q.wo, kappa_hat: q.kappa_hat };
    let rays: Vec<Incidence> = queries.iter().map(ray).collect();
    let mut alphas = vec![f32::NAN; rays.len()];
    material.alpha_batch(&rays, &mut alphas);
    let hits: Vec<usize> = (0..rays.len()).filter(|&k| alphas[k] > 0.0).collect();
    let entering: Vec<Incidence> = hits.iter().map(|&k| rays[k]).collect();
    let nowhere = Entry { uv: Vec2::NAN, wo: Vec3::NAN, kappa_hat: f32::NAN, hit_uv: Vec2::NAN };
    let mut entries = vec![nowhere; hits.len()];
    material.enter_batch(&entering, &mut entries);
    let wi: Vec<Vec3> = hits.iter().map(|&k| queries[k].wi).collect();
    let mut rgb = vec![Vec3::NAN; hits.len()];
    material.rgb_batch(&entries, &wi, &mut rgb);
    let mut answers: Vec<Answer> =
        alphas.iter().map(|&alpha| Answer { alpha, ..Answer::default() }).collect();
    for (&k, &rgb) in hits.iter().zip(&rgb) {
        answers[k].rgb = rgb;
    }
    answers
}

#[test]
fn queries_that_need_no_network_get_none() {
    let form = small(Architecture::paper(0.1));
    let material = Material::new(&StoredModel::new(&Model::untrained(form, 1), Precision::F32));
    let mut queries = queries(64, 0.1);
    let mut answers = vec![Answer::default(); 64];
    let mut blocks = |queries: &[Query]| {
        let report = material.eval_reported(queries, &mut answers);
        (report.opacity_blocks, report.shade_blocks)
    };
    queries.iter_mut().for_each(|query| query.wo = -Vec3::Z);
    assert_eq!(blocks(&queries), (0, 0), "looking at the back");
    queries.iter_mut().for_each(|query| query.wo = Vec3::Z);
    assert_eq!(blocks(&queries), (0, 2), "more steeply than any silhouette");
    let grazing = Vec3::new(1.0, 0.0, 1e-3).normalize();
    queries.iter_mut().for_each(|query| (query.wo, query.kappa_hat) = (grazing, -1.0));
    assert_eq!(blocks(&queries), (0, 2), "concave");
}

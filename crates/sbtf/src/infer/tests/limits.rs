//! Where it gets hard: steep and grazing rays, the ends of every input, and what lies between.

use super::*;

/// Over the horizon and at least as steep as the form says, every ray hits.
#[test]
fn steep_rays_hit_whatever_the_curvature() {
    for (name, form) in forms() {
        let (from, range) = (form.opaque_from(), form.kappa_range);
        if form.opacity != OpacityHead::Silhouette {
            assert_eq!(from.is_infinite(), form.opacity == OpacityHead::Direct, "{name}");
            continue;
        }
        let depth = form.depth;
        let tight = largest_cosine(range[1], depth);
        assert!(from >= tight && from < 1.00001 * tight, "{name}: {from} for {tight}");
        let material = Material::new(&StoredModel::new(&Model::untrained(form, 7), Precision::F16));
        let mut rays = Vec::new();
        for i in 0..2000 {
            let (cosine, angle) = (if i % 2 == 0 { from } else { from + 1e-4 * i as f32 }, 0.1 * i as f32);
            let wo = ((1.0 - cosine * cosine).sqrt() * Vec2::from_angle(angle)).extend(cosine);
            // Up to the end of the range, around it, and far beyond.
            let kappa_hat = range[1] * [1.0, 0.002 * i as f32, 1.0 - 1e-7 * i as f32, -1e9, 1e9][i % 5];
            rays.push(Incidence { uv: Vec2::new(0.37 * i as f32, 0.11), wo, kappa_hat });
        }
        let mut alphas = vec![0.0; rays.len()];
        material.alpha_batch(&rays, &mut alphas);
        let single = |ray: &Incidence| material.alpha(ray.uv, ray.wo, ray.kappa_hat);
        assert!(rays.iter().zip(&alphas).all(|(ray, &alpha)| alpha == 1.0 && single(ray) == 1.0), "{name}");
    }
}

/// The hard ends of every input.
#[test]
fn extremes_are_finite_and_clamped() {
    for (name, form) in forms() {
        let range = form.kappa_range;
        let model = Model::untrained(form, 11);
        let material = Material::new(&StoredModel::new(&model, Precision::F16));
        let directions = [
            Vec3::Z,
            -Vec3::Z,
            Vec3::new(1.0, 0.0, 1e-6),
            Vec3::new(0.0, -1.0, 0.0),
            Vec3::new(1e-30, 0.0, 1.0),
            Vec3::new(-0.6, 0.0, -0.8),
            Vec3::NAN,
            Vec3::new(f32::NAN, 0.0, 0.5),
        ];
        let numbers =
            [0.0, -0.0, 1e6 + 0.5, -1e6, 3e38, f32::NAN, f32::INFINITY, f32::NEG_INFINITY, 1e-40, -1e-9];
        let curvatures = [0.0, range[0], range[1], 1e30, -1e30, f32::NAN, f32::INFINITY, 1e-30];
        let mut queries = Vec::new();
        for wo in directions {
            for wi in directions {
                for uv in
                    numbers.map(|x| Vec2::new(x, 0.25)).into_iter().chain(numbers.map(|x| Vec2::new(0.25, x)))
                {
                    queries.extend(curvatures.map(|kappa_hat| Query { uv, wo, wi, kappa_hat }));
                }
            }
        }
        let mut answers = vec![Answer::default(); queries.len()];
        material.eval_batch(&queries, &mut answers);
        for (query, batched) in queries.iter().zip(&answers) {
            for answer in [*batched, material.eval(query)] {
                assert!(
                    answer.rgb.is_finite() && answer.rgb.min_element() >= 0.0,
                    "{name}: {query:?} {answer:?}"
                );
                assert!((0.0..=1.0).contains(&answer.alpha), "{name}: {query:?} {answer:?}");
                assert!(answer.alpha > 0.0 || answer.rgb == Vec3::ZERO, "{name}: {query:?} {answer:?}");
            }
            let kappa_hat =
                if query.kappa_hat.is_nan() { range[0] } else { query.kappa_hat.clamp(range[0], range[1]) };
            if query.wi.is_finite() && query.wo.is_finite() {
                assert_eq!(material.eval(query), material.eval(&Query { kappa_hat, ..*query }));
            }
        }
    }
}

/// Answers move no faster than the inputs do: steps of 2^-20 in every input, also across the tile's edge and the end of the range.
#[test]
fn answers_are_continuous() {
    let form = Architecture { opacity: OpacityHead::Direct, ..small(Architecture::taps(0.1)) };
    let material = Material::new(&StoredModel::new(&Model::untrained(form, 2), Precision::F32));
    let step = 1.0 / 1_048_576.0;
    let base = Query {
        uv: Vec2::new(0.3, 0.7),
        wo: Vec3::new(0.6, -0.3, 0.0).normalize().with_z(0.4).normalize(),
        wi: Vec3::new(0.1, 0.9, -0.2).normalize(),
        kappa_hat: 0.7,
    };
    let places = [
        (base, "inside"),
        (Query { uv: Vec2::new(-step / 2.0, 0.7), ..base }, "the tile's edge"),
        (Query { uv: Vec2::new(0.3, 1.0 - step / 2.0), ..base }, "the tile's other edge"),
        (Query { kappa_hat: 2.5 - step / 2.0, ..base }, "the end of the range"),
        (Query { wo: Vec3::new(1.0, 0.0, 1e-6), ..base }, "grazing"),
        (Query { wi: Vec3::new(1.0, 0.0, -step / 2.0), ..base }, "the horizon"),
    ];
    for (query, name) in places {
        let moved = [
            Query { uv: query.uv + Vec2::new(step, 0.0), ..query },
            Query { uv: query.uv + Vec2::new(0.0, step), ..query },
            Query { kappa_hat: query.kappa_hat + step, ..query },
            Query { wi: query.wi + Vec3::Z * step, ..query },
            Query { wo: query.wo + Vec3::Y * step, ..query },
        ];
        let here = material.eval(&query);
        for (k, query) in moved.iter().enumerate() {
            let there = material.eval(query);
            let change = distance(&here, &there);
            // Slopes of this model are below 1e3 per unit; a jump would be of the order of 0.1.
            assert!(change.is_some_and(|d| d < 2e-3), "{name}, input {k}: {here:?} {there:?}");
        }
    }
}

/// Whole tiles do not matter, as far as f32 can tell the positions.
#[test]
fn far_tiles_repeat() {
    let material = Material::new(&StoredModel::new(
        &Model::untrained(small(Architecture::taps(0.1)), 2),
        Precision::F32,
    ));
    for query in queries(100, 0.1) {
        // A multiple of 1/16 is exact up to 2^20 tiles away.
        let uv = (query.uv * 16.0).floor() / 16.0;
        let near = material.eval(&Query { uv, ..query });
        for tiles in [1.0, -3.0, 1e6, -1e6] {
            assert_eq!(near, material.eval(&Query { uv: uv + Vec2::splat(tiles), ..query }), "{uv} {tiles}");
        }
    }
}

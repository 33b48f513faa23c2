use super::*;
use crate::patch::TransportOptions;
use crate::patch::test_fields::{bumps, level};

fn dataset(options: DatasetOptions) -> PatchDataset {
    let micro = Microstructure { name: "bumps".into(), geometry: Geometry::HeightField(bumps(48, 0.15)) };
    PatchDataset::new(&micro, options).expect("valid options")
}

fn appearance(dataset: &PatchDataset, index: u64, count: usize) -> AppearanceBatch {
    let mut batch = AppearanceBatch::default();
    batch.resize(count);
    dataset.fill_appearance(index, &mut batch);
    batch
}

fn opacity(dataset: &PatchDataset, index: u64, count: usize) -> OpacityBatch {
    let mut batch = OpacityBatch::default();
    batch.resize(count);
    dataset.fill_opacity(index, &mut batch);
    batch
}

#[test]
fn samples_depend_on_seed_and_index_only() {
    for tracing in [Tracing::March, Tracing::Triangles] {
        let options = DatasetOptions { tracing, ..DatasetOptions::default() };
        let (a, b) = (dataset(options.clone()), dataset(options.clone()));
        let pool = rayon::ThreadPoolBuilder::new().num_threads(1).build().expect("a thread");
        // In another order, on another number of threads.
        let first = [3, 0, 1].map(|i| (i, appearance(&a, i, 3000)));
        for (i, batch) in first {
            assert_eq!(pool.install(|| appearance(&b, i, 3000)), batch);
            assert_ne!(appearance(&b, i + 7, 3000), batch);
        }
        assert_eq!(pool.install(|| opacity(&b, 5, 3000)), opacity(&a, 5, 3000));
        let other = dataset(DatasetOptions { seed: 1 << 63, ..options });
        assert_ne!(opacity(&other, 5, 3000), opacity(&a, 5, 3000));
    }
}

#[test]
fn patches_repeat_where_there_are_only_so_many() {
    let mut kappas = Vec::new();
    for tracing in [Tracing::March, Tracing::Triangles] {
        let few = DatasetOptions { tracing, patches: Some(2), ..DatasetOptions::default() };
        let few = dataset(DatasetOptions { patches_per_batch: 1, ..few });
        let kappa = |index| appearance(&few, index, 64).kappa_hat;
        assert_eq!(kappa(0), kappa(2));
        assert_ne!(kappa(0), kappa(1));
        assert_ne!(appearance(&few, 0, 64).uv, appearance(&few, 2, 64).uv, "the queries still differ");
        kappas.push(kappa(0));
    }
    assert_eq!(kappas[0], kappas[1], "the same patches, however they are traced");
}

#[test]
fn rows_are_queries_with_answers() {
    let made = dataset(DatasetOptions::default());
    let rows = opacity(&made, 1, 20_000);
    let mut around = 0;
    for i in 0..rows.len() {
        let (cosine, kappa) = (rows.silhouette_cosine[i], rows.kappa_hat[i]);
        let wo = Vec3::new(rows.wo[0][i], rows.wo[1][i], rows.wo[2][i]);
        assert!((wo.length() - 1.0).abs() < 1e-5 && wo.z > 0.0 && (-2.5..=2.5).contains(&kappa));
        assert_eq!(rows.alpha[i], f32::from(u8::from(wo.z >= cosine)));
        assert!((0.0..1.0).contains(&cosine) && (kappa > 0.0 || cosine == 0.0));
        around += u32::from(rows.alpha[i] == 0.0);
    }
    assert!((2000..16_000).contains(&around), "{around} of 20000 rays pass");
    let rows = appearance(&made, 1, 5000);
    let light: f32 = rows.rgb[1].iter().sum();
    assert!(light > 0.0 && rows.rgb.iter().flatten().all(|x| x.is_finite() && *x >= 0.0));
    assert!(rows.wi[2].iter().any(|z| *z < -0.9) && rows.wo[2].iter().any(|z| *z < 0.05));
    // A hit lies along the ray, within what it can travel over the patch.
    for i in 0..rows.len() {
        let along = -Vec2::new(rows.wo[0][i], rows.wo[1][i]);
        let offset = Vec2::new(rows.offset[0][i], rows.offset[1][i]);
        assert!(along.perp_dot(offset).abs() <= 1e-3 * along.length(), "{along} {offset}");
        assert!(along.dot(offset) > -1e-3);
    }
}

#[test]
fn options_that_make_no_sense_are_refused() {
    let micro = Microstructure { name: "level".into(), geometry: Geometry::HeightField(level(0.5, 0.1)) };
    let error = |options| PatchDataset::new(&micro, options).map(|_| ()).expect_err("refused");
    let d = DatasetOptions::default;
    assert_eq!(error(DatasetOptions { kappa_range: [1.0, 0.0], ..d() }), DatasetError::KappaRange(1.0, 0.0));
    error(DatasetOptions { kappa_range: [f32::NAN, 0.0], ..d() });
    error(DatasetOptions { patches: Some(0), ..d() });
    error(DatasetOptions { patches_per_batch: 0, ..d() });
    error(DatasetOptions { transport: TransportOptions { bounces: 0, specular: 0.5 }, ..d() });
    let hole = crate::micro::TileMesh::new(Vec::new(), Vec::new(), Vec::new(), Vec::new(), 0.1);
    let micro = Microstructure { name: "air".into(), geometry: Geometry::TileMesh(hole) };
    let error = PatchDataset::new(&micro, d()).map(|_| ()).expect_err("refused");
    assert_eq!(error.to_string(), "air: none of 1024 rays hits the material");
}

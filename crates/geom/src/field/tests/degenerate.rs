//! Rays and meshes where nothing is in general position.

use proptest::prelude::*;

use super::*;
use crate::curvature::{Status, VertexCurvature};

fn all_filters(field: &CurvatureField<'_>) -> Vec<Filter> {
    let length = 0.05 * field.diagonal();
    let bounds = Arc::new(SkipBounds::new(field, length));
    vec![
        Filter::Point,
        Filter::March,
        Filter::MarchWithin { bounds, tolerance: 0.5 },
        Filter::Baked(Arc::new(BakedMinimum::new(field, 8, WalkLength::Fixed(length)))),
        Filter::Chord,
        Filter::BakedChord(Arc::new(BakedChord::new(field, 8, WalkLength::Fixed(length)))),
    ]
}

#[test]
fn degenerate_rays_have_defined_answers() {
    let mut fin = shapes::plane(6, 6);
    let mut positions = fin.positions().to_vec();
    positions.push(Vec3::new(0.1, 0.1, 0.5));
    let mut triangles = fin.triangles().to_vec();
    triangles.push([triangles[0][0], triangles[0][2], crate::mesh::index_u32(positions.len() - 1)]);
    fin = Mesh::new(positions, triangles).unwrap();
    for mesh in
        [shapes::torus_with_uv(1.0, 0.45, 24, 12), shapes::plane(6, 6), shapes::saddle(8, 8), fin, spot()]
    {
        let field = estimated(&mesh);
        for filter in all_filters(&field) {
            for triangle in (0..mesh.triangles().len()).step_by(1 + mesh.triangles().len() / 20) {
                for barycentric in
                    [[1.0, 0.0, 0.0], [0.0, 1.0, 0.0], [0.5, 0.5, 0.0], [0.0, 0.25, 0.75], [0.3, 0.3, 0.4]]
                {
                    check_degenerate(&field, &filter, SurfacePoint { triangle, barycentric });
                }
            }
        }
    }
}

fn check_degenerate(field: &CurvatureField<'_>, filter: &Filter, point: SurfacePoint) {
    let Some(normal) = field.unit_normal(point) else { return };
    let [a, b, c] = field.surface().corners(point.triangle);
    // Along all three edges, both ways, and askew.
    for tangent in [b - a, a - b, c - b, b - c, a - c, c - a, (b - a) * 0.3 + (c - a)] {
        let x = (tangent - normal * normal.dot(&tangent)).normalize();
        for cosine in [1.0, 1.0 - 1e-15, 0.3, 1e-8, 0.0, -1e-8, -0.5] {
            let sine = f64::max(0.0, 1.0 - cosine * cosine).sqrt();
            for length in [
                WalkLength::Fixed(0.0),
                WalkLength::Fixed(0.2),
                WalkLength::Fixed(f64::INFINITY),
                WalkLength::of_mesh(field.diagonal()),
            ] {
                let query = FilterQuery { point, w: normal * cosine + x * sine, length };
                let answer = filter.ask(field, &query).unwrap();
                let finite = [Some(answer.kappa), Some(answer.length), answer.t_exit];
                assert!(finite.iter().flatten().all(|x| x.is_finite()), "{filter:?} {query:?}: {answer:?}");
                assert!(
                    answer.uv_rate.is_none_or(|q| q.iter().all(|x| x.is_finite())),
                    "{query:?}: {answer:?}"
                );
                assert!(answer.crossings <= MAX_CROSSINGS);
                if cosine == 1.0 && answer.stop == Stop::NormalIncidence {
                    let point = Filter::Point.ask(field, &query).unwrap();
                    assert_eq!(answer.kappa, point.kappa, "{filter:?}");
                }
            }
        }
    }
    for w in [Vec3::zeros(), Vec3::repeat(f64::NAN), Vec3::x() * f64::INFINITY] {
        let query = FilterQuery { point, w, length: WalkLength::Fixed(0.1) };
        assert_eq!(filter.ask(field, &query), None, "{filter:?}");
    }
}

/// Over a corner on a boundary the section plane cuts off pieces that are nothing, or rounding. Their chords have no direction.
#[test]
fn rays_out_of_the_mesh_have_no_rate_or_go_forward() {
    let flat = shapes::plane(12, 12);
    let turn = nalgebra::Rotation3::from_euler_angles(0.3, 1.1, 2.0);
    let turned = flat.positions().iter().map(|p| turn * p).collect();
    let turned = Mesh::new(turned, flat.triangles().to_vec()).unwrap();
    // UVs are x and y before the turn.
    let turned = turned.with_uv_set(flat.uv_sets()[0].clone()).unwrap();
    for (mesh, turn) in [(&flat, nalgebra::Rotation3::identity()), (&turned, turn)] {
        let field = estimated(mesh);
        let table = Filter::BakedChord(Arc::new(BakedChord::new(&field, 16, DEEP)));
        let rays =
            (0..mesh.triangles().len()).flat_map(|t| (0..64).map(move |k| (t, TAU * f64::from(k) / 64.0)));
        let (mut outside, mut inside) = (0, 0);
        for (triangle, azimuth) in rays {
            let forward = Vec3::new(azimuth.cos(), azimuth.sin(), 0.0);
            let w = turn * Vec3::new(-forward.x, -forward.y, 0.3);
            let query = FilterQuery { point: vertex(triangle), w, length: DEEP };
            for filter in [&Filter::Chord, &table] {
                let answer = filter.ask(&field, &query).unwrap();
                assert!(answer.kappa.abs() < 1e-9, "{triangle} {azimuth}: {answer:?}");
                let Some([u, v]) = answer.uv_rate else {
                    outside += 1;
                    continue;
                };
                inside += 1;
                let off = (u - forward.x).hypot(v - forward.y);
                assert!(off < 1e-4, "{triangle} {azimuth}: {answer:?}");
            }
        }
        assert!(outside > 100 && inside > 10 * outside, "{outside} {inside}");
    }
}

#[test]
fn without_estimates_there_is_no_answer() {
    let mesh = shapes::plane(4, 4);
    let surface = Surface::new(&mesh, Weld::Exact);
    let nothing = vec![VertexCurvature::undetermined(Status::RankDeficient); surface.positions().len()];
    let field = CurvatureField::new(surface, nothing);
    let query = FilterQuery { point: vertex(3), w: Vec3::new(0.3, 0.1, 0.5), length: DEEP };
    for filter in all_filters(&field) {
        assert_eq!(filter.ask(&field, &query), None, "{filter:?}");
    }
}

proptest! {
    #![proptest_config(ProptestConfig::with_cases(200))]

    /// Noise of any size on a small mesh, and any ray.
    #[test]
    fn any_mesh_and_ray_get_a_finite_answer(
        noise in prop::collection::vec((-1.0..1.0f64, -1.0..1.0f64, -1.0..1.0f64), 6 * 5),
        size in prop::sample::select(vec![0.0, 1e-9, 1e-3, 0.3, 3.0]),
        triangle in 0..60usize,
        b in (0.0..1.0f64, 0.0..1.0f64),
        w in (-1.0..1.0f64, -1.0..1.0f64, -1.0..1.0f64),
        length in prop::sample::select(vec![0.0, 1e-6, 0.3, 1e9]),
    ) {
        let torus = shapes::torus(1.0, 0.4, 6, 5);
        let shifted = torus.positions().iter().zip(&noise);
        let positions = shifted.map(|(p, &(x, y, z))| p + Vec3::new(x, y, z) * size).collect();
        let mesh = Mesh::new(positions, torus.triangles().to_vec()).unwrap();
        let field = estimated(&mesh);
        let barycentric = [1.0 - b.0, b.0 * (1.0 - b.1), b.0 * b.1];
        let point = SurfacePoint { triangle, barycentric };
        for filter in all_filters(&field) {
            for length in [WalkLength::Fixed(length), WalkLength::Shell { depth: length }] {
                let query = FilterQuery { point, w: Vec3::new(w.0, w.1, w.2), length };
                if let Some(answer) = filter.ask(&field, &query) {
                    prop_assert!(answer.kappa.is_finite() && answer.length.is_finite(), "{:?}", answer);
                    let point = Filter::Point.ask(&field, &query).unwrap();
                    // All but the chord and its table are a minimum that the point's curvature is part of.
                    if !matches!(filter.kind(), FilterKind::Chord | FilterKind::BakedChord) {
                        let is_table = filter.kind() == FilterKind::Baked;
                        let rounding = if is_table { single_precision(&field) } else { 0.0 };
                        prop_assert!(answer.kappa <= point.kappa + rounding);
                    }
                }
            }
        }
    }
}

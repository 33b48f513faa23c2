//! A glance against what walks start from.

use super::*;
use crate::curvature::{Principal, Status, VertexCurvature};
use crate::field::glance::{Glance, widen};
use crate::field::start::Start;

/// Compares both on a ray; curvatures are allowed to be off by `tolerance`.
fn compare(field: &CurvatureField<'_>, query: &FilterQuery, tolerance: f64) {
    let start = Start::new(field, query.point, query.w).unwrap();
    let glance = Glance::new(field, query.point, &query.w).unwrap();
    let near = |found: f64, expected: f64, tolerance: f64| {
        assert!((found - expected).abs() <= tolerance, "{query:?}: {found} {expected}");
    };
    near(glance.cosine.into(), start.cosine, 1e-6);
    near(glance.along(), start.along(field), tolerance);
    let (Some(seen), Some(at)) = (&glance.section, &start.section) else {
        panic!("a plane: {query:?} {glance:?}");
    };
    // A plane is known the better, the lower the ray is.
    let sine = (1.0 - start.cosine * start.cosine).sqrt();
    near((widen(seen.forward) - at.forward).norm(), 0.0, 1e-6 / sine);
    near((widen(seen.plane) - at.plane.normal).norm(), 0.0, 1e-6 / sine);
    near(glance.kappa(seen, 0.0), at.kappa, tolerance / sine);
    near(glance.across(), start.across(), tolerance / sine);
    let vertices = field.surface().triangles()[query.point.triangle];
    for (vertex, weight, turn) in glance.turns(seen.forward) {
        let corner = vertices.iter().position(|&v| v as usize == vertex).unwrap();
        near(weight.into(), query.point.barycentric[corner], 1e-6);
        let principal = field.principal(vertices[corner]).unwrap();
        let angle = at.forward.dot(&principal.d2).atan2(at.forward.dot(&principal.d1));
        let apart = (f64::from(turn) - angle / TAU).rem_euclid(1.0);
        near(apart.min(1.0 - apart), 0.0, 1e-6 / sine);
    }
}

#[test]
fn a_glance_sees_what_walks_start_from() {
    for mesh in [spot(), bumpy_sphere(), shapes::torus(1.0, 0.45, 60, 30)] {
        let field = estimated(&mesh);
        for query in spread_queries(&field, 3000, DEEP) {
            compare(&field, &query, single_precision(&field));
        }
    }
}

/// Curvatures far beyond the range of single precision.
#[test]
fn a_glance_knows_any_scale() {
    for scale in [1e-150, 1e-30, 1e30, 1e150_f64] {
        let torus = shapes::torus(1.0, 0.45, 24, 12);
        let positions = torus.positions().iter().map(|p| p * scale).collect();
        let mesh = Mesh::new(positions, torus.triangles().to_vec()).unwrap();
        let field = estimated(&mesh);
        for query in spread_queries(&field, 300, DEEP) {
            compare(&field, &query, single_precision(&field));
        }
        let walk = WalkLength::Shell { depth: 0.1 * scale };
        let tables = [
            Filter::Baked(Arc::new(BakedMinimum::on_demand(&field, 8, walk))),
            Filter::BakedChord(Arc::new(BakedChord::on_demand(&field, 8, walk))),
        ];
        let unscaled = estimated(&torus);
        let walk = WalkLength::Shell { depth: 0.1 };
        let expected = [
            Filter::Baked(Arc::new(BakedMinimum::on_demand(&unscaled, 8, walk))),
            Filter::BakedChord(Arc::new(BakedChord::on_demand(&unscaled, 8, walk))),
        ];
        for query in spread_queries(&unscaled, 300, DEEP) {
            // Rows of the minimum are 1/length in single precision.
            let first = usize::from(scale.log10().abs() > 38.0);
            for (table, expected) in tables.iter().zip(&expected).skip(first) {
                let found = table.ask(&field, &query).unwrap().kappa * scale;
                let expected = expected.ask(&unscaled, &query).unwrap().kappa;
                assert!((found - expected).abs() < 1e-3, "{scale} {:?}: {found} {expected}", table.kind());
            }
        }
    }
}

/// Corners without an estimate, and those without a share, do not count.
#[test]
fn a_glance_leaves_corners_out() {
    let mesh = shapes::plane(1, 1);
    let surface = Surface::new(&mesh, Weld::Exact);
    let bent = |kappa: f64| {
        let principal = Principal { kappa_max: kappa, kappa_min: kappa, d1: Vec3::x(), d2: Vec3::y() };
        VertexCurvature { principal: Some(principal), error: 0.0, status: Status::Ok }
    };
    let mut estimates = vec![VertexCurvature::undetermined(Status::RankDeficient); 4];
    let [a, b, _] = surface.triangles()[0];
    (estimates[a as usize], estimates[b as usize]) = (bent(1.0), bent(4.0));
    let field = CurvatureField::new(surface, estimates);
    let ask = |barycentric: [f64; 3]| {
        let point = SurfacePoint { triangle: 0, barycentric };
        let glance = Glance::new(&field, point, &Vec3::new(0.6, 0.0, 0.8))?;
        let corners =
            glance.turns(glance.section?.forward).map(|(vertex, weight, _)| (vertex, weight)).collect();
        Some((glance.along(), corners))
    };
    let near = |found: Option<(f64, Vec<(usize, f32)>)>, kappa: f64, corners: &[(u32, f32)]| {
        let (along, found) = found.unwrap();
        assert!((along - kappa).abs() < 1e-5, "{along} {kappa}");
        let corners: Vec<_> = corners.iter().map(|&(vertex, weight)| (vertex as usize, weight)).collect();
        assert_eq!(found, corners);
    };
    near(ask([0.25, 0.25, 0.5]), 2.5, &[(a, 0.5), (b, 0.5)]);
    near(ask([0.0, 0.5, 0.5]), 4.0, &[(b, 1.0)]);
    assert_eq!(ask([0.0, 0.0, 1.0]), None);
}

/// A spike that is bent beyond the range of single precision beside a corner that is not.
#[test]
fn a_glance_at_a_spike_is_finite() {
    let mesh = shapes::plane(1, 1);
    let surface = Surface::new(&mesh, Weld::Exact);
    let spike = Principal { kappa_max: 1e300, kappa_min: -1e300, d1: Vec3::x(), d2: Vec3::y() };
    let estimates = vec![VertexCurvature { principal: Some(spike), error: 0.0, status: Status::Ok }; 4];
    let field = CurvatureField::new(surface, estimates);
    for barycentric in [[1.0, 0.0, 0.0], [0.3, 0.3, 0.4]] {
        let glance =
            Glance::new(&field, SurfacePoint { triangle: 0, barycentric }, &Vec3::new(0.6, 0.1, 0.8));
        let glance = glance.unwrap();
        let section = glance.section.unwrap();
        for kappa in [glance.along(), glance.across(), glance.kappa(&section, 0.0)] {
            assert!(kappa.is_finite() && kappa.abs() > 1e25, "{kappa}");
        }
    }
}

/// Straight down, along a hair beside it, and with normals that cancel.
#[test]
fn without_a_plane_there_is_the_curvature_along_the_ray() {
    let mesh = shapes::icosphere(0.5, 3);
    let field = estimated(&mesh);
    for triangle in (0..mesh.triangles().len()).step_by(31) {
        let point = SurfacePoint { triangle, barycentric: [0.2, 0.3, 0.5] };
        let normal = field.unit_normal(point).unwrap();
        for w in [normal, normal * 1e-200, normal * 1e200, normal + Vec3::repeat(1e-8)] {
            let glance = Glance::new(&field, point, &w).unwrap();
            assert!(glance.section.is_none() && glance.cosine > 0.999_999, "{glance:?}");
            assert!((glance.along() - field.kappa_along(point, normal).unwrap()).abs() < 1e-4);
        }
    }
    let flat = shapes::plane(1, 1);
    let surface = Surface::new(&flat, Weld::Exact);
    let side = |d2: Vec3| {
        let principal = Principal { kappa_max: 1.0, kappa_min: 1.0, d1: Vec3::x(), d2 };
        VertexCurvature { principal: Some(principal), error: 0.0, status: Status::Ok }
    };
    let mut estimates = vec![side(Vec3::y()); 4];
    estimates[surface.triangles()[0][1] as usize] = side(-Vec3::y());
    let field = CurvatureField::new(surface, estimates);
    let point = SurfacePoint { triangle: 0, barycentric: [0.5, 0.5, 0.0] };
    let glance = Glance::new(&field, point, &Vec3::new(0.6, 0.0, 0.8)).unwrap();
    assert!(glance.section.is_none() && glance.cosine == 0.0, "{glance:?}");
}

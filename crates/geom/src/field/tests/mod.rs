//! The filters against each other and against slicing the whole mesh.

use std::f64::consts::TAU;
use std::sync::Arc;

mod baked_chord;
mod chord;
mod degenerate;
mod glance;

use super::*;
use crate::curvature::{CurvatureOptions, estimate};
use crate::io::{no_files, read_obj};
use crate::mesh::{Surface, Weld};
use crate::shapes;
use crate::{Mesh, Vec3};

fn spot() -> Mesh {
    const SPOT: &[u8] = include_bytes!("../../../../../assets/meshes/spot.obj");
    read_obj(SPOT, &no_files).unwrap().mesh
}

fn bumpy_sphere() -> Mesh {
    let sphere = shapes::icosphere(1.0, 4);
    let bump = |p: &Vec3| p * (1.0 + 0.06 * (5.0 * p.x).sin() * (4.0 * p.y).cos() * (6.0 * p.z + 1.0).sin());
    Mesh::new(sphere.positions().iter().map(bump).collect(), sphere.triangles().to_vec()).unwrap()
}

fn estimated(mesh: &Mesh) -> CurvatureField<'_> {
    let surface = Surface::new(mesh, Weld::Exact);
    let curvature = estimate(&surface, &CurvatureOptions::default()).unwrap();
    CurvatureField::new(surface, curvature).with_uv_set(mesh, 0)
}

/// What answers of tables are off by for being in single precision: of the order of its rounding times the largest curvature.
fn single_precision(field: &CurvatureField<'_>) -> f64 {
    let vertices = 0..crate::mesh::index_u32(field.surface().positions().len());
    let largest =
        vertices.filter_map(|v| field.principal(v)).map(|p| p.kappa_max.abs().max(p.kappa_min.abs()));
    2e-6 * largest.fold(0.0, f64::max)
}

fn vertex(triangle: usize) -> SurfacePoint {
    SurfacePoint { triangle, barycentric: [1.0, 0.0, 0.0] }
}

const DEEP: WalkLength = WalkLength::Shell { depth: 10.0 };

#[test]
fn march_equals_slicing_the_whole_mesh() {
    let meshes = [
        shapes::ellipsoid(Vec3::new(1.0, 1.6, 0.7), 4),
        shapes::torus(1.0, 0.45, 60, 30),
        bumpy_sphere(),
        spot(),
        shapes::saddle(20, 20),
    ];
    for mesh in &meshes {
        let field = estimated(mesh);
        let mut compared = 0;
        for length in [0.01, 0.05, 0.4, 1e9] {
            let queries = spread_queries(&field, 60, WalkLength::Fixed(length));
            for query in queries {
                let Some(expected) = field.minimum_by_slicing(query.point, query.w, length) else { continue };
                let found = Filter::March.ask(&field, &query).unwrap();
                compared += 1;
                // Absolute, on meshes of unit size; curvatures reach a hundred.
                assert!((found.kappa - expected).abs() < 1e-9, "{query:?}: {found:?} {expected}");
            }
        }
        assert!(compared > 230, "{compared}");
    }
}

/// On a torus, whose curvatures differ: what lies across one ray lies along another, and no filter changes it.
#[test]
fn what_is_across_one_ray_is_along_another() {
    let mesh = shapes::torus(1.0, 0.45, 60, 30);
    let field = estimated(&mesh);
    let walk = WalkLength::Fixed(0.1);
    let filters = [
        Filter::Point,
        Filter::March,
        Filter::Chord,
        Filter::Baked(Arc::new(BakedMinimum::new(&field, 8, walk))),
        Filter::BakedChord(Arc::new(BakedChord::on_demand(&field, 8, walk))),
    ];
    for triangle in (0..mesh.triangles().len()).step_by(97) {
        let point = vertex(triangle);
        let n = field.unit_normal(point).unwrap();
        let along = n.cross(&Vec3::new(0.3, 0.5, -0.8)).normalize();
        let across = n.cross(&along);
        let expected = field.kappa_along(point, across).unwrap();
        let answers = filters.iter().map(|filter| {
            filter.ask(&field, &FilterQuery { point, w: along + 0.3 * n, length: walk }).unwrap().across
        });
        for (answer, filter) in answers.zip(&filters) {
            let tolerance = match filter {
                // Blends some mean curvature in.
                Filter::Point => 1e-2,
                Filter::Baked(_) | Filter::BakedChord(_) => single_precision(&field),
                _ => 1e-9,
            };
            assert!(
                (answer - expected).abs() < tolerance,
                "{triangle} {:?}: {answer} {expected}",
                filter.kind()
            );
        }
        let straight = Filter::Chord.ask(&field, &FilterQuery { point, w: n, length: walk }).unwrap();
        assert!((straight.across - straight.kappa).abs() < 1e-12, "the mean: {straight:?}");
    }
}

#[test]
fn tables_converge_to_the_walk_and_stay_within_the_proof() {
    for mesh in [spot(), bumpy_sphere(), shapes::torus(1.0, 0.45, 60, 30)] {
        let field = estimated(&mesh);
        let walk = WalkLength::Fixed(0.04 * field.diagonal());
        let bounds = SkipBounds::new(&field, walk.longest(field.diagonal()));
        let rounding = single_precision(&field);
        let mut medians = Vec::new();
        for azimuths in BakedMinimum::AZIMUTHS {
            let table = BakedMinimum::new(&field, azimuths, walk);
            let error = table.error(&field, &bounds, 3000).unwrap();
            assert!(error.max <= error.proved.unwrap() + rounding, "{error:?}");
            medians.push(error.median);
            let filter = Filter::Baked(Arc::new(table));
            for query in spread_queries(&field, 1000, walk) {
                let baked = filter.ask(&field, &query).unwrap();
                let march = Filter::March.ask(&field, &query).unwrap();
                let proved = f64::from(bounds.bound(query.point.triangle));
                assert!(
                    (baked.kappa - march.kappa).abs() <= proved + rounding,
                    "{query:?} {baked:?} {march:?} {proved}"
                );
            }
        }
        assert!(medians[2] < 0.7 * medians[0], "{medians:?}");
    }
}

#[test]
fn a_table_on_demand_has_the_bits_of_a_whole_one() {
    let mesh = shapes::torus(1.0, 0.45, 60, 30);
    let field = estimated(&mesh);
    let walk = WalkLength::Shell { depth: 0.05 };
    let whole = Arc::new(BakedMinimum::new(&field, 16, walk));
    let some = Arc::new(BakedMinimum::on_demand(&field, 16, walk));
    assert_eq!((whole.known(), some.known()), (16 * 60 * 30, 0));
    let [whole_filter, some_filter] = [whole.clone(), some.clone()].map(Filter::Baked);
    for (asked, query) in (1..).zip(spread_queries(&field, 100, walk)) {
        assert_eq!(some_filter.ask(&field, &query), whole_filter.ask(&field, &query));
        // Two directions at three corners.
        assert!((6..=6 * asked).contains(&some.known()), "{} of {asked}", some.known());
    }
    assert!((0..1800).all(|vertex| some.row(vertex).is_none() && whole.row(vertex).is_some()));
    some.fill(&field);
    assert_eq!(some, whole);
}

#[test]
fn tables_are_exact_at_vertices_in_their_directions() {
    let mesh = bumpy_sphere();
    let field = estimated(&mesh);
    let walk = WalkLength::Shell { depth: 0.03 }.for_table();
    let table = Arc::new(BakedMinimum::new(&field, 8, walk));
    for triangle in (0..mesh.triangles().len()).step_by(37) {
        let point = vertex(triangle);
        let principal = *field.principal(field.surface().triangles()[triangle][0]).unwrap();
        for k in 0..8 {
            let azimuth = TAU * f64::from(k) / 8.0;
            let forward = principal.d1 * azimuth.cos() + principal.d2 * azimuth.sin();
            let w = principal.normal() * 0.1 - forward;
            let query = FilterQuery { point, w, length: walk };
            let baked = Filter::Baked(table.clone()).ask(&field, &query).unwrap();
            let march = Filter::March.ask(&field, &query).unwrap();
            assert!((baked.kappa - march.kappa).abs() < single_precision(&field), "{baked:?} {march:?}");
        }
    }
}

#[test]
fn bounds_hold_on_random_queries_and_do_skip() {
    let meshes = [
        shapes::icosphere(1.0, 3),
        shapes::cylinder(0.5, 2.0, 64, 40),
        shapes::torus(1.0, 0.45, 60, 30),
        shapes::ellipsoid(Vec3::new(1.0, 1.6, 0.7), 3),
        shapes::saddle(24, 24),
        bumpy_sphere(),
        spot(),
    ];
    for (index, mesh) in meshes.iter().enumerate() {
        let field = estimated(mesh);
        for share in [0.005, 0.03, 0.15] {
            let length = share * field.diagonal();
            let bounds = SkipBounds::new(&field, length);
            let again =
                SkipBounds::from_vertices(field.surface(), &bounds.per_vertex(field.surface()), length);
            for query in spread_queries(&field, 1000, WalkLength::Fixed(length)) {
                let march = Filter::March.ask(&field, &query).unwrap();
                let still = FilterQuery { length: WalkLength::Fixed(0.0), ..query };
                let still = Filter::March.ask(&field, &still).unwrap();
                let lowered = still.kappa - march.kappa;
                let bound = f64::from(bounds.bound(query.point.triangle));
                assert!((0.0..=bound).contains(&lowered), "mesh {index}: {lowered} {bound} {query:?}");
                assert!(again.bound(query.point.triangle) >= bounds.bound(query.point.triangle));
            }
        }
        // On a sphere of estimates and on the middle of a cylinder hardly anything can change.
        if index < 2 {
            let bounds = SkipBounds::new(&field, 0.02 * field.diagonal());
            let small = bounds.bounds().iter().filter(|&&b| b < 0.1).count();
            assert!(2 * small > bounds.bounds().len(), "mesh {index}: {small} of {}", bounds.bounds().len());
        }
    }
}

#[test]
fn skipped_walks_are_within_the_tolerance() {
    let mesh = spot();
    let field = estimated(&mesh);
    let length = WalkLength::Shell { depth: 0.001 * field.diagonal() };
    let bounds = Arc::new(SkipBounds::new(&field, length.nominal(field.diagonal())));
    let tolerance = 2.0;
    let within = Filter::MarchWithin { bounds, tolerance };
    let mut skipped = 0;
    for query in spread_queries(&field, 4000, length) {
        let (fast, slow) = (within.ask(&field, &query).unwrap(), Filter::March.ask(&field, &query).unwrap());
        assert!((0.0..=tolerance).contains(&(fast.kappa - slow.kappa)), "{fast:?} {slow:?}");
        if fast.stop == Stop::Skipped {
            skipped += 1;
        } else {
            assert_eq!(fast, slow);
        }
    }
    assert!(skipped > 300, "{skipped} skipped");
}

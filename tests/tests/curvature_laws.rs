//! What must hold for curvature estimates on shapes whose curvature is known, and under maps that it is invariant to.

use osculate_geom::curvature::{
    CurvatureOptions, Method, Neighbourhood, Principal, Status, VertexCurvature, estimate,
};
use osculate_geom::mesh::{Surface, Weld};
use osculate_geom::{Mat3, Mesh, Vec3, shapes};
use osculate_tests::surfaces::{Exact, cylinder, surfaces, torus};
use proptest::prelude::*;

fn run(mesh: &Mesh, method: Method, rings: u32) -> Vec<VertexCurvature> {
    let options =
        CurvatureOptions { method, neighbourhood: Some(Neighbourhood::Rings(rings)), ..Default::default() };
    estimate(&Surface::new(mesh, Weld::Exact), &options).expect("valid options")
}

/// Some number that should be zero.
type Measure = fn(&Principal) -> f64;

/// Errors of the worse curvature at vertices with status `Ok`, ascending.
fn errors(mesh: &Mesh, estimates: &[VertexCurvature], exact: Exact) -> Vec<f64> {
    let mut errors: Vec<f64> = std::iter::zip(mesh.positions(), estimates)
        .filter(|(_, e)| e.status == Status::Ok)
        .map(|(p, e)| error(p, e, exact))
        .collect();
    errors.sort_by(f64::total_cmp);
    errors
}

fn error(p: &Vec3, estimate: &VertexCurvature, exact: Exact) -> f64 {
    let found = estimate.principal.expect("a regular vertex has an estimate");
    let [max, min] = exact(p);
    (found.kappa_max - max).abs().max((found.kappa_min - min).abs())
}

fn quantile(sorted: &[f64], percent: usize) -> f64 {
    sorted[(sorted.len() - 1) * percent / 100]
}

/// Median and 95th percentile of our error over libigl's, for every shape and resolution, with the rings of each.
fn ratios_to_libigl(our_rings: u32, their_rings: u32) -> Vec<(String, f64)> {
    let mut ratios = Vec::new();
    for (n, levels) in [(20, 3), (40, 4), (80, 5)] {
        for (name, mesh, exact) in surfaces(n, levels) {
            let ours = errors(&mesh, &run(&mesh, Method::Quadric, our_rings), exact);
            let theirs = errors(&mesh, &run(&mesh, Method::Libigl, their_rings), exact);
            for percent in [50, 95] {
                let [ours, theirs] = [&ours, &theirs].map(|e| quantile(e, percent));
                ratios.push((
                    format!("{name}, n {n}, quantile {percent} %: {ours:e} / {theirs:e}"),
                    ours / theirs,
                ));
            }
        }
    }
    ratios
}

#[test]
fn quadric_is_better_than_libigl_with_the_defaults_of_each() {
    for (case, ratio) in ratios_to_libigl(2, 5) {
        assert!(ratio < 1.0, "{case} = {ratio}");
    }
}

#[test]
fn quadric_is_no_worse_than_libigl_at_the_same_radius() {
    for rings in [2, 5] {
        let ratios = ratios_to_libigl(rings, rings);
        for (case, ratio) in &ratios {
            // The one exception of 72: the saddle z = xy has no fourth derivatives that falling weights could keep
            // out, so on five rings of its finest mesh they only cost efficiency (6 %).
            let bound = if rings == 5 && case.starts_with("irregular saddle, n 80, quantile 50 %") {
                1.07
            } else {
                1.0
            };
            assert!(*ratio <= bound, "{rings} rings, {case} = {ratio}");
        }
        let mean = (ratios.iter().map(|(_, r)| r.ln()).sum::<f64>() / ratios.len() as f64).exp();
        assert!(mean < 0.85, "{rings} rings: geometric mean {mean}");
    }
}

#[test]
fn tilted_fits_keep_the_minimum_of_a_cylinder_at_zero() {
    // The area-weighted normal leans on an irregular mesh, so the fit has a slope; libigl's matrix then mixes the axes.
    let mesh = cylinder(40, 0.3);
    let sorted = |method, value: Measure| {
        let estimates = run(&mesh, method, 2);
        let regular = estimates.iter().filter(|e| e.status == Status::Ok);
        let mut values: Vec<f64> = regular.map(|e| value(&e.principal.unwrap()).abs()).collect();
        values.sort_by(f64::total_cmp);
        values
    };
    // The axis is y: the minimum is zero, and the direction of the maximum has no part along y.
    let cases: [(&str, Measure); 2] = [("minimum", |p| p.kappa_min), ("direction", |p| p.d1.y)];
    for (name, value) in cases {
        let (ours, theirs) = (sorted(Method::Quadric, value), sorted(Method::Libigl, value));
        for percent in [50, 95] {
            let [ours, theirs] = [&ours, &theirs].map(|m| quantile(m, percent));
            assert!(ours < theirs, "{name}, quantile {percent} %: {ours:e} {theirs:e}");
        }
    }
}

#[test]
fn error_estimate_covers_the_error() {
    for (name, mesh, exact) in surfaces(64, 4) {
        for rings in [2, 3] {
            let estimates = run(&mesh, Method::Quadric, rings);
            let regular =
                std::iter::zip(mesh.positions(), &estimates).filter(|(_, e)| e.status == Status::Ok);
            let pairs: Vec<(f64, f64)> = regular.map(|(p, e)| (error(p, e, exact), e.error)).collect();
            let covered = pairs.iter().filter(|(error, stated)| error <= stated).count() as f64;
            let share = covered / pairs.len() as f64;
            assert!(share > 0.85, "{name}, {rings} rings: {share}");
        }
    }
}

#[test]
fn rounding_that_hides_a_curvature_is_stated() {
    // At a height of 1e7 a unit in the last place is 1.9e-9, and so coordinates that bend by less are those of a plane: its fits leave
    // no residual, and only the position says what may be missing.
    let kappa = 1e-10;
    let height = |x: f64, y: f64| 1e7 + 0.5 * kappa * (x * x + y * y);
    let mesh = shapes::grid(6, 6, [shapes::Ends::Open; 2], |u, v| {
        let (x, y) = (6.0 * u - 3.0, 6.0 * v - 3.0);
        Vec3::new(x, y, height(x, y))
    });
    assert!(mesh.positions().iter().all(|p| (p.z - 1e7).abs() < f64::MIN_POSITIVE), "not hidden");
    for method in Method::ALL.into_iter().filter(|m| *m != Method::Libigl) {
        let options = CurvatureOptions { method, ..Default::default() };
        for e in estimate(&Surface::new(&mesh, Weld::Exact), &options).expect("valid options") {
            let found = e.principal.expect("an estimate");
            // The grid bowls: curvature is -kappa seen from above.
            let off = (found.kappa_max + kappa).abs().max((found.kappa_min + kappa).abs());
            assert!(off <= e.error, "{method:?}: {off:e} stated as {:e}", e.error);
        }
    }
}

#[test]
fn a_plane_meets_any_tolerance() {
    // Turned, so that rounding leaves it a curvature to be relative to.
    let turn = nalgebra::Rotation3::from_euler_angles(0.4, 0.3, 0.2);
    let mesh = shapes::grid(16, 16, [shapes::Ends::Open; 2], |u, v| turn * Vec3::new(u, v, 0.0));
    let options = CurvatureOptions { tolerance: 1e-6, ..Default::default() };
    for e in estimate(&Surface::new(&mesh, Weld::Exact), &options).expect("valid options") {
        assert!(matches!(e.status, Status::Ok | Status::Boundary), "{e:?}");
    }
}

#[test]
fn gauss_bonnet_of_the_estimates() {
    // The integral of kappa_max kappa_min over a closed surface is 2 pi times its Euler characteristic; what is missing
    // falls with the square of the edge length.
    let excess = |mesh: &Mesh, characteristic: f64| {
        let estimates = run(mesh, Method::Quadric, 2);
        let gauss = |v: u32| {
            let p = estimates[v as usize].principal.unwrap();
            p.kappa_max * p.kappa_min
        };
        let on_triangle = |(index, triangle): (usize, &[u32; 3])| {
            let [a, b, c] = mesh.corners(index);
            (b - a).cross(&(c - a)).norm() / 6.0 * triangle.map(gauss).iter().sum::<f64>()
        };
        let integral: f64 = mesh.triangles().iter().enumerate().map(on_triangle).sum();
        (integral / std::f64::consts::TAU - characteristic).abs()
    };
    let sphere = [4, 5].map(|levels| excess(&shapes::icosphere(3.0, levels), 2.0));
    let torus = [64, 128].map(|n| excess(&torus(n, 0.3), 0.0));
    for [coarse, fine] in [sphere, torus] {
        assert!(fine < 0.02 && fine < coarse / 3.0, "{coarse} {fine}");
    }
}

fn tensor(vertex: &VertexCurvature) -> Mat3 {
    vertex.principal.expect("a regular vertex has an estimate").tensor()
}

#[test]
fn scales_with_the_inverse_of_length() {
    let mesh = torus(24, 0.3);
    for method in [Method::Quadric, Method::Libigl] {
        let base = run(&mesh, method, 3);
        // libigl's own cut-off for singular values is not scale-free, so only a modest range is asked of it.
        let scales: &[f64] =
            if method == Method::Libigl { &[1e-3, 1e3] } else { &[1e-150, 1e-9, 1e9, 1e150] };
        for &scale in scales {
            let positions = mesh.positions().iter().map(|p| p * scale).collect();
            let scaled = run(&Mesh::new(positions, mesh.triangles().to_vec()).unwrap(), method, 3);
            for (a, b) in base.iter().zip(&scaled) {
                let (a, b) = (a.principal.unwrap(), b.principal.unwrap());
                let difference =
                    (a.kappa_max - b.kappa_max * scale).abs().max((a.kappa_min - b.kappa_min * scale).abs());
                assert!(difference < 1e-10 * a.kappa_max.abs(), "{method:?} {scale:e}: {difference:e}");
            }
        }
    }
}

#[test]
fn flips_sign_with_orientation() {
    let mesh = torus(24, 0.3);
    let flipped = mesh.triangles().iter().map(|&[a, b, c]| [a, c, b]).collect();
    let flipped = Mesh::new(mesh.positions().to_vec(), flipped).unwrap();
    for method in [Method::Quadric, Method::Libigl] {
        for (a, b) in run(&mesh, method, 2).iter().zip(run(&flipped, method, 2)) {
            let (a, b) = (a.principal.unwrap(), b.principal.unwrap());
            assert!((a.kappa_max + b.kappa_min).abs() < 1e-11, "{a:?} {b:?}");
            assert!((a.kappa_min + b.kappa_max).abs() < 1e-11, "{a:?} {b:?}");
        }
    }
}

#[test]
fn same_bits_for_any_thread_count() {
    let mesh = torus(48, 0.3);
    let with = |threads: usize| {
        let pool = rayon::ThreadPoolBuilder::new().num_threads(threads).build().unwrap();
        pool.install(|| run(&mesh, Method::Quadric, 2))
    };
    assert_eq!(with(1), with(2));
    assert_eq!(with(1), with(5));
}

#[test]
fn hopeless_vertices_say_why() {
    let p = [[0.0, 0.0, 0.0], [1.0, 0.0, 0.0], [0.0, 1.0, 0.0], [1.0, 1.0, 0.3]].map(Vec3::from).to_vec();
    let status = |positions: Vec<Vec3>, triangles: Vec<[u32; 3]>| -> Vec<Status> {
        let mesh = Mesh::new(positions, triangles).unwrap();
        let estimates = run(&mesh, Method::Quadric, 2);
        for estimate in &estimates {
            assert!(estimate.principal.is_none() && estimate.error == f64::INFINITY, "{estimate:?}");
        }
        estimates.iter().map(|e| e.status).collect()
    };
    assert_eq!(status(p.clone(), vec![]), [Status::Isolated; 4]);
    assert_eq!(status(p.clone(), vec![[0, 1, 2]])[..3], [Status::FewNeighbours; 3]);
    assert_eq!(status(p.clone(), vec![[0, 1, 2], [1, 3, 2]]), [Status::FewNeighbours; 4]);
    assert_eq!(status(vec![Vec3::zeros(); 3], vec![[0, 1, 2]]), [Status::Isolated]);
    // A ribbon one triangle wide with straight sides: two lines carry no second derivative across.
    let ribbon: Vec<Vec3> = (0..40).map(|i| Vec3::new(f64::from(i / 2), f64::from(i % 2), 0.0)).collect();
    let strip = (0..38).map(|i| if i % 2 == 0 { [i, i + 2, i + 1] } else { [i, i + 1, i + 2] }).collect();
    assert_eq!(status(ribbon, strip), [Status::RankDeficient; 40]);
}

proptest! {
    #[test]
    fn invariant_to_rigid_motion_and_numbering(
        axis in prop::array::uniform3(-1.0..1.0_f64),
        angle in 0.0..6.3_f64,
        shift in prop::array::uniform3(-10.0..10.0_f64),
        stride in 1..641_usize,
    ) {
        let mesh = torus(16, 0.3);
        let base = run(&mesh, Method::Quadric, 2);
        let axis = Vec3::from(axis) + Vec3::new(0.0, 0.0, 1e-3);
        let turn = nalgebra::Rotation3::from_axis_angle(&nalgebra::Unit::new_normalize(axis), angle);
        // A permutation: multiplication by a unit modulo a prime above the count, skipping what falls outside.
        let n = mesh.positions().len();
        let order: Vec<usize> = (1..641).map(|i| i * stride % 641).filter(|&i| i <= n && i > 0).map(|i| i - 1).collect();
        prop_assert_eq!(order.len(), n);
        let mut place = vec![0_u32; n];
        for (new, &old) in order.iter().enumerate() {
            place[old] = u32::try_from(new).unwrap();
        }
        let positions = order.iter().map(|&old| turn * mesh.positions()[old] + Vec3::from(shift)).collect();
        let triangles: Vec<[u32; 3]> =
            mesh.triangles().iter().rev().map(|&[a, b, c]| [b, c, a].map(|v| place[v as usize])).collect();
        let moved = run(&Mesh::new(positions, triangles).unwrap(), Method::Quadric, 2);
        for (new, &old) in order.iter().enumerate() {
            let expected = turn.matrix() * tensor(&base[old]) * turn.matrix().transpose();
            let difference = (tensor(&moved[new]) - expected).amax();
            // Positions of order 10 carry 1e-15; a second difference over edges of 0.15 magnifies it a thousandfold.
            prop_assert!(difference < 1e-10, "vertex {}: {:e}", old, difference);
        }
    }
}

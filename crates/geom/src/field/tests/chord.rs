//! The chord query against closed forms.

use std::f64::consts::TAU;

use super::super::chord::{PACE, chord};
use super::super::start::Start;
use super::*;
use crate::curvature::{Principal, Status, VertexCurvature};
use crate::shapes::Ends;

/// A field with the curvature that a closed form has at each vertex.
fn exact(mesh: &Mesh, principal: impl Fn(&Vec3) -> Principal) -> CurvatureField<'_> {
    let surface = Surface::new(mesh, Weld::Exact);
    let at = |p| VertexCurvature { principal: Some(principal(p)), error: 0.0, status: Status::Ok };
    let curvature: Vec<_> = surface.positions().iter().map(at).collect();
    CurvatureField::new(surface, curvature).with_uv_set(mesh, 0)
}

/// Larger curvature along `d1`, smaller across it.
fn principal(kappa_max: f64, kappa_min: f64, d1: Vec3, normal: Vec3) -> Principal {
    Principal { kappa_max, kappa_min, d1, d2: normal.cross(&d1) }
}

fn on_sphere(radius: f64, sign: f64) -> impl Fn(&Vec3) -> Principal {
    move |p| {
        let n = p.normalize() * sign;
        let d1 = n.cross(&Vec3::ith(n.iamin(), 1.0)).normalize();
        principal(sign / radius, sign / radius, d1, n)
    }
}

const MAJOR: f64 = 1.0;
const MINOR: f64 = 0.45;

/// The unit vector from the middle of the tube to a point near a torus, and the way around the axis.
fn torus_frame(p: &Vec3) -> (Vec3, Vec3) {
    let out = Vec3::new(p.x, 0.0, p.z).normalize();
    ((p - out * MAJOR).normalize(), Vec3::y().cross(&out))
}

fn on_torus(p: &Vec3) -> Principal {
    let (n, around) = torus_frame(p);
    let kappa_around = n.dot(&Vec3::new(p.x, 0.0, p.z).normalize()) / p.x.hypot(p.z);
    principal(1.0 / MINOR, kappa_around, n.cross(&around), n)
}

fn torus_height(p: &Vec3) -> f64 {
    (p.x.hypot(p.z) - MAJOR).hypot(p.y) - MINOR
}

/// First point in `(from, to)` at which `f` is no longer negative, by steps and bisection.
fn first_rise(f: impl Fn(f64) -> f64, from: f64, to: f64) -> f64 {
    let step = (to - from) / 4000.0;
    let mut low = from + step;
    while f(low + step) < 0.0 {
        low += step;
        assert!(low < to, "does not rise");
    }
    let mut high = low + step;
    for _ in 0..80 {
        let middle = 0.5 * (low + high);
        if f(middle) < 0.0 { low = middle } else { high = middle }
    }
    high
}

/// The direction to a viewer with this cosine to the normal, whose rays travel into this azimuth.
fn towards_viewer(field: &CurvatureField<'_>, point: SurfacePoint, cosine: f64, azimuth: f64) -> Vec3 {
    let n = field.unit_normal(point).unwrap();
    let x = n.cross(&Vec3::ith(n.iamin(), 1.0)).normalize();
    let forward = x * azimuth.cos() + n.cross(&x) * azimuth.sin();
    n * cosine - forward * (1.0 - cosine * cosine).sqrt()
}

fn chord_at(field: &CurvatureField<'_>, point: SurfacePoint, w: Vec3, length: WalkLength) -> FilterAnswer {
    Filter::Chord.ask(field, &FilterQuery { point, w, length }).unwrap()
}

#[test]
fn chord_on_a_sphere_is_its_curvature_for_every_entry() {
    let mesh = shapes::icosphere(2.0, 4);
    let field = exact(&mesh, on_sphere(2.0, 1.0));
    // Edges are 0.07 R long; the lift leaves 1e-6 R, of fourth order in that. A chord is (c^2 / 2) R high, so most is lost
    // for those of one to three edges.
    for cosine in [0.0, 1e-8, 1e-4, 0.01, 0.05, 0.2, 0.5, 0.9, 0.999] {
        for query in spread_queries(&field, 200, DEEP) {
            let w = towards_viewer(&field, query.point, cosine, 40.0 * query.w.x);
            let found = chord_at(&field, query.point, w, DEEP);
            assert_eq!(found.stop, Stop::Exit);
            let tolerance = 2e-3;
            assert!((found.kappa - 0.5).abs() < tolerance * 0.5, "{cosine}: {found:?}");
            let t_exit = found.t_exit.unwrap();
            assert!((t_exit - 4.0 * cosine).abs() <= tolerance * 4.0 * cosine + 1e-15, "{cosine}: {found:?}");
        }
    }
}

#[test]
fn chord_inside_a_sphere_is_its_curvature() {
    let mesh = shapes::icosphere(2.0, 4).flipped();
    let field = exact(&mesh, on_sphere(2.0, -1.0));
    for (length, stop) in
        [(WalkLength::Shell { depth: 0.1 }, Stop::Below), (WalkLength::Fixed(0.5), Stop::Length)]
    {
        for cosine in [0.0, 1e-8, 0.01, 0.2, 0.9] {
            for query in spread_queries(&field, 100, length) {
                let w = towards_viewer(&field, query.point, cosine, 40.0 * query.w.x);
                let found = chord_at(&field, query.point, w, length);
                assert_eq!((found.stop, found.t_exit), (stop, None));
                assert!((found.kappa + 0.5).abs() < 0.01 * 0.5, "{cosine}: {found:?}");
                if let (WalkLength::Shell { .. }, true) = (length, cosine < 0.5) {
                    // It ends where the ray is below the material by the definition of the rule's length.
                    let expected = length.resolve(-0.5, cosine, field.diagonal());
                    assert!((found.length - expected).abs() < 0.02 * expected, "{found:?} {expected}");
                }
            }
        }
    }
}

#[test]
fn chord_across_a_plane_is_flat() {
    let mesh = shapes::plane(20, 20);
    let field = exact(&mesh, |_| principal(0.0, 0.0, Vec3::x(), Vec3::z()));
    let length = WalkLength::Shell { depth: 0.02 };
    for query in spread_queries(&field, 300, length) {
        let found = chord_at(&field, query.point, query.w, length);
        assert!(found.kappa.abs() < 1e-12, "{found:?}");
        assert!(matches!(found.stop, Stop::Below | Stop::Boundary), "{found:?}");
        // UVs are x and y, so the rate is the direction of travel.
        let rate = found.uv_rate.unwrap();
        let forward = -Vec3::new(query.w.x, query.w.y, 0.0).normalize();
        assert!((rate[0] - forward.x).hypot(rate[1] - forward.y) < 1e-9, "{rate:?} {forward}");
    }
}

/// Charts that are turned, mirrored and moved against each other are one material to a ray: it goes on as it began.
#[test]
fn chord_goes_straight_over_charts_that_lie_otherwise() {
    let whole = shapes::plane(20, 20);
    // Every triangle has corners of its own, in the chart of its column.
    let chart = |triangle: usize| {
        let corners = whole.corners(triangle);
        let x = (corners[0].x + corners[1].x + corners[2].x) / 3.0;
        // Columns of half a cell, four charts in turn.
        (1..4).take_while(|&k| (40.0 * x).rem_euclid(4.0) >= f64::from(k)).count()
    };
    let axes = |chart: usize| -> [[f64; 2]; 2] {
        [
            [[1.0, 0.0], [0.0, 1.0]],
            [[0.0, -1.0], [1.0, 0.0]],
            [[0.6, 0.8], [0.8, -0.6]],
            [[-1.0, 0.0], [0.0, -1.0]],
        ][chart]
    };
    let put = |chart: usize, x: f64, y: f64| axes(chart).map(|[a, b]| a * x + b * y);
    let (mut positions, mut uvs) = (vec![], vec![]);
    for triangle in 0..whole.triangles().len() {
        let number = chart(triangle);
        for corner in whole.corners(triangle) {
            let [u, v] = put(number, corner.x, corner.y);
            positions.push(corner);
            uvs.push([u + 0.3 * number as f64, v - 0.7 * number as f64]);
        }
    }
    let count = crate::mesh::index_u32(whole.triangles().len());
    let triangles = (0..count).map(|t| [3 * t, 3 * t + 1, 3 * t + 2]).collect();
    let mesh = Mesh::new(positions, triangles).unwrap().with_uv_set(uvs).unwrap();
    let field = exact(&mesh, |_| principal(0.0, 0.0, Vec3::x(), Vec3::z()));
    let length = WalkLength::Shell { depth: 0.1 };
    let mut crossed = 0;
    for query in spread_queries(&field, 500, length) {
        let found = chord_at(&field, query.point, query.w, length);
        let forward = -Vec3::new(query.w.x, query.w.y, 0.0).normalize();
        let expected = put(chart(query.point.triangle), forward.x, forward.y);
        let rate = found.uv_rate.unwrap();
        assert!((rate[0] - expected[0]).hypot(rate[1] - expected[1]) < 1e-9, "{rate:?} {expected:?}");
        crossed += usize::from(found.crossings > 4);
    }
    assert!(crossed > 100, "{crossed}");
}

#[test]
fn chord_obliquely_across_a_cylinder() {
    const RADIUS: f64 = 0.5;
    let mesh = shapes::grid(96, 96, [Ends::Open; 2], |u, v| {
        let a = TAU * u.fract();
        Vec3::new(RADIUS * a.sin(), 6.0 * (v - 0.5), RADIUS * a.cos())
    });
    let on_cylinder = |p: &Vec3| {
        let n = Vec3::new(p.x, 0.0, p.z).normalize();
        principal(1.0 / RADIUS, 0.0, Vec3::y().cross(&n), n)
    };
    let field = exact(&mesh, on_cylinder);
    for row in 40..56 {
        let point = vertex(2 * (96 * row + (row * 7) % 96));
        let n = field.unit_normal(point).unwrap();
        let around = Vec3::y().cross(&n);
        for cosine in [0.02_f64, 0.1, 0.3, 0.7] {
            for turn in [0.0_f64, 0.4, 0.9, 2.0, 3.5] {
                let sine = (1.0 - cosine * cosine).sqrt();
                let w = n * cosine - (around * turn.cos() + Vec3::y() * turn.sin()) * sine;
                let found = chord_at(&field, point, w, DEEP);
                // Where the ray meets x^2 + z^2 = R^2 again.
                let expected = (sine * sine * turn.cos() * turn.cos() + cosine * cosine) / RADIUS;
                assert_eq!(found.stop, Stop::Exit, "{cosine} {turn}: {found:?}");
                // Quads are 0.033 R wide around; relative to the largest curvature, of second order in that.
                assert!(
                    (found.kappa - expected).abs() < 2e-3 / RADIUS,
                    "{cosine} {turn}: {} {expected}",
                    found.kappa
                );
                // The foot on the ellipse that the ray's plane cuts out, below the chord's middle.
                let t = 2.0 * cosine / expected;
                let forward = around * turn.cos() + Vec3::y() * turn.sin();
                let middle = field.position(point) - w * (0.5 * t);
                let across = forward * cosine + n * sine;
                let height = |p: Vec3| p.x.hypot(p.z) - RADIUS;
                let foot = middle + across * first_rise(|h| height(middle + across * h), 0.0, 2.0);
                let angle = foot.dot(&around).atan2(foot.dot(&n));
                let along = (foot - field.position(point)).y;
                let arc = 0.5 * t * cosine.asin() / cosine;
                let [du, dv] = [angle / TAU / arc, along / 6.0 / arc];
                let rate = found.uv_rate.unwrap();
                assert!(
                    (rate[0] - du).abs() < 0.01 / (TAU * RADIUS) && (rate[1] - dv).abs() < 0.01 / 6.0,
                    "{cosine} {turn}: {rate:?} {du} {dv}"
                );
            }
        }
    }
}

#[test]
fn chord_on_a_torus_against_the_exact_intersection() {
    let mesh = shapes::torus_with_uv(MAJOR, MINOR, 160, 80);
    let field = exact(&mesh, on_torus);
    let mut checked = 0;
    for index in 0..300_usize {
        let point = vertex(index * 7919 % mesh.triangles().len());
        let p0 = field.position(point);
        let (n, _) = torus_frame(&p0);
        let cosine = [0.03, 0.1, 0.3, 0.6][index % 4];
        let w = towards_viewer(&field, point, cosine, index as f64);
        let found = chord_at(&field, point, w, DEEP);
        let t = first_rise(|t| torus_height(&(p0 - w * t)), 0.0, 3.5);
        let Some(t_exit) = found.t_exit else {
            // The section by the ray's plane leads around the torus; the ray may come out on another branch of it.
            continue;
        };
        checked += 1;
        let is_same_branch = (t_exit - t).abs() < 0.1 * t;
        assert!(is_same_branch, "{index}: {t_exit} {t}");
        // Edges are 0.06 long at most; the shortest chords checked are as long.
        let expected = 2.0 * cosine / t;
        assert!((found.kappa - expected).abs() < 0.01 / MINOR, "{index}: {} {expected}", found.kappa);
        // The foot below the middle, on the section that leads to the exit.
        let forward = (n * n.dot(&w) - w).normalize();
        let across = forward * cosine + n * (1.0 - cosine * cosine).sqrt();
        let middle = p0 - w * (0.5 * t);
        let foot = middle + across * first_rise(|h| torus_height(&(middle + across * h)), 0.0, 2.0);
        let uv = |p: &Vec3| {
            let out = p.x.hypot(p.z) - MAJOR;
            [p.x.atan2(p.z) / TAU, p.y.atan2(out) / TAU]
        };
        let (a, b) = (uv(&p0), uv(&foot));
        let arc = 0.5 * t * cosine.asin() / cosine;
        let rate = found.uv_rate.unwrap();
        for k in 0..2 {
            // Wrapped to the nearest copy: no half chord goes half way around.
            let expected = ((b[k] - a[k] + 1.5).rem_euclid(1.0) - 0.5) / arc;
            let scale = [1.0 / (TAU * (MAJOR - MINOR)), 1.0 / (TAU * MINOR)][k];
            assert!((rate[k] - expected).abs() < 0.01 * scale, "{index}, {k}: {} {expected}", rate[k]);
        }
    }
    assert!(checked > 200, "{checked}");
}

#[test]
fn chord_of_the_estimate_comes_close_too() {
    let mesh = shapes::icosphere(1.0, 4);
    let field = estimated(&mesh);
    for query in spread_queries(&field, 500, DEEP) {
        let found = chord_at(&field, query.point, query.w, DEEP);
        assert!((found.kappa - 1.0).abs() < 0.01, "{found:?}");
    }
}

/// The value below which so many in a hundred of them lie.
fn quantile(mut values: Vec<f64>, percent: usize) -> f64 {
    values.sort_by(f64::total_cmp);
    values[(values.len() - 1) * percent / 100]
}

/// Looking at the section now and then, as the filter does, against looking at it in every triangle. Curvature counts against the
/// depth: the silhouette moves by about the share of it in the depth. Spot's estimates change from triangle to triangle, more than
/// any number of looks can know in between.
#[test]
fn looking_now_and_then_finds_what_looking_everywhere_does() {
    let (torus, ball, cow) =
        (shapes::torus_with_uv(MAJOR, MINOR, 240, 120), shapes::icosphere(1.0, 5), spot());
    let fields =
        [(exact(&torus, on_torus), 2e-3, 5e-3), (estimated(&ball), 3e-4, 0.0), (estimated(&cow), 0.03, 0.03)];
    for (field, curvature_bound, uv_bound) in &fields {
        for share in [0.02, 0.05] {
            let depth = share * field.diagonal();
            let (mut curvatures, mut rates, mut stops) = (Vec::new(), Vec::new(), 0);
            for query in spread_queries(field, 3000, WalkLength::Shell { depth }) {
                let start = Start::new(field, query.point, query.w).unwrap();
                let [now, all] = [PACE, 0.0].map(|pace| chord(field, &start, query.length, pace));
                stops += u32::from(now.stop != all.stop);
                curvatures.push((now.kappa - all.kappa).abs() * depth);
                let off = |a: [f64; 2], b: [f64; 2]| (a[0] - b[0]).hypot(a[1] - b[1]) / b[0].hypot(b[1]);
                rates.extend(now.uv_rate.zip(all.uv_rate).map(|(a, b)| off(a, b)));
            }
            assert!(stops <= 6, "{stops} of {} end otherwise", curvatures.len());
            let [median, most] = [50, 99].map(|percent| quantile(curvatures.clone(), percent));
            assert!(median < 0.05 * curvature_bound && most < *curvature_bound, "{share}: {median} {most}");
            if !rates.is_empty() {
                let most = quantile(rates, 99);
                assert!(most < *uv_bound, "{share}: UV rates are off by {most}");
            }
        }
    }
}

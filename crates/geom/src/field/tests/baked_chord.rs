//! The table of chords against the chords themselves.

use super::*;
use crate::curvature::{Principal, Status, VertexCurvature};

const SHELL: WalkLength = WalkLength::Shell { depth: 0.1 };

fn table(field: &CurvatureField<'_>, azimuths: usize) -> Filter {
    Filter::BakedChord(Arc::new(BakedChord::new(field, azimuths, SHELL)))
}

fn torus() -> Mesh {
    shapes::torus_with_uv(1.0, 0.45, 60, 30)
}

/// The same UV, mapped linearly.
fn with_uv(mesh: &Mesh, map: impl Fn([f64; 2]) -> [f64; 2]) -> Mesh {
    let uvs = mesh.uv_sets()[0].iter().map(|uv| map(*uv)).collect();
    Mesh::new(mesh.positions().to_vec(), mesh.triangles().to_vec()).unwrap().with_uv_set(uvs).unwrap()
}

/// Distance between two rates, as a share of the first.
fn off(exact: [f64; 2], found: [f64; 2]) -> f64 {
    (exact[0] - found[0]).hypot(exact[1] - found[1]) / exact[0].hypot(exact[1])
}

#[test]
fn table_is_exact_at_vertices_in_its_directions() {
    let mesh = torus();
    let field = estimated(&mesh);
    let filter = table(&field, 8);
    let mut compared = 0;
    for triangle in (0..mesh.triangles().len()).step_by(7) {
        let principal = *field.principal(field.surface().triangles()[triangle][0]).unwrap();
        let [a, b, c] = field.surface().corners(triangle);
        for (k, level) in (0..8).flat_map(|k| (1..6).map(move |level| (k, level))) {
            // A hair from the directions of the table, which pass through other vertices: there the walk takes either side.
            let (azimuth, cosine) = (TAU * f64::from(k) / 8.0 + 1e-9, (f64::from(level) / 6.0).powi(2));
            let forward = principal.d1 * azimuth.cos() + principal.d2 * azimuth.sin();
            let plane = principal.normal().cross(&forward);
            let is_ahead = plane.dot(&(b - a)) < 0.0 && plane.dot(&(c - a)) > 0.0;
            if !is_ahead {
                continue;
            }
            compared += 1;
            let w = principal.normal() * cosine - forward * (1.0 - cosine * cosine).sqrt();
            let query = FilterQuery { point: vertex(triangle), w, length: SHELL };
            let exact = Filter::Chord.ask(&field, &query).unwrap();
            let found = filter.ask(&field, &query).unwrap();
            // Steps are 3e-5 of the largest number of the vertex, which are below 10 for curvatures and below 3 for rates.
            assert!((exact.kappa - found.kappa).abs() < 4e-4, "{k} {level}: {exact:?} {found:?}");
            let off = off(exact.uv_rate.unwrap(), found.uv_rate.unwrap());
            assert!(off < 2e-4, "{k} {level}: {off} {exact:?} {found:?}");
        }
    }
    assert!(compared > 500, "{compared}");
}

#[test]
fn tables_come_closer_to_chords_with_more_azimuths() {
    let mesh = torus();
    let field = estimated(&mesh);
    let of = |azimuths: usize| BakedChord::new(&field, azimuths, SHELL).error(&field, 4000).unwrap();
    let [coarse, middle, fine] = [4, 8, 16].map(of);
    assert!(middle.kappa_median < 0.5 * coarse.kappa_median, "{coarse:?} {middle:?}");
    assert!(fine.kappa_median < 0.6 * middle.kappa_median, "{middle:?} {fine:?}");
    assert!(fine.kappa_p99 < coarse.kappa_p99 && fine.rate_p99 < coarse.rate_p99, "{coarse:?} {fine:?}");
    // Curvatures are up to 2.2. Chords jump where the ray no longer comes out, which no table follows.
    assert!(fine.kappa_median < 0.01 && fine.kappa_p99 < 0.4, "{fine:?}");
    assert!(fine.rate_median < 0.04 && fine.rate_p99 < 0.6, "{fine:?}");
}

/// A linear map of UV maps rates alike, also one that mirrors: what is kept of them is a way on the surface.
#[test]
fn rates_follow_the_chart() {
    let plain = torus();
    let map = |[u, v]: [f64; 2]| [0.5 * u + 3.0 * v, -2.0 * u + 0.7 * v];
    let mapped = with_uv(&plain, map);
    let fields = [estimated(&plain), estimated(&mapped)];
    let filters = fields.each_ref().map(|field| table(field, 8));
    for query in spread_queries(&fields[0], 500, SHELL) {
        let [one, two] = [0, 1].map(|k: usize| filters[k].ask(&fields[k], &query).unwrap());
        assert_eq!(one.kappa, two.kappa);
        // Numbers of 16 bits are rounded on either side.
        assert!(off(map(one.uv_rate.unwrap()), two.uv_rate.unwrap()) < 1e-3, "{query:?}: {one:?} {two:?}");
    }
}

#[test]
fn curved_and_flat_surfaces_have_nothing_to_add() {
    let sphere = shapes::icosphere(2.0, 4);
    let plane = shapes::plane(20, 20);
    for (mesh, kappa) in [(&sphere, 0.5), (&plane, 0.0)] {
        let field = estimated(mesh);
        let filter = table(&field, 8);
        for query in spread_queries(&field, 500, SHELL) {
            let found = filter.ask(&field, &query).unwrap();
            // Of the estimate and of the chords along the icosphere's edges.
            assert!((found.kappa - kappa).abs() < 5e-3, "{query:?}: {found:?}");
            if let Some(rate) = found.uv_rate {
                // UVs are x and y.
                let forward = -Vec3::new(query.w.x, query.w.y, 0.0).normalize();
                assert!(off([forward.x, forward.y], rate) < 1e-3, "{query:?}: {found:?}");
            }
        }
    }
}

#[test]
fn tables_on_demand_answer_alike_and_follow_no_more_chords_than_they_must() {
    let mesh = torus();
    let field = estimated(&mesh);
    let whole = BakedChord::new(&field, 8, SHELL);
    let some = Arc::new(BakedChord::on_demand(&field, 8, SHELL));
    assert_eq!((whole.known(), some.known()), (8 * 60 * 30, 0));
    let [whole_filter, some_filter] = [Arc::new(whole.clone()), Arc::clone(&some)].map(Filter::BakedChord);
    let mut met = std::collections::HashSet::new();
    let empty = some.bytes();
    for (asked, query) in (1..).zip(spread_queries(&field, 100, SHELL)) {
        assert_eq!(some_filter.ask(&field, &query), whole_filter.ask(&field, &query));
        met.extend(field.surface().triangles()[query.point.triangle]);
        // Two directions at three corners.
        assert!(some.known() <= 6 * asked && some.known() >= 2 * met.len(), "{} of {asked}", some.known());
    }
    assert!(met.len() < 400);
    let each = (some.bytes() - empty) / met.len();
    // 8 azimuths, 6 elevations and 3 numbers of 16 bits, and what a direction keeps beside them.
    assert!((8 * 36..=8 * 48).contains(&each), "{each}");
    some.fill(&field);
    assert!(*some == whole);
}

#[test]
fn tables_are_the_same_bits_for_any_number_of_threads() {
    let mesh = bumpy_sphere();
    let field = estimated(&mesh);
    let of = |threads| {
        let pool = rayon::ThreadPoolBuilder::new().num_threads(threads).build().unwrap();
        pool.install(|| BakedChord::new(&field, 4, SHELL))
    };
    assert!(of(1) == of(3));
}

/// Triangles that are turned over against the estimates' normals: rates still go the ray's way.
#[test]
fn rates_go_forward_over_turned_triangles() {
    let mesh = shapes::plane(12, 12).flipped();
    let surface = Surface::new(&mesh, Weld::Exact);
    let flat = Principal { kappa_max: 0.0, kappa_min: 0.0, d1: Vec3::x(), d2: Vec3::y() };
    let up = VertexCurvature { principal: Some(flat), error: 0.0, status: Status::Ok };
    let estimates = vec![up; surface.positions().len()];
    let field = CurvatureField::new(surface, estimates).with_uv_set(&mesh, 0);
    let filter = table(&field, 8);
    for query in spread_queries(&field, 300, SHELL) {
        let rate = filter.ask(&field, &query).unwrap().uv_rate.unwrap();
        let forward = -Vec3::new(query.w.x, query.w.y, 0.0).normalize();
        assert!(off([forward.x, forward.y], rate) < 1e-3, "{query:?}: {rate:?}");
    }
}

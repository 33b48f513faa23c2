//! Random triangle soups, broken meshes and stray vertices: no estimator may panic, hang or break its promises.

use std::sync::OnceLock;

use osculate_geom::curvature::{Method, VertexCurvature};
use osculate_geom::{Mesh, Vec3};
use osculate_tests::hard_cases::meshes::{edges_from, index, patch, torus};
use osculate_tests::hard_cases::{Outcome, invariants};
use proptest::prelude::*;

/// A coordinate: on a small lattice (so that points coincide and line up), ordinary, of any magnitude, or any number.
fn coordinate() -> impl Strategy<Value = f64> {
    use proptest::num::f64::{NEGATIVE, NORMAL, POSITIVE, SUBNORMAL, ZERO};
    prop_oneof![
        6 => (-2..=2_i32).prop_map(f64::from),
        4 => -1.0..1.0_f64,
        2 => (-150..=150_i32, -1.0..1.0_f64).prop_map(|(e, x)| x * 10.0_f64.powi(e)),
        1 => NORMAL | SUBNORMAL | ZERO | POSITIVE | NEGATIVE,
    ]
}

/// Points of one kind of coordinate, or of mixed ones.
fn soup() -> impl Strategy<Value = Mesh> {
    let points = prop::collection::vec(prop::array::uniform3(coordinate()), 1..30);
    points.prop_flat_map(|points| {
        let count = points.len();
        let triangles = prop::collection::vec(prop::array::uniform3(0..index(count)), 0..80);
        triangles.prop_map(move |triangles| {
            Mesh::new(points.iter().map(|&p| p.into()).collect(), triangles).expect("finite and in range")
        })
    })
}

/// What may happen to a mesh on its way.
#[derive(Debug, Clone, Copy)]
enum Damage {
    /// One vertex goes onto another.
    Collapse(usize, usize),
    /// One vertex goes anywhere.
    Stray(usize, [f64; 3]),
    /// A triangle is turned over.
    Flip(usize),
    /// A triangle is there twice.
    Repeat(usize),
    /// A corner of a triangle becomes some vertex.
    Rewire(usize, usize, usize),
    /// A triangle is lost.
    Lose(usize),
}

fn damage() -> impl Strategy<Value = Damage> {
    let any = || 0..10_000_usize;
    prop_oneof![
        (any(), any()).prop_map(|(a, b)| Damage::Collapse(a, b)),
        (any(), prop::array::uniform3(coordinate())).prop_map(|(a, p)| Damage::Stray(a, p)),
        any().prop_map(Damage::Flip),
        any().prop_map(Damage::Repeat),
        (any(), 0..3_usize, any()).prop_map(|(t, k, v)| Damage::Rewire(t, k, v)),
        any().prop_map(Damage::Lose),
    ]
}

fn damaged(mesh: &Mesh, damages: &[Damage]) -> Mesh {
    let (mut positions, mut triangles) = (mesh.positions().to_vec(), mesh.triangles().to_vec());
    let n = positions.len();
    for damage in damages {
        let m = triangles.len();
        match *damage {
            Damage::Collapse(a, b) => positions[a % n] = positions[b % n],
            Damage::Stray(a, p) => positions[a % n] = p.into(),
            Damage::Flip(t) => triangles[t % m].swap(0, 1),
            Damage::Repeat(t) => triangles.push(triangles[t % m]),
            Damage::Rewire(t, k, v) => triangles[t % m][k] = index(v % n),
            Damage::Lose(t) => {
                triangles.swap_remove(t % m);
            }
        }
    }
    Mesh::new(positions, triangles).expect("still a mesh")
}

fn check(mesh: &Mesh) -> Result<(), TestCaseError> {
    for method in Method::ALL {
        invariants(&Outcome::new(mesh, method))
            .map_err(|e| TestCaseError::fail(format!("{method:?}: {e}")))?;
    }
    Ok(())
}

/// The estimates of the undamaged torus by every method.
fn whole_torus() -> &'static [Vec<VertexCurvature>] {
    static WHOLE: OnceLock<Vec<Vec<VertexCurvature>>> = OnceLock::new();
    WHOLE.get_or_init(|| Method::ALL.map(|method| Outcome::new(&torus(), method).estimates).to_vec())
}

proptest! {
    #![proptest_config(ProptestConfig::with_cases(1024))]

    #[test]
    fn any_soup_keeps_the_invariants(mesh in soup()) {
        check(&mesh)?;
    }

    #[test]
    fn any_damage_keeps_the_invariants(damages in prop::collection::vec(damage(), 1..24)) {
        check(&damaged(&patch(8, 0.3, |x, y| 0.3 * x * x - 0.2 * x * y), &damages))?;
    }
}

proptest! {
    #![proptest_config(ProptestConfig::with_cases(48))]

    #[test]
    fn a_stray_vertex_is_a_local_matter(
        vertex in 0..1280_usize,
        direction in prop::array::uniform3(-1.0..1.0_f64),
        exponent in -3..=100_i32,
    ) {
        let base = torus();
        let mut positions = base.positions().to_vec();
        positions[vertex] += Vec3::from(direction) * 10.0_f64.powi(exponent);
        let moved = Mesh::new(positions, base.triangles().to_vec()).expect("finite");
        let distance = edges_from(&base, |v| v == vertex);
        for (method, whole) in Method::ALL.into_iter().zip(whole_torus()) {
            let found = Outcome::new(&moved, method).estimates;
            for v in (0..1280).filter(|&v| distance[v] > 8) {
                prop_assert_eq!(&found[v], &whole[v], "{:?}: vertex {}, {} edges off", method, v, distance[v]);
            }
        }
    }
}

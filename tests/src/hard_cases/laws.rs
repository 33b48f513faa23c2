//! Maps under which curvature is invariant or scales, at sizes and places that tempt rounding, and locality.

use nalgebra::{Rotation3, Unit};
use osculate_geom::curvature::{Method, VertexCurvature};
use osculate_geom::{Mat3, Mesh, Vec3, shapes};

use super::meshes::{edges_from, mesh, moved, torus, torus_curvature, with_triangles};
use super::sharp::OUT_OF_REACH;
use super::smooth::unit_sphere;
use super::{HardCase, Outcome, Truth, ensure};

const FOLLOWS_LIBIGL: &str =
    "repeats libigl, whose axes hang on the numbering and whose matrix hangs on the axes";

pub(super) fn cases() -> Vec<HardCase> {
    [scales(), places(), orders(), locality()].concat()
}

/// Checks every tensor against an expected one, relative to the inverse of the tube's radius in the mesh's own units.
fn tensors(
    outcome: &Outcome<'_>,
    expected: impl Fn(usize) -> Option<Mat3>,
    scale: f64,
    bound: f64,
) -> Result<(), String> {
    for vertex in 0..outcome.estimates.len() {
        let found = outcome.principal(vertex)?.tensor() * scale;
        let expected =
            expected(vertex).ok_or_else(|| format!("vertex {vertex} has an estimate here only"))?;
        let off = (found - expected).amax() / 2.5;
        ensure(off <= bound, || format!("vertex {vertex} is off by {off:e} of kappa_max"))?;
    }
    Ok(())
}

fn tensor(estimate: &VertexCurvature) -> Option<Mat3> {
    estimate.principal.map(|p| p.tensor())
}

fn scaled_torus(scale: f64) -> Mesh {
    moved(&torus(), |p| p * scale)
}

fn scaled_truth(mesh: &Mesh, scale: f64) -> Vec<Truth> {
    let truth = |p: &Vec3| {
        let kappa = torus_curvature(&(p / scale)).map(|k| k / scale);
        Truth::Known { kappa, tolerance: 0.12 * 2.5 / scale }
    };
    mesh.positions().iter().map(truth).collect()
}

macro_rules! scale_case {
    ($name:literal, $scale:literal, $exempt:expr) => {
        HardCase {
            truth: |mesh| scaled_truth(mesh, $scale),
            check: |outcome| {
                let base = outcome.again(&torus());
                tensors(outcome, |v| tensor(&base[v]), $scale, 1e-10)
            },
            exempt: $exempt,
            ..HardCase::new(
                $name,
                concat!("a torus of radii 1 and 0.4, scaled by ", stringify!($scale)),
                "the torus's own tensors over the scale, to 1e-10 of kappa_max",
                || scaled_torus($scale),
            )
        }
    };
}

fn scales() -> Vec<HardCase> {
    const ABSOLUTE: &[(Method, &str)] = &[(
        Method::Libigl,
        "repeats libigl, whose cut-off for singular values depends on the unit of length",
    )];
    vec![
        scale_case!("scale_1e_minus_150", 1e-150, ABSOLUTE),
        scale_case!("scale_1e_minus_100", 1e-100, ABSOLUTE),
        scale_case!("scale_1e_minus_9", 1e-9, ABSOLUTE),
        scale_case!("scale_1e9", 1e9, ABSOLUTE),
        scale_case!("scale_1e100", 1e100, ABSOLUTE),
        scale_case!("scale_1e150", 1e150, ABSOLUTE),
    ]
}

/// Coordinates rounded to this, so that adding 1e7 is exact.
const GRID: f64 = 1.0 / 16_777_216.0;

fn on_grid() -> Mesh {
    moved(&torus(), |p| p.map(|x| (x / GRID).round() * GRID))
}

fn places() -> Vec<HardCase> {
    fn shift() -> Vec3 {
        Vec3::new(1e7, -1e7, 1e7)
    }
    vec![
        HardCase {
            truth: |mesh| scaled_truth(&moved(mesh, |p| p - shift()), 1.0),
            check: |outcome| {
                let base = outcome.again(&on_grid());
                tensors(outcome, |v| tensor(&base[v]), 1.0, 1e-8)
            },
            ..HardCase::new(
                "offset_1e7",
                "the torus 1e7 radii from the origin, on coordinates that can be moved there without rounding",
                "the tensors of the torus at the origin, to 1e-8 of kappa_max",
                || moved(&on_grid(), |p| p + shift()),
            )
        },
        HardCase {
            truth: |mesh| scaled_truth(&moved(mesh, |p| p - shift()), 1.0),
            check: |outcome| {
                // The error estimate has a part for the rounding of coordinates. Their spacing is 1.9e-9 here; a second
                // difference over two edges of 0.12 makes up to 1e-7 of it.
                let base = outcome.again(&torus());
                tensors(outcome, |v| tensor(&base[v]), 1.0, 2e-6)
            },
            ..HardCase::new(
                "offset_1e7_rounded",
                "the same on arbitrary coordinates: doubles at 1e7 are 1.9e-9 apart",
                "what the rounding of the coordinates leaves, 2e-6 of kappa_max",
                || moved(&torus(), |p| p + shift()),
            )
        },
        HardCase {
            truth: |mesh| scaled_truth(&moved(mesh, |p| p - Vec3::repeat(1e3)), 1.0),
            check: |outcome| {
                // f32 at 1e3 is 6.1e-5 apart, 5e-4 of an edge; see the noise cases for what that does.
                let base = outcome.again(&torus());
                if outcome.method != Method::Auto {
                    return tensors(outcome, |v| tensor(&base[v]), 1.0, 0.05);
                }
                // On a mesh this coarse the rounding makes `auto` take another neighbourhood here and there, and the bias of
                // the two differs: 5.6 % was seen. What it must not do is to be surer than that.
                for (one, two) in std::iter::zip(&outcome.estimates, &base) {
                    let difference =
                        (tensor(one).unwrap_or_default() - tensor(two).unwrap_or_default()).amax();
                    let honest = difference <= (0.05 * 2.5_f64).max(one.error + two.error);
                    ensure(honest, || format!("{difference} apart: {one:?} and {two:?}"))?;
                }
                Ok(())
            },
            ..HardCase::new(
                "offset_1e3_in_f32",
                "the torus at 1e3 in single precision, as a file may force it: coordinates are 6.1e-5 apart, 5e-4 of an edge",
                "what that rounding leaves: 5 % of kappa_max, or for `auto` what the stated errors allow, since it may take another neighbourhood",
                || in_f32(1e3),
            )
        },
        HardCase {
            ..HardCase::new(
                "offset_1e7_in_f32",
                "the torus at 1e7 in single precision: coordinates are 1 apart, all of it falls onto a few points",
                "nothing of the shape is left in such a file: flags, or estimates of what is there; no estimator can do more",
                || in_f32(1e7),
            )
        },
        HardCase {
            truth: |mesh| {
                let back = rotation().inverse();
                scaled_truth(&moved(mesh, |p| back * p), 1.0)
            },
            check: |outcome| {
                let (turn, base) = (*rotation().matrix(), outcome.again(&torus()));
                tensors(outcome, |v| tensor(&base[v]).map(|t| turn * t * turn.transpose()), 1.0, 1e-10)
            },
            ..HardCase::new(
                "random_rotation",
                "the torus turned by an angle without symmetry",
                "the turned tensors, to 1e-10 of kappa_max",
                || moved(&torus(), |p| rotation() * p),
            )
        },
    ]
}

fn rotation() -> Rotation3<f64> {
    Rotation3::from_axis_angle(&Unit::new_normalize(Vec3::new(0.31, -0.77, 0.56)), 2.1)
}

#[allow(clippy::cast_possible_truncation, reason = "the loss is the case")]
fn in_f32(offset: f64) -> Mesh {
    moved(&torus(), |p| p.map(|x| f64::from((x + offset) as f32)))
}

/// Where vertex `v` of the torus goes: a permutation without short cycles, since 471 and 1280 are coprime.
fn place(v: usize) -> usize {
    (471 * v + 13) % 1280
}

fn orders() -> Vec<HardCase> {
    vec![
        HardCase {
            truth: |mesh| scaled_truth(mesh, 1.0),
            check: |outcome| {
                let base = outcome.again(&torus());
                let mut original = vec![0; base.len()];
                (0..base.len()).for_each(|v| original[place(v)] = v);
                tensors(outcome, |v| tensor(&base[original[v]]), 1.0, 1e-10)
            },
            exempt: &[(Method::Libigl, FOLLOWS_LIBIGL)],
            ..HardCase::new(
                "permutation",
                "the torus with vertices, triangles and the corners of each triangle in another order",
                "the same tensors, to 1e-10 of kappa_max",
                || {
                    let base = torus();
                    let mut positions = base.positions().to_vec();
                    let place_u32 = |v: u32| super::meshes::index(place(v as usize));
                    (0..1280).for_each(|v| positions[place(v)] = base.positions()[v]);
                    let turned = |&[a, b, c]: &[u32; 3]| [b, c, a].map(place_u32);
                    mesh(positions, base.triangles().iter().rev().map(turned).collect())
                },
            )
        },
        HardCase {
            truth: |mesh| {
                let flipped = |truth: &Truth| match *truth {
                    Truth::Known { kappa: [max, min], tolerance } => {
                        Truth::Known { kappa: [-min, -max], tolerance }
                    }
                    other => other,
                };
                scaled_truth(mesh, 1.0).iter().map(flipped).collect()
            },
            check: |outcome| {
                let base = outcome.again(&torus());
                tensors(outcome, |v| tensor(&base[v]).map(|t| -t), 1.0, 1e-10)
            },
            exempt: &[(Method::Libigl, FOLLOWS_LIBIGL)],
            ..HardCase::new(
                "inside_out",
                "the torus with every triangle wound the other way",
                "the negated tensors, to 1e-10 of kappa_max",
                || {
                    let base = torus();
                    with_triangles(&base, base.triangles().iter().map(|&[a, b, c]| [a, c, b]).collect())
                },
            )
        },
    ]
}

fn sphere_with_stray(to: f64) -> Mesh {
    let mut first = true;
    moved(&shapes::icosphere(1.0, 4), |p| if std::mem::take(&mut first) { p * to } else { *p })
}

fn beyond_stray(mesh: &Mesh) -> Vec<Truth> {
    let distance = edges_from(mesh, |v| v == 0);
    let truths = unit_sphere(mesh, 0.05);
    std::iter::zip(truths, distance).map(|(t, d)| if d > OUT_OF_REACH { t } else { Truth::Free }).collect()
}

fn untouched(outcome: &Outcome<'_>) -> Result<(), String> {
    let base = outcome.again(&shapes::icosphere(1.0, 4));
    let distance = edges_from(outcome.mesh, |v| v == 0);
    let changed = (0..base.len()).find(|&v| distance[v] > OUT_OF_REACH && outcome.estimates[v] != base[v]);
    ensure(changed.is_none(), || {
        format!("vertex {changed:?} is {:?} edges off", changed.map(|v| distance[v]))
    })
}

fn locality() -> Vec<HardCase> {
    let expect = "farther than 8 edges from it the bits of the whole sphere";
    vec![
        HardCase {
            truth: beyond_stray,
            check: untouched,
            ..HardCase::new("spike", "a sphere with one vertex at ten times the radius", expect, || {
                sphere_with_stray(10.0)
            })
        },
        HardCase {
            truth: beyond_stray,
            check: untouched,
            ..HardCase::new("vertex_at_1e100", "a sphere with one vertex at 1e100", expect, || {
                sphere_with_stray(1e100)
            })
        },
    ]
}

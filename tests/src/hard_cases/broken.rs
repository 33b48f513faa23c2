//! Too little data, useless data, and numbers at the ends of their range.

use osculate_geom::curvature::{Method, Status};
use osculate_geom::{Mesh, Vec3, shapes};

use super::meshes::{joined, mesh, moved};
use super::smooth::unit_sphere;
use super::{HardCase, Truth, ensure};

fn nothing(mesh: &Mesh) -> Vec<Truth> {
    vec![Truth::Undetermined; mesh.positions().len()]
}

pub(super) fn cases() -> Vec<HardCase> {
    [empty(), tiny(), useless()].concat()
}

fn empty() -> Vec<HardCase> {
    vec![
        HardCase {
            check: |outcome| ensure(outcome.estimates.is_empty(), || "rows without vertices".to_owned()),
            ..HardCase::new("no_vertices", "an empty mesh", "no rows", || mesh(vec![], vec![]))
        },
        HardCase {
            truth: nothing,
            check: |outcome| outcome.statuses(|_| Status::Isolated),
            ..HardCase::new(
                "points_only",
                "vertices without a triangle",
                "no estimate, flagged isolated",
                || mesh(shapes::icosphere(1.0, 1).positions().to_vec(), vec![]),
            )
        },
        HardCase {
            truth: |mesh| {
                let mut truths = unit_sphere(mesh, 0.05);
                truths[..7].fill(Truth::Undetermined);
                truths[649..].fill(Truth::Undetermined);
                truths
            },
            check: |outcome| {
                outcome.statuses(|v| if (7..649).contains(&v) { Status::Ok } else { Status::Isolated })?;
                let alone = outcome.again(&shapes::icosphere(1.0, 3));
                ensure(outcome.estimates[7..649] == alone, || "unused vertices change the others".to_owned())
            },
            ..HardCase::new(
                "isolated_vertices",
                "a sphere amid vertices that no triangle uses, first and last in the list",
                "the sphere's vertices to the bit as without the others; those flagged isolated, in their rows",
                || {
                    let loose =
                        |n: usize| mesh((0..n).map(|i| Vec3::repeat(5.0 + i as f64)).collect(), vec![]);
                    joined(&[&loose(7), &shapes::icosphere(1.0, 3), &moved(&loose(5), |p| -p)])
                },
            )
        },
    ]
}

fn tiny() -> Vec<HardCase> {
    let few = "no estimate, flagged: fewer neighbours than a second-order surface has coefficients";
    vec![
        HardCase {
            truth: nothing,
            check: |outcome| outcome.statuses(|_| Status::FewNeighbours),
            ..HardCase::new("one_triangle", "a single triangle", few, || {
                mesh(vec![Vec3::zeros(), Vec3::x(), Vec3::y()], vec![[0, 1, 2]])
            })
        },
        HardCase {
            truth: nothing,
            check: |outcome| outcome.statuses(|_| Status::FewNeighbours),
            ..HardCase::new("two_triangles", "a folded pair of triangles", few, || {
                let corners = vec![Vec3::zeros(), Vec3::x(), Vec3::y(), Vec3::new(1.0, 1.0, 0.3)];
                mesh(corners, vec![[0, 1, 2], [1, 3, 2]])
            })
        },
        HardCase {
            truth: |mesh| {
                unit_sphere(mesh, 0.05)
                    .into_iter()
                    .enumerate()
                    .map(|(v, t)| if v < 642 { t } else { Truth::Undetermined })
                    .collect()
            },
            ..HardCase::new(
                "tetrahedron_beside_a_sphere",
                "a component of four vertices: tools that ask for six neighbours have looked for them for ever",
                "the sphere 1 and 1 within 5 %; the tetrahedron's vertices without an estimate, flagged",
                || {
                    let p = [[1.0, 1.0, 1.0], [1.0, -1.0, -1.0], [-1.0, 1.0, -1.0], [-1.0, -1.0, 1.0]];
                    let corners = p.map(|p| Vec3::from(p) + Vec3::repeat(4.0)).to_vec();
                    let tetrahedron = mesh(corners, vec![[0, 1, 2], [0, 3, 1], [0, 2, 3], [1, 3, 2]]);
                    joined(&[&shapes::icosphere(1.0, 3), &tetrahedron])
                },
            )
        },
        HardCase {
            check: |outcome| {
                let differ =
                    outcome.estimates.iter().find(|e| e.principal.is_some_and(|p| p.kappa_min <= 0.0));
                ensure(differ.is_none(), || format!("an octahedron is convex: {differ:?}"))
            },
            ..HardCase::new(
                "octahedron",
                "six vertices with five neighbours each, as many as a quadric has coefficients",
                "no estimate and a flag, or a convex one",
                || {
                    let axes = [Vec3::x(), Vec3::y(), -Vec3::x(), -Vec3::y(), Vec3::z(), -Vec3::z()];
                    let triangles = (0..4).flat_map(|i| [[i, (i + 1) % 4, 4], [(i + 1) % 4, i, 5]]).collect();
                    mesh(axes.to_vec(), triangles)
                },
            )
        },
    ]
}

fn useless() -> Vec<HardCase> {
    vec![
        HardCase {
            truth: nothing,
            check: |outcome| outcome.statuses(|_| Status::RankDeficient),
            exempt: &[(Method::Libigl, "repeats libigl, which takes the flattest of all surfaces that fit")],
            ..HardCase::new(
                "collinear_ring",
                "a ribbon one triangle wide: all neighbours of a vertex lie on two lines",
                "no estimate, flagged rank deficient: two lines carry no second derivative across",
                || {
                    let positions =
                        (0..40).map(|i| Vec3::new(f64::from(i / 2), f64::from(i % 2), 0.0)).collect();
                    let turn =
                        |i: u32| if i.is_multiple_of(2) { [i, i + 2, i + 1] } else { [i, i + 1, i + 2] };
                    mesh(positions, (0..38).map(turn).collect())
                },
            )
        },
        HardCase {
            truth: nothing,
            ..HardCase::new(
                "all_on_a_line",
                "triangles that all lie on one line",
                "no estimate, flagged: there is no normal",
                || {
                    let positions = (0..30).map(|i| Vec3::new(0.5, -0.25, 1.0) * f64::from(i)).collect();
                    mesh(positions, (0..28).map(|i| [i, i + 1, i + 2]).collect())
                },
            )
        },
        HardCase {
            truth: nothing,
            check: |outcome| outcome.statuses(|_| Status::Isolated),
            ..HardCase::new(
                "all_in_one_point",
                "a sphere's triangles, every vertex at the same place",
                "no estimate, flagged isolated: no triangle has an area",
                || moved(&shapes::icosphere(1.0, 2), |_| Vec3::new(0.1, 0.2, 0.3)),
            )
        },
        HardCase {
            ..HardCase::new(
                "largest_numbers",
                "a sphere of radius 1.7e308, where differences of coordinates are infinite",
                "an estimate or a flag, no overflow that shows: all numbers finite",
                || shapes::icosphere(1.7e308, 2),
            )
        },
        HardCase {
            ..HardCase::new(
                "smallest_numbers",
                "a sphere of radius 1e-310: coordinates are subnormal numbers, the curvature is no number at all",
                "an estimate or a flag: all numbers finite",
                || shapes::icosphere(1e-310, 2),
            )
        },
        HardCase {
            ..HardCase::new(
                "all_magnitudes",
                "a sphere whose vertices are moved to distances from 1e-150 to 1e150",
                "an estimate or a flag at every vertex",
                || {
                    let mut k = 0;
                    moved(&shapes::icosphere(1.0, 2), |p| {
                        k += 1;
                        p * 10.0_f64.powi(k * 37 % 301 - 150)
                    })
                },
            )
        },
        HardCase {
            truth: |mesh| {
                let (large, small) = ([1e-3; 2], [1e6; 2]);
                let at = |v: usize| {
                    let kappa = if v < 642 { large } else { small };
                    Truth::Known { kappa, tolerance: 0.05 * kappa[0] }
                };
                (0..mesh.positions().len()).map(at).collect()
            },
            ..HardCase::new(
                "far_apart_in_size",
                "a sphere of radius 1e-6 beside one of radius 1e3",
                "the inverse radius within 5 % on both: no length of the whole mesh enters",
                || joined(&[&shapes::icosphere(1e3, 3), &shapes::icosphere(1e-6, 3)]),
            )
        },
    ]
}

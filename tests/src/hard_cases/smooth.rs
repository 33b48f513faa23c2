//! Smooth surfaces at their difficult points, and difficult meshes of smooth surfaces.

use osculate_geom::curvature::Status;
use osculate_geom::{Mesh, Vec3, shapes};

use super::meshes::{
    disc, edges_from, graph_curvature, index, mesh, moved, on_boundary, patch, torus, torus_curvature,
    with_triangles,
};
use super::{HardCase, NO_ERROR_ESTIMATE, Outcome, Truth, ensure};

/// The same truth everywhere but on the boundary and up to `margin` edges from it.
pub(super) fn inside(mesh: &Mesh, margin: u32, truth: impl Fn(&Vec3) -> Truth) -> Vec<Truth> {
    let boundary = on_boundary(mesh);
    let distance = edges_from(mesh, |v| boundary[v]);
    let at = |(p, d): (&Vec3, u32)| if d > margin { truth(p) } else { Truth::Free };
    mesh.positions().iter().zip(distance).map(at).collect()
}

/// Both curvatures of the unit sphere, within a share.
pub(super) fn unit_sphere(mesh: &Mesh, tolerance: f64) -> Vec<Truth> {
    vec![Truth::Known { kappa: [1.0; 2], tolerance }; mesh.positions().len()]
}

pub(super) fn cases() -> Vec<HardCase> {
    [umbilics(), flat_points(), meshings()].concat()
}

fn umbilics() -> Vec<HardCase> {
    vec![
        HardCase {
            truth: |mesh| unit_sphere(mesh, 0.05),
            check: |outcome| {
                let umbilic = outcome.estimates.iter().filter(|e| e.is_umbilic()).count();
                let all = outcome.estimates.len();
                // The five-valent vertices have a symmetry that hides the error from any estimate of it.
                ensure(umbilic * 10 >= all * 8, || {
                    format!("{umbilic} of {all} vertices are flagged umbilic")
                })?;
                outcome.statuses(|_| Status::Ok)
            },
            exempt: NO_ERROR_ESTIMATE,
            ..HardCase::new(
                "umbilic_sphere",
                "every point is umbilic: no direction is principal",
                "1 and 1 within 5 %, unit and orthogonal directions; at least 80 % are flagged umbilic",
                || shapes::icosphere(1.0, 3),
            )
        },
        HardCase {
            truth: |mesh| inside(mesh, 0, |_| Truth::Known { kappa: [0.0; 2], tolerance: 1e-12 }),
            check: |outcome| {
                let sharp = outcome.estimates.iter().position(|e| !e.is_umbilic());
                ensure(sharp.is_none(), || format!("vertex {sharp:?} of a plane is not flagged umbilic"))
            },
            exempt: NO_ERROR_ESTIMATE,
            ..HardCase::new(
                "umbilic_plane",
                "a tilted plane: zero curvature, and no direction",
                "0 and 0 to rounding (1e-12 of the inverse size), unit and orthogonal directions, all flagged umbilic",
                || {
                    // Not through the origin and not along an axis.
                    let (t, s) = (Vec3::new(0.6, 0.0, 0.8), Vec3::new(0.64, 0.6, -0.48));
                    moved(&patch(16, 0.3, |_, _| 0.0), |p| t * p.x + s * p.y + Vec3::new(0.1, 0.2, 0.3))
                },
            )
        },
        HardCase {
            truth: |mesh| {
                // The closed form only has to be met where the ellipsoid is far from its four umbilics or on them alike.
                let exact = |p: &Vec3| ellipsoid_curvature(p);
                mesh.positions().iter().map(|p| Truth::Known { kappa: exact(p), tolerance: 0.1 }).collect()
            },
            ..HardCase::new(
                "umbilics_of_an_ellipsoid",
                "four isolated umbilics with index 1/2: directions turn by half a turn around each",
                "the closed form within 0.1 of the inverse middle axis, at the umbilics as elsewhere",
                || shapes::ellipsoid(Vec3::new(1.2, 1.0, 0.8), 3),
            )
        },
    ]
}

/// Axes 1.2, 1.0 and 0.8; from the quadratic form's gradient.
fn ellipsoid_curvature(p: &Vec3) -> [f64; 2] {
    let [a, b, c]: [f64; 3] = [1.2, 1.0, 0.8];
    let g2 = p.x * p.x / a.powi(4) + p.y * p.y / b.powi(4) + p.z * p.z / c.powi(4);
    let product = a * b * c;
    let gauss = 1.0 / (product * g2).powi(2);
    let mean = (a * a + b * b + c * c - p.norm_squared()) / (2.0 * product.powi(2) * g2.powf(1.5));
    let root = (mean * mean - gauss).max(0.0).sqrt();
    [mean + root, mean - root]
}

fn flat_points() -> Vec<HardCase> {
    vec![
        HardCase {
            truth: |mesh| {
                let known = |p| Truth::Known { kappa: torus_curvature(p), tolerance: 0.12 * 2.5 };
                mesh.positions().iter().map(known).collect()
            },
            check: |outcome| {
                // Off the circles by half a radian the sign of the Gaussian curvature is certain.
                for (vertex, p) in outcome.mesh.positions().iter().enumerate() {
                    let outside = (p.x.hypot(p.z) - 1.0) / 0.4;
                    let kappa_min = outcome.principal(vertex)?.kappa_min;
                    ensure(outside.abs() < 0.48 || kappa_min * outside > 0.0, || {
                        format!("vertex {vertex}: kappa_min {kappa_min} at {outside} of the tube")
                    })?;
                }
                Ok(())
            },
            ..HardCase::new(
                "parabolic_lines",
                "a torus: two circles on which kappa_min passes through zero",
                "the closed form within 12 % of kappa_max on both sides of the lines and on them, and its sign off them",
                torus,
            )
        },
        HardCase {
            truth: |mesh| {
                let exact = |p: &Vec3| {
                    let (x, y) = (p.x, p.y);
                    graph_curvature([x * x - y * y, -2.0 * x * y], [2.0 * x, -2.0 * y, -2.0 * x])
                };
                inside(mesh, 2, |p| Truth::Known { kappa: exact(p), tolerance: 0.1 })
            },
            check: |outcome| {
                let middle =
                    outcome.mesh.positions().iter().position(|p| p.norm() < 1e-9).expect("on the grid");
                let found = outcome.principal(middle)?;
                ensure(found.kappa_max.abs().max(found.kappa_min.abs()) < 0.05, || format!("{found:?}"))
            },
            ..HardCase::new(
                "monkey_saddle",
                "z = x^3/3 - x y^2: a flat umbilic of index -1/2 amid negative curvature",
                "the closed form within 0.1 of the inverse size; 0 within 0.05 at the flat point",
                || patch(32, 0.0, |x, y| x * x * x / 3.0 - x * y * y),
            )
        },
        HardCase {
            truth: |mesh| inside(mesh, 1, |_| Truth::Known { kappa: [1e-9, 0.5e-9], tolerance: 0.02e-9 }),
            ..HardCase::new(
                "near_flat",
                "curvature 1e-9 and 0.5e-9 of the inverse size, seen from a tilted frame",
                "both within 2 %: they stand out of the rounding by five digits and more",
                || {
                    let (t, s) = (Vec3::new(0.6, 0.0, 0.8), Vec3::new(0.64, 0.6, -0.48));
                    let n = t.cross(&s);
                    let flat = patch(16, 0.2, |x, y| -0.5e-9 * x * x - 0.25e-9 * y * y);
                    moved(&flat, |p| t * p.x + s * p.y + n * p.z)
                },
            )
        },
    ]
}

fn meshings() -> Vec<HardCase> {
    vec![
        HardCase {
            truth: |mesh| unit_sphere(mesh, 0.1),
            check: |outcome| outcome.statuses(|_| Status::Ok),
            ..HardCase::new(
                "valence_3",
                "a sphere, every third triangle cut in three: a third of its vertices have three neighbours",
                "1 and 1 within 10 %",
                || {
                    let coarse = shapes::icosphere(1.0, 3);
                    let (mut positions, mut triangles) = (coarse.positions().to_vec(), Vec::new());
                    for (t, &[a, b, c]) in coarse.triangles().iter().enumerate() {
                        if t % 3 != 0 {
                            triangles.push([a, b, c]);
                            continue;
                        }
                        let middle = index(positions.len());
                        positions.push(coarse.corners(t).iter().sum::<Vec3>().normalize());
                        triangles.extend([[a, b, middle], [b, c, middle], [c, a, middle]]);
                    }
                    mesh(positions, triangles)
                },
            )
        },
        HardCase {
            truth: |mesh| {
                inside(mesh, 0, |p| {
                    if p.x.hypot(p.y) < 0.15 {
                        Truth::Known { kappa: [1.0; 2], tolerance: 0.1 }
                    } else {
                        Truth::Honest { kappa: [1.0; 2], tolerance: 0.1 }
                    }
                })
            },
            exempt: NO_ERROR_ESTIMATE,
            ..HardCase::new(
                "valence_500",
                "a pole with 500 neighbours on a unit sphere, and triangles of aspect 80 around it",
                "1 and 1 within 10 % at the pole and its neighbours; farther out, where a ring is 80 times longer than wide, the same or an error that admits it",
                || disc(500, &[0.1, 0.2, 0.3, 0.4], on_unit_sphere),
            )
        },
        HardCase {
            truth: |mesh| inside(mesh, 0, |_| Truth::Known { kappa: [1.0; 2], tolerance: 0.1 }),
            ..HardCase::new(
                "graded_edges",
                "edge lengths from 5e-6 to 0.5 (1 : 1e5) towards the pole of a unit sphere",
                "1 and 1 within 10 % at every grade",
                || {
                    let radii: Vec<f64> =
                        (0..=35).map(|i| 1e-5 * 1e5_f64.powf(f64::from(i) / 35.0)).collect();
                    disc(16, &radii, on_unit_sphere)
                },
            )
        },
        HardCase {
            truth: |mesh| unit_sphere(mesh, 0.1),
            ..HardCase::new(
                "needle_triangles",
                "a sphere with a vertex a millionth of an edge beside a corner in every seventh triangle",
                "1 and 1 within 10 %, at the twin vertices too",
                sphere_with_needles,
            )
        },
        HardCase {
            truth: |mesh| inside(mesh, 0, |_| Truth::Honest { kappa: [1.0, 0.0], tolerance: 0.1 }),
            exempt: NO_ERROR_ESTIMATE,
            ..HardCase::new(
                "needle_cylinder",
                "a cylinder of needles only: rings 0.13 wide around, 1.3e-7 apart (aspect 1e6)",
                "1 and 0 within 10 %, or a flag, or an error estimate that admits it: the mesh has no width to measure across",
                || {
                    shapes::grid(48, 12, [shapes::Ends::Closed, shapes::Ends::Open], |u, v| {
                        let a = std::f64::consts::TAU * u;
                        Vec3::new(a.sin(), 12.0 * 1.3e-7 * (v - 0.5), a.cos())
                    })
                },
            )
        },
        HardCase {
            truth: |mesh| {
                inside(mesh, 0, |p| Truth::Known {
                    kappa: graph_curvature([-p.x, 0.0], [-1.0, 0.0, 0.0]),
                    tolerance: 0.1,
                })
            },
            check: no_width_lost,
            ..HardCase::new(
                "zero_area_triangles",
                "a parabolic cylinder with vertices on the edges of their neighbours, zero-area triangles in between, and triangles that name a vertex twice",
                "the closed form within 0.1 of the inverse radius; a triangle without area is no hole and no crease",
                with_zero_area_triangles,
            )
        },
    ]
}

/// A point of the unit sphere through the origin with the outward normal +z there, by arc length from it.
pub(super) fn on_unit_sphere(arc: f64, angle: f64) -> Vec3 {
    // 1 - cos without cancellation: the finest rings of a graded mesh have heights of 5e-11.
    let drop = 2.0 * (0.5 * arc).sin().powi(2);
    Vec3::new(arc.sin() * angle.cos(), arc.sin() * angle.sin(), -drop)
}

fn sphere_with_needles() -> Mesh {
    let coarse = shapes::icosphere(1.0, 3);
    let (mut positions, mut triangles) = (coarse.positions().to_vec(), Vec::new());
    for (t, &[a, b, c]) in coarse.triangles().iter().enumerate() {
        if t % 7 != 0 {
            triangles.push([a, b, c]);
            continue;
        }
        let [pa, pb, pc] = coarse.corners(t);
        let beside = index(positions.len());
        positions.push((pa + 1e-6 * (0.5 * (pb + pc) - pa)).normalize());
        triangles.extend([[a, b, beside], [b, c, beside], [c, a, beside]]);
    }
    mesh(positions, triangles)
}

/// A regular grid on `z = -x^2 / 2`; every fifth inner edge along the straight y is split on one side only.
fn with_zero_area_triangles() -> Mesh {
    let n = 20;
    let base = patch(n, 0.0, |x, _| -0.5 * x * x);
    let (mut positions, mut triangles) = (base.positions().to_vec(), Vec::new());
    for (t, &[a, b, c]) in base.triangles().iter().enumerate() {
        // The second triangle of a quad is [corner, opposite corner, above the corner]; its last side runs down y.
        if t % 10 != 1 || base.positions()[a as usize].x.abs() > 0.99 {
            triangles.push([a, b, c]);
            continue;
        }
        let middle = index(positions.len());
        positions.push(0.5 * (positions[a as usize] + positions[c as usize]));
        triangles.extend([[a, b, middle], [middle, b, c], [a, middle, c]]);
    }
    for k in (5..300).step_by(42) {
        triangles.extend([[k, k, k + 1], [k, k, k]]);
    }
    with_triangles(&mesh(positions, base.triangles().to_vec()), triangles)
}

/// Inner vertices have neighbours on all sides.
fn no_width_lost(outcome: &Outcome<'_>) -> Result<(), String> {
    let inner = |p: &Vec3| p.x.abs() < 0.99 && p.y.abs() < 0.99;
    let positions = outcome.mesh.positions();
    let lost =
        (0..positions.len()).find(|&v| inner(&positions[v]) && outcome.estimates[v].status != Status::Ok);
    ensure(lost.is_none(), || format!("vertex {lost:?} is inside and not ok"))
}

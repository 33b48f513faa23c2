//! Creases, tips, rims, steps and sheets: where a surface is not smooth, or another one is near.

use osculate_geom::curvature::{Principal, Status};
use osculate_geom::{Mesh, Vec3, shapes};

use super::meshes::{
    cut, disc, edges_from, graph_curvature, joined, moved, on_boundary, patch, revolution, steps,
};
use super::smooth::{inside, unit_sphere};
use super::{HardCase, NO_ERROR_ESTIMATE, Truth, ensure};

/// Edges from a feature at which no default neighbourhood sees it any more.
pub(super) const OUT_OF_REACH: u32 = 8;

/// A truth where no seed is within reach, off the boundary, and nothing elsewhere.
pub(super) fn away(mesh: &Mesh, seed: impl Fn(&Vec3) -> bool, truth: impl Fn(&Vec3) -> Truth) -> Vec<Truth> {
    let positions = mesh.positions();
    let distance = edges_from(mesh, |v| seed(&positions[v]));
    let boundary = on_boundary(mesh);
    let known = |v: usize| distance[v] > OUT_OF_REACH && !boundary[v];
    (0..positions.len()).map(|v| if known(v) { truth(&positions[v]) } else { Truth::Free }).collect()
}

pub(super) fn cases() -> Vec<HardCase> {
    [creases(), rims(), near_misses()].concat()
}

fn creases() -> Vec<HardCase> {
    vec![
        HardCase {
            truth: |mesh| {
                // kappa_max of z = -r is sin(45 degrees) / r.
                let exact = |p: &Vec3| [0.5_f64.sqrt() / p.x.hypot(p.y), 0.0];
                away(
                    mesh,
                    |p| p.norm() == 0.0,
                    |p| Truth::Known { kappa: exact(p), tolerance: 0.1 * exact(p)[0] },
                )
            },
            check: |outcome| {
                let tip = &outcome.estimates[0];
                // The curvature there is infinite; one over the edge length is what an edge-long smoothing would give.
                ensure(tip.principal.is_none() || tip.error > 0.1 * 24.0, || {
                    format!("the tip claims {tip:?}")
                })
            },
            exempt: NO_ERROR_ESTIMATE,
            ..HardCase::new(
                "cone_tip",
                "a cone of 45 degrees: infinite curvature at one vertex",
                "at the tip no estimate or one whose error admits it (over a tenth of the inverse edge length); the closed form within 10 % farther away than 8 edges",
                || {
                    let radii: Vec<f64> = (1..=24).map(|i| f64::from(i) / 24.0).collect();
                    disc(36, &radii, |r, a| Vec3::new(r * a.cos(), r * a.sin(), -r))
                },
            )
        },
        HardCase {
            truth: |mesh| {
                away(
                    mesh,
                    |p| p.x.hypot(p.y) > 0.999 && p.z.abs() > 2.999,
                    |p| {
                        let (kappa, tolerance) =
                            if p.z.abs() > 2.999 { ([0.0; 2], 1e-9) } else { ([1.0, 0.0], 0.05) };
                        Truth::Known { kappa, tolerance }
                    },
                )
            },
            check: |outcome| {
                let rim = |p: &Vec3| p.x.hypot(p.y) > 0.999 && p.z.abs() > 2.999;
                for (p, e) in std::iter::zip(outcome.mesh.positions(), &outcome.estimates) {
                    let of_side = |p: Principal| (p.kappa_max - 1.0).abs() < 0.05 && p.kappa_min.abs() < 0.05;
                    let right = match e.status {
                        Status::Crease => e.principal.is_some_and(of_side) || e.error >= 1.0,
                        _ => e.error >= 1.0,
                    };
                    ensure(!rim(p) || right, || format!("a vertex on the rim: {e:?}"))?;
                }
                Ok(())
            },
            exempt: NO_ERROR_ESTIMATE,
            ..HardCase::new(
                "capped_cylinder",
                "a cylinder of radius 1 with flat caps: two creases of 90 degrees, two poles of valence 40",
                "1 and 0 on the side, 0 and 0 on the caps, farther than 8 edges from the rims; on the rims the status says so with the side's curvature to 5 %, or the stated error is the inverse radius and more",
                capped_cylinder,
            )
        },
        HardCase {
            truth: |mesh| {
                let on_edge = |p: &Vec3| p.iter().filter(|x| x.abs() == 1.0).count() >= 2;
                away(mesh, on_edge, |_| Truth::Known { kappa: [0.0; 2], tolerance: 1e-9 })
            },
            check: |outcome| {
                for (v, p) in outcome.mesh.positions().iter().enumerate() {
                    let faces = p.iter().filter(|x| x.abs() == 1.0).count();
                    let e = &outcome.estimates[v];
                    let flat = |p: Principal| p.kappa_max.abs().max(p.kappa_min.abs()) < 1e-9;
                    let convex = e.principal.is_none_or(|p| p.kappa_max > 0.0);
                    let right = match e.status {
                        Status::Crease => faces >= 2 && e.principal.is_some_and(flat),
                        status => status == Status::Ok && (faces < 2 || convex),
                    };
                    ensure(right, || format!("vertex {v} on {faces} faces of a cube: {e:?}"))?;
                }
                Ok(())
            },
            ..HardCase::new(
                "cube",
                "flat faces, creases of 90 degrees and corners where three meet; equal positions on each face, to be merged",
                "0 and 0 on the faces farther than 8 edges from a crease; on creases and corners the status says so with 0 and 0, those of one side, or (libigl) kappa_max is positive; nothing is flagged as a boundary",
                cube,
            )
        },
        HardCase {
            truth: |mesh| {
                let exact = |p: &Vec3| graph_curvature([-0.5 * p.x, -0.5 * p.y], [-0.5, 0.0, -0.5]);
                inside(mesh, 3, |p| Truth::Honest { kappa: exact(p), tolerance: 0.5 })
            },
            share: 0.9,
            exempt: NO_ERROR_ESTIMATE,
            ..HardCase::new(
                "stair_steps",
                "a scan of a dome with heights rounded to half an edge length: terraces with vertical error 0.25 of an edge",
                "the dome within its own curvature (0.5), or an error estimate that covers the difference twice over, at 90 % of the vertices",
                || {
                    let step = 0.5 * 2.0 / 40.0;
                    patch(40, 0.0, |x, y| (-0.25 * (x * x + y * y) / step).round() * step)
                },
            )
        },
    ]
}

fn rims() -> Vec<HardCase> {
    vec![
        HardCase {
            truth: |mesh| {
                let boundary = on_boundary(mesh);
                let exact = |p: &Vec3| graph_curvature([-p.x, 0.5 * p.y], [-1.0, 0.0, 0.5]);
                let truth = |(p, rim): (&Vec3, &bool)| {
                    let kappa = exact(p);
                    if *rim {
                        Truth::Honest { kappa, tolerance: 0.2 }
                    } else {
                        Truth::Known { kappa, tolerance: 0.1 }
                    }
                };
                mesh.positions().iter().zip(&boundary).map(truth).collect()
            },
            check: |outcome| {
                let boundary = on_boundary(outcome.mesh);
                outcome.statuses(|v| if boundary[v] { Status::Boundary } else { Status::Ok })
            },
            ..HardCase::new(
                "boundary_and_corners",
                "a square of a saddle: vertices that see half a disc, and corners that see a quarter",
                "inner vertices within 0.1 of the inverse radius; boundary and corner vertices flagged as such, within 0.2 or with an error that admits it",
                || patch(24, 0.2, |x, y| -0.5 * x * x + 0.25 * y * y),
            )
        },
        HardCase {
            truth: |mesh| {
                let boundary = on_boundary(mesh);
                let truth = |&rim: &bool| {
                    if rim {
                        Truth::Honest { kappa: [1.0; 2], tolerance: 0.2 }
                    } else {
                        Truth::Known { kappa: [1.0; 2], tolerance: 0.1 }
                    }
                };
                boundary.iter().map(truth).collect()
            },
            check: |outcome| {
                let boundary = on_boundary(outcome.mesh);
                ensure(boundary.iter().any(|&b| b), || "no hole".to_owned())?;
                outcome.statuses(|v| if boundary[v] { Status::Boundary } else { Status::Ok })
            },
            ..HardCase::new(
                "holes",
                "a sphere with eight holes of some triangles each, as scans have them",
                "1 and 1 within 10 % inside; the rims flagged as boundary, within 20 % or with an error that admits it",
                || {
                    let corner = 1.0 / 3.0_f64.sqrt();
                    cut(&shapes::icosphere(1.0, 3), |[a, b, c]| {
                        ((a + b + c) / 3.0
                            - Vec3::repeat(corner).component_mul(&(a + b + c).map(f64::signum)))
                        .norm()
                            > 0.2
                    })
                },
            )
        },
    ]
}

fn near_misses() -> Vec<HardCase> {
    vec![
        HardCase {
            truth: |mesh| unit_sphere(mesh, 0.05),
            check: |outcome| {
                let alone = outcome.again(&shapes::icosphere(1.0, 3));
                let differs = (0..alone.len()).find(|&v| outcome.estimates[v] != alone[v]);
                ensure(differs.is_none(), || format!("vertex {differs:?} sees the other sphere"))
            },
            ..HardCase::new(
                "self_intersection",
                "two unit spheres through one another, in one mesh",
                "1 and 1 within 5 %, to the bit what either sphere gives alone: only what edges connect counts",
                || {
                    let sphere = shapes::icosphere(1.0, 3);
                    joined(&[&sphere, &moved(&sphere, |p| p + Vec3::new(0.7, 0.1, 0.0))])
                },
            )
        },
        HardCase {
            truth: |mesh| {
                away(mesh, |p| p.x.hypot(p.y) > 0.999, |_| Truth::Known { kappa: [0.0; 2], tolerance: 1e-9 })
            },
            ..HardCase::new(
                "thin_sheet",
                "a coin of thickness 1e-3: the other side is nearer than the next vertex",
                "0 and 0 on both faces, farther than 8 edges from the rim",
                || {
                    let mut profile = vec![[0.0, 5e-4]];
                    profile.extend(steps([0.0, 5e-4], [1.0, 5e-4], 20));
                    profile.extend(steps([1.0, -5e-4], [0.0, -5e-4], 20).collect::<Vec<_>>());
                    revolution(&profile, 40)
                },
            )
        },
    ]
}

fn capped_cylinder() -> Mesh {
    let mut profile = vec![[0.0, 3.0]];
    profile.extend(steps([0.0, 3.0], [1.0, 3.0], 12));
    profile.extend(steps([1.0, 3.0], [1.0, -3.0], 40));
    profile.extend(steps([1.0, -3.0], [0.0, -3.0], 12));
    revolution(&profile, 40)
}

fn cube() -> Mesh {
    // Twelfths, rounded alike on both sides of zero, so that the sides meet to the bit.
    let side = moved(&patch(24, 0.0, |_, _| 1.0), |p| p.map(|x| (12.0 * x).round() / 12.0));
    let turn = |m: fn(&Vec3) -> Vec3| moved(&side, m);
    joined(&[
        &side,
        &turn(|p| Vec3::new(p.z, p.x, p.y)),
        &turn(|p| Vec3::new(p.y, p.z, p.x)),
        &turn(|p| Vec3::new(-p.x, p.y, -p.z)),
        &turn(|p| Vec3::new(-p.z, -p.x, p.y)),
        &turn(|p| Vec3::new(p.y, -p.z, -p.x)),
    ])
}

//! Surfaces that are no manifold, or not oriented, or glued where they should not be.

use osculate_geom::curvature::Status;
use osculate_geom::{Mesh, Vec3, shapes};

use super::meshes::{disc, edges_from, index, joined, mesh, moved, torus_curvature, with_triangles};
use super::smooth::{inside, on_unit_sphere, unit_sphere};
use super::{HardCase, Outcome, Truth, ensure};

pub(super) fn cases() -> Vec<HardCase> {
    [repeated_triangles(), junctions(), orientations(), seams()].concat()
}

/// The vertices that a test finds are flagged non-manifold, all others are ok.
fn flagged(outcome: &Outcome<'_>, bad: impl Fn(usize) -> bool) -> Result<(), String> {
    outcome.statuses(|v| if bad(v) { Status::NonManifold } else { Status::Ok })
}

/// Corners of every tenth triangle.
fn in_tenth_triangle(source: &Mesh) -> Vec<bool> {
    let mut named = vec![false; source.positions().len()];
    source.triangles().iter().take(1280).step_by(10).flatten().for_each(|&v| named[v as usize] = true);
    named
}

fn repeated_triangles() -> Vec<HardCase> {
    fn repeated(again: fn(&[u32; 3]) -> [u32; 3]) -> Mesh {
        let sphere = shapes::icosphere(1.0, 3);
        let mut triangles = sphere.triangles().to_vec();
        triangles.extend(sphere.triangles().iter().step_by(10).map(again));
        with_triangles(&sphere, triangles)
    }
    let case = |name, about, build| HardCase {
        truth: |mesh| unit_sphere(mesh, 0.1),
        check: |outcome| {
            let twice = in_tenth_triangle(outcome.mesh);
            flagged(outcome, |v| twice[v])
        },
        ..HardCase::new(
            name,
            about,
            "1 and 1 within 10 % everywhere; the corners of those triangles flagged non-manifold, no others",
            build,
        )
    };
    vec![
        case("duplicated_triangles", "a sphere with every tenth triangle in the list twice", || {
            repeated(|t| *t)
        }),
        case(
            "reversed_triangles",
            "a sphere with every tenth triangle in the list a second time, the other way round",
            || repeated(|&[a, b, c]| [a, c, b]),
        ),
    ]
}

fn junctions() -> Vec<HardCase> {
    vec![
        HardCase {
            truth: |mesh| {
                let mut truths = inside(mesh, 0, |_| Truth::Known { kappa: [1.0; 2], tolerance: 0.15 });
                truths[0] = Truth::Free;
                truths
            },
            check: |outcome| {
                let status = outcome.estimates[0].status;
                ensure(status == Status::NonManifold, || format!("the common vertex is {status:?}"))
            },
            ..HardCase::new(
                "bow_tie",
                "two unit spheres' caps that share one vertex, where their normals cancel",
                "the common vertex flagged non-manifold; all others as if the other cap were not there, 1 and 1 within 15 %",
                || {
                    let radii: Vec<f64> = (1..=8).map(|i| 0.1 * f64::from(i)).collect();
                    let lower = disc(16, &radii, on_unit_sphere);
                    let upper = moved(&lower, |p| Vec3::new(p.x, -p.y, -p.z));
                    let both = joined(&[&lower, &upper]);
                    let other = index(lower.positions().len());
                    let triangles =
                        both.triangles().iter().map(|t| t.map(|v| if v == other { 0 } else { v }));
                    // The unused copy of the common vertex stays away from both.
                    let triangles = triangles.map(|t| t.map(|v| if v > other { v - 1 } else { v })).collect();
                    let mut positions = both.positions().to_vec();
                    positions.remove(other as usize);
                    mesh(positions, triangles)
                },
            )
        },
        HardCase {
            truth: |mesh| {
                let p = mesh.positions();
                let distance = edges_from(mesh, |v| p[v].x == 0.0 && p[v].z == 0.0);
                let flat = Truth::Known { kappa: [0.0; 2], tolerance: 1e-9 };
                distance
                    .iter()
                    .map(|&d| if d > super::sharp::OUT_OF_REACH { flat } else { Truth::Free })
                    .collect()
            },
            check: |outcome| {
                for (v, p) in outcome.mesh.positions().iter().enumerate() {
                    let (status, at_fold) = (outcome.estimates[v].status, p.x == 0.0 && p.z == 0.0);
                    ensure((status == Status::NonManifold) == at_fold, || {
                        format!("vertex {v} is {status:?}")
                    })?;
                }
                Ok(())
            },
            ..HardCase::new(
                "non_manifold_edge",
                "three flat pages that meet in one line of edges, each with three triangles",
                "the vertices of the line flagged non-manifold, no others; 0 and 0 farther than 8 edges from it",
                || {
                    let page = |degrees: f64| {
                        let (sin, cos) = degrees.to_radians().sin_cos();
                        shapes::grid(14, 12, [shapes::Ends::Open; 2], move |u, v| {
                            Vec3::new(1.4 * u * cos, 1.2 * v, 1.4 * u * sin)
                        })
                    };
                    joined(&[&page(0.0), &page(120.0), &page(240.0)])
                },
            )
        },
    ]
}

fn orientations() -> Vec<HardCase> {
    vec![
        HardCase {
            truth: |mesh| {
                let border = orientation_border(mesh);
                let distance = edges_from(mesh, |v| border[v]);
                let at = |(p, d): (&Vec3, u32)| {
                    let kappa = if p.z > 0.0 { [-1.0; 2] } else { [1.0; 2] };
                    if d > 5 { Truth::Known { kappa, tolerance: 0.1 } } else { Truth::Free }
                };
                mesh.positions().iter().zip(distance).map(at).collect()
            },
            check: |outcome| {
                let border = orientation_border(outcome.mesh);
                flagged(outcome, |v| border[v])
            },
            ..HardCase::new(
                "mixed_orientation",
                "a sphere whose upper half is wound the other way",
                "the vertices between the halves flagged non-manifold, no others; farther than 5 edges from them +1 below and -1 above, within 10 %",
                || {
                    let sphere = shapes::icosphere(1.0, 3);
                    let flipped = (0..sphere.triangles().len()).map(|t| {
                        let [a, b, c] = sphere.triangles()[t];
                        if sphere.corners(t).iter().sum::<Vec3>().z > 0.0 { [a, c, b] } else { [a, b, c] }
                    });
                    with_triangles(&sphere, flipped.collect())
                },
            )
        },
        HardCase {
            check: |outcome| {
                for (v, e) in outcome.estimates.iter().enumerate() {
                    // Columns of nine vertices; the first one is where the band meets itself turned over.
                    let at_seam = v < 9;
                    ensure((e.status == Status::NonManifold) == at_seam, || format!("vertex {v} is {e:?}"))?;
                    let principal = outcome.principal(v)?;
                    // The ruled surface bends by less than twice its inverse radius; the estimate also sees its rim.
                    let largest = principal.kappa_max.abs().max(principal.kappa_min.abs());
                    ensure(at_seam || largest < 6.0, || format!("vertex {v}: {principal:?}"))?;
                }
                Ok(())
            },
            ..HardCase::new(
                "moebius_band",
                "a band with one side: no orientation of its triangles agrees everywhere",
                "an estimate everywhere; the line where the orientation turns over flagged non-manifold, and nothing else",
                moebius_band,
            )
        },
    ]
}

/// Vertices that two neighbouring triangles pass in the same direction.
fn orientation_border(source: &Mesh) -> Vec<bool> {
    let mut sides = std::collections::HashSet::new();
    let mut border = vec![false; source.positions().len()];
    for &[a, b, c] in source.triangles() {
        for side in [(a, b), (b, c), (c, a)] {
            if !sides.insert(side) {
                border[side.0 as usize] = true;
                border[side.1 as usize] = true;
            }
        }
    }
    border
}

fn moebius_band() -> Mesh {
    let (around, across) = (60_usize, 8_usize);
    let point = |i: usize, j: usize| {
        let angle = std::f64::consts::TAU * i as f64 / around as f64;
        let offset = 0.4 * (2.0 * j as f64 / across as f64 - 1.0);
        let radius = 1.0 + offset * (0.5 * angle).cos();
        Vec3::new(radius * angle.cos(), radius * angle.sin(), offset * (0.5 * angle).sin())
    };
    let positions = (0..around).flat_map(|i| (0..=across).map(move |j| point(i, j))).collect();
    let at = |i: usize, j: usize| {
        if i == around { index(across - j) } else { index(i * (across + 1) + j) }
    };
    let mut triangles = Vec::new();
    for i in 0..around {
        for j in 0..across {
            let [a, b, c, d] = [at(i, j), at(i + 1, j), at(i + 1, j + 1), at(i, j + 1)];
            triangles.extend([[a, b, c], [a, c, d]]);
        }
    }
    mesh(positions, triangles)
}

fn seams() -> Vec<HardCase> {
    vec![
        HardCase {
            truth: |mesh| unit_sphere(mesh, 0.05),
            check: |outcome| outcome.statuses(|_| Status::Ok),
            ..HardCase::new(
                "unmerged_triangles",
                "a sphere as STL has it: every triangle with three vertices of its own",
                "as on the sphere with shared vertices: 1 and 1 within 5 %, nothing flagged as a boundary",
                || {
                    let sphere = shapes::icosphere(1.0, 3);
                    let corners: Vec<Vec3> = (0..1280).flat_map(|t| sphere.corners(t)).collect();
                    mesh(corners, (0..1280).map(|t| [3 * t, 3 * t + 1, 3 * t + 2]).collect())
                },
            )
        },
        HardCase {
            truth: |mesh| {
                mesh.positions()
                    .iter()
                    .map(|p| Truth::Known { kappa: torus_curvature(p), tolerance: 0.12 * 2.5 })
                    .collect()
            },
            check: |outcome| {
                let closed = shapes::torus(1.0, 0.4, 48, 20);
                let expected = outcome.again(&closed);
                for row in 0..=20 {
                    for column in 0..=48 {
                        let (copy, original) = (row * 49 + column, row % 20 * 48 + column % 48);
                        ensure(outcome.estimates[copy] == expected[original], || {
                            format!(
                                "row {row}, column {column} of the torus with a seam differs from the closed one"
                            )
                        })?;
                    }
                }
                Ok(())
            },
            ..HardCase::new(
                "uv_seam",
                "a torus cut open along two circles, so that it has UVs: vertices on the cuts are there twice, one four times",
                "the same bits as on the closed torus, equal on all copies of a vertex",
                || shapes::torus_with_uv(1.0, 0.4, 48, 20),
            )
        },
        HardCase {
            check: |outcome| {
                let merged = outcome.again(&bowl(false));
                let first = (0..merged.len()).find(|&v| outcome.estimates[v] != merged[v]);
                ensure(first.is_none(), || format!("normals in the file change vertex {first:?}"))?;
                let boundary = outcome.estimates.iter().position(|e| e.status == Status::Boundary);
                ensure(boundary.is_none(), || format!("vertex {boundary:?} is no boundary"))
            },
            ..HardCase::new(
                "normal_seam",
                "a closed bowl with two sets of vertices along its rim, each with the normals of its own side",
                "the same bits as without normals in the file, equal on both copies; no boundary along the rim",
                || bowl(true),
            )
        },
    ]
}

/// A dome over a flat disc; the rim is in the list twice.
fn bowl(normals: bool) -> Mesh {
    let radii: Vec<f64> = (1..=10).map(|i| 0.1 * f64::from(i)).collect();
    let dome = disc(32, &radii, |r, a| Vec3::new(r * a.cos(), r * a.sin(), 0.5 * (1.0 - r * r)));
    let floor = disc(32, &radii, |r, a| Vec3::new(r * a.cos(), -r * a.sin(), 0.0));
    // The floor runs the other way around; its rim takes the dome's very points.
    let rim: Vec<Vec3> = dome.positions().to_vec();
    let first = rim.len() - 32;
    let mut k = 0;
    let floor = moved(&floor, |p| {
        k += 1;
        if k <= first { *p } else { rim[first + (32 - (k - 1 - first)) % 32] }
    });
    let bowl = joined(&[&dome, &floor]);
    if !normals {
        return bowl;
    }
    let up = dome.positions().iter().map(|p| Vec3::new(p.x, p.y, 1.0).normalize());
    let down = floor.positions().iter().map(|_| -Vec3::z());
    let normals = up.chain(down).collect();
    bowl.with_normals(normals).expect("one normal a vertex")
}

#[cfg(test)]
mod tests {
    use super::*;
    use osculate_geom::mesh::{Surface, Topology, Weld};

    #[test]
    fn the_bowl_is_closed_once_merged() {
        let bowl = bowl(true);
        let surface = Surface::new(&bowl, Weld::Exact);
        let topology = Topology::new(surface.triangles());
        assert_eq!((topology.boundary_edges, topology.inconsistent_edges), (0, 0));
        assert_eq!(surface.merged_vertices(), 32);
    }
}

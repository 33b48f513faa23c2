//! Rays where geometry is degenerate: along the normal, in the surface, through vertices and along edges.

use osculate_geom::curvature::{CurvatureOptions, estimate};
use osculate_geom::field::{CurvatureField, Stop, SurfacePoint};
use osculate_geom::mesh::{Surface, Weld};
use osculate_geom::rays::{Bvh, Ray, to_f32};
use osculate_geom::{Mesh, Vec3, shapes};

use super::{OtherCase, ensure};

pub(super) fn cases() -> Vec<OtherCase> {
    vec![
        OtherCase {
            name: "ray_at_exactly_normal_incidence",
            what: "a viewer straight above a cylinder's vertex: the ray has no tangent direction",
            expect: "the mean curvature, reached without a jump as the ray turns into the normal; no walk along the surface",
            check: normal_incidence,
        },
        OtherCase {
            name: "ray_at_grazing_1e_8",
            what: "a ray 1e-8 off the surface, along the curvature field and through the acceleration structure",
            expect: "Euler's curvature of its tangent direction, to 1e-7 of kappa_max; the hit where the ray meets the plane, and no second one on leaving it",
            check: grazing,
        },
        OtherCase {
            name: "rays_through_vertices_and_edges",
            what: "rays out of a closed mesh through each of its vertices and edge middles",
            expect: "a hit for every ray, at a point on that vertex or edge to 1e-5 of the radius",
            check: through_vertices_and_edges,
        },
        OtherCase {
            name: "rays_along_edges",
            what: "sections of the surface that start at a vertex and run along mesh edges, through vertex after vertex",
            expect: "the walk goes its whole length or to the boundary, and finds the cylinder's zero along its axis",
            check: along_edges,
        },
        OtherCase {
            name: "rays_in_the_plane_of_triangles",
            what: "rays in a flat mesh's own plane, along its edges and through its vertices",
            expect: "no hit, or one with finite distance and weights in [0, 1]: no panic and no NaN",
            check: in_plane,
        },
    ]
}

/// The unit cylinder around y on a grid whose edges run along its axis, and its field.
fn with_cylinder(run: impl FnOnce(&Mesh, &CurvatureField<'_>) -> Result<(), String>) -> Result<(), String> {
    let mesh = shapes::cylinder(1.0, 2.0, 48, 12);
    let surface = Surface::new(&mesh, Weld::Exact);
    let curvature = estimate(&surface, &CurvatureOptions::default()).expect("the defaults are valid");
    run(&mesh, &CurvatureField::new(surface.clone(), curvature))
}

/// A vertex half-way up, as a point of the triangle that starts there.
fn middle(mesh: &Mesh) -> (SurfacePoint, Vec3) {
    let vertex = 6 * 48;
    let triangle =
        mesh.triangles().iter().position(|t| t[0] == vertex).expect("an inner vertex starts a triangle");
    let p = mesh.positions()[vertex as usize];
    (SurfacePoint { triangle, barycentric: [1.0, 0.0, 0.0] }, Vec3::new(p.x, 0.0, p.z).normalize())
}

fn normal_incidence() -> Result<(), String> {
    with_cylinder(|mesh, field| {
        let (point, _) = middle(mesh);
        // The fitted surface's own normal, to the bit: the eigenvector of the tensor that it has no part of.
        let tensor = field.tensor(point).ok_or("no tensor")?;
        let eigen = tensor.symmetric_eigen();
        let largest = eigen.eigenvalues.iamax();
        let across = eigen.eigenvectors.column(largest).into_owned();
        let normal = across.cross(&Vec3::y()).normalize();
        let mean = 0.5 * tensor.trace();
        let at = field.kappa_along(point, normal).ok_or("no curvature along the normal")?;
        ensure((at - mean).abs() < 1e-9, || format!("{at} instead of the mean {mean}"))?;
        for exponent in -300..=-3 {
            let w = (normal + across * 10.0_f64.powi(exponent)).normalize();
            let near = field.kappa_along(point, w).ok_or("no curvature near the normal")?;
            // The blend reaches over a sine of 0.02 and is quadratic: at 1e-3 it has moved by 0.0025 of the difference.
            ensure((near - mean).abs() < 0.01, || format!("{near} at 1e{exponent} from the normal"))?;
        }
        let march = field.minimum_past(point, normal, 1.0).ok_or("no walk")?;
        ensure(march.kappa.is_finite() && march.length <= 1.0, || format!("{march:?}"))
    })
}

fn grazing() -> Result<(), String> {
    with_cylinder(|mesh, field| {
        let (point, normal) = middle(mesh);
        let tensor = field.tensor(point).ok_or("no tensor")?;
        for degrees in [0.0_f64, 30.0, 45.0, 90.0] {
            let (sin, cos) = degrees.to_radians().sin_cos();
            let tangent = Vec3::y() * sin + normal.cross(&Vec3::y()) * cos;
            let euler = (tangent.transpose() * tensor * tangent)[0];
            let found = field.kappa_along(point, tangent + normal * 1e-8).ok_or("no curvature")?;
            ensure((found - euler).abs() < 1e-7, || {
                format!("{found} instead of {euler} at {degrees} degrees")
            })?;
        }
        Ok(())
    })?;
    let plane = Bvh::from_mesh(&shapes::plane(8, 8));
    let ray = Ray::new(glam::Vec3::new(-0.5, 0.3, 1e-8), glam::Vec3::new(1.0, 0.0, -1e-8));
    let hit = plane.closest_hit(&ray).ok_or("a ray at 1e-8 misses the plane")?;
    // The plane is met at t = 1, and the quotient of two roundings of 1e-8 is good to a few of single precision.
    ensure((hit.t - 1.0).abs() < 1e-6, || format!("{hit:?}"))?;
    let off = glam::Vec3::new(1.0, 0.0, 1e-8);
    let again = Ray::new(plane.surface_point(&hit).origin_towards(off), off);
    ensure(!plane.any_hit(&again), || format!("{again:?} hits the plane that it leaves"))
}

fn through_vertices_and_edges() -> Result<(), String> {
    let mesh = shapes::icosphere(1.0, 3);
    let bvh = Bvh::from_mesh(&mesh);
    let p = mesh.positions();
    let edges = mesh.triangles().iter().flat_map(|&[a, b, c]| [(a, b), (b, c), (c, a)]);
    let middles = edges.map(|(a, b)| 0.5 * (p[a as usize] + p[b as usize]));
    let targets: Vec<Vec3> = p.iter().copied().chain(middles).collect();
    for origin in [Vec3::zeros(), Vec3::new(0.3, -0.2, 0.1), Vec3::new(0.0, 0.5, 0.0)] {
        for target in &targets {
            let ray = Ray::new(to_f32(&origin), to_f32(target) - to_f32(&origin));
            let hit = bvh.closest_hit(&ray).ok_or_else(|| format!("{ray:?} leaks through {target:?}"))?;
            let off = (ray.at(hit.t) - to_f32(target)).length();
            ensure(off < 1e-5, || format!("{ray:?} hits {off:e} beside {target:?}"))?;
            ensure(bvh.any_hit(&ray), || format!("any_hit denies {ray:?}"))?;
        }
    }
    Ok(())
}

fn along_edges() -> Result<(), String> {
    with_cylinder(|mesh, field| {
        let (point, normal) = middle(mesh);
        for (up, reach) in [(1.0, 0.7), (-1.0, 0.7)] {
            // Seen from a grazing viewer, so that the section runs along the axis through vertex after vertex.
            let w = (Vec3::y() * up + normal * 0.1).normalize();
            let march = field.minimum_past(point, w, reach).ok_or("no walk along the axis")?;
            ensure(march.stop == Stop::Length && (march.length - reach).abs() < 1e-12, || {
                format!("{march:?}")
            })?;
            ensure(march.kappa.abs() < 0.02, || format!("the axis is straight: {march:?}"))?;
            let out = field.minimum_past(point, w, 10.0).ok_or("no walk to the rim")?;
            ensure(out.stop == Stop::Boundary && (out.length - 1.0).abs() < 1e-9, || format!("{out:?}"))?;
        }
        let around = (normal.cross(&Vec3::y()) + normal * 0.1).normalize();
        let march = field.minimum_past(point, around, 2.0).ok_or("no walk around")?;
        ensure((march.kappa - 1.0).abs() < 0.02 && march.stop == Stop::Length, || format!("{march:?}"))
    })
}

fn in_plane() -> Result<(), String> {
    let bvh = Bvh::from_mesh(&shapes::plane(8, 8));
    for k in -1_i16..=9 {
        let along = f32::from(k) / 8.0;
        let through = glam::Vec3::new(along, along, 0.0);
        let directions =
            [glam::Vec3::X, glam::Vec3::Y, glam::Vec3::new(1.0, 1.0, 0.0), glam::Vec3::new(1.0, -1.0, 0.0)];
        for direction in directions {
            let ray = Ray::new(through - 2.0 * direction, direction);
            let Some(hit) = bvh.closest_hit(&ray) else { continue };
            let sound = hit.t.is_finite() && hit.barycentrics.iter().all(|w| (0.0..=1.0).contains(w));
            ensure(sound, || format!("{ray:?}: {hit:?}"))?;
        }
    }
    Ok(())
}

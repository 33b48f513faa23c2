//! Parametric surfaces with UVs and outward normals, for tests, studies and scenes.

pub mod study;

use std::collections::HashMap;
use std::f64::consts::{PI, TAU};

use crate::mesh::index_u32;
use crate::{Mesh, Vec3};

/// Whether a parameter direction closes on itself.
#[derive(Debug, Clone, Copy, PartialEq, Eq)]
pub enum Ends {
    /// The last row of vertices is the first one again.
    Closed,
    /// The surface has a boundary there.
    Open,
}

/// A grid of `nu` by `nv` quads over `(u, v)` in the unit square, each cut along the same diagonal, so that inner vertices have valence 6.
///
/// `point(u, v)` must turn counter-clockwise around the outward normal. Closed directions share their vertices; such a
/// grid has no UVs. An open one has `(u, v)` as its UV set.
///
/// # Panics
///
/// If `nu` or `nv` is below 3 in a closed or 1 in an open direction, or `point` returns something not finite.
#[must_use]
pub fn grid(nu: usize, nv: usize, ends: [Ends; 2], point: impl Fn(f64, f64) -> Vec3) -> Mesh {
    let rows = [(nu, ends[0]), (nv, ends[1])].map(|(n, end)| {
        assert!(n >= if end == Ends::Closed { 3 } else { 1 }, "{n} quads are too few");
        n + usize::from(end == Ends::Open)
    });
    let uv = |i: usize, j: usize| [i as f64 / nu as f64, j as f64 / nv as f64];
    let parameters: Vec<[f64; 2]> = (0..rows[1]).flat_map(|j| (0..rows[0]).map(move |i| uv(i, j))).collect();
    let positions = parameters.iter().map(|&[u, v]| point(u, v)).collect();
    let index = |i: usize, j: usize| index_u32((j % rows[1]) * rows[0] + i % rows[0]);
    let mut triangles = Vec::with_capacity(2 * nu * nv);
    for j in 0..nv {
        for i in 0..nu {
            let [a, b, c, d] = [index(i, j), index(i + 1, j), index(i + 1, j + 1), index(i, j + 1)];
            triangles.extend([[a, b, c], [a, c, d]]);
        }
    }
    let mesh = Mesh::new(positions, triangles).expect("a grid of finite points is a mesh");
    if ends == [Ends::Open; 2] { mesh.with_uv_set(parameters).expect("one UV a vertex") } else { mesh }
}

/// The unit square in the plane `z = 0`, normal `+z`.
#[must_use]
pub fn plane(nu: usize, nv: usize) -> Mesh {
    grid(nu, nv, [Ends::Open; 2], |u, v| Vec3::new(u, v, 0.0))
}

/// A torus around the y axis: tube radius `minor` around a circle of radius `major`.
#[must_use]
pub fn torus(major: f64, minor: f64, nu: usize, nv: usize) -> Mesh {
    grid(nu, nv, [Ends::Closed; 2], torus_point(major, minor))
}

/// The same torus cut open along two circles, so that it has UVs: `u` around the axis, `v` around the tube.
#[must_use]
pub fn torus_with_uv(major: f64, minor: f64, nu: usize, nv: usize) -> Mesh {
    // The last row must have the first one's coordinates to the bit, or the seam does not weld.
    let point = torus_point(major, minor);
    grid(nu, nv, [Ends::Open; 2], |u, v| point(u.fract(), v.fract()))
}

fn torus_point(major: f64, minor: f64) -> impl Fn(f64, f64) -> Vec3 {
    move |u, v| {
        let (a, b) = (u * TAU, v * TAU);
        let radius = major + minor * b.cos();
        Vec3::new(radius * a.sin(), minor * b.sin(), radius * a.cos())
    }
}

/// An open cylinder around the y axis, from `y = -height / 2` to `height / 2`.
#[must_use]
pub fn cylinder(radius: f64, height: f64, nu: usize, nv: usize) -> Mesh {
    grid(nu, nv, [Ends::Closed, Ends::Open], |u, v| {
        let a = u * TAU;
        Vec3::new(radius * a.sin(), height * (v - 0.5), radius * a.cos())
    })
}

/// The saddle `z = x y` over `[-1/2, 1/2]^2`, normal towards `+z`.
#[must_use]
pub fn saddle(nu: usize, nv: usize) -> Mesh {
    grid(nu, nv, [Ends::Open; 2], |u, v| {
        let (x, y) = (u - 0.5, v - 0.5);
        Vec3::new(x, y, x * y)
    })
}

/// A sphere of `20 4^levels` triangles, subdivided from an icosahedron.
#[must_use]
pub fn icosphere(radius: f64, levels: u32) -> Mesh {
    let (mut positions, mut triangles) = icosahedron();
    for _ in 0..levels {
        let mut middles: HashMap<(u32, u32), u32> = HashMap::new();
        let mut next = Vec::with_capacity(4 * triangles.len());
        for [a, b, c] in triangles {
            let [ab, bc, ca] = [(a, b), (b, c), (c, a)].map(|(i, j)| {
                *middles.entry((i.min(j), i.max(j))).or_insert_with(|| {
                    positions.push((positions[i as usize] + positions[j as usize]).normalize());
                    index_u32(positions.len() - 1)
                })
            });
            next.extend([[a, ab, ca], [b, bc, ab], [c, ca, bc], [ab, bc, ca]]);
        }
        triangles = next;
    }
    let positions = positions.into_iter().map(|p| p * radius).collect();
    Mesh::new(positions, triangles).expect("a sphere is a mesh")
}

/// An ellipsoid with half-axes `axes` along x, y and z, from an icosphere.
#[must_use]
pub fn ellipsoid(axes: Vec3, levels: u32) -> Mesh {
    let sphere = icosphere(1.0, levels);
    let positions = sphere.positions().iter().map(|p| p.component_mul(&axes)).collect();
    Mesh::new(positions, sphere.triangles().to_vec()).expect("an ellipsoid is a mesh")
}

fn icosahedron() -> (Vec<Vec3>, Vec<[u32; 3]>) {
    // Two poles and two staggered rings of five at latitude atan(1/2).
    let ring = |sign: f64, i: u32| {
        let a = PI / 5.0 * (2.0 * f64::from(i) + if sign > 0.0 { 0.0 } else { 1.0 });
        Vec3::new(2.0 * a.sin(), sign, 2.0 * a.cos()) / 5.0_f64.sqrt()
    };
    let mut positions = vec![Vec3::y(), -Vec3::y()];
    positions.extend((0..5).map(|i| ring(1.0, i)));
    positions.extend((0..5).map(|i| ring(-1.0, i)));
    let mut triangles = Vec::new();
    for i in 0..5 {
        let (up, up_next) = (2 + i, 2 + (i + 1) % 5);
        let (down, down_next) = (7 + i, 7 + (i + 1) % 5);
        triangles.extend([
            [0, up, up_next],
            [up, down, up_next],
            [down, down_next, up_next],
            [1, down_next, down],
        ]);
    }
    (positions, triangles)
}

#[cfg(test)]
mod tests {
    use super::*;
    use crate::mesh::{Orientation, Topology};

    /// Six times the enclosed volume.
    fn volume6(mesh: &Mesh) -> f64 {
        (0..mesh.triangles().len())
            .map(|t| {
                let [a, b, c] = mesh.corners(t);
                a.dot(&b.cross(&c))
            })
            .sum()
    }

    #[test]
    fn closed_shapes_are_closed_and_face_outwards() {
        let torus = 6.0 * 2.0 * PI * PI * 0.16;
        for (mesh, volume, euler) in [
            (icosphere(1.0, 3), 8.0 * PI, 2),
            (ellipsoid(Vec3::new(1.0, 2.0, 0.5), 3), 8.0 * PI, 2),
            (super::torus(1.0, 0.4, 80, 40), torus, 0),
        ] {
            let topology = Topology::new(mesh.triangles());
            assert_eq!((topology.boundary_edges, topology.non_manifold_edges), (0, 0));
            assert_eq!(topology.orientation(), Orientation::Consistent);
            let count = |n: usize| i64::try_from(n).unwrap();
            assert_eq!(
                count(mesh.positions().len()) - count(topology.edges) + count(mesh.triangles().len()),
                euler
            );
            // Inscribed, so below by the square of the edge length.
            let ratio = volume6(&mesh) / volume;
            assert!((0.96..1.0).contains(&ratio), "{ratio}");
        }
    }

    #[test]
    fn torus_with_uv_welds_to_the_closed_one() {
        let mesh = torus_with_uv(1.0, 0.45, 24, 12);
        let surface = crate::mesh::Surface::new(&mesh, crate::mesh::Weld::Exact);
        assert_eq!(surface.positions().len(), 24 * 12);
        assert_eq!(Topology::new(surface.triangles()).boundary_edges, 0);
    }
}

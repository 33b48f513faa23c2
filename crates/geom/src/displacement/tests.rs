//! Displaced meshes against closed forms and against the heights that they stand for.

use std::f64::consts::{PI, TAU};

use super::*;
use crate::mesh::{Orientation, Surface, Topology, Weld};
use crate::{Mesh, Vec3, shapes};

/// A tile of `n` by `n` quads with these heights at their corners; the first corner lies off the lattice's origin.
fn tile(n: u32, z: impl Fn(f64, f64) -> f64) -> HeightTile {
    let at = |i: u32| (f64::from(i) + 0.5) / f64::from(n);
    let points: Vec<[f64; 2]> = (0..(n + 1) * (n + 1)).map(|i| [at(i % (n + 1)), at(i / (n + 1))]).collect();
    let wrapped = |i: u32| at(i % n);
    let heights: Vec<f64> =
        (0..(n + 1) * (n + 1)).map(|i| z(wrapped(i % (n + 1)), wrapped(i / (n + 1)))).collect();
    let corner = |i: u32, j: u32| j * (n + 1) + i;
    let quads = (0..n * n).map(|i| (i % n, i / n));
    let triangles: Vec<[u32; 3]> = quads
        .flat_map(|(i, j)| {
            let [a, b, c, d] = [corner(i, j), corner(i + 1, j), corner(i + 1, j + 1), corner(i, j + 1)];
            [[a, b, c], [a, c, d]]
        })
        .collect();
    HeightTile::new(&points, &heights, &triangles).expect("a tile")
}

fn waves(u: f64, v: f64) -> f64 {
    -0.1 + 0.05 * (TAU * u).sin() * (TAU * v).cos() + 0.03 * (TAU * (u + 2.0 * v)).sin()
}

/// Six times the enclosed volume, and the area.
fn volume6_and_area(mesh: &Mesh) -> (f64, f64) {
    let sums = (0..mesh.triangles().len()).map(|t| {
        let [a, b, c] = mesh.corners(t);
        (a.dot(&b.cross(&c)), 0.5 * (b - a).cross(&(c - a)).norm())
    });
    sums.fold((0.0, 0.0), |sum, x| (sum.0 + x.0, sum.1 + x.1))
}

/// Asserts that a displaced torus is closed, and returns its Euler characteristic.
fn euler_if_closed(mesh: &Mesh, name: &str) -> i64 {
    let surface = Surface::new(mesh, Weld::Exact);
    let topology = Topology::new(surface.triangles());
    assert_eq!((topology.boundary_edges, topology.non_manifold_edges), (0, 0), "{name}: open");
    assert_eq!(topology.orientation(), Orientation::Consistent, "{name}");
    let count = |n: usize| i64::try_from(n).expect("a count");
    count(surface.positions().len()) - count(topology.edges) + count(mesh.triangles().len())
        - count(topology.degenerate_triangles)
}

fn options(tiles: [f64; 2], tile_size: f64) -> DisplaceOptions {
    DisplaceOptions { tiles, tile_size, ..DisplaceOptions::default() }
}

#[test]
fn a_constant_height_makes_the_smaller_torus() {
    let base = shapes::torus_with_uv(1.0, 0.45, 96, 48);
    let made = displace(&base, &HeightTile::level(-0.3), &options([6.0, 3.0], 0.5)).unwrap();
    assert_eq!(euler_if_closed(&made.mesh, "torus"), 0);
    let (volume6, area) = volume6_and_area(&made.mesh);
    let inner = 0.45 - 0.15;
    let (expected6, expected_area) = (12.0 * PI * PI * inner * inner, 4.0 * PI * PI * inner);
    // The base's facets lie inside by (pi / n)^2 / 2 of its radii: 0.2 % for the tube, and a little for the ring.
    assert!((volume6 / expected6 - 1.0).abs() < 6e-3, "{volume6} {expected6}");
    assert!((area / expected_area - 1.0).abs() < 4e-3, "{area} {expected_area}");
    // Cuts in the middle of facets follow them; at the base's own vertices the distance is exact but for its estimated normals.
    for p in &made.mesh.positions()[..base.positions().len()] {
        let distance = (p.x.hypot(p.z) - 1.0).hypot(p.y);
        assert!((distance - inner).abs() < 2e-4, "{distance}");
    }
    assert!(made.bow > 0.0 && made.bow < 1e-3, "{}", made.bow);
}

#[test]
fn waves_on_a_torus_have_the_volume_under_them() {
    let base = shapes::torus_with_uv(1.0, 0.45, 192, 96);
    let made = displace(&base, &tile(32, waves), &options([6.0, 3.0], 0.4)).unwrap();
    assert_eq!(euler_if_closed(&made.mesh, "waves"), 0);
    // The volume of a tube of radius r(u, v): the integral of (R r^2 / 2 + r^3 cos b / 3) over both angles.
    let n = 600;
    let mut sum = 0.0;
    for i in 0..n {
        for j in 0..n {
            let (u, v) = ((f64::from(i) + 0.5) / f64::from(n), (f64::from(j) + 0.5) / f64::from(n));
            let r = 0.45 + 0.4 * waves(6.0 * u, 3.0 * v);
            sum += r * r / 2.0 + r.powi(3) * (TAU * v).cos() / 3.0;
        }
    }
    let expected6 = 6.0 * sum * (TAU / f64::from(n)).powi(2);
    let (volume6, _) = volume6_and_area(&made.mesh);
    // Of the base's facets 0.05 to 0.07 %, of the tile's linear pieces less.
    assert!((volume6 / expected6 - 1.0).abs() < 1.5e-3, "{volume6} {expected6}");
}

#[test]
fn heights_are_the_tiles_everywhere() {
    let (tile, scale) = (tile(24, waves), 0.5);
    // One quad that the tile is much finer than, and many that are finer than the tile; off the lattice and turned over.
    for (n, tiles) in [(1, [3.0, 2.0]), (57, [1.7, 0.6])] {
        for mirrored in [false, true] {
            let flat = shapes::plane(n, n);
            let uvs = flat.uv_sets()[0].iter().map(|&[u, v]| if mirrored { [0.31 - u, v] } else { [u, v] });
            let base = Mesh::new(flat.positions().to_vec(), flat.triangles().to_vec());
            let base = base.and_then(|m| m.with_uv_set(uvs.collect())).unwrap();
            let made = displace(&base, &tile, &options(tiles, scale)).unwrap();
            let mut area = 0.0;
            for triangle in 0..made.mesh.triangles().len() {
                let [a, b, c] = made.mesh.corners(triangle);
                let doubled = (b - a).cross(&(c - a)).z;
                assert!(doubled > -1e-12, "triangle {triangle} is turned over");
                area += 0.5 * doubled;
                let p = (a + b + c) / 3.0;
                let u = if mirrored { 0.31 - p.x } else { p.x };
                let z = scale * waves(u * tiles[0], p.y * tiles[1]);
                // Linear pieces sqrt(2) / 24 long of a surface that bends by at most 0.05 (2 pi)^2 + 0.03 5 (2 pi)^2 = 7.9:
                // an eighth of the product with the square of the length.
                assert!((p.z - z).abs() < 3.5e-3 * scale, "{n} {mirrored}: {p} for {z}");
            }
            assert!((area - 1.0).abs() < 1e-9, "{area}");
        }
    }
}

#[test]
fn shared_edges_are_watertight_whatever_coincides() {
    // Base edges along the tile's edges and through its vertices (16 quads a tile of 16), between them, and irrational.
    for (nu, nv) in [(96, 48), (48, 24), (12, 6), (91, 37)] {
        let base = shapes::torus_with_uv(1.0, 0.45, nu, nv);
        for n in [1, 3, 16] {
            let made = displace(&base, &tile(n, waves), &options([6.0, 3.0], 0.4)).unwrap();
            assert_eq!(euler_if_closed(&made.mesh, &format!("{nu} x {nv}, {n}")), 0);
        }
    }
}

/// A square with a triangle without UV area between its halves: its corners are on the diagonal, one of them in the middle.
#[test]
fn triangles_without_uv_area_keep_their_edges() {
    let positions: Vec<Vec3> =
        [(0.0, 0.0, 0.0), (1.0, 0.0, 0.0), (1.0, 1.0, 0.0), (0.0, 1.0, 0.0), (0.4, 0.6, 0.0)]
            .map(|(x, y, z)| Vec3::new(x, y, z))
            .into();
    let uvs = vec![[0.0, 0.0], [1.0, 0.0], [1.0, 1.0], [0.0, 1.0], [0.375, 0.375]];
    let triangles = vec![[0, 1, 2], [0, 2, 4], [0, 4, 3], [4, 2, 3]];
    let base = Mesh::new(positions, triangles).and_then(|m| m.with_uv_set(uvs)).unwrap();
    let made = displace(&base, &tile(7, waves), &options([2.0, 2.0], 0.2)).unwrap();
    let surface = Surface::new(&made.mesh, Weld::Exact);
    let topology = Topology::new(surface.triangles());
    assert_eq!(topology.non_manifold_edges, 0);
    // The outline of the square is all that is open.
    for (t, corners) in surface.triangles().iter().enumerate() {
        for side in (0..3).filter(|&side| topology.is_boundary(t, side)) {
            let [p, q] = [corners[side], corners[(side + 1) % 3]].map(|i| surface.positions()[i as usize]);
            let on = |x: f64, y: f64| (x - y).abs() < 1e-9;
            let outline = [0.0, 1.0].iter().any(|&b| on(p.x, b) && on(q.x, b) || on(p.y, b) && on(q.y, b));
            assert!(outline, "open from {p} to {q}");
        }
    }
    // All corners at one point: the triangle stays one.
    let point = Mesh::new(base.positions().to_vec(), vec![[0, 1, 2]]).unwrap();
    let point = point.with_uv_set(vec![[0.3; 2]; 5]).unwrap();
    let made = displace(&point, &tile(7, waves), &options([2.0; 2], 0.2)).unwrap();
    assert_eq!(made.mesh.triangles().len(), 1);
}

#[test]
fn what_cannot_be_displaced_says_why() {
    let tile = tile(8, waves);
    let bare = shapes::torus(1.0, 0.4, 12, 6);
    assert_eq!(displace(&bare, &tile, &DisplaceOptions::default()).unwrap_err(), DisplaceError::NoUv);
    let base = shapes::plane(4, 4);
    let far = displace(&base, &tile, &options([1e9, 1.0], 1.0)).unwrap_err();
    assert!(matches!(far, DisplaceError::TooFar { vertex: 1, .. }), "{far}");
    for (tiles, size) in [([0.0, 1.0], 1.0), ([1.0; 2], f64::NAN)] {
        let refused = displace(&base, &tile, &options(tiles, size)).unwrap_err();
        assert!(matches!(refused, DisplaceError::Size { .. }), "{refused}");
    }
    let few = DisplaceOptions { most_triangles: 1000, ..options([20.0; 2], 1.0) };
    let DisplaceError::TooMany { predicted, limit: 1000 } = displace(&base, &tile, &few).unwrap_err() else {
        panic!("a limit of 1000 triangles is over");
    };
    let made = displace(&base, &tile, &options([20.0; 2], 1.0)).unwrap().mesh.triangles().len();
    // The forecast takes edges to lie in random directions, and these are parallel to each other.
    let ratio = predicted as f64 / made as f64;
    assert!((0.8..1.25).contains(&ratio), "{predicted} {made}");
}

#[test]
fn sources_parts_and_uv_follow_the_base() {
    let base = shapes::plane(3, 3);
    let part = |name: &str, triangles| crate::Part { name: name.into(), triangles, material: None };
    let base = base.with_parts(vec![part("a", 0..5), part("b", 5..18)], Vec::new()).unwrap();
    let made = displace(&base, &tile(5, waves), &options([1.3; 2], 0.2)).unwrap();
    let [a, b] = made.mesh.parts() else { panic!("two parts") };
    for t in 0..made.mesh.triangles().len() {
        let source = made.sources[t] as usize;
        assert_eq!(a.triangles.contains(&t), source < 5);
        assert_eq!(b.triangles.contains(&t), source >= 5);
        // The centre's UV are its place in the plane, and inside the source's.
        let centre = made.mesh.corners(t).iter().sum::<Vec3>() / 3.0;
        let uv = made.mesh.triangles()[t].map(|v| made.mesh.uv_sets()[0][v as usize]);
        let mean = [0, 1].map(|i| (uv[0][i] + uv[1][i] + uv[2][i]) / 3.0);
        assert!((centre.x - mean[0]).abs() + (centre.y - mean[1]).abs() < 1e-6);
        let [p, q, r] = base.corners(source);
        let left = |p: Vec3, q: Vec3| (q - p).cross(&(Vec3::new(centre.x, centre.y, 0.0) - p)).z > -1e-9;
        assert!(left(p, q) && left(q, r) && left(r, p));
    }
}

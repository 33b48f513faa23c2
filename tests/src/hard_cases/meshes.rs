//! Meshes that the hard cases are made of.

use std::collections::VecDeque;
use std::f64::consts::TAU;

use osculate_geom::mesh::{Adjacency, Surface, Topology, Weld};
use osculate_geom::shapes::{self, Ends};
use osculate_geom::{Mesh, Vec3};

/// `SplitMix64` (Steele, Lea, Flood, "Fast Splittable Pseudorandom Number Generators", OOPSLA 2014).
#[derive(Debug)]
pub struct Random(pub u64);

impl Random {
    /// Uniform in `[-1, 1)`.
    pub fn signed(&mut self) -> f64 {
        self.0 = self.0.wrapping_add(0x9E37_79B9_7F4A_7C15);
        let mut z = self.0;
        z = (z ^ (z >> 30)).wrapping_mul(0xBF58_476D_1CE4_E5B9);
        z = (z ^ (z >> 27)).wrapping_mul(0x94D0_49BB_1331_11EB);
        ((z ^ (z >> 31)) >> 11) as f64 / (1_u64 << 52) as f64 - 1.0
    }

    /// Uniform in the cube of half-width one.
    pub fn vector(&mut self) -> Vec3 {
        Vec3::new(self.signed(), self.signed(), self.signed())
    }
}

/// A mesh of data that a generator made.
///
/// # Panics
///
/// If the data is no mesh.
#[must_use]
pub fn mesh(positions: Vec<Vec3>, triangles: Vec<[u32; 3]>) -> Mesh {
    Mesh::new(positions, triangles).expect("generators make valid meshes")
}

/// The 32-bit index of a count.
///
/// # Panics
///
/// If it does not fit.
#[must_use]
pub fn index(count: usize) -> u32 {
    u32::try_from(count).expect("hard cases are small")
}

/// The graph of a height over `[-1, 1]^2`, `n` by `n` quads, normal towards `+z`; inner vertices moved in the plane by up
/// to `jitter` quads.
#[must_use]
pub fn patch(n: usize, jitter: f64, height: impl Fn(f64, f64) -> f64) -> Mesh {
    let random = std::cell::RefCell::new(Random(7));
    shapes::grid(n, n, [Ends::Open; 2], |u, v| {
        let inner = |t: f64| t > 0.0 && t < 1.0;
        let moved = |t: f64| {
            let shift = 2.0 * jitter / n as f64 * random.borrow_mut().signed();
            if inner(u) && inner(v) { 2.0 * t - 1.0 + shift } else { 2.0 * t - 1.0 }
        };
        let (x, y) = (moved(u), moved(v));
        Vec3::new(x, y, height(x, y))
    })
}

/// A disc: vertex 0 in the middle, then one ring of `spokes` vertices a radius; `point(radius, angle)` must turn
/// counter-clockwise around the normal.
#[must_use]
pub fn disc(spokes: usize, radii: &[f64], point: impl Fn(f64, f64) -> Vec3) -> Mesh {
    let angle = |k: usize| TAU * k as f64 / spokes as f64;
    let mut positions = vec![point(0.0, 0.0)];
    positions.extend(
        radii.iter().flat_map(|&r| (0..spokes).map(move |k| (r, k))).map(|(r, k)| point(r, angle(k))),
    );
    let at = |ring: usize, k: usize| index(1 + ring * spokes + k % spokes);
    let mut triangles: Vec<[u32; 3]> = (0..spokes).map(|k| [0, at(0, k), at(0, k + 1)]).collect();
    for ring in 1..radii.len() {
        for k in 0..spokes {
            let [a, b, c, d] = [at(ring - 1, k), at(ring, k), at(ring, k + 1), at(ring - 1, k + 1)];
            triangles.extend([[a, b, c], [a, c, d]]);
        }
    }
    mesh(positions, triangles)
}

/// A closed surface of revolution around z. `profile` lists radius and height from the upper to the lower pole; the first
/// and the last radius are zero, all others positive.
#[must_use]
pub fn revolution(profile: &[[f64; 2]], spokes: usize) -> Mesh {
    let (top, rings, bottom) = (profile[0], &profile[1..profile.len() - 1], profile[profile.len() - 1]);
    let radii: Vec<f64> = (0..rings.len()).map(|ring| ring as f64).collect();
    let ring_of = |row: f64| rings.iter().zip(&radii).find(|(_, r)| **r == row).map_or(top, |(p, _)| *p);
    let upper = disc(spokes, &radii, |row, angle| {
        let [radius, height] = ring_of(row);
        Vec3::new(radius * angle.cos(), radius * angle.sin(), height)
    });
    let mut positions = upper.positions().to_vec();
    positions[0] = Vec3::new(0.0, 0.0, top[1]);
    positions.push(Vec3::new(0.0, 0.0, bottom[1]));
    let (last, pole) = (1 + (rings.len() - 1) * spokes, index(positions.len() - 1));
    let at = |k: usize| index(last + k % spokes);
    let mut triangles = upper.triangles().to_vec();
    triangles.extend((0..spokes).map(|k| [at(k), pole, at(k + 1)]));
    mesh(positions, triangles)
}

/// Points `from..=to` in `n` equal steps, the first left out.
pub fn steps(from: [f64; 2], to: [f64; 2], n: usize) -> impl Iterator<Item = [f64; 2]> {
    (1..=n).map(move |i| {
        let t = i as f64 / n as f64;
        [0, 1].map(|k| if i == n { to[k] } else { from[k] + t * (to[k] - from[k]) })
    })
}

/// The points of a mesh under a map.
#[must_use]
pub fn moved(source: &Mesh, map: impl FnMut(&Vec3) -> Vec3) -> Mesh {
    mesh(source.positions().iter().map(map).collect(), source.triangles().to_vec())
}

/// The points of a mesh with other triangles.
#[must_use]
pub fn with_triangles(source: &Mesh, triangles: Vec<[u32; 3]>) -> Mesh {
    mesh(source.positions().to_vec(), triangles)
}

/// Several meshes as one, in order.
#[must_use]
pub fn joined(parts: &[&Mesh]) -> Mesh {
    let (mut positions, mut triangles) = (Vec::new(), Vec::new());
    for part in parts {
        let first = index(positions.len());
        positions.extend_from_slice(part.positions());
        triangles.extend(part.triangles().iter().map(|t| t.map(|v| v + first)));
    }
    mesh(positions, triangles)
}

/// The triangles that a test keeps, and the vertices that these use.
#[must_use]
pub fn cut(source: &Mesh, keep: impl Fn([Vec3; 3]) -> bool) -> Mesh {
    let kept: Vec<usize> = (0..source.triangles().len()).filter(|&t| keep(source.corners(t))).collect();
    let mut place = vec![u32::MAX; source.positions().len()];
    let mut positions = Vec::new();
    let mut triangles = Vec::new();
    for triangle in kept {
        triangles.push(source.triangles()[triangle].map(|v| {
            let place = &mut place[v as usize];
            if *place == u32::MAX {
                *place = index(positions.len());
                positions.push(source.positions()[v as usize]);
            }
            *place
        }));
    }
    mesh(positions, triangles)
}

/// How many edges every vertex is from the nearest seed, equal positions merged; `u32::MAX` where no walk leads.
#[must_use]
pub fn edges_from(source: &Mesh, seed: impl Fn(usize) -> bool) -> Vec<u32> {
    let surface = Surface::new(source, Weld::Exact);
    let triangles = surface.triangles();
    let incident = Adjacency::triangles_of_vertices(triangles, surface.positions().len());
    let mut distance = vec![u32::MAX; surface.positions().len()];
    let mut queue = VecDeque::new();
    for vertex in (0..source.positions().len()).filter(|&v| seed(v)) {
        let vertex = surface.surface_from_vertex(vertex);
        distance[vertex] = 0;
        queue.push_back(vertex);
    }
    while let Some(vertex) = queue.pop_front() {
        for &next in incident.row(vertex).iter().flat_map(|&t| &triangles[t as usize]) {
            if distance[next as usize] == u32::MAX {
                distance[next as usize] = distance[vertex] + 1;
                queue.push_back(next as usize);
            }
        }
    }
    surface.spread(distance)
}

/// Which vertices lie on an edge with one triangle, equal positions merged.
#[must_use]
pub fn on_boundary(source: &Mesh) -> Vec<bool> {
    let surface = Surface::new(source, Weld::Exact);
    let topology = Topology::new(surface.triangles());
    let mut boundary = vec![false; surface.positions().len()];
    for (index, triangle) in surface.triangles().iter().enumerate() {
        for side in (0..3).filter(|&side| topology.across(index, side).is_none()) {
            boundary[triangle[side] as usize] = true;
            boundary[triangle[(side + 1) % 3] as usize] = true;
        }
    }
    surface.spread(boundary)
}

/// The torus of most laws: radii 1 and 0.4 around y, 1280 vertices, all moved along the surface, so that no symmetry
/// cancels errors.
#[must_use]
pub fn torus() -> Mesh {
    let random = std::cell::RefCell::new(Random(3));
    let (nu, nv) = (64, 20);
    shapes::grid(nu, nv, [Ends::Closed; 2], |u, v| {
        let moved = |t: f64, n: usize| TAU * (t + 0.15 / n as f64 * random.borrow_mut().signed());
        let (a, b) = (moved(u, nu), moved(v, nv));
        let radius = 1.0 + 0.4 * b.cos();
        Vec3::new(radius * a.sin(), 0.4 * b.sin(), radius * a.cos())
    })
}

/// Curvatures of [`torus`] at a point of it.
#[must_use]
pub fn torus_curvature(p: &Vec3) -> [f64; 2] {
    let radius = p.x.hypot(p.z);
    [2.5, (radius - 1.0) / 0.4 / radius]
}

/// Curvatures of a graph with slopes `[x, y]` and second derivatives `[xx, xy, yy]`, the normal towards `+z`, from the
/// fundamental forms; positive where the graph is a hilltop.
#[must_use]
pub fn graph_curvature([p, q]: [f64; 2], [r, s, t]: [f64; 3]) -> [f64; 2] {
    let w2 = 1.0 + p * p + q * q;
    let mean = -((1.0 + q * q) * r - 2.0 * p * q * s + (1.0 + p * p) * t) / (2.0 * w2.powf(1.5));
    let gauss = (r * t - s * s) / (w2 * w2);
    let root = (mean * mean - gauss).max(0.0).sqrt();
    [mean + root, mean - root]
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn random_numbers_fill_the_interval() {
        let mut random = Random(1);
        let values: Vec<f64> = (0..1000).map(|_| random.signed()).collect();
        let mean = values.iter().sum::<f64>() / 1000.0;
        // The standard deviation of the mean is 0.018.
        assert!(mean.abs() < 0.08 && values.iter().all(|v| (-1.0..1.0).contains(v)), "{mean}");
    }

    #[test]
    fn revolutions_are_closed_and_face_outwards() {
        let profile: Vec<[f64; 2]> = [[0.0, 1.0]]
            .into_iter()
            .chain(steps([0.0, 1.0], [1.0, 1.0], 2))
            .chain(steps([1.0, 1.0], [1.0, 0.0], 2))
            .chain(steps([1.0, 0.0], [0.0, 0.0], 2))
            .collect();
        let can = revolution(&profile, 12);
        let topology = Topology::new(can.triangles());
        assert_eq!(
            (topology.boundary_edges, topology.inconsistent_edges, topology.non_manifold_edges),
            (0, 0, 0)
        );
        let volume6: f64 = (0..can.triangles().len())
            .map(|t| {
                let [a, b, c] = can.corners(t);
                a.dot(&b.cross(&c))
            })
            .sum();
        // A prism over a regular dodecagon has volume 3.
        assert!((volume6 / 6.0 - 3.0).abs() < 1e-12, "{volume6}");
    }
}

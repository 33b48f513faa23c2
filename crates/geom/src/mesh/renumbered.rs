//! [`Renumbered`]: a copy of a mesh whose numbering is scattered, in an order that keeps neighbours together.

use rayon::prelude::*;

use super::weld::index_u32;
use crate::Vec3;

/// A mesh whose vertices and triangles are numbered along a curve through space, cell by cell of a grid.
///
/// What looks at the neighbours of one vertex after the other waits for memory at every one of them if the mesh is numbered as hash tables and collapses of edges
/// leave it. 52 bytes a vertex.
#[derive(Debug)]
pub(crate) struct Renumbered {
    pub(crate) positions: Vec<Vec3>,
    pub(crate) triangles: Vec<[u32; 3]>,
    /// For every vertex the one that it is a copy of.
    pub(crate) originals: Vec<u32>,
}

impl Renumbered {
    /// `None` for a mesh that is numbered well enough, or so small that it does not matter.
    ///
    /// The same for any number of threads.
    pub(crate) fn of(positions: &[Vec3], triangles: &[[u32; 3]]) -> Option<Self> {
        /// Vertices that the caches hold, with all that is known of them.
        const LEAST: usize = 1 << 15;
        /// Numbers between neighbours, of all: a third in a random order, the square root of their number row by row.
        const SCATTERED: f64 = 1.0 / 32.0;
        if positions.len() < LEAST {
            return None;
        }
        let (apart, length) = typical_edge(positions, triangles);
        (apart > SCATTERED * positions.len() as f64).then(|| Self::by_cell(positions, triangles, length))
    }

    fn by_cell(positions: &[Vec3], triangles: &[[u32; 3]], edge: f64) -> Self {
        /// Edges along a cell.
        const WIDTH: f64 = 4.0;
        let least = positions.iter().fold(Vec3::repeat(f64::INFINITY), |least, p| least.inf(p));
        let key = |(vertex, p): (usize, &Vec3)| (morton((p - least) / (WIDTH * edge)), index_u32(vertex));
        let mut keys: Vec<(u64, u32)> = positions.par_iter().enumerate().map(key).collect();
        keys.par_sort_unstable();
        let originals: Vec<u32> = keys.into_par_iter().map(|(_, vertex)| vertex).collect();
        let copies = inverse(&originals);
        let mut triangles: Vec<[u32; 3]> =
            triangles.par_iter().map(|triangle| triangle.map(|vertex| copies[vertex as usize])).collect();
        triangles.par_sort_unstable_by_key(|&triangle| (triangle.into_iter().min(), triangle));
        let positions = originals.par_iter().map(|&original| positions[original as usize]).collect();
        Self { positions, triangles, originals }
    }
}

/// Where each number stands in an order of all numbers.
pub(crate) fn inverse(order: &[u32]) -> Vec<u32> {
    let mut places = vec![0; order.len()];
    for (place, &number) in order.iter().enumerate() {
        places[number as usize] = index_u32(place);
    }
    places
}

/// How far the ends of an edge are from each other, in numbers of vertices and in length: the means over a sample.
fn typical_edge(positions: &[Vec3], triangles: &[[u32; 3]]) -> (f64, f64) {
    const SAMPLE: usize = 1 << 10;
    let (mut apart, mut length, mut count) = (0.0, 0.0, 0.0);
    for &[a, b, c] in triangles.iter().step_by(triangles.len().div_ceil(SAMPLE).max(1)) {
        for (from, to) in [(a, b), (b, c), (c, a)] {
            apart += f64::from(from.abs_diff(to));
            length += (positions[from as usize] - positions[to as usize]).norm();
            count += 1.0;
        }
    }
    (apart / f64::max(count, 1.0), length / f64::max(count, 1.0))
}

/// A place on the curve that visits the unit cells of a grid in cubes of cubes; beyond 21 bits a coordinate counts as the largest.
fn morton(place: Vec3) -> u64 {
    const LARGEST: u64 = (1 << 21) - 1;
    // Bits move apart in halves: 10 to either side, then 5, and so on.
    const STEPS: [(u32, u64); 5] = [
        (32, 0x001f_0000_0000_ffff),
        (16, 0x001f_0000_ff00_00ff),
        (8, 0x100f_00f0_0f00_f00f),
        (4, 0x10c3_0c30_c30c_30c3),
        (2, 0x1249_2492_4924_9249),
    ];
    let spread = |x: f64| {
        #[allow(clippy::cast_possible_truncation, clippy::cast_sign_loss, reason = "casts saturate")]
        let cell = (x as u64).min(LARGEST);
        STEPS.iter().fold(cell, |bits, &(by, mask)| (bits | bits << by) & mask)
    };
    spread(place.x) | spread(place.y) << 1 | spread(place.z) << 2
}

#[cfg(test)]
mod tests {
    use super::*;
    use crate::{Mesh, shapes};

    /// The mesh with its vertices and triangles in an order without order.
    fn scattered(mesh: &Mesh) -> Mesh {
        /// Prime, and so coprime to the numbers of vertices and triangles here.
        const STEP: usize = 16_411;
        let (count, faces) = (mesh.positions().len(), mesh.triangles().len());
        let mut positions = vec![Vec3::zeros(); count];
        for (vertex, position) in mesh.positions().iter().enumerate() {
            positions[vertex * STEP % count] = *position;
        }
        let moved = |t: [u32; 3]| t.map(|v| index_u32(v as usize * STEP % count));
        let triangles = (0..faces).map(|t| moved(mesh.triangles()[t * STEP % faces])).collect();
        Mesh::new(positions, triangles).unwrap()
    }

    #[test]
    fn curve_visits_cubes_of_cubes() {
        let code = |x: f64, y: f64, z: f64| morton(Vec3::new(x, y, z));
        let found = [
            code(0.9, 0.0, 0.5),
            code(1.0, 0.0, 0.0),
            code(0.0, 1.5, 0.0),
            code(0.0, 0.0, 1.0),
            code(2.0, 0.0, 0.0),
        ];
        assert_eq!(found, [0, 1, 2, 4, 8]);
        assert_eq!(code(f64::INFINITY, 1e300, 3e6), (1 << 63) - 1);
        assert_eq!(code(f64::NAN, 0.0, 0.0), 0);
        let bits = |x: u64| (0..21).map(|bit| (x >> bit & 1) << (3 * bit)).sum::<u64>();
        for x in [5_u64, 77_777, 1_398_101, 2_000_003] {
            assert_eq!(morton(Vec3::new(x as f64, 0.0, 0.0)), bits(x), "{x}");
        }
    }

    #[test]
    fn neighbours_of_a_scattered_mesh_come_together_and_nothing_else_changes() {
        let mesh = shapes::torus(1.0, 0.4, 300, 120);
        let mixed = scattered(&mesh);
        let found = Renumbered::of(mixed.positions(), mixed.triangles()).unwrap();
        let apart = typical_edge(&found.positions, &found.triangles).0;
        assert!(apart < 300.0, "{apart}");
        assert!(found.triangles.windows(2).all(|pair| pair[0].iter().min() <= pair[1].iter().min()));
        let mut back: Vec<[u32; 3]> =
            found.triangles.iter().map(|t| t.map(|v| found.originals[v as usize])).collect();
        let mut expected = mixed.triangles().to_vec();
        back.sort_unstable();
        expected.sort_unstable();
        assert_eq!(back, expected);
        for (position, &original) in found.positions.iter().zip(&found.originals) {
            assert_eq!(position, &mixed.positions()[original as usize]);
        }
    }

    #[test]
    fn meshes_in_order_and_small_ones_stay_as_they_are() {
        let small = scattered(&shapes::torus(1.0, 0.4, 100, 50));
        for mesh in [shapes::torus(1.0, 0.4, 300, 120), shapes::plane(400, 100), small] {
            assert!(Renumbered::of(mesh.positions(), mesh.triangles()).is_none());
        }
    }

    #[test]
    fn any_mesh_has_an_order() {
        let count = 40_000_u32;
        for scale in [0.0, 1e-300, 1e300] {
            let positions: Vec<Vec3> =
                (0..count).map(|k| Vec3::new(f64::from(k), 0.0, 1.0) * scale).collect();
            let found = Renumbered::of(&positions, &[[0, count - 1, 1]]).unwrap();
            assert_eq!(found.positions.len(), positions.len(), "{scale}");
        }
    }
}

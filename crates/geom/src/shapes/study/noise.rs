//! Measurement noise on a mesh.

use super::random::Random;
use crate::{Mesh, Vec3};

/// The mesh with every vertex moved by isotropic gaussian noise: each coordinate by a normal deviate of standard deviation
/// `fraction` times the mean edge. Triangles stay. The clean positions, whose curvature is the exact one, are those of the
/// argument; vertex `i` is the same vertex in both. The same seed makes the same noise; 0 makes none.
///
/// # Panics
///
/// If `fraction` is negative or not finite.
#[must_use]
pub fn add_noise(mesh: &Mesh, fraction: f64, seed: u64) -> Mesh {
    assert!(fraction.is_finite() && fraction >= 0.0, "noise of {fraction} mean edges");
    let deviation = fraction * mean_edge(mesh);
    // Not the stream that made the mesh, should both have the same seed.
    let mut random = Random::new(seed ^ 0x6E6F_6973_6500_0000);
    let positions = mesh.positions().iter().map(|p| {
        let ([x, y], [z, _]) = (random.gaussian_pair(), random.gaussian_pair());
        p + Vec3::new(x, y, z) * deviation
    });
    Mesh::new(positions.collect(), mesh.triangles().to_vec()).expect("finite steps from finite points")
}

/// Mean length of the triangles' sides; a side between two triangles counts twice. 0 without triangles.
#[must_use]
pub fn mean_edge(mesh: &Mesh) -> f64 {
    let triangles = mesh.triangles().len();
    let sides = (0..triangles).map(|t| {
        let [a, b, c] = mesh.corners(t);
        (a - b).norm() + (b - c).norm() + (c - a).norm()
    });
    sides.sum::<f64>() / (3 * triangles.max(1)) as f64
}

#[cfg(test)]
mod tests {
    use super::super::StudyShape;
    use super::*;

    #[test]
    fn noise_has_the_stated_size_in_every_direction() {
        let mesh = StudyShape::Torus.mesh(4000, 1);
        let edge = mean_edge(&mesh);
        let noisy = add_noise(&mesh, 0.05, 1);
        assert_eq!(noisy.triangles(), mesh.triangles());
        let steps: Vec<Vec3> =
            std::iter::zip(noisy.positions(), mesh.positions()).map(|(a, b)| (a - b) / edge).collect();
        for axis in 0..3 {
            let variance = steps.iter().map(|s| s[axis] * s[axis]).sum::<f64>() / steps.len() as f64;
            // The relative standard deviation of a variance from 4000 numbers is 2.2 %.
            assert!((variance.sqrt() / 0.05 - 1.0).abs() < 0.06, "axis {axis}: {}", variance.sqrt());
        }
        assert_eq!(add_noise(&mesh, 0.05, 1), noisy);
        assert_ne!(add_noise(&mesh, 0.05, 2), noisy);
        assert_eq!(add_noise(&mesh, 0.0, 1).positions(), mesh.positions());
    }
}

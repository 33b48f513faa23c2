//! How UV space lies on the surface.

use super::Mesh;
use crate::Vec3;

/// Derivatives of position with respect to UV on one triangle, world length per UV unit.
#[derive(Debug, Clone, Copy, PartialEq)]
pub struct UvJacobian {
    /// `dP/du`.
    pub dp_du: Vec3,
    /// `dP/dv`.
    pub dp_dv: Vec3,
}

/// The UV Jacobian of one triangle, or `None` when its UV area is zero (relative to its longest UV edge, at rounding).
///
/// # Panics
///
/// If `triangle` or `uv_set` is out of range.
#[must_use]
pub fn uv_jacobian(mesh: &Mesh, uv_set: usize, triangle: usize) -> Option<UvJacobian> {
    let [p0, p1, p2] = mesh.corners(triangle);
    let [a, b, c] = mesh.triangles()[triangle].map(|v| mesh.uv_sets()[uv_set][v as usize]);
    let (e1, e2) = ([b[0] - a[0], b[1] - a[1]], [c[0] - a[0], c[1] - a[1]]);
    let determinant = e1[0] * e2[1] - e1[1] * e2[0];
    // The products carry a rounding error of one part in 2^53 each: below a few of those the sign is noise.
    let magnitude = (e1[0] * e2[1]).abs() + (e1[1] * e2[0]).abs();
    if determinant.abs() <= 4.0 * f64::EPSILON * magnitude {
        return None;
    }
    let (q1, q2) = (p1 - p0, p2 - p0);
    Some(UvJacobian {
        dp_du: (q1 * e2[1] - q2 * e1[1]) / determinant,
        dp_dv: (q2 * e1[0] - q1 * e2[0]) / determinant,
    })
}

/// World length per UV unit: the square root of world area over UV area, both summed over the whole mesh.
///
/// `None` when the mesh lacks this UV set, or when either area is zero.
#[must_use]
pub fn uv_scale(mesh: &Mesh, uv_set: usize) -> Option<f64> {
    let uvs = mesh.uv_sets().get(uv_set)?;
    // World areas in units of the bounding box, so that they neither overflow nor underflow.
    let size = mesh.bbox_diagonal();
    if size == 0.0 {
        return None;
    }
    let (mut world, mut flat) = (0.0, 0.0);
    for (index, triangle) in mesh.triangles().iter().enumerate() {
        let [p0, p1, p2] = mesh.corners(index).map(|p| p / size);
        world += (p1 - p0).cross(&(p2 - p0)).norm();
        let [a, b, c] = triangle.map(|v| uvs[v as usize]);
        flat += ((b[0] - a[0]) * (c[1] - a[1]) - (b[1] - a[1]) * (c[0] - a[0])).abs();
    }
    (world > 0.0 && flat > 0.0).then(|| size * (world / flat).sqrt())
}

#[cfg(test)]
mod tests {
    use super::*;

    fn square(scale: f64) -> Mesh {
        let p = [[0.0, 0.0], [2.0, 0.0], [2.0, 2.0], [0.0, 2.0]];
        let positions = p.iter().map(|p| Vec3::new(p[0], 0.0, -p[1]) * scale).collect();
        let uv = p.iter().map(|p| [p[0] * 3.0, p[1] * 3.0]).collect();
        Mesh::new(positions, vec![[0, 1, 2], [0, 2, 3]]).unwrap().with_uv_set(uv).unwrap()
    }

    #[test]
    fn jacobian_and_scale_of_a_stretched_square() {
        for scale in [1e-150, 1.0, 1e150] {
            let mesh = square(scale);
            let jacobian = uv_jacobian(&mesh, 0, 1).unwrap();
            assert!((jacobian.dp_du / scale - Vec3::x() / 3.0).norm() < 1e-15, "{jacobian:?}");
            assert!((jacobian.dp_dv / scale + Vec3::z() / 3.0).norm() < 1e-15, "{jacobian:?}");
            let found = uv_scale(&mesh, 0).unwrap();
            assert!((found * 3.0 / scale - 1.0).abs() < 1e-14, "{found}");
        }
    }

    #[test]
    fn no_uv_area_is_no_frame() {
        let flat = vec![[0.1, 0.3], [0.2, 0.6], [0.3, 0.9], [0.4, 1.2]];
        let mesh =
            Mesh::new(square(1.0).positions().to_vec(), vec![[0, 1, 2]]).unwrap().with_uv_set(flat).unwrap();
        assert_eq!(uv_jacobian(&mesh, 0, 0), None);
        assert_eq!(uv_scale(&mesh, 1), None);
    }
}

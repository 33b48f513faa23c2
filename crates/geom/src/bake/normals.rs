//! Vertex normals for meshes whose file has none.

use crate::mesh::{Mesh, Surface, Weld};
use crate::Vec3;

/// Mean of the unit triangle normals around each vertex, weighted by the corner angle, on the welded surface, so that a
/// UV seam does not show. Not normalised; zero where no triangle of non-zero area uses the vertex.
///
/// Weights: G. Thürmer, C. A. Wüthrich, Computing vertex normals from polygonal facets, Journal of Graphics Tools 3(1), 1998.
pub(super) fn vertex_normals(mesh: &Mesh, weld: Weld) -> Vec<Vec3> {
    let surface = Surface::new(mesh, weld);
    let mut normals = vec![Vec3::zeros(); surface.positions().len()];
    for (triangle, indices) in surface.triangles().iter().enumerate() {
        let corners = surface.corners(triangle);
        let Some(normal) = unit_normal(corners) else { continue };
        for k in 0..3 {
            let to_next = corners[(k + 1) % 3] - corners[k];
            let to_last = corners[(k + 2) % 3] - corners[k];
            normals[indices[k] as usize] += normal * angle_between(to_next, to_last);
        }
    }
    surface.spread(&normals)
}

/// Unit normal of a triangle, or `None` without area. Edges are scaled first, so that no size overflows.
fn unit_normal([a, b, c]: [Vec3; 3]) -> Option<Vec3> {
    let (u, v) = (b - a, c - a);
    let scale = u.amax().max(v.amax());
    if scale == 0.0 || !scale.is_finite() {
        return None;
    }
    (u / scale).cross(&(v / scale)).try_normalize(0.0)
}

/// Angle between two non-zero vectors in `[0, pi]`, accurate also near both ends.
fn angle_between(u: Vec3, v: Vec3) -> f64 {
    let (u, v) = (u / u.amax(), v / v.amax());
    u.cross(&v).norm().atan2(u.dot(&v))
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn a_cube_corner_points_along_the_diagonal_however_it_is_split() {
        // Three faces meet at the origin; one of them is cut so that it has two triangles there, of 45 degrees each.
        let p = [[0., 0., 0.], [1., 0., 0.], [0., 1., 0.], [0., 0., 1.], [1., 1., 0.]].map(Vec3::from);
        let mesh = Mesh::new(p.to_vec(), vec![[0, 4, 1], [0, 2, 4], [0, 1, 3], [0, 3, 2]]).unwrap();
        let n = vertex_normals(&mesh, Weld::Exact)[0].normalize();
        assert!((n + Vec3::repeat(1.0).normalize()).norm() < 1e-15, "{n}");
    }

    #[test]
    fn zero_area_and_unused_vertices_have_no_normal() {
        let p = [[0., 0., 0.], [1., 0., 0.], [2., 0., 0.], [9., 9., 9.]].map(Vec3::from);
        let mesh = Mesh::new(p.to_vec(), vec![[0, 1, 2]]).unwrap();
        assert!(vertex_normals(&mesh, Weld::Exact).iter().all(|n| *n == Vec3::zeros()));
    }
}

//! Vertex normals rounded as libigl rounds them.
//!
//! libigl drops neighbours with `N_w . N_i <= 0`. On a part with right angles that product is zero up to rounding, and
//! whole neighbourhoods hang on its sign, so the estimator that follows libigl must also follow its order of operations:
//! triangle normals by a plain cross product, weighted by the area that the
//! projections on the coordinate planes give.

use rayon::prelude::*;

use crate::Vec3;
use crate::mesh::Adjacency;

/// Share of the largest part below which a sum is looked at again: far above the rounding of a few hundred parts, and so rare that it
/// costs nothing.
const CANCELLED: f64 = 1e-9;

/// Area-weighted unit vertex normals; zero where no triangle has an area, and where all cancel: some part of a sum lies along
/// the sum, so if no triangle faces that way it is made of rounding (libigl takes the rounding for a normal).
pub(crate) fn libigl_vertex_normals(
    positions: &[Vec3],
    triangles: &[[u32; 3]],
    incident: &Adjacency,
) -> Vec<Vec3> {
    (0..positions.len())
        .into_par_iter()
        .with_min_len(1024)
        .map(|vertex| {
            let corners = |&index: &u32| triangles[index as usize].map(|v| positions[v as usize]);
            let (mut sum, mut largest) = (Vec3::zeros(), 0.0_f64);
            for corners in incident.row(vertex).iter().map(corners) {
                let area = doubled_area(corners);
                sum += face_normal(corners) * area;
                largest = largest.max(area);
            }
            let faces = |corners: [Vec3; 3]| face_normal(corners).dot(&sum) > 0.0;
            // Only a sum that is next to nothing beside its parts can be rounding.
            if sum.amax() < CANCELLED * largest && !incident.row(vertex).iter().map(corners).any(faces) {
                return Vec3::zeros();
            }
            unit_or(sum, sum)
        })
        .collect()
}

fn face_normal([a, b, c]: [Vec3; 3]) -> Vec3 {
    unit_or((b - a).cross(&(c - a)), Vec3::zeros())
}

fn unit_or(v: Vec3, otherwise: Vec3) -> Vec3 {
    let length = norm(v);
    if length > 0.0 { v / length } else { otherwise }
}

/// Twice the area, from the areas of the projections on the coordinate planes.
fn doubled_area([a, b, c]: [Vec3; 3]) -> f64 {
    let (r, s) = (a - c, b - c);
    let projected = |x: usize, y: usize| r[x] * s[y] - r[y] * s[x];
    norm(Vec3::new(projected(0, 1), projected(1, 2), projected(2, 0)))
}

/// Summed in coordinate order, which nalgebra does not promise.
fn norm(v: Vec3) -> f64 {
    (v.x * v.x + v.y * v.y + v.z * v.z).sqrt()
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn normals_that_cancel_to_rounding_are_none() {
        // A triangle and its reverse, long enough that the sum keeps a rounding error at right angles to both.
        let positions = [
            Vec3::new(0.0, -2.0, 2.0),
            Vec3::new(0.0, -0.564_796_863_806_995_1, -1.0),
            Vec3::new(-4.043_698_586_463_810_7e-143, 2.863_003_697_364_507_5e135, -2.0),
        ];
        let triangles = [[0, 1, 2], [2, 1, 0]];
        let incident = Adjacency::triangles_of_vertices(&triangles, 3);
        assert_eq!(libigl_vertex_normals(&positions, &triangles, &incident), [Vec3::zeros(); 3]);
        // A triangle alone keeps its normal.
        let incident = Adjacency::triangles_of_vertices(&triangles[..1], 3);
        let normals = libigl_vertex_normals(&positions, &triangles[..1], &incident);
        assert!(normals.iter().all(|n| n.norm() > 0.9), "{normals:?}");
    }

    #[test]
    fn right_triangle() {
        let right = [Vec3::zeros(), Vec3::x() * 3.0, Vec3::y() * 4.0];
        assert_eq!(doubled_area(right), 12.0);
        assert_eq!(face_normal(right), Vec3::z());
        assert_eq!(face_normal([Vec3::x(); 3]), Vec3::zeros());
    }
}

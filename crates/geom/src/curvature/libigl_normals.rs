//! Vertex normals rounded as libigl rounds them.
//!
//! libigl drops neighbours with `N_w . N_i <= 0`. On a part with right angles that product is zero up to rounding, and
//! whole neighbourhoods hang on its sign, so the estimator that follows libigl must also follow its order of operations:
//! triangle normals by a plain cross product, weighted by the area that the
//! projections on the coordinate planes give.

use rayon::prelude::*;

use crate::Vec3;
use crate::mesh::Adjacency;

/// Area-weighted unit vertex normals; zero where no triangle has an area.
pub(crate) fn libigl_vertex_normals(
    positions: &[Vec3],
    triangles: &[[u32; 3]],
    incident: &Adjacency,
) -> Vec<Vec3> {
    (0..positions.len())
        .into_par_iter()
        .with_min_len(1024)
        .map(|vertex| {
            let mut sum = Vec3::zeros();
            for &index in incident.row(vertex) {
                let corners = triangles[index as usize].map(|v| positions[v as usize]);
                sum += face_normal(corners) * doubled_area(corners);
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
    fn right_triangle() {
        let right = [Vec3::zeros(), Vec3::x() * 3.0, Vec3::y() * 4.0];
        assert_eq!(doubled_area(right), 12.0);
        assert_eq!(face_normal(right), Vec3::z());
        assert_eq!(face_normal([Vec3::x(); 3]), Vec3::zeros());
    }
}

//! Vertex normals from triangles.

use rayon::prelude::*;

use super::triangle_mesh::bbox_diagonal;
use super::{Adjacency, Mesh, Surface, Weld};
use crate::Vec3;

/// Unit normal of a triangle by the right-hand rule, or `None` when its area is zero.
///
/// Works at any scale: the edges are scaled by their largest component before they are multiplied.
#[must_use]
pub fn triangle_normal([a, b, c]: [Vec3; 3]) -> Option<Vec3> {
    let (u, v) = (b - a, c - a);
    let scale = u.amax().max(v.amax());
    if scale == 0.0 || !scale.is_finite() {
        return None;
    }
    unit((u / scale).cross(&(v / scale)))
}

/// Unit vertex normals, each the sum of the incident triangles' normals weighted by their areas. Slivers hardly count.
///
/// Zero where the sum is zero: no triangle of non-zero area, or opposite ones that cancel. Areas below 1e-300 of the squared
/// bounding box diagonal count as zero.
#[must_use]
pub fn area_weighted_normals(positions: &[Vec3], triangles: &[[u32; 3]], incident: &Adjacency) -> Vec<Vec3> {
    // A power of two, so that scaling is exact, near the mesh's size, so that products of edges neither overflow nor
    // underflow at scales from 1e-150 to 1e150.
    let size = bbox_diagonal(positions);
    let inverse = if size > 0.0 { (-size.log2().round()).exp2() } else { 1.0 };
    vertex_normals(triangles, incident, |_, corners| {
        let [a, b, c] = corners.map(|v| positions[v as usize]);
        ((b - a) * inverse).cross(&((c - a) * inverse))
    })
}

/// Unit vertex normals, each the sum of the incident triangles' normals weighted by their angles at the vertex
/// (Thürmer and Wüthrich, "Computing Vertex Normals from Polygonal Facets", Journal of Graphics Tools, 1998).
///
/// Unlike area weighting it does not depend on how a flat or smooth surface is cut into triangles, which makes it the one
/// for shading; but a sliver with an angle of nearly pi weighs as much as half a disc. Zero as there.
#[must_use]
pub fn angle_weighted_normals(positions: &[Vec3], triangles: &[[u32; 3]], incident: &Adjacency) -> Vec<Vec3> {
    vertex_normals(triangles, incident, |corner, corners| {
        let p = corners.map(|v| positions[v as usize]);
        let [a, b, c] = [p[corner], p[(corner + 1) % 3], p[(corner + 2) % 3]];
        triangle_normal(p).map_or_else(Vec3::zeros, |normal| normal * angle(b - a, c - a))
    })
}

/// Angle-weighted unit normals of the welded surface, one per mesh vertex, so that a UV seam does not show. Zero as there.
#[must_use]
pub fn smooth_normals(mesh: &Mesh, weld: Weld) -> Vec<Vec3> {
    let surface = Surface::new(mesh, weld);
    let (positions, triangles) = (surface.positions(), surface.triangles());
    let incident = Adjacency::triangles_of_vertices(triangles, positions.len());
    surface.spread(angle_weighted_normals(positions, triangles, &incident))
}

/// Normalised sums of `weighted(corner, triangle)` over the triangles at each vertex.
fn vertex_normals(
    triangles: &[[u32; 3]],
    incident: &Adjacency,
    weighted: impl Fn(usize, [u32; 3]) -> Vec3 + Sync,
) -> Vec<Vec3> {
    (0..incident.len())
        .into_par_iter()
        .with_min_len(1024)
        .map(|vertex| {
            let mut sum = Vec3::zeros();
            for &index in incident.row(vertex) {
                let triangle = triangles[index as usize];
                let corner = triangle.iter().position(|&v| v as usize == vertex).expect("incident");
                sum += weighted(corner, triangle);
            }
            unit(sum).unwrap_or_else(Vec3::zeros)
        })
        .collect()
}

/// The unit vector, also where the squares of the components would underflow.
fn unit(v: Vec3) -> Option<Vec3> {
    let squared = v.norm_squared();
    if squared > 1e-200 {
        return Some(v / squared.sqrt());
    }
    let largest = v.amax();
    if largest > 0.0 { Some((v / largest).normalize()) } else { None }
}

fn angle(u: Vec3, v: Vec3) -> f64 {
    let (u, v) = (u / u.amax(), v / v.amax());
    u.cross(&v).norm().atan2(u.dot(&v))
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn cube_corner_split_unevenly_has_the_diagonal_as_angle_weighted_normal() {
        // Three faces of a cube at the origin; one of them is cut in two, which shifts the area-weighted normal.
        let p = [Vec3::zeros(), Vec3::x(), Vec3::y(), Vec3::z(), Vec3::x() + Vec3::y()];
        let triangles = [[0, 2, 4], [0, 4, 1], [0, 3, 2], [0, 1, 3]];
        let incident = Adjacency::triangles_of_vertices(&triangles, p.len());
        let outward = -Vec3::repeat(1.0 / 3.0_f64.sqrt());
        for scale in [1e-150, 1.0, 1e150] {
            let scaled: Vec<Vec3> = p.iter().map(|p| p * scale).collect();
            let angle = angle_weighted_normals(&scaled, &triangles, &incident)[0];
            assert!((angle - outward).norm() < 1e-15, "scale {scale}: {angle}");
            let area = area_weighted_normals(&scaled, &triangles, &incident)[0];
            let expected = -Vec3::new(1.0, 1.0, 2.0).normalize();
            assert!((area - expected).norm() < 1e-15, "scale {scale}: {area}");
        }
    }

    #[test]
    fn no_area_is_no_normal() {
        assert_eq!(triangle_normal([Vec3::zeros(), Vec3::x(), Vec3::x() * 2.0]), None);
        assert_eq!(triangle_normal([Vec3::x(); 3]), None);
        let both_sides = [[0, 1, 2], [0, 2, 1]];
        let p = [Vec3::zeros(), Vec3::x(), Vec3::y()];
        let incident = Adjacency::triangles_of_vertices(&both_sides, 3);
        assert_eq!(area_weighted_normals(&p, &both_sides, &incident), [Vec3::zeros(); 3]);
    }
}

//! Vertex normals from triangles.

use rayon::prelude::*;

use super::Adjacency;
use crate::Vec3;

/// Unit normal of a triangle by the right-hand rule, or `None` when its area is zero.
///
/// Works at any scale: the edges are scaled by their largest component before they are multiplied.
#[must_use]
pub fn triangle_normal(corners: [Vec3; 3]) -> Option<Vec3> {
    let (normal, _) = scaled_cross(corners)?;
    Some(normal)
}

/// Unit vertex normals, each the sum of the incident triangles' normals weighted by their areas, as libigl takes them.
///
/// `None` where the sum is zero: no triangle of non-zero area, or opposite ones that cancel.
#[must_use]
pub fn area_weighted_normals(
    positions: &[Vec3],
    triangles: &[[u32; 3]],
    incident: &Adjacency,
) -> Vec<Option<Vec3>> {
    vertex_normals(positions, triangles, incident, |_, corners| {
        let (normal, area) = scaled_cross(corners)?;
        Some((normal, area))
    })
}

/// Unit vertex normals, each the sum of the incident triangles' normals weighted by their angles at the vertex
/// (Thürmer and Wüthrich, "Computing Vertex Normals from Polygonal Facets", Journal of Graphics Tools, 1998).
///
/// Unlike area weighting it does not depend on how a flat or smooth surface is cut into triangles. `None` as there.
#[must_use]
pub fn angle_weighted_normals(
    positions: &[Vec3],
    triangles: &[[u32; 3]],
    incident: &Adjacency,
) -> Vec<Option<Vec3>> {
    vertex_normals(positions, triangles, incident, |corner, corners| {
        let (normal, _) = scaled_cross(corners)?;
        let [a, b, c] = [corners[corner], corners[(corner + 1) % 3], corners[(corner + 2) % 3]];
        Some((normal, angle(b - a, c - a)))
    })
}

fn vertex_normals(
    positions: &[Vec3],
    triangles: &[[u32; 3]],
    incident: &Adjacency,
    weighted: impl Fn(usize, [Vec3; 3]) -> Option<(Vec3, f64)> + Sync,
) -> Vec<Option<Vec3>> {
    (0..positions.len())
        .into_par_iter()
        .with_min_len(1024)
        .map(|vertex| {
            let mut sum = Vec3::zeros();
            for &index in incident.row(vertex) {
                let triangle = triangles[index as usize];
                let corner = triangle.iter().position(|&v| v as usize == vertex).expect("incident");
                if let Some((normal, weight)) = weighted(corner, triangle.map(|v| positions[v as usize])) {
                    sum += normal * weight;
                }
            }
            // Areas may be as small as 1e-300; their squares must not decide that the sum is zero.
            let largest = sum.amax();
            if largest > 0.0 { Some((sum / largest).normalize()) } else { None }
        })
        .collect()
}

/// Unit normal and area (half the cross product's length, possibly underflowing to zero) of a triangle.
fn scaled_cross([a, b, c]: [Vec3; 3]) -> Option<(Vec3, f64)> {
    let (u, v) = (b - a, c - a);
    let scale = u.amax().max(v.amax());
    if scale == 0.0 || !scale.is_finite() {
        return None;
    }
    let cross = (u / scale).cross(&(v / scale));
    let length = cross.norm();
    if length == 0.0 { None } else { Some((cross / length, 0.5 * length * scale * scale)) }
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
            let angle = angle_weighted_normals(&scaled, &triangles, &incident)[0].unwrap();
            assert!((angle - outward).norm() < 1e-15, "scale {scale}: {angle}");
            let area = area_weighted_normals(&scaled, &triangles, &incident)[0].unwrap();
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
        assert_eq!(area_weighted_normals(&p, &both_sides, &incident), [None; 3]);
    }
}

//! Vertex normals from triangles.

use rayon::prelude::*;

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
/// Zero where the sum is zero: no triangle of non-zero area, or opposite ones that cancel. Works at any scale, and a vertex
/// knows of its own triangles only: what lies elsewhere, however far, changes no bit.
#[must_use]
pub fn area_weighted_normals(positions: &[Vec3], triangles: &[[u32; 3]], incident: &Adjacency) -> Vec<Vec3> {
    let normal = |vertex: usize| area_weighted_normal(positions, triangles, incident.row(vertex));
    (0..incident.len()).into_par_iter().with_min_len(1024).map(normal).collect()
}

/// That of one vertex, given its triangles.
pub(super) fn area_weighted_normal(positions: &[Vec3], triangles: &[[u32; 3]], row: &[u32]) -> Vec3 {
    let sum = |scale: f64| -> Vec3 {
        let doubled_area = |&index: &u32| {
            let [a, b, c] = triangles[index as usize].map(|v| positions[v as usize] * scale);
            (b - a).cross(&(c - a))
        };
        row.iter().map(doubled_area).sum()
    };
    let plain = sum(1.0);
    let squared = plain.norm_squared();
    if (1e-200..1e200).contains(&squared) {
        return plain / squared.sqrt();
    }
    // Products of edges over- or underflow, or there is no area. A power of two scales without rounding.
    let side = |&index: &u32| {
        let [a, b, c] = triangles[index as usize].map(|v| positions[v as usize] * 0.5);
        (b - a).amax().max((c - a).amax())
    };
    let size = row.iter().map(side).fold(0.0, f64::max);
    let scale = (-size.log2().round()).clamp(-1020.0, 1020.0).exp2();
    unit(sum(scale)).unwrap_or_else(Vec3::zeros)
}

/// Unit vertex normals, each the sum of the incident triangles' normals weighted by their angles at the vertex
/// (Thürmer and Wüthrich, "Computing Vertex Normals from Polygonal Facets", Journal of Graphics Tools, 1998).
///
/// Unlike area weighting it does not depend on how a flat or smooth surface is cut into triangles, which makes it the one
/// for shading; but a sliver with an angle of nearly pi weighs as much as half a disc. Zero as there.
#[must_use]
pub fn angle_weighted_normals(positions: &[Vec3], triangles: &[[u32; 3]], incident: &Adjacency) -> Vec<Vec3> {
    let weighted = |corner: usize, corners: [u32; 3]| {
        let p = corners.map(|v| positions[v as usize]);
        let [a, b, c] = [p[corner], p[(corner + 1) % 3], p[(corner + 2) % 3]];
        triangle_normal(p).map_or_else(Vec3::zeros, |normal| normal * angle(b - a, c - a))
    };
    let normal = |vertex: usize| {
        let mut sum = Vec3::zeros();
        for &index in incident.row(vertex) {
            let triangle = triangles[index as usize];
            let corner = triangle.iter().position(|&v| v as usize == vertex).expect("incident");
            sum += weighted(corner, triangle);
        }
        unit(sum).unwrap_or_else(Vec3::zeros)
    };
    (0..incident.len()).into_par_iter().with_min_len(1024).map(normal).collect()
}

/// Angle-weighted unit normals of the welded surface, one per mesh vertex, so that a UV seam does not show. Zero as there.
#[must_use]
pub fn smooth_normals(mesh: &Mesh, weld: Weld) -> Vec<Vec3> {
    let surface = Surface::new(mesh, weld);
    let (positions, triangles) = (surface.positions(), surface.triangles());
    let incident = Adjacency::triangles_of_vertices(triangles, positions.len());
    surface.spread(angle_weighted_normals(positions, triangles, &incident))
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
        for scale in [1e-300, 1e-150, 1.0, 1e150, 1e307] {
            let scaled: Vec<Vec3> = p.iter().map(|p| p * scale).collect();
            let angle = angle_weighted_normals(&scaled, &triangles, &incident)[0];
            assert!((angle - outward).norm() < 1e-15, "scale {scale}: {angle}");
            let area = area_weighted_normals(&scaled, &triangles, &incident)[0];
            let expected = -Vec3::new(1.0, 1.0, 2.0).normalize();
            assert!((area - expected).norm() < 1e-15, "scale {scale}: {area}");
        }
    }

    #[test]
    fn a_normal_does_not_know_what_lies_far_away() {
        let mut p =
            vec![Vec3::zeros(), Vec3::x(), Vec3::y(), Vec3::new(0.3, -0.7, 0.2), Vec3::z(), Vec3::z() * 2.0];
        let triangles = [[0, 1, 2], [0, 3, 1], [4, 5, 4]];
        let incident = Adjacency::triangles_of_vertices(&triangles, p.len());
        let near = area_weighted_normals(&p, &triangles, &incident)[0];
        for far in [1e100, 1e300, f64::MAX] {
            p[5] = Vec3::repeat(far);
            assert_eq!(area_weighted_normals(&p, &triangles, &incident)[0], near, "{far:e}");
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

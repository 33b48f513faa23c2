//! The minimum curvature along a section of the surface.
//!
//! On each piece of the section the interpolated curvature is linear, so its minimum is at an end and the walk finds the
//! exact minimum of the interpolated field.

use super::direction::section_curvature;
use super::section::{Section, SectionWalk, SideEnd, Stop};
use super::start::Start;
use super::surface_field::CurvatureField;

/// What a walk found.
#[derive(Debug, Clone, Copy, PartialEq)]
pub struct March {
    /// The minimum curvature met, the starting point included, 1/length.
    pub kappa: f64,
    /// Arc length walked, at most the length asked for.
    pub length: f64,
    /// Triangles entered after the first.
    pub crossings: u32,
    /// Why the walk ended.
    pub stop: Stop,
}

/// The least of the curvature along the ray, and of the section's curvature over an arc of `length`, both ends included.
pub(super) fn minimum_past(field: &CurvatureField<'_>, start: &Start, length: f64) -> March {
    let stay = March { kappa: start.kappa(field), length: 0.0, crossings: 0, stop: Stop::NormalIncidence };
    let Some(at) = &start.section else { return stay };
    let Some(mut walk) = SectionWalk::new(field, at.plane, start.point, at.forward) else { return stay };
    let mut minimum = Minimum {
        kappa: stay.kappa,
        last: Some(at.kappa),
        walked: 0.0,
        length,
        corners: [(u32::MAX, None); 2],
    };
    let stop = loop {
        if minimum.add(field, &at.plane, &walk) {
            break Stop::Length;
        }
        if let Err(stop) = walk.advance() {
            break stop;
        }
    };
    March { kappa: minimum.kappa, length: minimum.walked, crossings: walk.crossings(), stop }
}

/// The running state: the minimum so far and how far it has come.
struct Minimum {
    kappa: f64,
    /// Curvature at the end of the last piece.
    last: Option<f64>,
    walked: f64,
    length: f64,
    /// The ends of the last crossed side, with the section's curvature: of the next, one is the same.
    corners: [(u32, Option<f64>); 2],
}

impl Minimum {
    /// Goes over a piece, or as far as the length allows; whether it ends there.
    fn add(&mut self, field: &CurvatureField<'_>, section: &Section, walk: &SectionWalk<'_, '_>) -> bool {
        let span = walk.piece().span();
        let left = self.length - self.walked;
        let ends = span >= left;
        let at_exit = self.at_side(field, section, walk.ends());
        let kappa = if ends && span > 0.0 {
            // Linear on the piece between its two ends.
            at_exit.zip(self.last).map(|(exit, from)| from + left / span * (exit - from))
        } else {
            at_exit
        };
        self.kappa = kappa.map_or(self.kappa, |kappa| self.kappa.min(kappa));
        self.last = at_exit;
        self.walked = if ends { self.length } else { self.walked + span };
        ends
    }

    /// Curvature of the section where it crosses a side, of those ends that have an estimate and a share.
    fn at_side(&mut self, field: &CurvatureField<'_>, section: &Section, ends: &[SideEnd; 2]) -> Option<f64> {
        let known = self.corners;
        self.corners = ends.map(|end| {
            let same = known.into_iter().find(|corner| corner.0 == end.vertex);
            let new = || field.principal(end.vertex).map(|p| section_curvature(p, &section.normal));
            same.unwrap_or_else(|| (end.vertex, new()))
        });
        let (mut sum, mut total) = (0.0, 0.0);
        for (corner, end) in self.corners.iter().zip(ends) {
            if let (Some(kappa), true) = (corner.1, end.weight > 0.0) {
                sum += kappa * end.weight;
                total += end.weight;
            }
        }
        (total > 0.0).then(|| sum / total)
    }
}

#[cfg(test)]
mod tests {
    use super::*;
    use crate::curvature::{CurvatureOptions, VertexCurvature, estimate};
    use crate::field::SurfacePoint;
    use crate::mesh::{Surface, Weld};
    use crate::{Mesh, Vec3, shapes};

    fn with_field<T>(mesh: &Mesh, run: impl FnOnce(&CurvatureField<'_>, &[VertexCurvature]) -> T) -> T {
        let surface = Surface::new(mesh, Weld::Exact);
        let curvature = estimate(&surface, &CurvatureOptions::default()).unwrap();
        run(&CurvatureField::new(surface, &curvature[..]), &curvature)
    }

    #[test]
    fn starts_at_vertices_and_on_edges() {
        let mesh = shapes::torus(1.0, 0.4, 40, 20);
        with_field(&mesh, |field, _| {
            for triangle in 0..mesh.triangles().len() {
                for barycentric in [[1.0, 0.0, 0.0], [0.0, 0.0, 1.0], [0.5, 0.5, 0.0], [0.0, 0.25, 0.75]] {
                    let start = SurfacePoint { triangle, barycentric };
                    let normal = field.normal(start).normalize();
                    for turn in 0..8 {
                        // Also along the edges of the grid, where whole edges lie in the plane.
                        let [a, b, _] = mesh.corners(triangle);
                        let edge = b - a;
                        let x = (edge - normal * normal.dot(&edge)).normalize();
                        let y = normal.cross(&x);
                        let angle = f64::from(turn) * std::f64::consts::FRAC_PI_4;
                        let w = normal * 0.2 + x * angle.cos() + y * angle.sin();
                        let found = field.minimum_past(start, w, 0.3).unwrap();
                        assert_eq!(found.stop, Stop::Length, "{start:?} {turn}: {found:?}");
                        assert!(found.kappa <= field.kappa_along(start, w.normalize()).unwrap() + 1e-12);
                    }
                }
            }
        });
    }

    #[test]
    fn ends_at_boundaries_non_manifold_edges_and_normal_incidence() {
        let plane = shapes::plane(8, 8);
        let start = SurfacePoint { triangle: 0, barycentric: [0.3, 0.3, 0.4] };
        with_field(&plane, |field, _| {
            let out = field.minimum_past(start, Vec3::new(1.0, 0.1, 0.2), 10.0).unwrap();
            assert_eq!(out.stop, Stop::Boundary);
            assert!(out.length < 0.2, "{out:?}");
            let up = field.minimum_past(start, Vec3::z(), 10.0).unwrap();
            assert_eq!((up.stop, up.length), (Stop::NormalIncidence, 0.0));
        });
        // A third sheet stands on the edge between the two triangles of the first quad.
        let mut positions = plane.positions().to_vec();
        positions.push(Vec3::new(0.1, 0.1, 0.5));
        let mut triangles = plane.triangles().to_vec();
        let [a, _, c] = triangles[0];
        triangles.push([a, c, 81]);
        let fin = Mesh::new(positions, triangles).unwrap();
        with_field(&fin, |field, _| {
            let w = Vec3::new(1.0, -1.0, 0.3);
            let found = field.minimum_past(start, w, 10.0).unwrap();
            assert_eq!(found.stop, Stop::NonManifold, "{found:?}");
        });
    }
}

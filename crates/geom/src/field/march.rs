//! The minimum curvature along a section of the surface.
//!
//! On each piece of the section the interpolated curvature is linear, so its minimum is at an end and the walk finds the
//! exact minimum of the interpolated field.

use super::direction::section_curvature;
use super::front::{Front, FrontEnd};
use super::section::{Beginning, Section, Stop};
use super::start::Start;
use super::surface_field::CurvatureField;
use crate::Vec3;

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
    let mut kappa = start.kappa(field);
    let stay = March { kappa, length: 0.0, crossings: 0, stop: Stop::NormalIncidence };
    let Some(at) = &start.section else { return stay };
    let Some(begun) = Beginning::new(field, at.plane, start.point, at.forward) else { return stay };
    let mut front = Front::new(&begun, |end| Corner::new(field, &begun.section, end.vertex, &end.position));
    let (mut position, mut last, mut walked) = (begun.piece.from_position, Some(at.kappa), 0.0);
    let stop = loop {
        let exit = front.position();
        let (span, left) = ((exit - position).norm(), length - walked);
        let at_exit = front.kappa();
        let ends = span >= left;
        let here = if ends && span > 0.0 {
            // Linear on the piece between its two ends.
            at_exit.zip(last).map(|(exit, from)| from + left / span * (exit - from))
        } else {
            at_exit
        };
        kappa = here.map_or(kappa, |here| kappa.min(here));
        walked = if ends { length } else { walked + span };
        if ends {
            break Stop::Length;
        }
        (position, last) = (exit, at_exit);
        let way =
            front.cross(field, &begun.section, |vertex, p| Corner::new(field, &begun.section, vertex, p));
        if let Err(stop) = way {
            break stop;
        }
    };
    March { kappa, length: walked, crossings: front.crossings, stop }
}

/// What the walk wants to know of a vertex.
#[derive(Debug, Clone, Copy)]
struct Corner {
    position: Vec3,
    /// Curvature of the section there, if there is an estimate.
    kappa: Option<f64>,
}

impl Corner {
    fn new(field: &CurvatureField<'_>, section: &Section, vertex: u32, position: &Vec3) -> Self {
        let kappa = field.principal(vertex).map(|p| section_curvature(p, &section.normal));
        Self { position: *position, kappa }
    }
}

impl Front<Corner> {
    fn position(&self) -> Vec3 {
        let [from, to] = self.ends.map(|end| end.known.position);
        from + (to - from) * self.share
    }

    /// Curvature of the section, of those ends that have an estimate and a share.
    fn kappa(&self) -> Option<f64> {
        let (mut sum, mut total) = (0.0, 0.0);
        for (FrontEnd { known, .. }, weight) in self.ends.iter().zip([1.0 - self.share, self.share]) {
            if let (Some(kappa), true) = (known.kappa, weight > 0.0) {
                sum += kappa * weight;
                total += weight;
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
                    let normal = field.unit_normal(start).unwrap();
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

    /// Around the tube of a torus, and then not a second time.
    #[test]
    fn ends_where_it_began() {
        let mesh = shapes::torus(1.0, 0.4, 40, 20);
        with_field(&mesh, |field, _| {
            let start = SurfacePoint { triangle: 7, barycentric: [0.3, 0.3, 0.4] };
            let (p, n) = (field.position(start), field.unit_normal(start).unwrap());
            // Within a half-plane through the axis, which no section leaves by itself.
            let axis = mesh.positions().iter().fold(Vec3::zeros(), |sum, q| sum + q.abs()).imin();
            let axis = Vec3::ith(axis, 1.0);
            let around = axis.cross(&p).normalize();
            let w = n.cross(&around).normalize() + n * 0.1;
            let found = field.minimum_past(start, w, 1e3).unwrap();
            assert_eq!(found.stop, Stop::Closed, "{found:?}");
            let tube = std::f64::consts::TAU * 0.4;
            assert!((found.length / tube - 1.0).abs() < 0.15, "{found:?}");
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

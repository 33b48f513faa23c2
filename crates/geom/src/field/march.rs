//! The minimum curvature along a section of the surface, found by walking from triangle to triangle.
//!
//! Every decision is taken on the sides of the section plane that the corners lie on, where a corner in the plane
//! counts as above it. A triangle then has either no crossed side or exactly two, whatever rounding does, so the walk
//! never meets a special case at a vertex or along an edge and never turns back. On each segment the interpolated curvature
//! is linear, so its minimum is at an end and the walk finds the exact minimum of the interpolated field.

use super::surface_field::{CurvatureField, SurfacePoint};
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

/// Why a walk ended.
#[derive(Debug, Clone, Copy, PartialEq, Eq)]
pub enum Stop {
    /// The whole length was walked.
    Length,
    /// It met a boundary edge.
    Boundary,
    /// It met an edge with three or more triangles: no way on is more right than another.
    NonManifold,
    /// The direction has no tangential part (or the point no section): nothing was walked.
    NormalIncidence,
    /// It came back to where it started.
    Closed,
    /// It took [`MAX_CROSSINGS`] triangles and the length was not reached.
    Budget,
}

/// Bound on the triangles of one walk. A section of a mesh of a million triangles has about two thousand.
pub const MAX_CROSSINGS: u32 = 1 << 14;

/// Where a section leaves a triangle.
#[derive(Debug, Clone, Copy)]
struct Crossing {
    side: usize,
    point: SurfacePoint,
    position: Vec3,
}

struct Section {
    origin: Vec3,
    normal: Vec3,
}

pub(super) fn minimum_past(
    field: &CurvatureField<'_>,
    start: SurfacePoint,
    w: Vec3,
    length: f64,
) -> Option<March> {
    let forward_tangent = |n: Vec3| n * n.dot(&w) / n.norm_squared() - w;
    let normal = field.normal(start);
    let stay = |kappa| Some(March { kappa, length: 0.0, crossings: 0, stop: Stop::NormalIncidence });
    let at_point = field.kappa_along(start, w)?;
    let forward = forward_tangent(normal);
    // Below the sine where the point's own curvature is blended, the azimuth of the plane carries no information.
    if normal.norm_squared() == 0.0 || forward.norm() < super::direction::NORMAL_INCIDENCE_SINE * 1e-6 {
        return stay(at_point);
    }
    let section = Section { origin: field.position(start), normal: normal.cross(&forward).normalize() };
    let Some((entry, mut exit)) = leave_start(field, &section, start, forward) else { return stay(at_point) };
    let start_triangle = entry.triangle;
    let mut from = (entry, section.origin);
    let mut walk = Walk { field, section: &section, kappa: at_point, walked: 0.0, length };
    let mut crossings = 0;
    loop {
        if walk.segment(from, &exit) {
            return Some(walk.end(crossings, Stop::Length));
        }
        let Some((next, entered)) = field.topology().across(exit.point.triangle, exit.side) else {
            let stop = dead_end(field, &exit);
            return Some(walk.end(crossings, stop));
        };
        crossings += 1;
        if crossings == MAX_CROSSINGS {
            return Some(walk.end(crossings, Stop::Budget));
        }
        from = (exit.point, exit.position);
        let [one, two] = section.crossings(field, next).expect("entered through a crossed side");
        exit = if one.side == entered { two } else { one };
        if next == start_triangle {
            walk.segment(from, &exit);
            return Some(walk.end(crossings, Stop::Closed));
        }
    }
}

/// The running state: the minimum so far and how far it has come.
struct Walk<'a, 'f> {
    field: &'a CurvatureField<'f>,
    section: &'a Section,
    kappa: f64,
    walked: f64,
    length: f64,
}

impl Walk<'_, '_> {
    /// Goes from one point of a triangle to its exit, or as far as the length allows; whether it ends here.
    fn segment(&mut self, (from, from_position): (SurfacePoint, Vec3), exit: &Crossing) -> bool {
        let span = (exit.position - from_position).norm();
        let left = self.length - self.walked;
        let ends = span >= left;
        let kappa_exit = self.kappa_at(exit.point);
        let kappa = if ends && span > 0.0 {
            // Linear on the segment between its two ends.
            let kappa_from = self.kappa_at(from);
            let share = left / span;
            kappa_exit.zip(kappa_from).map(|(exit, from)| from + share * (exit - from))
        } else {
            kappa_exit
        };
        self.kappa = kappa.map_or(self.kappa, |kappa| self.kappa.min(kappa));
        self.walked = if ends { self.length } else { self.walked + span };
        ends
    }

    /// Curvature along the curve: each corner's, in the direction in which the plane cuts its tangent plane.
    fn kappa_at(&self, point: SurfacePoint) -> Option<f64> {
        let m = self.section.normal;
        self.field.interpolate(point, |principal| {
            let (x1, x2) = (principal.d2.dot(&m), principal.d1.dot(&m));
            let squared = x1 * x1 + x2 * x2;
            if squared == 0.0 {
                principal.mean()
            } else {
                (principal.kappa_max * x1 * x1 + principal.kappa_min * x2 * x2) / squared
            }
        })
    }

    fn end(&self, crossings: u32, stop: Stop) -> March {
        March { kappa: self.kappa, length: self.walked, crossings, stop }
    }
}

impl Section {
    fn height(&self, p: Vec3) -> f64 {
        self.normal.dot(&(p - self.origin))
    }

    /// The two crossed sides of a triangle, or `None` if all corners lie on one side.
    fn crossings(&self, field: &CurvatureField<'_>, triangle: usize) -> Option<[Crossing; 2]> {
        let corners = field.surface().corners(triangle);
        let heights = corners.map(|p| self.height(p));
        let above = heights.map(|h| h >= 0.0);
        let crossing = |side: usize| {
            let (a, b) = (side, (side + 1) % 3);
            (above[a] != above[b]).then(|| {
                // The heights differ in sign, so the share is in [0, 1] and the division is safe.
                let share = heights[a] / (heights[a] - heights[b]);
                let mut barycentric = [0.0; 3];
                (barycentric[a], barycentric[b]) = (1.0 - share, share);
                let point = SurfacePoint { triangle, barycentric };
                Crossing { side, point, position: corners[a] + (corners[b] - corners[a]) * share }
            })
        };
        let mut found = (0..3).filter_map(crossing);
        Some([found.next()?, found.next()?])
    }
}

/// The starting point as a point of the triangle in which the walk starts, and the exit from that on the way forward.
///
/// It is the point's own triangle, unless the point lies on a corner or an edge, up to rounding, and the way forward is
/// in a neighbour.
fn leave_start(
    field: &CurvatureField<'_>,
    section: &Section,
    start: SurfacePoint,
    forward: Vec3,
) -> Option<(SurfacePoint, Crossing)> {
    let along = |c: &Crossing| forward.dot(&(c.position - section.origin));
    let behind_and_ahead =
        |[one, two]: [Crossing; 2]| if along(&one) < along(&two) { (one, two) } else { (two, one) };
    let own = section.crossings(field, start.triangle).map(|pair| behind_and_ahead(pair).1);
    if let Some(exit) = own.filter(|exit| along(exit) > 0.0) {
        return Some((start, exit));
    }
    let corner = (0..3).max_by(|&a, &b| start.barycentric[a].total_cmp(&start.barycentric[b]))?;
    let vertex = field.surface().triangles()[start.triangle][corner];
    let neighbours = fan(field, start.triangle, vertex).into_iter();
    let exits = neighbours.filter_map(|t| section.crossings(field, t)).map(behind_and_ahead);
    let best = exits.filter(|(_, exit)| along(exit) > 0.0).max_by(|a, b| along(&a.1).total_cmp(&along(&b.1)));
    best.map(|(behind, exit)| (behind.point, exit)).or(own.map(|exit| (start, exit)))
}

/// Triangles around a vertex that are reached from one of them over shared edges.
fn fan(field: &CurvatureField<'_>, triangle: usize, vertex: u32) -> Vec<usize> {
    let mut fan = vec![triangle];
    let mut head = 0;
    while let Some(&current) = fan.get(head) {
        head += 1;
        for side in 0..3 {
            let Some((next, _)) = field.topology().across(current, side) else { continue };
            if field.surface().triangles()[next].contains(&vertex) && !fan.contains(&next) {
                fan.push(next);
            }
        }
    }
    fan
}

fn dead_end(field: &CurvatureField<'_>, exit: &Crossing) -> Stop {
    if field.topology().is_boundary(exit.point.triangle, exit.side) {
        Stop::Boundary
    } else {
        Stop::NonManifold
    }
}

#[cfg(test)]
mod tests {
    use super::*;
    use crate::curvature::{CurvatureOptions, VertexCurvature, estimate};
    use crate::mesh::{Surface, Weld};
    use crate::{Mesh, shapes};

    fn with_field<T>(mesh: &Mesh, run: impl FnOnce(&CurvatureField<'_>, &[VertexCurvature]) -> T) -> T {
        let surface = Surface::new(mesh, Weld::Exact);
        let curvature = estimate(&surface, &CurvatureOptions::default()).unwrap();
        run(&CurvatureField::new(surface, &curvature[..]), &curvature)
    }

    /// Every triangle cut by the plane, independently of the walk: the crossings in order of their angle around the middle
    /// of a convex section, starting at `origin` and going towards `forward`.
    fn brute_force(field: &CurvatureField<'_>, section: &Section, forward: Vec3, length: f64) -> f64 {
        let curve = Walk { field, section, kappa: 0.0, walked: 0.0, length };
        let mut points: Vec<(Vec3, f64)> = (0..field.surface().triangles().len())
            .filter_map(|t| section.crossings(field, t))
            .flatten()
            .map(|c| (c.position, curve.kappa_at(c.point).unwrap()))
            .collect();
        let middle = points.iter().map(|(p, _)| p).sum::<Vec3>() / points.len() as f64;
        let x = (section.origin - middle).normalize();
        let y = section.normal.cross(&x) * section.normal.cross(&x).dot(&forward).signum();
        let angle =
            |p: Vec3| (p - middle).dot(&y).atan2((p - middle).dot(&x)).rem_euclid(std::f64::consts::TAU);
        points.sort_by(|a, b| angle(a.0).total_cmp(&angle(b.0)));
        let (mut minimum, mut walked) = (f64::INFINITY, 0.0);
        let mut last = (section.origin, None);
        for (position, kappa) in points {
            let span = (position - last.0).norm();
            if walked + span >= length {
                let share = (length - walked) / span;
                let end: f64 = last.1.map_or(kappa, |k: f64| k + share * (kappa - k));
                return minimum.min(end);
            }
            walked += span;
            minimum = minimum.min(kappa);
            last = (position, Some(kappa));
        }
        minimum
    }

    #[test]
    fn equals_brute_force_slicing_of_an_ellipsoid() {
        let mesh = shapes::ellipsoid(Vec3::new(1.0, 1.6, 0.7), 4);
        with_field(&mesh, |field, _| {
            for index in 0..400_usize {
                let triangle = index * 2_654_435_761 % mesh.triangles().len();
                let start = SurfacePoint { triangle, barycentric: [0.2, 0.5, 0.3] };
                let normal = field.normal(start).normalize();
                let side = normal.cross(&Vec3::new(1.0, 0.3 * index as f64, -0.7)).normalize();
                let w = normal * 0.3 + side;
                let length = [0.2, 0.9, 1e9][index % 3];
                let found = field.minimum_past(start, w, length).unwrap();
                let section =
                    Section { origin: field.position(start), normal: normal.cross(&side).normalize() };
                let expected =
                    brute_force(field, &section, -side, length).min(field.kappa_along(start, w).unwrap());
                assert!((found.kappa - expected).abs() < 1e-9, "{index}: {found:?} {expected}");
                let stop = if length > 100.0 { Stop::Closed } else { Stop::Length };
                assert_eq!(found.stop, stop);
            }
        });
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
                        assert!(found.kappa <= field.kappa_along(start, w).unwrap());
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

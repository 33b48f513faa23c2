//! Sharp creases: found, and cut open, so that no fit reaches across one.
//!
//! Curvature is not defined on a crease, and a fit across one returns the crease's own angle over the edge length. A surface is
//! therefore cut along its creases before it is fitted: a vertex on a crease is given one copy for each side, each side is fitted
//! as if it ended there, and the vertex gets the estimate of the side that takes the largest angle around it, with
//! [`Status::Crease`].
//!
//! An edge is a candidate when its two triangles turn by 40 degrees or more, and by 2.5 times what they turn by over the
//! flattest of their other edges: a coarse but smooth surface turns alike everywhere. A candidate is a crease when it goes
//! on at both ends in another candidate of the same sense, without turning back; what noise makes does not. A smooth tube
//! of 10 sides or more has no creases by this rule, a hexagonal prism does.

use std::collections::{HashMap, HashSet};

use rayon::prelude::*;

use super::{Status, VertexCurvature};
use crate::Vec3;
use crate::mesh::{Adjacency, index_u32, triangle_normal};

/// Cosine of the least angle of a crease: 40 degrees.
pub(super) const LEAST_TURN_COSINE: f64 = 0.766;
/// Angle of a crease over that of the flattest other edges beside it.
const OUTSTANDING: f64 = 2.5;
/// Cosine of the largest angle by which a crease turns from one edge to the next: 75 degrees.
const LARGEST_BEND_COSINE: f64 = 0.26;
/// One vertex in so many where triangles turn is few.
const FEW: usize = 20;
/// How often edges that do not go on are dropped; each time shortens what noise strings together by two edges.
const PRUNINGS: u32 = 3;

/// A surface cut open along its creases.
#[derive(Debug)]
pub(super) struct Cut {
    pub(super) positions: Vec<Vec3>,
    pub(super) triangles: Vec<[u32; 3]>,
    pub(super) copies: Copies,
}

/// What became of the vertices on creases.
#[derive(Debug)]
pub(super) struct Copies {
    /// Copies of each, largest angle first. Where a crease ends there is only the vertex itself.
    of: HashMap<u32, Vec<u32>>,
    /// Those of them that lie on the surface's own boundary.
    on_boundary: HashSet<u32>,
}

impl Cut {
    /// Cuts a surface, given the triangles at each vertex and the vertices where triangles may turn by 40 degrees or more,
    /// ascending; `None` if it has no crease.
    pub(super) fn along_creases(
        positions: &[Vec3],
        triangles: &[[u32; 3]],
        incident: &Adjacency,
        turning: &[u32],
    ) -> Option<Self> {
        if turning.is_empty() {
            return None;
        }
        let normal = |t: &[u32; 3]| triangle_normal(t.map(|v| positions[v as usize])).unwrap_or_default();
        // Each is asked for several times, but of few triangles where there are few creases.
        let normals = if turning.len() > positions.len() / FEW {
            triangles.par_iter().with_min_len(1 << 12).map(normal).collect()
        } else {
            Vec::new()
        };
        let sides = Sides { positions, triangles, incident, normals };
        let creases = sides.creases(turning);
        if creases.is_empty() {
            return None;
        }
        let mut on_crease: Vec<u32> = creases.iter().flat_map(|&(a, b)| [a, b]).collect();
        on_crease.sort_unstable();
        on_crease.dedup();
        let on_boundary = on_crease.iter().copied().filter(|&v| sides.is_boundary(v)).collect();
        let copies = Copies { of: HashMap::new(), on_boundary };
        let mut cut = Self { positions: positions.to_vec(), triangles: triangles.to_vec(), copies };
        for vertex in on_crease {
            cut.split(vertex, sides.sectors(vertex, &creases));
        }
        Some(cut)
    }

    /// Gives every sector but the first its own copy of the vertex.
    fn split(&mut self, vertex: u32, sectors: Vec<Vec<u32>>) {
        let mut copies = vec![vertex];
        for sector in sectors.into_iter().skip(1) {
            let copy = index_u32(self.positions.len());
            self.positions.push(self.positions[vertex as usize]);
            copies.push(copy);
            for triangle in sector {
                for corner in &mut self.triangles[triangle as usize] {
                    if *corner == vertex {
                        *corner = copy;
                    }
                }
            }
        }
        self.copies.of.insert(vertex, copies);
    }
}

impl Copies {
    /// The estimates of `count` vertices from those of the cut surface.
    pub(super) fn join(&self, mut estimates: Vec<VertexCurvature>, count: usize) -> Vec<VertexCurvature> {
        for (&vertex, copies) in &self.of {
            let best = copies.iter().map(|&copy| estimates[copy as usize]).find(|e| e.principal.is_some());
            if let Some(best) = best {
                // That the side ends here is what the cut made of it, but for the surface's own boundary.
                let made = best.status == Status::Boundary && !self.on_boundary.contains(&vertex);
                let own = if made { Status::Ok } else { best.status };
                estimates[vertex as usize] = VertexCurvature { status: own.worse(Status::Crease), ..best };
            }
        }
        estimates.truncate(count);
        estimates
    }
}

/// An edge whose two triangles turn.
#[derive(Debug, Clone, Copy)]
struct Candidate {
    edge: (u32, u32),
    convex: bool,
}

/// The surface, and the triangles at each of its vertices.
struct Sides<'a> {
    positions: &'a [Vec3],
    triangles: &'a [[u32; 3]],
    incident: &'a Adjacency,
    /// Unit normals of the triangles, zero for those without area; or none, to compute them as needed.
    normals: Vec<Vec3>,
}

impl Sides<'_> {
    fn creases(&self, turning: &[u32]) -> HashSet<(u32, u32)> {
        let turning = turning.par_iter().with_min_len(1 << 10);
        let mut candidates: Vec<Candidate> = turning.flat_map_iter(|&v| self.candidates(v)).collect();
        for _ in 0..PRUNINGS {
            let mut at_vertex: HashMap<u32, Vec<Candidate>> = HashMap::new();
            for candidate in &candidates {
                for end in [candidate.edge.0, candidate.edge.1] {
                    at_vertex.entry(end).or_default().push(*candidate);
                }
            }
            candidates.retain(|c| {
                let (a, b) = c.edge;
                self.goes_on(c, a, b, &at_vertex[&b]) && self.goes_on(c, b, a, &at_vertex[&a])
            });
        }
        candidates.into_iter().map(|c| c.edge).collect()
    }

    /// The candidates among the edges from a vertex to those of higher numbers.
    fn candidates(&self, vertex: u32) -> impl Iterator<Item = Candidate> + '_ {
        self.incident.row(vertex as usize).iter().flat_map(move |&index| {
            let triangle = self.triangles[index as usize];
            let sides = (0..3).map(move |side| (triangle[side], triangle[(side + 1) % 3]));
            // The neighbour sees the edge the other way round.
            let rising = sides.filter(move |&(from, to)| from == vertex && from < to);
            rising.filter_map(move |edge| self.candidate(index as usize, edge))
        })
    }

    /// The edge of a triangle if it is a candidate.
    fn candidate(&self, index: usize, edge: (u32, u32)) -> Option<Candidate> {
        let normal = self.normal(index)?;
        let other = self.across(index, edge)?;
        let other_normal = self.normal(other)?;
        if normal.dot(&other_normal) > LEAST_TURN_COSINE {
            return None;
        }
        let turn = angle(&normal, &other_normal);
        let flattest = self.flattest(index, edge).max(self.flattest(other, edge));
        let apex = self.triangles[other].iter().find(|&&v| v != edge.0 && v != edge.1)?;
        let height = normal.dot(&(self.positions[*apex as usize] - self.positions[edge.0 as usize]));
        (turn > OUTSTANDING * flattest).then_some(Candidate { edge, convex: height < 0.0 })
    }

    /// The least turn over the other two sides of a triangle; zero where it has no neighbour there.
    fn flattest(&self, index: usize, edge: (u32, u32)) -> f64 {
        let triangle = self.triangles[index];
        let turn = |side: usize| {
            let (a, b) = (triangle[side], triangle[(side + 1) % 3]);
            if (a, b) == edge || (b, a) == edge {
                return f64::INFINITY;
            }
            let other = self.across(index, (a, b)).and_then(|other| self.normal(other));
            self.normal(index).zip(other).map_or(0.0, |(one, two)| angle(&one, &two))
        };
        (0..3).map(turn).fold(f64::INFINITY, f64::min)
    }

    /// Whether the edge from `from` to `to` continues there: in another of its sense, or into the surface's boundary.
    fn goes_on(&self, candidate: &Candidate, from: u32, to: u32, at_end: &[Candidate]) -> bool {
        let position = |v: u32| self.positions[v as usize];
        let Some(along) = (position(to) - position(from)).try_normalize(0.0) else { return false };
        let others = at_end.iter().filter(|other| other.edge != candidate.edge);
        let onward = others.filter(|other| other.convex == candidate.convex).any(|other| {
            let next = if other.edge.0 == to { other.edge.1 } else { other.edge.0 };
            let direction = (position(next) - position(to)).try_normalize(0.0);
            direction.is_some_and(|d| d.dot(&along) > LARGEST_BEND_COSINE)
        });
        // Three edges or more meet at a corner; at the boundary a crease may end.
        onward || at_end.len() > 2 || self.is_boundary(to)
    }

    fn is_boundary(&self, vertex: u32) -> bool {
        self.incident.row(vertex as usize).iter().any(|&t| {
            let triangle = self.triangles[t as usize];
            (0..3).any(|side| {
                let (a, b) = (triangle[side], triangle[(side + 1) % 3]);
                (a == vertex || b == vertex) && self.across(t as usize, (a, b)).is_none()
            })
        })
    }

    /// The one triangle that has this directed edge the other way round; `None` where there is none or more than one.
    fn across(&self, index: usize, (a, b): (u32, u32)) -> Option<usize> {
        let mut found = None;
        for &other in self.incident.row(a as usize) {
            let [x, y, z] = self.triangles[other as usize];
            if other as usize == index || (x != b && y != b && z != b) {
                continue;
            }
            let opposite = (x == b && y == a) || (y == b && z == a) || (z == b && x == a);
            if !opposite || found.is_some() {
                return None;
            }
            found = Some(other as usize);
        }
        found
    }

    /// Unit normal; `None` for a triangle without area.
    fn normal(&self, index: usize) -> Option<Vec3> {
        match self.normals.get(index) {
            Some(normal) => Some(*normal).filter(|n| *n != Vec3::zeros()),
            None => triangle_normal(self.triangles[index].map(|v| self.positions[v as usize])),
        }
    }

    /// The triangles at a vertex in groups that no crease divides, the one with the largest angle first.
    fn sectors(&self, vertex: u32, creases: &HashSet<(u32, u32)>) -> Vec<Vec<u32>> {
        let mut left: Vec<u32> = self.incident.row(vertex as usize).to_vec();
        let mut sectors: Vec<Vec<u32>> = Vec::new();
        while let Some(first) = left.pop() {
            let mut sector = vec![first];
            let mut head = 0;
            while let Some(&current) = sector.get(head) {
                head += 1;
                let connected = |&other: &u32| self.share_smooth_edge(current, other, vertex, creases);
                sector.extend(left.iter().copied().filter(connected).collect::<Vec<_>>());
                left.retain(|t| !sector.contains(t));
            }
            sector.sort_unstable();
            sectors.push(sector);
        }
        let total = |sector: &[u32]| sector.iter().map(|&t| self.corner_angle(t, vertex)).sum::<f64>();
        sectors.sort_by(|a, b| total(b).total_cmp(&total(a)).then(a.cmp(b)));
        sectors
    }

    /// Whether two triangles at a vertex share an edge there that is not a crease.
    fn share_smooth_edge(&self, one: u32, two: u32, vertex: u32, creases: &HashSet<(u32, u32)>) -> bool {
        let (one, two) = (self.triangles[one as usize], self.triangles[two as usize]);
        let shared = one.iter().filter(|&&v| v != vertex && two.contains(&v));
        shared.into_iter().any(|&other| !creases.contains(&(vertex.min(other), vertex.max(other))))
    }

    fn corner_angle(&self, triangle: u32, vertex: u32) -> f64 {
        let corners = self.triangles[triangle as usize];
        let Some(at) = corners.iter().position(|&v| v == vertex) else { return 0.0 };
        let p = corners.map(|v| self.positions[v as usize]);
        let sides = [1, 2].map(|step| (p[(at + step) % 3] - p[at]).try_normalize(0.0));
        sides[0].zip(sides[1]).map_or(0.0, |(a, b)| angle(&a, &b))
    }
}

/// Angle between unit vectors, radians.
fn angle(a: &Vec3, b: &Vec3) -> f64 {
    a.cross(b).norm().atan2(a.dot(b))
}

#[cfg(test)]
mod tests {
    use super::*;
    use crate::Mesh;
    use crate::mesh::Survey;
    use crate::shapes;

    fn cut(mesh: &Mesh) -> Option<Cut> {
        let incident = Adjacency::triangles_of_vertices(mesh.triangles(), mesh.positions().len());
        let survey = <Survey>::new(mesh.positions(), mesh.triangles(), &incident, LEAST_TURN_COSINE);
        Cut::along_creases(mesh.positions(), mesh.triangles(), &incident, &survey.turning)
    }

    /// A square of `n` by `n` quads, folded along its middle by this angle.
    fn folded(n: usize, turn: f64) -> Mesh {
        shapes::grid(n, n, [shapes::Ends::Open; 2], |u, v| {
            let x = u - 0.5;
            let (sin, cos) = turn.sin_cos();
            if x > 0.0 { Vec3::new(x * cos, v, -x * sin) } else { Vec3::new(x, v, 0.0) }
        })
    }

    #[test]
    fn a_fold_is_cut_from_end_to_end_and_no_more() {
        for (turn, copies) in [(1.2, 11), (-1.2, 11), (0.6, 0)] {
            let found = cut(&folded(10, turn)).map_or(0, |cut| cut.positions.len() - 121);
            assert_eq!(found, copies, "turn {turn}");
        }
    }

    #[test]
    fn smooth_surfaces_are_not_cut_however_coarse_or_noisy() {
        for (nu, nv) in [(12, 10), (40, 20)] {
            assert!(cut(&shapes::torus(1.0, 0.4, nu, nv)).is_none(), "{nu} {nv}");
        }
        assert!(cut(&shapes::icosphere(1.0, 1)).is_none());
        let noisy = shapes::study::add_noise(&shapes::icosphere(1.0, 4), 0.2, 3);
        let found = cut(&noisy).map_or(0, |cut| cut.copies.of.len());
        assert!(found * 100 < noisy.positions().len(), "{found} of {}", noisy.positions().len());
    }

    #[test]
    fn a_cube_falls_into_six_faces() {
        let p = |i: usize| Vec3::new((i & 1) as f64, (i >> 1 & 1) as f64, (i >> 2 & 1) as f64);
        #[rustfmt::skip]
        let triangles = vec![
            [0, 2, 1], [1, 2, 3], [4, 5, 6], [5, 7, 6], [0, 1, 4], [1, 5, 4],
            [2, 6, 3], [3, 6, 7], [0, 4, 2], [2, 4, 6], [1, 3, 5], [3, 7, 5],
        ];
        let mesh = Mesh::new((0..8).map(p).collect(), triangles).unwrap();
        let cut = cut(&mesh).unwrap();
        assert_eq!(cut.positions.len(), 24);
        assert!(cut.copies.of.values().all(|copies| copies.len() == 3));
    }
}

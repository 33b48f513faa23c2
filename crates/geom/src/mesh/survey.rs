//! What every vertex sees of its own triangles, in one pass: neighbours, fan, normal, and whether the surface turns there.

use rayon::prelude::*;

use super::closed_fan::ClosedFan;
use super::fans::{self, Fan};
use super::lookahead::Lookahead;
use super::normals::area_weighted_normal;
use super::rings::{self, Rings, SLOT};
use super::weld::index_u32;
use super::{Adjacency, triangle_normal};
use crate::Vec3;

/// Vertices handled by one task: enough to make its vectors worth their allocation.
const BLOCK: usize = 1 << 9;

/// How the normal of a vertex is kept.
pub(crate) trait Oriented: Copy + Send + Sync {
    /// A vertex and its unit normal; zero where it has none.
    fn new(position: &Vec3, normal: &Vec3) -> Self;
}

/// By itself.
impl Oriented for Vec3 {
    fn new(_: &Vec3, normal: &Vec3) -> Self {
        *normal
    }
}

/// The surroundings of every vertex.
#[derive(Debug)]
pub(crate) struct Survey<N = Vec3> {
    pub(crate) ring: Rings,
    pub(crate) fans: Vec<Fan>,
    /// Unit area-weighted normals, see [`usable_normal`].
    pub(crate) normals: Vec<N>,
    /// Vertices, ascending, where two triangles that share an edge may turn by more than the survey's angle. All others are
    /// known not to.
    pub(crate) turning: Vec<u32>,
}

/// The large tables of a survey, of which only the memory counts.
#[derive(Debug)]
pub(crate) struct SurveyMemory<N> {
    pub(crate) slots: Vec<[u32; SLOT]>,
    pub(crate) normals: Vec<N>,
}

impl<N> Default for SurveyMemory<N> {
    fn default() -> Self {
        Self { slots: Vec::new(), normals: Vec::new() }
    }
}

/// What one task found about its vertices.
#[derive(Debug, Default)]
struct Block {
    crowded: Vec<u32>,
    turning: Vec<u32>,
}

impl<N: Oriented> Survey<N> {
    /// [`in_memory`](Self::in_memory) of its own.
    #[cfg(test)]
    pub(crate) fn new(
        positions: &[Vec3],
        triangles: &[[u32; 3]],
        incident: &Adjacency,
        least_cosine: f64,
    ) -> Self {
        Self::in_memory(SurveyMemory::default(), positions, triangles, incident, least_cosine)
    }

    /// Visits all vertices, given the triangles at each, in the memory of another survey where there is room; `least_cosine` is that of the angle that
    /// [`turning`](Self::turning) is about, less than 90 degrees.
    pub(crate) fn in_memory(
        memory: SurveyMemory<N>,
        positions: &[Vec3],
        triangles: &[[u32; 3]],
        incident: &Adjacency,
        least_cosine: f64,
    ) -> Self {
        let mut fans = vec![Fan::Empty; incident.len()];
        let SurveyMemory { mut slots, mut normals } = memory;
        let count = incident.len();
        if slots.capacity() < count {
            // Zeros come from the system, and the tasks are the first to touch them.
            slots = vec![[0; SLOT]; count];
        }
        let none = N::new(&Vec3::zeros(), &Vec3::zeros());
        if normals.capacity() < count {
            // Not `vec!`, which would touch this much memory for the first time on one thread.
            normals = (0..count).into_par_iter().with_min_len(BLOCK).map(|_| none).collect();
        }
        slots.resize(count, [0; SLOT]);
        normals.resize(count, none);
        let corners = |vertex: usize| incident.row(vertex).iter().flat_map(|&t| triangles[t as usize]);
        let ahead = Lookahead::new(incident.len(), |vertex| corners(vertex).max().unwrap_or(0));
        let surveyor = Surveyor { positions, triangles, incident, least_cosine, ahead };
        let blocks: Vec<Block> = fans
            .par_chunks_mut(BLOCK)
            .zip(normals.par_chunks_mut(BLOCK))
            .zip(slots.par_chunks_mut(BLOCK))
            .enumerate()
            .map(|(block, ((fans, normals), slots))| surveyor.survey(block * BLOCK, fans, normals, slots))
            .collect();
        let turning = blocks.iter().flat_map(|block| &block.turning).copied().collect();
        let crowded = blocks.into_iter().map(|block| block.crowded).collect();
        let ring = Rings::new(slots, crowded, BLOCK);
        Self { ring, fans, normals, turning }
    }
}

struct Surveyor<'a> {
    positions: &'a [Vec3],
    triangles: &'a [[u32; 3]],
    incident: &'a Adjacency,
    least_cosine: f64,
    ahead: Lookahead,
}

impl Surveyor<'_> {
    fn survey<N: Oriented>(
        &self,
        first: usize,
        fans: &mut [Fan],
        normals: &mut [N],
        slots: &mut [[u32; SLOT]],
    ) -> Block {
        let mut block = Block::default();
        let (mut edges, mut ring) = (Vec::new(), Vec::new());
        for (offset, ((fan, kept), slot)) in fans.iter_mut().zip(normals).zip(slots).enumerate() {
            let vertex = first + offset;
            self.ahead.ask(self.positions, vertex);
            let row = self.incident.row(vertex);
            let closed = ClosedFan::new(index_u32(vertex), row, self.triangles);
            let (normal, flat) = if let Some(closed) = closed {
                *fan = Fan::Closed;
                *slot = closed.slot(index_u32(vertex));
                let (sum, flat) = closed.area_and_flatness(vertex, self.positions, self.least_cosine);
                (self.unit(vertex, sum), flat)
            } else {
                ring.clear();
                *fan = fans::visit(index_u32(vertex), row, self.triangles, &mut edges, &mut ring);
                *slot = rings::slot(index_u32(vertex), &ring, &mut block.crowded);
                (self.usable_normal(vertex), self.is_flat(row))
            };
            *kept = N::new(&self.positions[vertex], &normal);
            if !flat {
                block.turning.push(index_u32(vertex));
            }
        }
        block
    }

    /// Whether no two triangles of an unusual vertex turn; no, if that would take long to say.
    fn is_flat(&self, row: &[u32]) -> bool {
        const MOST: usize = 16;
        if row.len() > MOST {
            return false;
        }
        let mut normals = [Vec3::zeros(); MOST];
        for (normal, &t) in normals.iter_mut().zip(row) {
            let corners = self.triangles[t as usize].map(|v| self.positions[v as usize]);
            *normal = triangle_normal(corners).unwrap_or_default();
        }
        let normals = &normals[..row.len()];
        let turns = |a: &Vec3, b: &Vec3| a.dot(b) <= self.least_cosine + 1e-9;
        !normals.iter().enumerate().any(|(i, a)| normals[..i].iter().any(|b| turns(a, b)))
    }

    fn unit(&self, vertex: usize, sum: Vec3) -> Vec3 {
        let squared = sum.norm_squared();
        // Otherwise products of edges over- or underflow, areas cancel, or a triangle is a needle.
        if (1e-200..1e200).contains(&squared) { sum / squared.sqrt() } else { self.usable_normal(vertex) }
    }

    /// The area-weighted normal with a stand-in where the incident triangles' cancel (double-sided leftovers): the normal of
    /// the first that has one. Zero where there is none.
    fn usable_normal(&self, vertex: usize) -> Vec3 {
        let row = self.incident.row(vertex);
        let normal = area_weighted_normal(self.positions, self.triangles, row);
        if normal != Vec3::zeros() {
            return normal;
        }
        let corners = |&t: &u32| self.triangles[t as usize].map(|v| self.positions[v as usize]);
        row.iter().find_map(|t| triangle_normal(corners(t))).unwrap_or_else(Vec3::zeros)
    }
}

#[cfg(test)]
mod tests {
    use super::*;
    use crate::mesh::{Mesh, Topology, area_weighted_normals};
    use crate::shapes;

    fn survey(mesh: &Mesh, least_cosine: f64) -> (Survey, Adjacency) {
        let incident = Adjacency::triangles_of_vertices(mesh.triangles(), mesh.positions().len());
        (<Survey>::new(mesh.positions(), mesh.triangles(), &incident, least_cosine), incident)
    }

    /// Irregular, noisy, with a boundary, a doubled triangle, a vertex of high valence and one without triangles.
    fn difficult() -> Mesh {
        let plane = shapes::study::add_noise(&shapes::plane(12, 9), 0.3, 5);
        let (mut positions, mut triangles) = (plane.positions().to_vec(), plane.triangles().to_vec());
        triangles.push(triangles[40]);
        let hub = index_u32(positions.len());
        positions.push(Vec3::new(5.0, 0.0, 0.5));
        positions.extend((0..21).map(|i| Vec3::new(5.0 + f64::from(i).cos(), f64::from(i).sin(), 0.0)));
        triangles.extend((1..21).map(|i| [hub, hub + i, hub + i + 1]));
        positions.push(Vec3::zeros());
        Mesh::new(positions, triangles).unwrap()
    }

    #[test]
    fn rings_fans_and_normals_are_those_of_the_long_way() {
        for mesh in [difficult(), shapes::icosphere(2.0, 3)] {
            let (found, incident) = survey(&mesh, 0.7);
            let normals = area_weighted_normals(mesh.positions(), mesh.triangles(), &incident);
            let mut edges = Vec::new();
            for (vertex, normal) in normals.iter().enumerate() {
                let mut ring = Vec::new();
                let fan = fans::visit(
                    index_u32(vertex),
                    incident.row(vertex),
                    mesh.triangles(),
                    &mut edges,
                    &mut ring,
                );
                assert_eq!(
                    (found.fans[vertex], found.ring.row(index_u32(vertex))),
                    (fan, &ring[..]),
                    "vertex {vertex}"
                );
                // Sums of a few terms in another order.
                let apart = (found.normals[vertex] - normal).norm();
                assert!(apart < 1e-14, "vertex {vertex}: {apart:e}");
            }
        }
    }

    #[test]
    fn no_turn_is_missed_and_none_is_seen_on_a_smooth_surface() {
        let mesh = difficult();
        let topology = Topology::new(mesh.triangles());
        let normals: Vec<_> = (0..mesh.triangles().len()).map(|t| triangle_normal(mesh.corners(t))).collect();
        for least_cosine in [0.5, 0.766, 0.95, 0.999] {
            let turning = survey(&mesh, least_cosine).0.turning;
            assert!(turning.is_sorted());
            let mut turns = 0;
            for (index, triangle) in mesh.triangles().iter().enumerate() {
                for side in 0..3 {
                    let Some((other, _)) = topology.across(index, side) else { continue };
                    let Some((one, two)) = normals[index].zip(normals[other]) else { continue };
                    if one.dot(&two) > least_cosine {
                        continue;
                    }
                    turns += 1;
                    for end in [triangle[side], triangle[(side + 1) % 3]] {
                        assert!(turning.contains(&end), "cosine {least_cosine}, vertex {end}");
                    }
                }
            }
            assert!(turns > 0, "cosine {least_cosine}");
        }
        for smooth in [shapes::icosphere(1.0, 3), shapes::torus(1.0, 0.4, 60, 30), shapes::plane(9, 9)] {
            assert!(survey(&smooth, 0.766).0.turning.is_empty());
        }
    }
}

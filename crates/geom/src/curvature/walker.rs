//! Neighbourhoods on the surface graph, gathered without hashing or allocation.

use std::cmp::Ordering;
use std::collections::BinaryHeap;
use std::ops::Range;

use super::Neighbourhood;
use crate::Vec3;
use crate::mesh::{Lookahead, Rings, SLOT};

/// Gathers vertices around a seed. One per thread; `4 n` bytes.
#[derive(Debug)]
pub(crate) struct Walker<'a> {
    positions: &'a [Vec3],
    ring: &'a Rings,
    /// `stamp[v] == generation` marks `v` as visited in the current walk, so that nothing is cleared between walks.
    stamp: Vec<u32>,
    generation: u32,
    /// The members, and behind them what earlier walks have left, so that nothing is cleared here either.
    buffer: Vec<u32>,
    count: usize,
    /// Where in the buffer each ring ends, the seed's own included; empty after a walk by distance.
    ring_ends: Vec<usize>,
    rejected: BinaryHeap<Candidate>,
}

impl<'a> Walker<'a> {
    pub(crate) fn new(positions: &'a [Vec3], ring: &'a Rings) -> Self {
        Self {
            positions,
            ring,
            stamp: vec![0; ring.len()],
            generation: 0,
            buffer: vec![0; 128],
            count: 0,
            ring_ends: Vec::new(),
            rejected: BinaryHeap::new(),
        }
    }

    /// All vertices of a neighbourhood, the seed first.
    pub(crate) fn gather(&mut self, seed: u32, neighbourhood: Neighbourhood) -> &[u32] {
        match neighbourhood {
            Neighbourhood::Rings(rings) => self.rings(seed, rings),
            Neighbourhood::Radius(radius) | Neighbourhood::MeanEdges(radius) => self.within(seed, radius),
            Neighbourhood::Nearest(count) => self.within_at_least(seed, 0.0, count as usize + 1),
        }
    }

    /// Asks for what walks around vertices further on read.
    #[inline(always)]
    pub(crate) fn ask_ahead(&self, ahead: Lookahead, vertex: usize) {
        self.ring.ask_ahead(ahead, vertex);
        ahead.ask(&self.stamp, vertex);
    }

    /// All vertices at most `rings` edges from `seed`, the seed first, then ring by ring.
    pub(crate) fn rings(&mut self, seed: u32, rings: u32) -> &[u32] {
        self.begin(seed);
        self.ring_ends.push(1);
        self.grow_rings(rings)
    }

    /// Goes on with the last walk by rings until it has this many.
    pub(crate) fn grow_rings(&mut self, rings: u32) -> &[u32] {
        while self.ring_ends.len() <= rings as usize {
            let end = self.count;
            let level = if self.ring_ends.len() == 1 { 0 } else { self.ring_ends[self.ring_ends.len() - 2] };
            if level == end {
                break; // The last ring was empty: the whole component is in.
            }
            self.expand(level..end);
            self.ring_ends.push(self.count);
        }
        self.members()
    }

    /// Adds the unvisited neighbours of some members.
    ///
    /// Which of them are new nobody can foretell, the processor neither: so every one is written behind the members, and only
    /// the new ones are counted. On five rings that takes 0.6 of the time of a branch.
    fn expand(&mut self, range: Range<usize>) {
        let Self { ring, stamp, generation, buffer, count, .. } = self;
        let mut end = *count;
        for index in range {
            let row = ring.padded(buffer[index]);
            let most = row.map_or_else(<[u32]>::len, |_| SLOT);
            if buffer.len() < end + most {
                buffer.resize(2 * (end + most), 0);
            }
            let to = &mut buffer[end..];
            // What pads a slot is the member itself, which is marked. The fixed length makes a loop without a branch.
            end += match row {
                Ok(slot) => visit_all(slot.as_slice(), stamp, *generation, to),
                Err(row) => visit_all(row, stamp, *generation, to),
            };
        }
        *count = end;
    }

    /// All vertices closer to `seed` than `radius` that a walk over edges reaches through such vertices.
    pub(crate) fn within(&mut self, seed: u32, radius: f64) -> &[u32] {
        self.begin(seed);
        let mut head = 0;
        while let Some(&vertex) = self.members().get(head) {
            head += 1;
            for &next in self.ring.row(vertex) {
                if self.visit(next) && self.distance(seed, next) < radius {
                    self.push(next);
                }
            }
        }
        self.members()
    }

    /// As `within`, topped up to `at_least` members in libigl's way: a vertex that fails the distance test while fewer
    /// than `at_least` vertices have been expanded is kept aside, and the closest of those join until the count is met.
    pub(crate) fn within_at_least(&mut self, seed: u32, radius: f64, at_least: usize) -> &[u32] {
        self.begin(seed);
        self.rejected.clear();
        let mut head = 0;
        while let Some(&vertex) = self.members().get(head) {
            head += 1;
            for &next in self.ring.row(vertex) {
                if !self.visit(next) {
                    continue;
                }
                let distance = self.distance(seed, next);
                if distance < radius {
                    self.push(next);
                } else if head < at_least {
                    self.rejected.push(Candidate { distance, vertex: next });
                }
            }
        }
        while self.count < at_least {
            let Some(Candidate { vertex, .. }) = self.rejected.pop() else { break };
            self.push(vertex);
            for &next in self.ring.row(vertex) {
                if self.visit(next) {
                    let distance = self.distance(seed, next);
                    self.rejected.push(Candidate { distance, vertex: next });
                }
            }
        }
        self.members()
    }

    /// What the last walk gathered.
    pub(crate) fn members(&self) -> &[u32] {
        &self.buffer[..self.count]
    }

    /// Hands out the members of the last walk, with any vertices behind them, for another buffer of vertices.
    pub(crate) fn exchange_buffer(&mut self, buffer: &mut Vec<u32>) {
        std::mem::swap(&mut self.buffer, buffer);
        self.count = 0;
    }

    /// Where in [`members`](Self::members) each ring ends, starting with the seed's own; empty after a walk by distance.
    pub(crate) fn ring_ends(&self) -> &[usize] {
        &self.ring_ends
    }

    fn begin(&mut self, seed: u32) {
        if self.generation == u32::MAX {
            self.stamp.fill(0);
            self.generation = 0;
        }
        self.generation += 1;
        self.count = 0;
        self.ring_ends.clear();
        self.push(seed);
        self.stamp[seed as usize] = self.generation;
    }

    fn push(&mut self, vertex: u32) {
        match self.buffer.get_mut(self.count) {
            Some(to) => *to = vertex,
            None => self.buffer.push(vertex),
        }
        self.count += 1;
    }

    /// Marks a vertex; whether it was new.
    #[inline]
    fn visit(&mut self, vertex: u32) -> bool {
        let stamp = &mut self.stamp[vertex as usize];
        let new = *stamp != self.generation;
        *stamp = self.generation;
        new
    }

    fn distance(&self, a: u32, b: u32) -> f64 {
        (self.positions[b as usize] - self.positions[a as usize]).norm()
    }
}

/// Marks the vertices of a row and writes those that were not marked; how many those are. There must be room for all.
#[inline(always)]
fn visit_all(row: &[u32], stamp: &mut [u32], generation: u32, to: &mut [u32]) -> usize {
    let to = &mut to[..row.len()];
    let mut count = 0;
    for &vertex in row {
        let stamp = &mut stamp[vertex as usize];
        to[count] = vertex;
        count += usize::from(*stamp != generation);
        *stamp = generation;
    }
    count
}

/// A vertex outside the radius; the heap's greatest is the closest.
#[derive(Debug, PartialEq)]
struct Candidate {
    distance: f64,
    vertex: u32,
}

impl Eq for Candidate {}

impl Ord for Candidate {
    fn cmp(&self, other: &Self) -> Ordering {
        other.distance.total_cmp(&self.distance).then(other.vertex.cmp(&self.vertex))
    }
}

impl PartialOrd for Candidate {
    fn partial_cmp(&self, other: &Self) -> Option<Ordering> {
        Some(self.cmp(other))
    }
}

#[cfg(test)]
mod tests {
    use super::*;
    use crate::mesh::{Adjacency, Survey};
    use crate::shapes;

    #[test]
    fn rings_of_a_triangle_grid_are_hexagons() {
        let mesh = shapes::plane(20, 20);
        let incident = Adjacency::triangles_of_vertices(mesh.triangles(), mesh.positions().len());
        let ring = <Survey>::new(mesh.positions(), mesh.triangles(), &incident, 0.5).ring;
        let mut walker = Walker::new(mesh.positions(), &ring);
        let middle = 10 * 21 + 10;
        for (rings, expected) in [(0, 1), (1, 7), (2, 19), (5, 91)] {
            let found = walker.rings(middle, rings).to_vec();
            assert_eq!(found.len(), expected, "{rings} rings");
            assert_eq!(found[0], middle);
        }
        assert_eq!(walker.rings(0, 100).len(), 21 * 21);
    }

    #[test]
    fn radius_walk_equals_a_scan_on_a_convex_patch() {
        let mesh = shapes::plane(20, 20);
        let p = mesh.positions();
        let incident = Adjacency::triangles_of_vertices(mesh.triangles(), p.len());
        let ring = <Survey>::new(mesh.positions(), mesh.triangles(), &incident, 0.5).ring;
        let mut walker = Walker::new(p, &ring);
        let seed = 8 * 21 + 7;
        let mut found = walker.within(seed, 0.23).to_vec();
        found.sort_unstable();
        let scan: Vec<u32> =
            (0..21 * 21).filter(|&v| (p[v as usize] - p[seed as usize]).norm() < 0.23).collect();
        assert_eq!(found, scan);
        assert_eq!(walker.within_at_least(seed, 1e-9, 6).len(), 6);
    }
}

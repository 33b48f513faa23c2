//! The neighbourhoods of eight vertices, transposed.

use crate::curvature::walker::Walker;

/// Most rings that are fitted in groups; where there are more, one fit is enough work by itself.
pub(super) const MOST_RINGS: usize = 6;

/// Room for this many vertices times its number in each ring: two to three times what a regular mesh has. A vertex with more is
/// fitted by itself.
const ROOM: usize = 16;

/// Rows in all.
const ROWS: usize = ROOM * MOST_RINGS * (MOST_RINGS + 1) / 2;

/// Eight vertices, and their neighbours ring by ring.
#[derive(Debug)]
pub(super) struct Octet {
    /// The vertices; any vertex where there is none.
    pub(super) seeds: [u32; 8],
    pub(super) rings: Vec<Ring>,
    /// Row `k` of a ring holds the `k`-th member of each vertex's ring, or the vertex itself where there are fewer.
    table: Box<[[u32; 8]]>,
}

/// One ring of eight vertices.
#[derive(Debug, Clone, Copy, Default)]
pub(super) struct Ring {
    /// How many members each has.
    pub(super) sizes: [f64; 8],
    /// The largest of these.
    pub(super) rows: usize,
}

impl Default for Octet {
    fn default() -> Self {
        Self { seeds: [0; 8], rings: Vec::new(), table: vec![[0; 8]; ROWS].into_boxed_slice() }
    }
}

impl Octet {
    /// Starts a group of vertices with this many rings.
    pub(super) fn begin(&mut self, rings: usize, any: u32) {
        self.rings.clear();
        self.rings.resize(rings, Ring::default());
        self.seeds = [any; 8];
    }

    /// Walks the rings of a vertex. Whether they fit in the table, and there are so many.
    pub(super) fn gather(&mut self, lane: usize, seed: u32, walker: &mut Walker<'_>) -> bool {
        walker.rings(seed, u32::try_from(self.rings.len()).expect("few rings"));
        let (ends, members) = (walker.ring_ends(), walker.members());
        if ends.len() != self.rings.len() + 1 {
            return false;
        }
        let fits = ends.windows(2).enumerate().all(|(index, ends)| ends[1] - ends[0] <= room(index));
        if !fits {
            return false;
        }
        self.seeds[lane] = seed;
        for (index, ring) in self.rings.iter_mut().enumerate() {
            let members = &members[ends[index]..ends[index + 1]];
            ring.sizes[lane] = members.len() as f64;
            ring.rows = ring.rows.max(members.len());
            for (row, &member) in self.table[start(index)..].iter_mut().zip(members) {
                row[lane] = member;
            }
        }
        true
    }

    /// Fills what smaller rings leave open.
    pub(super) fn finish(&mut self) {
        for (index, ring) in self.rings.iter().enumerate() {
            let rows = &mut self.table[start(index)..start(index) + ring.rows];
            for lane in 0..8 {
                #[allow(clippy::cast_possible_truncation, clippy::cast_sign_loss, reason = "a small count")]
                let size = ring.sizes[lane] as usize;
                for row in &mut rows[size..] {
                    row[lane] = self.seeds[lane];
                }
            }
        }
    }

    /// Rows of one ring.
    #[inline]
    pub(super) fn members(&self, ring: usize) -> &[[u32; 8]] {
        &self.table[start(ring)..start(ring) + self.rings[ring].rows]
    }
}

/// Room of a ring, counted from zero.
fn room(ring: usize) -> usize {
    ROOM * (ring + 1)
}

/// First row of a ring.
fn start(ring: usize) -> usize {
    ROOM * ring * (ring + 1) / 2
}

//! The neighbourhoods of eight vertices, side by side.

use crate::curvature::walker::Walker;

/// Most rings that are fitted in groups; where there are more, one fit is enough work by itself.
pub(super) const MOST_RINGS: usize = 6;

/// Room for this many vertices times its number in each ring: two to three times what a regular mesh has. A vertex with more is
/// fitted by itself.
const ROOM: usize = 16;

/// Room in all, the vertex itself included.
const TOTAL: usize = 1 + ROOM * MOST_RINGS * (MOST_RINGS + 1) / 2;

/// Eight vertices, and their neighbours ring by ring.
#[derive(Debug)]
pub(super) struct Octet {
    /// The vertices; any vertex where there is none.
    pub(super) seeds: [u32; 8],
    pub(super) rings: Vec<Ring>,
    /// What the walk around each vertex has gathered, and any vertices behind that; never shorter than the room.
    lanes: [Vec<u32>; 8],
}

/// One ring of eight vertices.
#[derive(Debug, Clone, Copy, Default)]
pub(super) struct Ring {
    /// How many members each has.
    pub(super) sizes: [f64; 8],
    /// The largest of these.
    pub(super) rows: usize,
    /// Where they start in each lane.
    starts: [usize; 8],
}

impl Default for Octet {
    fn default() -> Self {
        Self { seeds: [0; 8], rings: Vec::new(), lanes: std::array::from_fn(|_| vec![0; TOTAL]) }
    }
}

impl Octet {
    /// Starts a group with this many rings. A vertex that is not gathered counts nowhere.
    pub(super) fn begin(&mut self, rings: usize, any: u32) {
        self.rings.clear();
        self.rings.resize(rings, Ring::default());
        self.seeds = [any; 8];
    }

    /// Walks the rings of a vertex. Whether they fit in the room, and there are so many.
    pub(super) fn gather(&mut self, lane: usize, seed: u32, walker: &mut Walker<'_>) -> bool {
        walker.rings(seed, u32::try_from(self.rings.len()).expect("few rings"));
        let ends = walker.ring_ends();
        if ends.len() != self.rings.len() + 1 {
            return false;
        }
        let fits = ends.windows(2).enumerate().all(|(index, ends)| ends[1] - ends[0] <= ROOM * (index + 1));
        if !fits {
            return false;
        }
        self.seeds[lane] = seed;
        for (ring, ends) in self.rings.iter_mut().zip(ends.windows(2)) {
            let size = ends[1] - ends[0];
            ring.sizes[lane] = size as f64;
            ring.rows = ring.rows.max(size);
            ring.starts[lane] = ends[0];
        }
        walker.exchange_buffer(&mut self.lanes[lane]);
        if self.lanes[lane].len() < TOTAL {
            self.lanes[lane].resize(TOTAL, seed);
        }
        true
    }

    /// The members of one ring, vertex by vertex, and any vertices where others have more.
    #[inline(always)]
    pub(super) fn members(&self, ring: usize) -> [&[u32]; 8] {
        let Ring { rows, starts, .. } = &self.rings[ring];
        std::array::from_fn(|lane| &self.lanes[lane][starts[lane]..starts[lane] + rows])
    }
}

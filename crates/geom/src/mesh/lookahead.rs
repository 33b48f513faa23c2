//! [`Lookahead`]: asking for memory before a pass over the vertices comes to it.

use prefetch_index::prefetch_index;

/// How many numbers ahead of itself a pass over the vertices of a mesh meets vertices that it has not met before.
///
/// Where vertices are numbered along a curve or row by row, a front moves over the mesh. What a walk around a vertex needs of the vertices behind
/// the front lies in the caches, and what it needs of those at the front comes in no order that the processor could foresee: it waits for
/// the memory again and again. By numbers the front moves evenly, and so can be asked for in time.
#[derive(Debug, Clone, Copy, PartialEq, Eq)]
pub(crate) struct Lookahead(Option<usize>);

impl Lookahead {
    /// From the largest number that a walk around a vertex meets, which is asked for a few vertices.
    pub(crate) fn new(vertices: usize, mut largest_met: impl FnMut(usize) -> u32) -> Self {
        /// The second level of a cache holds what is known of fewer vertices.
        const LEAST_VERTICES: usize = 1 << 14;
        const SAMPLE: usize = 64;
        /// A front that takes up more of the mesh moves over it in no order.
        const LARGEST_SHARE: usize = 8;
        if vertices < LEAST_VERTICES {
            return Self(None);
        }
        let vertex = |k: usize| (2 * k + 1) * vertices / (2 * SAMPLE);
        let ahead = |v: usize| (largest_met(v) as usize).saturating_sub(v);
        let mut reaches: Vec<usize> = (0..SAMPLE).map(vertex).map(ahead).collect();
        reaches.sort_unstable();
        // Where a curve turns back or a surface closes few walks reach very far, and need not be served.
        let most = reaches[SAMPLE * 3 / 4];
        Self(Some(most).filter(|&most| most > 0 && most < vertices / LARGEST_SHARE))
    }

    /// Asks for what the table has at the front, for a pass that is at `vertex` and comes to all of them: line by line of the cache.
    #[inline(always)]
    pub(crate) fn ask<T>(self, table: &[T], vertex: usize) {
        const LINE: usize = 64;
        let entries_of_line = (LINE / size_of::<T>()).max(1);
        if let Some(ahead) = self.0
            && vertex.is_multiple_of(entries_of_line)
        {
            prefetch_index(table, vertex + ahead);
        }
    }
}

#[cfg(test)]
mod tests {
    use super::*;
    use crate::mesh::index_u32;

    /// On a grid of rows of 256, two rings.
    fn two_rows_on(vertex: usize) -> u32 {
        index_u32(vertex + 2 * 256 + 2)
    }

    #[test]
    fn is_the_reach_of_most_walks() {
        assert_eq!(Lookahead::new(1 << 16, two_rows_on), Lookahead(Some(514)));
        // One walk in eight reaches far, as at a seam.
        let seam = |vertex: usize| if vertex % 8192 < 1024 { (1 << 16) - 1 } else { two_rows_on(vertex) };
        assert_eq!(Lookahead::new(1 << 16, seam), Lookahead(Some(514)));
    }

    #[test]
    fn scattered_reversed_and_small_meshes_have_none() {
        assert_eq!(Lookahead::new(1 << 16, |v| index_u32((v * 40_503 + 7) % (1 << 16))), Lookahead(None));
        assert_eq!(Lookahead::new(1 << 16, |v| index_u32(v - v.min(514))), Lookahead(None));
        assert_eq!(Lookahead::new(1000, two_rows_on), Lookahead(None));
        Lookahead(Some(514)).ask(&[0_u8; 4], 3);
    }
}

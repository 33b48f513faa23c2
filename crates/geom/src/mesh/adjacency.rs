//! Which vertices and triangles meet at a vertex, in compressed rows.

use super::weld::index_u32;

/// Compressed rows of `u32` indices: row `i` is `entries[offsets[i]..offsets[i + 1]]`.
#[derive(Debug, Clone, PartialEq, Eq)]
pub struct Adjacency {
    offsets: Vec<u32>,
    entries: Vec<u32>,
}

impl Adjacency {
    /// The triangles at every vertex, ascending. A triangle that names a vertex twice is listed once there.
    ///
    /// # Panics
    ///
    /// If an index is out of range, or the triangles have more than `u32::MAX` corners.
    #[must_use]
    pub fn triangles_of_vertices(triangles: &[[u32; 3]], vertex_count: usize) -> Self {
        let mut offsets = vec![0_u32; vertex_count + 1];
        for triangle in triangles {
            for vertex in distinct(*triangle) {
                offsets[vertex as usize + 1] += 1;
            }
        }
        accumulate(&mut offsets);
        let mut entries = vec![0_u32; offsets[vertex_count] as usize];
        let mut next = offsets.clone();
        for (index, triangle) in triangles.iter().enumerate() {
            for vertex in distinct(*triangle) {
                let slot = &mut next[vertex as usize];
                entries[*slot as usize] = index_u32(index);
                *slot += 1;
            }
        }
        Self { offsets, entries }
    }

    /// Concatenates blocks of rows, each the lengths of its rows and their entries.
    pub(crate) fn from_blocks(blocks: Vec<(Vec<u32>, Vec<u32>)>) -> Self {
        let rows = blocks.iter().map(|(lengths, _)| lengths.len()).sum::<usize>();
        let mut offsets = Vec::with_capacity(rows + 1);
        offsets.push(0);
        offsets.extend(blocks.iter().flat_map(|(lengths, _)| lengths));
        accumulate(&mut offsets);
        let mut entries = Vec::with_capacity(offsets[rows] as usize);
        for (_, block) in blocks {
            entries.extend_from_slice(&block);
        }
        Self { offsets, entries }
    }

    /// Number of rows.
    #[must_use]
    pub fn len(&self) -> usize {
        self.offsets.len() - 1
    }

    /// Whether there is no row.
    #[must_use]
    pub fn is_empty(&self) -> bool {
        self.len() == 0
    }

    /// The entries of one row.
    ///
    /// # Panics
    ///
    /// If `index` is out of range.
    #[inline]
    #[must_use]
    pub fn row(&self, index: usize) -> &[u32] {
        &self.entries[self.offsets[index] as usize..self.offsets[index + 1] as usize]
    }
}

fn accumulate(offsets: &mut [u32]) {
    let mut sum = 0_u32;
    for offset in offsets {
        sum = sum.checked_add(*offset).expect("a mesh has fewer than u32::MAX corners");
        *offset = sum;
    }
}

fn distinct([a, b, c]: [u32; 3]) -> impl Iterator<Item = u32> {
    [Some(a), (b != a).then_some(b), (c != a && c != b).then_some(c)].into_iter().flatten()
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn rows_of_a_fan_with_a_degenerate_and_an_unused_vertex() {
        let triangles = [[0, 1, 2], [0, 2, 3], [3, 3, 1]];
        let incident = Adjacency::triangles_of_vertices(&triangles, 5);
        assert_eq!(incident.row(0), [0, 1]);
        assert_eq!(incident.row(3), [1, 2]);
        assert!(incident.row(4).is_empty());
        assert_eq!(incident.len(), 5);
    }
}

//! Which vertices and triangles meet at a vertex, in compressed rows.

use std::sync::atomic::AtomicU32;
use std::sync::atomic::Ordering::Relaxed;

use rayon::prelude::*;

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
        Self::in_memory(Vec::new(), triangles, vertex_count)
    }

    /// The same, with entries in the memory of other ones where there is room.
    pub(crate) fn in_memory(entries: Vec<u32>, triangles: &[[u32; 3]], vertex_count: usize) -> Self {
        // Parts of the triangles in order, each with its own place in every row: what part comes first does not matter then.
        let size = triangles.len().div_ceil(parts(triangles.len())).max(1);
        let count = |part: &[[u32; 3]]| {
            let mut counts = vec![0_u32; vertex_count];
            for triangle in part {
                for_distinct(*triangle, |vertex| counts[vertex as usize] += 1);
            }
            counts
        };
        let mut places: Vec<Vec<u32>> = triangles.par_chunks(size).map(count).collect();
        let offsets = turn_to_places(&mut places, vertex_count);
        let total = offsets[vertex_count] as usize;
        // Relaxed atomics are plain memory that threads may share.
        let mut entries: Vec<AtomicU32> = entries.into_iter().map(AtomicU32::new).collect();
        if entries.capacity() < total {
            entries = (0..total).into_par_iter().map(|_| AtomicU32::new(0)).collect();
        }
        entries.resize_with(total, || AtomicU32::new(0));
        triangles.par_chunks(size).zip(&mut places).enumerate().for_each(|(part, (triangles, next))| {
            for (index, triangle) in triangles.iter().enumerate() {
                let index = index_u32(part * size + index);
                for_distinct(*triangle, |vertex| {
                    let place = &mut next[vertex as usize];
                    entries[*place as usize].store(index, Relaxed);
                    *place += 1;
                });
            }
        });
        Self { offsets, entries: entries.into_iter().map(AtomicU32::into_inner).collect() }
    }

    /// The memory of its entries, for others.
    pub(crate) fn into_memory(self) -> Vec<u32> {
        self.entries
    }

    /// No rows.
    pub(crate) fn none() -> Self {
        Self { offsets: vec![0], entries: Vec::new() }
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

/// Parts that triangles are worked on in at the same time. Each costs a number per vertex.
fn parts(triangles: usize) -> usize {
    const LEAST: usize = 1 << 16;
    const MOST: usize = 8;
    (triangles / LEAST).clamp(1, rayon::current_num_threads().min(MOST))
}

/// Turns how many entries each part has for each row into where they start; where rows start.
fn turn_to_places(parts: &mut [Vec<u32>], rows: usize) -> Vec<u32> {
    let mut offsets = Vec::with_capacity(rows + 1);
    let mut sum = 0_u32;
    for row in 0..rows {
        offsets.push(sum);
        for part in &mut *parts {
            let count = std::mem::replace(&mut part[row], sum);
            sum = sum.checked_add(count).expect("a mesh has fewer than u32::MAX corners");
        }
    }
    offsets.push(sum);
    offsets
}

#[inline]
fn for_distinct([a, b, c]: [u32; 3], mut visit: impl FnMut(u32)) {
    visit(a);
    if b != a {
        visit(b);
    }
    if c != a && c != b {
        visit(c);
    }
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

    #[test]
    fn rows_do_not_depend_on_the_number_of_threads() {
        let mesh = crate::shapes::torus(1.0, 0.4, 160, 120);
        let build = |threads: usize| {
            let pool = rayon::ThreadPoolBuilder::new().num_threads(threads).build().unwrap();
            pool.install(|| Adjacency::triangles_of_vertices(mesh.triangles(), mesh.positions().len()))
        };
        let one = build(1);
        assert!((0..one.len()).all(|v| one.row(v).is_sorted() && one.row(v).len() == 6));
        for threads in [2, 3] {
            assert_eq!(build(threads), one, "{threads} threads");
        }
    }
}

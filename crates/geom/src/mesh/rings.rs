//! The neighbours of every vertex, in rows of fixed length.

use super::lookahead::Lookahead;

/// Neighbours that a slot holds.
pub(crate) const SLOT: usize = 8;

/// Instead of a first neighbour: the row stands elsewhere. No vertex has this number.
const CROWDED: u32 = u32::MAX;

/// The vertices that share a triangle with each vertex, ascending, without itself.
///
/// A row of up to eight is padded with the vertex itself. Whoever walks the graph has been there already, and so can visit all
/// eight without asking how many there are, which the branch predictor would get wrong at every other vertex of an irregular mesh.
/// Longer rows, of which a mesh has few, stand apart. 32 bytes a vertex, and 4 for each neighbour in a longer row.
#[derive(Debug)]
pub(crate) struct Rings {
    slots: Vec<[u32; SLOT]>,
    /// Longer rows of the vertices of each block.
    crowded: Vec<Vec<u32>>,
    /// Vertices of a block.
    block: usize,
}

impl Rings {
    /// Slots as [`slot`] makes them, with the long rows of every `block` vertices.
    pub(super) fn new(slots: Vec<[u32; SLOT]>, crowded: Vec<Vec<u32>>, block: usize) -> Self {
        Self { slots, crowded, block }
    }

    /// The memory of the slots, for others.
    pub(crate) fn into_memory(self) -> Vec<[u32; SLOT]> {
        self.slots
    }

    /// Vertices that have a row.
    pub(crate) fn len(&self) -> usize {
        self.slots.len()
    }

    /// Asks for a row before it is needed.
    #[inline(always)]
    pub(crate) fn ask_ahead(&self, ahead: Lookahead, vertex: usize) {
        ahead.ask(&self.slots, vertex);
    }

    /// The neighbours of one vertex.
    ///
    /// # Panics
    ///
    /// If `vertex` is out of range.
    #[inline]
    pub(crate) fn row(&self, vertex: u32) -> &[u32] {
        match self.padded(vertex) {
            Ok(slot) => {
                let end = slot.iter().position(|&other| other == vertex).unwrap_or(SLOT);
                &slot[..end]
            }
            Err(row) => row,
        }
    }

    /// The neighbours of one vertex, and the vertex itself in what they leave open; or else a longer row.
    ///
    /// # Panics
    ///
    /// If `vertex` is out of range.
    #[inline(always)]
    pub(crate) fn padded(&self, vertex: u32) -> Result<&[u32; SLOT], &[u32]> {
        let slot = &self.slots[vertex as usize];
        if slot[0] == CROWDED { Err(self.long_row(vertex, slot)) } else { Ok(slot) }
    }

    #[cold]
    fn long_row(&self, vertex: u32, slot: &[u32; SLOT]) -> &[u32] {
        let start = slot[1] as usize;
        &self.crowded[vertex as usize / self.block][start..start + slot[2] as usize]
    }
}

/// The slot of a vertex with these neighbours; where they are too many, they are appended to `crowded`.
pub(super) fn slot(vertex: u32, row: &[u32], crowded: &mut Vec<u32>) -> [u32; SLOT] {
    let mut slot = [vertex; SLOT];
    if let Some(head) = slot.get_mut(..row.len()) {
        head.copy_from_slice(row);
    } else {
        let index = |count: usize| u32::try_from(count).expect("a mesh has fewer than u32::MAX corners");
        slot[..3].copy_from_slice(&[CROWDED, index(crowded.len()), index(row.len())]);
        crowded.extend_from_slice(row);
    }
    slot
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn rows_of_all_lengths_come_back() {
        let row = |vertex: u32| -> Vec<u32> { (1..=vertex % 13).map(|k| 100 * vertex + k).collect() };
        let mut blocks = vec![Vec::new(); 4];
        let slots =
            (0..40).map(|vertex| slot(vertex, &row(vertex), &mut blocks[vertex as usize / 11])).collect();
        let rings = Rings::new(slots, blocks, 11);
        for vertex in 0..40 {
            assert_eq!(rings.row(vertex), row(vertex), "vertex {vertex}");
            match rings.padded(vertex) {
                Ok(slot) => assert!(slot[row(vertex).len()..].iter().all(|&other| other == vertex)),
                Err(_) => assert!(row(vertex).len() > SLOT),
            }
        }
    }
}

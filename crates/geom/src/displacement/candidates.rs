//! [`Bins`]: which triangles of the tiled plane may lie over a rectangle.

use super::lattice::{Point, TILE};
use crate::mesh::index_u32;

/// A square grid over one tile; each bin lists the triangles whose bounding boxes touch it.
#[derive(Debug, Clone, Default)]
pub(super) struct Bins {
    /// Bins along a side.
    side: i64,
    /// Start of each bin's list, and the end.
    starts: Vec<u32>,
    entries: Vec<Entry>,
    /// Lowest bin of each triangle, in its own coordinates.
    lowest: Vec<[i64; 2]>,
}

#[derive(Debug, Clone, Copy)]
struct Entry {
    triangle: u32,
    /// The copy of the tile that the bin is in, from the triangle's own.
    copy: [i32; 2],
}

impl Bins {
    pub fn new(triangles: &[[Point; 3]]) -> Self {
        // Two triangles a bin.
        let side = (triangles.len() / 2).isqrt().clamp(1, 1024);
        let mut bins = Self {
            side: i64::try_from(side).expect("at most 1024"),
            starts: Vec::new(),
            entries: Vec::new(),
            lowest: Vec::new(),
        };
        let mut lists: Vec<Vec<Entry>> = vec![Vec::new(); side * side];
        for (triangle, corners) in triangles.iter().enumerate() {
            let [lower, upper] = bounds(corners).map(|p| p.map(|x| bins.bin(x)));
            bins.lowest.push(lower);
            for y in lower[1]..=upper[1] {
                for x in lower[0]..=upper[0] {
                    let (index, copy) = bins.wrapped([x, y]);
                    lists[index].push(Entry { triangle: index_u32(triangle), copy });
                }
            }
        }
        for list in lists {
            bins.starts.push(index_u32(bins.entries.len()));
            bins.entries.extend(list);
        }
        bins.starts.push(index_u32(bins.entries.len()));
        bins
    }

    /// Calls with every triangle whose bounding box may touch that of the points, and the copy that it is in; each once.
    pub fn near(&self, points: &[Point; 3], mut visit: impl FnMut(usize, [i32; 2])) {
        let [lower, upper] = bounds(points).map(|p| p.map(|x| self.bin(x)));
        for y in lower[1]..=upper[1] {
            for x in lower[0]..=upper[0] {
                let (index, tile) = self.wrapped([x, y]);
                for entry in &self.entries[self.starts[index] as usize..self.starts[index + 1] as usize] {
                    let copy = [tile[0] - entry.copy[0], tile[1] - entry.copy[1]];
                    let first = |i: usize| {
                        let low = self.lowest[entry.triangle as usize][i] + i64::from(copy[i]) * self.side;
                        low.max(lower[i])
                    };
                    // Of the bins that both touch, the lowest one counts.
                    if [x, y] == [first(0), first(1)] {
                        visit(entry.triangle as usize, copy);
                    }
                }
            }
        }
    }

    fn bin(&self, x: i64) -> i64 {
        (x * self.side).div_euclid(TILE)
    }

    #[allow(clippy::cast_sign_loss, clippy::cast_possible_truncation, reason = "at most 2^20 bins and tiles")]
    fn wrapped(&self, bin: [i64; 2]) -> (usize, [i32; 2]) {
        let [x, y] = bin.map(|b| b.rem_euclid(self.side) as usize);
        (y * self.side as usize + x, bin.map(|b| b.div_euclid(self.side) as i32))
    }
}

fn bounds(points: &[Point; 3]) -> [Point; 2] {
    let [a, b, c] = *points;
    [[0, 1].map(|i| a[i].min(b[i]).min(c[i])), [0, 1].map(|i| a[i].max(b[i]).max(c[i]))]
}

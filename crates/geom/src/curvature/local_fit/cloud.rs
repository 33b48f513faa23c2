//! The neighbours of a vertex as the fits read them.

use crate::Vec3;

/// Rows of a [`Cloud`], in this order.
pub(super) const ROWS: usize = 7;

/// Neighbours as a structure of arrays, the vertex itself first, near ones before far ones.
///
/// A row holds world-space offsets from the vertex (`x, y, z`), unit normals (`x, y, z`) or squared distances on a scale of
/// the caller's choice. Rows are padded to whole groups of eight, so that a group can always be read.
#[derive(Debug, Default)]
pub(crate) struct Cloud {
    rows: [Vec<f64>; ROWS],
    len: usize,
}

impl Cloud {
    /// Removes all points.
    pub(crate) fn clear(&mut self) {
        self.len = 0;
    }

    /// Makes room for this many points in all; rows never shrink.
    pub(crate) fn reserve(&mut self, count: usize) {
        let padded = count.next_multiple_of(8);
        if self.rows[0].len() < padded {
            self.rows.iter_mut().for_each(|row| row.resize(2 * padded, 0.0));
        }
    }

    /// Adds a point; `squared` is its squared distance on the caller's scale, the same for all points.
    ///
    /// # Panics
    ///
    /// If there is no room.
    #[inline]
    pub(crate) fn push(&mut self, offset: &Vec3, normal: &Vec3, squared: f64) {
        let point = [offset.x, offset.y, offset.z, normal.x, normal.y, normal.z, squared];
        for (row, value) in self.rows.iter_mut().zip(point) {
            row[self.len] = value;
        }
        self.len += 1;
    }

    /// Number of points.
    pub(crate) fn len(&self) -> usize {
        self.len
    }

    /// World-space offset of a point from the vertex.
    pub(crate) fn offset(&self, index: usize) -> Vec3 {
        Vec3::new(self.rows[0][index], self.rows[1][index], self.rows[2][index])
    }

    /// Unit normal at a point.
    pub(crate) fn normal(&self, index: usize) -> Vec3 {
        Vec3::new(self.rows[3][index], self.rows[4][index], self.rows[5][index])
    }

    /// Squared distance of a point on the caller's scale.
    pub(crate) fn squared(&self, index: usize) -> f64 {
        self.rows[6][index]
    }

    /// The largest distance from the vertex among the first `count` points, or `None` when all coincide or one is not finite.
    pub(crate) fn extent(&self, count: usize) -> Option<f64> {
        let mut largest = 0.0_f64;
        for row in &self.rows[..3] {
            for x in &row[..count] {
                largest = if x.abs() > largest { x.abs() } else { largest };
            }
        }
        if !(largest > 0.0 && largest.is_finite()) {
            return None;
        }
        // Relative to the largest coordinate, so that squares neither overflow nor vanish.
        let inverse = 1.0 / largest;
        let [x, y, z] = [0, 1, 2].map(|row| &self.rows[row][..count]);
        let mut farthest = 0.0_f64;
        for i in 0..count {
            let (x, y, z) = (x[i] * inverse, y[i] * inverse, z[i] * inverse);
            let squared = x * x + y * y + z * z;
            farthest = if squared > farthest { squared } else { farthest };
        }
        let extent = largest * farthest.sqrt();
        extent.is_finite().then_some(extent)
    }

    /// Eight points of a row.
    #[inline(always)]
    pub(super) fn group(&self, row: usize, start: usize) -> &[f64; 8] {
        self.rows[row][start..start + 8].first_chunk().expect("eight numbers")
    }
}

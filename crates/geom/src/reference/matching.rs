//! Which row of a reference belongs to which vertex of a file.

use serde::Serialize;

use crate::Vec3;

/// For every vertex of a file, the row of the reference with the same position.
#[derive(Debug, Clone, PartialEq)]
pub struct Matching {
    /// Reference row of each file vertex; `None` where no position is equal, or several are and none is the obvious one.
    pub rows: Vec<Option<u32>>,
    /// Vertices without an equal position in the reference.
    pub unmatched: usize,
    /// Vertices with several equal positions, none of which has the vertex's own index.
    pub ambiguous: usize,
    /// Whether positions were compared after rounding both to 32-bit floats.
    pub rounded: bool,
}

/// How the triangles of a file compare to those of a reference, as sets of oriented vertex triples.
#[derive(Debug, Clone, Copy, PartialEq, Eq, Serialize)]
pub struct Triangulation {
    /// In the file, not in the reference.
    pub only_here: usize,
    /// In the reference, not in the file.
    pub only_in_reference: usize,
}

impl Triangulation {
    /// Whether both have the same triangles.
    #[must_use]
    pub fn is_same(self) -> bool {
        self.only_here == 0 && self.only_in_reference == 0
    }
}

/// Matches vertices by position: bitwise in `f64` if that matches all, else after rounding to `f32`, as a bake does.
///
/// Copies that a seam makes match the same row, and order does not matter. Where several rows have one position (a
/// reference of an unwelded mesh), a vertex takes the row with its own index.
#[must_use]
pub fn match_rows(file: &[Vec3], reference: &[Vec3]) -> Matching {
    let exact = match_by_key(file, reference, false, |x| (x + 0.0).to_bits());
    if exact.unmatched == 0 {
        return exact;
    }
    let rounded = match_by_key(file, reference, true, |x| u64::from((to_f32(x) + 0.0).to_bits()));
    if rounded.unmatched < exact.unmatched { rounded } else { exact }
}

#[expect(clippy::cast_possible_truncation, reason = "makes keys; the value is not used as a number")]
fn to_f32(x: f64) -> f32 {
    x as f32
}

fn match_by_key(file: &[Vec3], reference: &[Vec3], rounded: bool, bits: impl Fn(f64) -> u64) -> Matching {
    let key = |p: &Vec3| [bits(p.x), bits(p.y), bits(p.z)];
    let mut sorted: Vec<([u64; 3], u32)> = (0..).zip(reference).map(|(row, p)| (key(p), row)).collect();
    sorted.sort_unstable();
    let (mut unmatched, mut ambiguous) = (0, 0);
    let rows = file
        .iter()
        .enumerate()
        .map(|(vertex, p)| {
            let key = key(p);
            let start = sorted.partition_point(|entry| entry.0 < key);
            let equal = sorted[start..].iter().take_while(|entry| entry.0 == key).map(|entry| entry.1);
            let mut equal = equal.peekable();
            let Some(&first) = equal.peek() else {
                unmatched += 1;
                return None;
            };
            let (mut count, mut own) = (0, None);
            for row in equal {
                count += 1;
                own = own.or((row as usize == vertex).then_some(row));
            }
            if count > 1 && own.is_none() {
                ambiguous += 1;
                return None;
            }
            own.or(Some(first))
        })
        .collect();
    Matching { rows, unmatched, ambiguous, rounded }
}

impl Matching {
    /// Compares the triangles of both files; one with an unmatched corner is only here.
    #[must_use]
    pub fn triangulation(&self, file: &[[u32; 3]], reference: &[[u32; 3]]) -> Triangulation {
        let rows = |t: &[u32; 3]| -> Option<[u32; 3]> {
            let [a, b, c] = t.map(|v| self.rows[v as usize]);
            Some([a?, b?, c?])
        };
        let mut here: Vec<_> = file.iter().filter_map(rows).map(smallest_first).collect();
        let outside = file.len() - here.len();
        let mut there: Vec<_> = reference.iter().copied().map(smallest_first).collect();
        here.sort_unstable();
        there.sort_unstable();
        let shared = shared_count(&here, &there);
        Triangulation { only_here: outside + here.len() - shared, only_in_reference: there.len() - shared }
    }
}

/// The same oriented triangle, starting at its smallest vertex.
fn smallest_first([a, b, c]: [u32; 3]) -> [u32; 3] {
    if a <= b && a <= c {
        [a, b, c]
    } else if b <= c {
        [b, c, a]
    } else {
        [c, a, b]
    }
}

fn shared_count<T: Ord>(a: &[T], b: &[T]) -> usize {
    let (mut i, mut j, mut shared) = (0, 0, 0);
    while i < a.len() && j < b.len() {
        match a[i].cmp(&b[j]) {
            std::cmp::Ordering::Less => i += 1,
            std::cmp::Ordering::Greater => j += 1,
            std::cmp::Ordering::Equal => (i, j, shared) = (i + 1, j + 1, shared + 1),
        }
    }
    shared
}

#[cfg(test)]
mod tests {
    use super::*;

    fn p(x: f64) -> Vec3 {
        Vec3::new(x, 0.0, -x)
    }

    #[test]
    fn reordered_copied_and_rounded_vertices_match() {
        let reference = [p(0.1), p(0.2), p(0.3)];
        let file = [p(0.3), p(0.1), p(0.3), p(9.0)];
        let found = match_rows(&file, &reference);
        assert_eq!(found.rows, [Some(2), Some(0), Some(2), None]);
        assert_eq!((found.unmatched, found.ambiguous, found.rounded), (1, 0, false));
        let rounded = [p(f64::from(0.3f32)), p(f64::from(0.1f32))];
        let found = match_rows(&rounded, &reference);
        assert_eq!((found.rows, found.rounded), (vec![Some(2), Some(0)], true));
    }

    #[test]
    fn equal_positions_take_their_own_row_or_none() {
        let reference = [p(1.0), p(1.0), p(2.0)];
        let found = match_rows(&[p(1.0), p(1.0), p(1.0), p(2.0)], &reference);
        assert_eq!(found.rows, [Some(0), Some(1), None, Some(2)]);
        assert_eq!((found.unmatched, found.ambiguous), (0, 1));
    }

    #[test]
    fn triangles_are_compared_as_oriented_sets() {
        let points = [p(0.0), p(1.0), p(2.0), p(3.0)];
        let found = match_rows(&points, &points);
        let reference = [[0, 1, 2], [0, 2, 3]];
        assert!(found.triangulation(&[[2, 3, 0], [1, 2, 0]], &reference).is_same());
        let flipped = found.triangulation(&[[0, 2, 1], [0, 2, 3]], &reference);
        assert_eq!(flipped, Triangulation { only_here: 1, only_in_reference: 1 });
    }
}

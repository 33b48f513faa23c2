//! The usual vertex: a few triangles that go around it once.

use super::rings::SLOT;
use crate::Vec3;

/// Most triangles of a fan that is recognised here.
const MOST: usize = SLOT;
/// No vertex has this number.
const NONE: u32 = u32::MAX;

/// The neighbours of a vertex inside a surface, in their cyclic order.
///
/// Arranging a fan is a search for each triangle's successor, and where it is found is different at every vertex of an
/// irregular mesh. Everything here is therefore of fixed length and without branches on what is found.
#[derive(Debug, Clone, Copy)]
pub(super) struct ClosedFan {
    ring: [u32; MOST],
    count: usize,
}

impl ClosedFan {
    /// `None` unless 3 to 8 proper triangles form one closed fan; there may be others that do.
    pub(super) fn new(vertex: u32, incident: &[u32], triangles: &[[u32; 3]]) -> Option<Self> {
        let count = incident.len();
        if !(3..=MOST).contains(&count) {
            return None;
        }
        let (mut next, mut last) = ([NONE; MOST], [NONE; MOST]);
        let mut proper = true;
        for k in 0..MOST {
            let [a, b, c] = triangles[incident[k.min(count - 1)] as usize];
            let (at_a, at_b) = (a == vertex, b == vertex);
            let one = select(at_a, b, select(at_b, c, a));
            let two = select(at_a, c, select(at_b, a, b));
            next[k] = select(k < count, one, NONE);
            last[k] = select(k < count, two, NONE);
            proper &= one != vertex;
        }
        let after = places(&next, &last);
        let mut ring = [NONE; MOST];
        let mut at = 0;
        for (step, slot) in ring.iter_mut().enumerate() {
            let inside = step < count;
            *slot = select(inside, next[at], NONE);
            at = after[at] as usize;
            // Back at the start for the first time after as many steps as there are triangles: one cycle through all of them.
            proper &= !inside | ((at < MOST) & ((at == 0) == (step + 1 == count)));
            at &= MOST - 1;
        }
        proper.then_some(Self { ring, count })
    }

    /// The neighbours in ascending order, and `vertex` in what they leave open.
    pub(super) fn slot(&self, vertex: u32) -> [u32; SLOT] {
        let mut slot = sorted(self.ring);
        for v in &mut slot {
            *v = select(*v == NONE, vertex, *v);
        }
        slot
    }

    /// Twice the sum of the triangles' area vectors, and whether neighbouring triangles are known to turn by less than the
    /// angle of this cosine. Zero, and not known, where a triangle is a [`NEEDLE`].
    pub(super) fn area_and_flatness(
        &self,
        vertex: usize,
        positions: &[Vec3],
        least_cosine: f64,
    ) -> (Vec3, bool) {
        let ring = &self.ring[..self.count];
        let spoke = |v: u32| {
            let edge = positions[v as usize] - positions[vertex];
            (edge, edge.norm_squared())
        };
        // Rounding must not hide a turn.
        let bound = least_cosine * least_cosine * (1.0 + 1e-9);
        let (first, mut here) = (spoke(ring[0]), spoke(ring[1]));
        let start = Face::new(first, here);
        let (mut before, mut sum) = (start, start.area);
        let (mut sound, mut flat) = (start.is_sound, true);
        for &v in &ring[2..] {
            let there = spoke(v);
            let face = Face::new(here, there);
            flat &= face.is_along(&before, bound);
            sound &= face.is_sound;
            sum += face.area;
            (before, here) = (face, there);
        }
        let last = Face::new(here, first);
        flat &= last.is_along(&before, bound) && start.is_along(&last, bound);
        if sound && last.is_sound { (sum + last.area, flat) } else { (Vec3::zeros(), false) }
    }
}

/// Squared ratio of height to longest side at which what a triangle's normal is depends on the corner that it is computed from.
/// The law that an estimate faces the way of one of its triangles, as anybody computes their normals, is kept by a margin of
/// 1e-7; from here on the rounding of a normal is 1e-10.
const NEEDLE: f64 = 1e-12;

/// A triangle between two edges from the vertex.
#[derive(Debug, Clone, Copy)]
struct Face {
    /// Twice the area, along the normal.
    area: Vec3,
    squared: f64,
    is_sound: bool,
}

impl Face {
    #[inline(always)]
    fn new((one, one_squared): (Vec3, f64), (two, two_squared): (Vec3, f64)) -> Self {
        let area = one.cross(&two);
        let squared = area.norm_squared();
        let longest = if one_squared > two_squared { one_squared } else { two_squared };
        // Not where products over- or underflow.
        Self { area, squared, is_sound: squared > NEEDLE * longest * longest }
    }

    /// Whether the normals' angle is less than that of a squared cosine.
    #[inline(always)]
    fn is_along(&self, other: &Self, squared_cosine: f64) -> bool {
        let cos = self.area.dot(&other.area);
        cos > 0.0 && cos * cos > squared_cosine * self.squared * other.squared
    }
}

/// Where each wanted value stands; [`MOST`] where it does not, the first place where there are several.
///
/// All searches at once, so that none waits for another, and in an order that compilers turn into a few wide instructions.
#[inline(always)]
fn places(values: &[u32; MOST], wanted: &[u32; MOST]) -> [u32; MOST] {
    let mut places = [8; MOST];
    for place in [7_u32, 6, 5, 4, 3, 2, 1, 0] {
        let value = values[place as usize];
        for (found, &v) in places.iter_mut().zip(wanted) {
            *found = select(v == value, place, *found);
        }
    }
    places
}

/// A choice that is not a branch.
#[inline(always)]
fn select(condition: bool, yes: u32, no: u32) -> u32 {
    if condition { yes } else { no }
}

/// Sorts by a fixed network of comparisons (Knuth, "The Art of Computer Programming", volume 3, section 5.3.4).
#[inline(always)]
fn sorted(mut x: [u32; MOST]) -> [u32; MOST] {
    macro_rules! exchange {
        ($($i:literal $j:literal),*) => {
            $((x[$i], x[$j]) = (x[$i].min(x[$j]), x[$i].max(x[$j]));)*
        };
    }
    exchange!(0 1, 2 3, 4 5, 6 7);
    exchange!(0 2, 1 3, 4 6, 5 7);
    exchange!(1 2, 5 6, 0 4, 3 7);
    exchange!(1 5, 2 6);
    exchange!(1 4, 3 6);
    exchange!(2 4, 3 5);
    exchange!(3 4);
    x
}

#[cfg(test)]
mod tests {
    use super::*;
    use crate::mesh::Adjacency;

    fn fan_of(triangles: &[[u32; 3]]) -> Option<ClosedFan> {
        let incident = Adjacency::triangles_of_vertices(triangles, 20);
        ClosedFan::new(0, incident.row(0), triangles)
    }

    #[test]
    fn fans_of_all_sizes_and_orders_are_arranged() {
        for count in 3..=MOST {
            for stride in [1, 3, 5, 7].into_iter().filter(|stride| count % stride != 0 || *stride == 1) {
                // Triangle i joins neighbours i and i + 1; listed in another order, each from another corner.
                let neighbour = |i: usize| u32::try_from(1 + (5 * (i % count)) % 19).unwrap();
                let corners = |i: usize| [0, neighbour(i), neighbour(i + 1)];
                let listed = (0..count).map(|k| k * stride % count);
                let triangles: Vec<[u32; 3]> = listed
                    .map(|i| {
                        let mut t = corners(i);
                        t.rotate_left(i % 3);
                        t
                    })
                    .collect();
                let fan = fan_of(&triangles).unwrap();
                let mut expected: Vec<_> = (0..count).map(neighbour).collect();
                let first = expected.iter().position(|&v| v == fan.ring[0]).unwrap();
                expected.rotate_left(first);
                assert_eq!(fan.ring[..fan.count], expected, "{count} {stride}");
                expected.sort_unstable();
                expected.resize(SLOT, 0);
                assert_eq!(fan.slot(0)[..], expected, "{count} {stride}");
            }
        }
    }

    #[test]
    fn nothing_else_is_taken_for_a_closed_fan() {
        let cases: [&[[u32; 3]]; 7] = [
            &[[0, 1, 2], [0, 2, 3]],
            &[[0, 1, 2], [0, 2, 3], [0, 3, 4]],
            // Two cycles, and one that passes a neighbour twice.
            &[[0, 1, 2], [0, 2, 3], [0, 3, 1], [0, 4, 5], [0, 5, 6], [0, 6, 4]],
            &[[0, 1, 2], [0, 2, 3], [0, 3, 2], [0, 2, 4], [0, 4, 1]],
            // A triangle that is turned over, one that is there twice, and degenerate ones.
            &[[0, 1, 2], [0, 3, 2], [0, 3, 1]],
            &[[0, 1, 2], [0, 2, 3], [0, 3, 1], [0, 1, 2]],
            &[[0, 1, 2], [0, 2, 0], [0, 0, 1]],
        ];
        for triangles in cases {
            assert!(fan_of(triangles).is_none(), "{triangles:?}");
        }
        assert!(fan_of(&[[0, 1, 2], [0, 2, 3], [0, 3, 1]]).is_some());
    }
}

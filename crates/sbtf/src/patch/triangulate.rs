//! Error-bounded triangulation of a height field over one tile.
//!
//! Greedy insertion (Garland and Heckbert, "Fast Polygonal Approximation of Terrains and Height Fields", CMU-CS-95-181, 1995)
//! into a Delaunay triangulation: the point where the triangles are farthest from the bilinear surface becomes a vertex, until
//! none is farther than the tolerance. Points are the texels and those half-way between two and between four of them. The tile's border runs through texel centres, and what is inserted on one side is inserted on the opposite
//! one, so that copies of the tile join without gaps.

use std::cmp::Ordering;
use std::collections::BinaryHeap;

use glam::{Vec2, Vec3};
use spade::handles::{FixedFaceHandle, FixedVertexHandle, InnerTag};
use spade::{DelaunayTriangulation, HasPosition, Point2, Triangulation};

use crate::micro::HeightField;

/// A triangulated tile.
pub(super) struct Triangulated {
    /// `(u, v, z)`; the tile spans `[1 / 2 width, 1 + 1 / 2 width]` and the like in v.
    pub vertices: Vec<Vec3>,
    pub triangles: Vec<[u32; 3]>,
    /// Largest vertical distance found, in depths.
    pub error: f32,
}

/// A vertex; coordinates count half texels from the centre of the first texel, so that they are exact.
struct Point {
    x: i32,
    y: i32,
    z: f32,
}

impl HasPosition for Point {
    type Scalar = f64;
    fn position(&self) -> Point2<f64> {
        Point2::new(f64::from(self.x), f64::from(self.y))
    }
}

/// The worst point of a triangle.
struct Candidate {
    error: f32,
    x: i32,
    y: i32,
    face: FixedFaceHandle<InnerTag>,
    /// The triangle's vertices: the handle may have been given to another triangle since.
    corners: [FixedVertexHandle; 3],
}

impl PartialEq for Candidate {
    fn eq(&self, other: &Self) -> bool {
        self.cmp(other) == Ordering::Equal
    }
}
impl Eq for Candidate {}
impl PartialOrd for Candidate {
    fn partial_cmp(&self, other: &Self) -> Option<Ordering> {
        Some(self.cmp(other))
    }
}
impl Ord for Candidate {
    fn cmp(&self, other: &Self) -> Ordering {
        self.error.total_cmp(&other.error).then((self.y, self.x).cmp(&(other.y, other.x)))
    }
}

/// Triangulates to a tolerance in depths, or to about so many triangles if that comes first.
pub(super) fn triangulate(field: &HeightField, tolerance: f32, most_triangles: usize) -> Triangulated {
    let mut state = State::new(field, tolerance * field.depth());
    // Two triangles per vertex, but for the border.
    while state.mesh.num_inner_faces() + 4 <= most_triangles.max(8) {
        let Some(worst) = state.pop() else { break };
        state.insert(worst.x, worst.y, worst.corners[0]);
    }
    state.finish()
}

struct State<'a> {
    field: &'a HeightField,
    /// Half texels along u and v.
    size: [i32; 2],
    tolerance: f32,
    /// `z` at texels, one row and column repeated.
    texels: Vec<f32>,
    mesh: DelaunayTriangulation<Point>,
    queue: BinaryHeap<Candidate>,
}

impl<'a> State<'a> {
    fn new(field: &'a HeightField, tolerance: f32) -> Self {
        let grid = field.heights();
        let (w, h) = (grid.width(), grid.height());
        let half = |n: usize| i32::try_from(2 * n).expect("a grid of fewer than 2^30 texels a side");
        let z = |i: usize| field.depth() * (grid.texel(i % (w + 1) % w, i / (w + 1) % h) - 1.0);
        let texels = (0..(w + 1) * (h + 1)).map(z).collect();
        let size = [half(w), half(h)];
        let mut state = Self {
            field,
            size,
            tolerance,
            texels,
            mesh: DelaunayTriangulation::new(),
            queue: BinaryHeap::new(),
        };
        for (x, y) in [(0, 0), (size[0], 0), (0, size[1]), (size[0], size[1])] {
            state.insert_one(x, y, None);
        }
        state
    }

    /// `z` of the bilinear surface at a texel or half-way between two or four.
    #[inline]
    fn z(&self, x: i32, y: i32) -> f32 {
        let at = |x: i32, y: i32| {
            #[allow(clippy::cast_sign_loss, reason = "inside the tile")]
            let index = (y >> 1) as usize * self.row_length() + (x >> 1) as usize;
            self.texels[index]
        };
        // The same texel twice where the coordinate is even.
        0.25 * (at(x, y) + at(x + 1, y) + at(x, y + 1) + at(x + 1, y + 1))
    }

    #[inline]
    fn row_length(&self) -> usize {
        self.field.heights().width() + 1
    }

    /// The triangle farthest off, if it is over the tolerance.
    fn pop(&mut self) -> Option<Candidate> {
        loop {
            let candidate = self.queue.pop()?;
            if corners(&self.mesh, candidate.face) == candidate.corners {
                return Some(candidate);
            }
        }
    }

    /// Inserts a point, and on the border also its copies.
    fn insert(&mut self, x: i32, y: i32, hint: FixedVertexHandle) {
        self.insert_one(x, y, Some(hint));
        let [w, h] = self.size;
        if x == 0 || x == w {
            self.insert_one(w - x, y, None);
        }
        if y == 0 || y == h {
            self.insert_one(x, h - y, None);
        }
    }

    fn insert_one(&mut self, x: i32, y: i32, hint: Option<FixedVertexHandle>) {
        let point = Point { x, y, z: self.z(x, y) };
        let inserted = match hint {
            Some(hint) => self.mesh.insert_with_hint(point, hint),
            None => self.mesh.insert(point),
        };
        let vertex = inserted.expect("coordinates are small integers");
        // Insertion changes no triangles but those around the new vertex.
        let faces: Vec<_> =
            self.mesh.vertex(vertex).out_edges().filter_map(|e| Some(e.face().as_inner()?.fix())).collect();
        for face in faces {
            self.queue_worst(face);
        }
    }

    /// Finds the worst point of a triangle, and queues it if it is over the tolerance.
    fn queue_worst(&mut self, face: FixedFaceHandle<InnerTag>) {
        let mut worst = (self.tolerance, None);
        self.scan(face, |x, y, error| {
            if error > worst.0 {
                worst = (error, Some((x, y)));
            }
        });
        if let (error, Some((x, y))) = worst {
            let corners = corners(&self.mesh, face);
            self.queue.push(Candidate { error, x, y, face, corners });
        }
    }

    /// Visits the points in a triangle with their vertical distances from it.
    fn scan(&self, face: FixedFaceHandle<InnerTag>, mut visit: impl FnMut(i32, i32, f32)) {
        let [a, b, c] = self.mesh.face(face).vertices().map(|v| {
            let p = v.data();
            (f64::from(p.x), f64::from(p.y), f64::from(p.z))
        });
        let (e1, e2) = ((b.0 - a.0, b.1 - a.1), (c.0 - a.0, c.1 - a.1));
        let area = e1.0 * e2.1 - e1.1 * e2.0;
        let slope_x = ((b.2 - a.2) * e2.1 - (c.2 - a.2) * e1.1) / area;
        let slope_y = ((c.2 - a.2) * e1.0 - (b.2 - a.2) * e2.0) / area;
        let mut sorted = [a, b, c];
        sorted.sort_by(|p, q| p.1.total_cmp(&q.1));
        let [low, middle, high] = sorted;
        let at = |p: (f64, f64, f64), q: (f64, f64, f64), y: f64| p.0 + (q.0 - p.0) * (y - p.1) / (q.1 - p.1);
        for y in whole(low.1)..=whole(high.1) {
            let row = f64::from(y);
            let long = if high.1 > low.1 { at(low, high, row) } else { low.0 };
            let short = if row < middle.1 || middle.1 == high.1 && middle.1 > low.1 {
                at(low, middle, row)
            } else if high.1 > middle.1 {
                at(middle, high, row)
            } else {
                middle.0
            };
            for x in whole(long.min(short).ceil())..=whole(long.max(short).floor()) {
                let flat = a.2 + slope_x * (f64::from(x) - a.0) + slope_y * (row - a.1);
                #[allow(clippy::cast_possible_truncation, reason = "a distance")]
                visit(x, y, (f64::from(self.z(x, y)) - flat).abs() as f32);
            }
        }
    }

    fn finish(self) -> Triangulated {
        let mut error = 0.0_f32;
        for face in self.mesh.fixed_inner_faces() {
            self.scan(face, |_, _, e| error = error.max(e));
        }
        let index = |v: FixedVertexHandle| u32::try_from(v.index()).expect("fewer than 2^32 vertices");
        let size = Vec2::new(self.size[0] as f32, self.size[1] as f32);
        let vertices = self
            .mesh
            .vertices()
            .map(|v| ((Vec2::new(v.data().x as f32, v.data().y as f32) + 1.0) / size).extend(v.data().z))
            .collect();
        let triangles = self.mesh.fixed_inner_faces().map(|f| corners(&self.mesh, f).map(index)).collect();
        Triangulated { vertices, triangles, error: error / self.field.depth() }
    }
}

/// Corners of a triangle, counter-clockwise as seen from above.
fn corners(mesh: &DelaunayTriangulation<Point>, face: FixedFaceHandle<InnerTag>) -> [FixedVertexHandle; 3] {
    mesh.face(face).vertices().map(|v| v.fix())
}

#[allow(clippy::cast_possible_truncation, reason = "coordinates of points in the tile")]
fn whole(x: f64) -> i32 {
    x as i32
}

#[cfg(test)]
mod tests {
    use super::*;
    use crate::micro::Grid;
    use crate::patch::test_fields::{bumps, grey, grooves, level, sinusoid};

    #[test]
    fn the_tolerance_holds_everywhere_and_few_triangles_do() {
        for (field, most, between) in [
            (sinusoid(128, 0.1), 4000, 0.0075),
            (grooves(128, 0.1), 64, 0.0075),
            // Cliffs one texel wide.
            (bumps(128, 0.1), 12_000, 0.03),
            (level(0.4, 0.1), 2, 0.0),
        ] {
            let made = triangulate(&field, 0.005, usize::MAX);
            assert!(made.error <= 0.005, "{}", made.error);
            assert!(made.triangles.len() <= most, "{} triangles, {most} at most", made.triangles.len());
            // Independently, between the points too: the height at random places from barycentric weights.
            for corners in &made.triangles {
                let [a, b, c] = corners.map(|i| made.vertices[i as usize]);
                for (u, v) in [(0.3, 0.3), (0.1, 0.8), (0.5, 0.01)] {
                    let p = u * a + v * b + (1.0 - u - v) * c;
                    let off = (field.z(p.truncate()) - p.z).abs() / field.depth();
                    // Where edges of triangles cross between the points, the error may be larger.
                    assert!(off <= between + 1e-6, "{off} at {p}");
                }
            }
        }
    }

    #[test]
    fn copies_join_and_nothing_is_left_out() {
        // Noise, so that the triangles inside, which decide what is inserted first, differ on opposite borders.
        let mut random = crate::random::Random::new(1, 1, 1);
        let noise = Grid::from_fn(40, 40, |_| random.unit());
        let noise = HeightField::new(noise, 0.2, grey(0.5));
        for (field, least, tolerance) in
            [(sinusoid(64, 0.1), 6, 0.01), (bumps(50, 0.2), 2, 0.01), (noise, 8, 0.4)]
        {
            let made = triangulate(&field, tolerance, usize::MAX);
            let area: f32 = made
                .triangles
                .iter()
                .map(|t| {
                    let [a, b, c] = t.map(|i| made.vertices[i as usize].truncate());
                    0.5 * (b - a).perp_dot(c - a)
                })
                .sum();
            assert!((area - 1.0).abs() < 1e-4, "{area}");
            let (first, last) = (0.5 / field.heights().width() as f32, 1.0);
            let border = |u: f32| {
                let mut on: Vec<[u32; 2]> = made
                    .vertices
                    .iter()
                    .filter(|p| p.x == u)
                    .map(|p| [p.y.to_bits(), p.z.to_bits()])
                    .collect();
                on.sort_unstable();
                on
            };
            assert!(border(first).len() >= least);
            assert_eq!(border(first), border(first + last));
        }
    }

    #[test]
    fn a_limit_on_triangles_is_kept_and_the_error_reported() {
        let made = triangulate(&bumps(128, 0.1), 0.0005, 500);
        assert!(
            made.triangles.len() <= 500 && made.error > 0.0005,
            "{} {}",
            made.triangles.len(),
            made.error
        );
    }
}

//! [`SkipBounds`]: where a walk cannot matter.
//!
//! # What is bounded
//!
//! A walk of at most `length` from a point of the triangle `T` returns the minimum of the curvature before the walk (the
//! lesser of the curvature along the ray and that of the section at the point, `k0`) and of the section's curvature on the
//! way. With `V(T) >= k0(section) - k(q)` for every section through every point of `T` and every point `q` on the way, the
//! result lies in `[k0 - V, k0]`. So where `V` is at most a tolerance the walk may be left out, and the error is one-sided
//! and at most that tolerance.
//!
//! # Why it holds
//!
//! Curvature at a point of a section with the plane normal `m` is a convex combination over the corners `j` of its triangle
//! (those with an estimate) of `k_j(m) = t_j^T S_j t_j`, where `t_j` is the unit vector along `m x n_j` and `S_j` the tensor. So
//! `V <= max over i in T, j in reach, m of k_i(m) - k_j(m)`, where the reach is every triangle that a walk can enter. A walk
//! is a path on the surface, so all of it lies within `length` of its start, and its triangles are joined by edges one after
//! another: a flood fill over edges from `T`, kept to triangles whose bounding sphere comes within `length` of that of `T`,
//! finds them all.
//!
//! `k_i(m) - k_j(m)` still depends on `m`. Let `a` be a fixed unit vector, `R_j` the smallest rotation that turns `n_j` into
//! `a`, `phi_j` its angle, and `t_a` the unit vector along `m x a`. The plane contains the normal `n` at its starting point, a
//! positive combination of the normals of the corners of `T`, so `m` is perpendicular to `n`, and with `theta` the largest
//! `phi_i` over the corners of `T`, `|m . a| <= sin theta`. With `a, e, f` a right-handed orthonormal frame such that
//! `n_j = a cos phi + e sin phi`, and `m = mu a + nu (e sin b + f cos b)`,
//!
//! ```text
//! m x a         = nu (e cos b - f sin b)
//! R_j (m x n_j) = nu e cos b + f (mu sin phi - nu cos phi sin b)
//! ```
//!
//! The two differ by `nu sin b (1 - cos phi) + mu sin phi` along `f`, so the sine of the angle `delta_j` between them, their
//! cross product over their lengths `nu` and `|m x n_j|`, is at most `(1/2 (1 - cos phi) + sin theta sin phi) / |m x n_j|`; and as
//! `n_j` is within `phi + theta` of a vector of the plane, `|m x n_j| >= cos(phi + theta)`. (Where that is not well above
//! zero, `k_j(m)` is only taken to lie between the principal curvatures.) The rotated tensor `S'_j = R_j S_j R_j^T` acts on the plane perpendicular to `a`, where turning a
//! direction by `delta` changes `t^T S' t` by at most `(k_max - k_min) sin delta`. Hence, with that as `r_j`,
//!
//! ```text
//! k_i(m) - k_j(m) <= t_a^T (S'_i - S'_j) t_a + r_i + r_j <= lambda_max(S'_i - S'_j) + r_i + r_j,
//! ```
//!
//! which no longer depends on `m`. On a sphere it is zero, on a cylinder it is of second order in the turn of the normal.
//! The maximum over `i` and `j` is `V`.
//!
//! Where the reach has more than [`MOST_REACHED`] triangles, `V` is the largest curvature in `T` less the least one of any triangle
//! within `length`, connected or not, in any direction: coarser, but found in constant time.
//!
//! All of this is arithmetic on numbers of the size of the largest curvature `K` met, so
//! `V` is widened by `1e-12 K`, thousands of roundings, and then rounded up to `f32`.

use std::collections::HashMap;

use rayon::prelude::*;

use super::surface_field::CurvatureField;
use crate::Vec3;
use crate::curvature::Principal;
use crate::mesh::Surface;

/// Triangles that a bound looks at one by one. Above, on meshes that are fine against the length of the walk, the time for
/// all triangles would grow with the square of their number.
const MOST_REACHED: usize = 512;

/// For every triangle, a bound on how much a walk of at most a given length can lower the curvature.
#[derive(Debug, Clone, PartialEq)]
pub struct SkipBounds {
    length: f64,
    bounds: Vec<f32>,
}

impl SkipBounds {
    /// Bound of a triangle for which nothing is known: the largest finite value, because glTF forbids infinities.
    pub const UNKNOWN: f32 = f32::MAX;

    /// Bounds for walks of at most `length` world units; see the source of this module for the proof.
    ///
    /// Triangles without any estimate have [`UNKNOWN`](Self::UNKNOWN). The same bits for any number of threads.
    #[must_use]
    pub fn new(field: &CurvatureField<'_>, length: f64) -> Self {
        let spheres: Vec<_> =
            (0..field.surface().triangles().len()).map(|t| sphere(field.surface(), t)).collect();
        let reaches = Reaches { field, least: Least::new(field, &spheres, length), spheres, length };
        let bounds = (0..reaches.spheres.len())
            .into_par_iter()
            .map_init(
                || Flood {
                    seen: vec![u32::MAX; reaches.spheres.len()],
                    seen_vertices: vec![u32::MAX; field.surface().positions().len()],
                    queue: Vec::new(),
                },
                |flood, triangle| reaches.bound(flood, triangle),
            )
            .collect();
        Self { length, bounds }
    }

    /// From one bound per surface vertex, as [`per_vertex`](Self::per_vertex) returns them.
    ///
    /// # Panics
    ///
    /// If `per_vertex` has not one entry per surface vertex.
    #[must_use]
    pub fn from_vertices(surface: &Surface<'_>, per_vertex: &[f32], length: f64) -> Self {
        assert_eq!(per_vertex.len(), surface.positions().len(), "one bound per surface vertex");
        // A vertex has the largest bound of its triangles, so the least of a triangle's corners is still one of its own.
        let least = |t: &[u32; 3]| t.map(|v| per_vertex[v as usize]).into_iter().fold(f32::MAX, f32::min);
        Self { length, bounds: surface.triangles().iter().map(least).collect() }
    }

    /// For every surface vertex the largest bound of the triangles around it; 0 where there is none.
    #[must_use]
    pub fn per_vertex(&self, surface: &Surface<'_>) -> Vec<f32> {
        let mut largest = vec![0.0_f32; surface.positions().len()];
        for (corners, &bound) in surface.triangles().iter().zip(&self.bounds) {
            for &v in corners {
                largest[v as usize] = largest[v as usize].max(bound);
            }
        }
        largest
    }

    /// The bound of a triangle, 1/length.
    ///
    /// # Panics
    ///
    /// If it is out of range.
    #[must_use]
    pub fn bound(&self, triangle: usize) -> f32 {
        self.bounds[triangle]
    }

    /// All bounds, in the order of the triangles.
    #[must_use]
    pub fn bounds(&self) -> &[f32] {
        &self.bounds
    }

    /// The longest walk that the bounds hold for.
    #[must_use]
    pub fn length(&self) -> f64 {
        self.length
    }

    /// Whether a walk of this length from this triangle changes the curvature by at most `tolerance`.
    #[must_use]
    pub fn allows_skip(&self, triangle: usize, length: f64, tolerance: f64) -> bool {
        length <= self.length && f64::from(self.bounds[triangle]) <= tolerance
    }
}

/// Centre and radius of a sphere around a triangle.
fn sphere(surface: &Surface<'_>, triangle: usize) -> (Vec3, f64) {
    let corners = surface.corners(triangle);
    let center = (corners[0] + corners[1] + corners[2]) / 3.0;
    (center, corners.iter().map(|p| (p - center).norm()).fold(0.0, f64::max))
}

/// Triangles within reach, found one after another, and their vertices. What was seen has the number of the triangle that
/// asked last.
struct Flood {
    seen: Vec<u32>,
    seen_vertices: Vec<u32>,
    queue: Vec<usize>,
}

/// The least curvature in any direction of the triangles in each cell of a grid whose cells are as wide as a walk and two
/// triangles, so that a walk from a triangle stays in its cell and the 26 around it.
struct Least {
    width: f64,
    cells: HashMap<[i64; 3], f64>,
}

impl Least {
    fn new(field: &CurvatureField<'_>, spheres: &[(Vec3, f64)], length: f64) -> Self {
        let largest = spheres.iter().map(|s| s.1).fold(0.0, f64::max);
        // An endless walk reaches everything; the diagonal and a half keep one cell from being a million wide.
        let width = (length + 2.0 * largest).min(2.0 * field.diagonal()) * (1.0 + 1e-9);
        let mut least = Self { width, cells: HashMap::new() };
        for (triangle, (center, _)) in spheres.iter().enumerate() {
            let corners = field.surface().triangles()[triangle];
            let kappa_min = corners.iter().filter_map(|&v| field.principal(v)).map(|p| p.kappa_min);
            let cell = least.cells.entry(least.cell(center)).or_insert(f64::INFINITY);
            *cell = kappa_min.fold(*cell, f64::min);
        }
        least
    }

    fn cell(&self, p: &Vec3) -> [i64; 3] {
        // A cast saturates; meshes whose extent is 2^63 cells do not exist, as a cell is wider than a triangle.
        #[allow(clippy::cast_possible_truncation, reason = "a number of cells")]
        [0, 1, 2].map(|k| (p[k] / self.width).floor() as i64)
    }

    fn around(&self, p: &Vec3) -> f64 {
        let [x, y, z] = self.cell(p);
        let offsets = (0..27).map(|i| [x + i % 3 - 1, y + i / 3 % 3 - 1, z + i / 9 - 1]);
        offsets.filter_map(|cell| self.cells.get(&cell)).copied().fold(f64::INFINITY, f64::min)
    }
}

struct Reaches<'a, 'f> {
    field: &'a CurvatureField<'f>,
    spheres: Vec<(Vec3, f64)>,
    least: Least,
    length: f64,
}

impl Reaches<'_, '_> {
    /// Finds the triangles that a walk from this one can enter, itself included; whether they are few enough.
    fn reach(&self, flood: &mut Flood, triangle: usize) -> bool {
        let mark = crate::mesh::index_u32(triangle);
        let (center, radius) = self.spheres[triangle];
        // Far above the rounding of a distance, far below any length that matters.
        let reach = (radius + self.length) * (1.0 + 1e-9);
        flood.queue.clear();
        flood.queue.push(triangle);
        flood.seen[triangle] = mark;
        let mut head = 0;
        while let Some(&current) = flood.queue.get(head) {
            head += 1;
            for side in 0..3 {
                let Some((next, _)) = self.field.topology().across(current, side) else { continue };
                let (other, other_radius) = self.spheres[next];
                if flood.seen[next] != mark && (other - center).norm() <= reach + other_radius {
                    flood.seen[next] = mark;
                    flood.queue.push(next);
                }
            }
            if flood.queue.len() > MOST_REACHED {
                return false;
            }
        }
        true
    }

    fn bound(&self, flood: &mut Flood, triangle: usize) -> f32 {
        let corners = self.field.surface().triangles()[triangle];
        let own: Vec<&Principal> = corners.iter().filter_map(|&v| self.field.principal(v)).collect();
        let Some(frame) = Frame::new(&own) else { return SkipBounds::UNKNOWN };
        if !self.reach(flood, triangle) {
            let most = own.iter().map(|p| p.kappa_max).fold(f64::NEG_INFINITY, f64::max);
            let least = self.least.around(&self.spheres[triangle].0);
            return round_up(most - least + 1e-12 * most.abs().max(least.abs()));
        }
        let own: Vec<Turned> = own.iter().map(|p| frame.turn(p)).collect();
        let mark = crate::mesh::index_u32(triangle);
        let (mut largest, mut scale) = (0.0_f64, 0.0_f64);
        for &vertex in flood.queue.iter().flat_map(|&t| &self.field.surface().triangles()[t]) {
            if std::mem::replace(&mut flood.seen_vertices[vertex as usize], mark) == mark {
                continue;
            }
            let Some(principal) = self.field.principal(vertex) else { continue };
            let there = frame.turn(principal);
            scale = scale.max(principal.kappa_max.abs()).max(principal.kappa_min.abs());
            for here in &own {
                largest = largest.max(most_above(here, &there));
            }
        }
        round_up(largest + 1e-12 * scale)
    }
}

/// A corner's tensor in the plane perpendicular to the reference normal, and how far off it can be.
#[derive(Debug, Clone, Copy)]
struct Turned {
    xx: f64,
    xy: f64,
    yy: f64,
    off: f64,
}

/// The largest eigenvalue of the difference, widened.
fn most_above(here: &Turned, there: &Turned) -> f64 {
    let (xx, xy, yy) = (here.xx - there.xx, here.xy - there.xy, here.yy - there.yy);
    0.5 * (xx + yy) + (0.5 * (xx - yy)).hypot(xy) + here.off + there.off
}

/// The reference of one triangle's bound.
struct Frame {
    axis: Vec3,
    x: Vec3,
    y: Vec3,
    /// Of `theta`, if that is below a right angle.
    cosine: f64,
    sine: f64,
}

impl Frame {
    /// `None` without an estimate, or where the normals cancel.
    fn new(own: &[&Principal]) -> Option<Self> {
        let sum: Vec3 = own.iter().map(|p| p.normal()).sum();
        let axis = sum.try_normalize(0.0)?;
        let cosine = own.iter().map(|p| p.normal().dot(&axis)).fold(1.0, f64::min);
        let sine = own.iter().map(|p| p.normal().cross(&axis).norm()).fold(0.0, f64::max);
        let x = Vec3::ith(axis.iamin(), 1.0);
        let x = (x - axis * axis.dot(&x)).normalize();
        Some(Self { axis, x, y: axis.cross(&x), cosine, sine })
    }

    fn turn(&self, principal: &Principal) -> Turned {
        /// Cosine of `phi + theta` from which on the direction is taken to be lost.
        const LEAST_SLOPE: f64 = 0.07;
        let n = principal.normal();
        let (cosine, sine) = (n.dot(&self.axis), n.cross(&self.axis).norm());
        let slope = cosine * self.cosine - sine * self.sine;
        let range = principal.kappa_max - principal.kappa_min;
        // With both angles under a right one, a positive cosine means that their sum is too.
        if cosine <= 0.0 || self.cosine <= 0.0 || slope < LEAST_SLOPE {
            return Turned { xx: principal.mean(), xy: 0.0, yy: principal.mean(), off: 0.5 * range };
        }
        // 1 - cos, in the form without cancellation.
        let turned = 0.5 * sine * sine / (1.0 + cosine) + self.sine * sine;
        let half_way = (n + self.axis) / (1.0 + cosine);
        let [d1, d2] = [principal.d1, principal.d2].map(|d| d - half_way * self.axis.dot(&d));
        let form = |u: &Vec3, v: &Vec3| {
            principal.kappa_max * d1.dot(u) * d1.dot(v) + principal.kappa_min * d2.dot(u) * d2.dot(v)
        };
        Turned {
            xx: form(&self.x, &self.x),
            xy: form(&self.x, &self.y),
            yy: form(&self.y, &self.y),
            off: range * (turned / slope).min(1.0),
        }
    }
}

/// The next `f32` not below.
#[allow(clippy::cast_possible_truncation, reason = "rounded up to stay a bound")]
fn round_up(x: f64) -> f32 {
    if x >= f64::from(f32::MAX) || x.is_nan() {
        return SkipBounds::UNKNOWN;
    }
    let nearest = x as f32;
    if f64::from(nearest) < x { nearest.next_up() } else { nearest }
}

//! [`Sweep`]: the silhouette cosine of a height field, without tracing rays.
//!
//! A ray enters the bounding cylinder at arc length 0 and runs towards positive `s`. It passes below the point `(s, z)` of the
//! profile if and only if its cosine is at least `-Z / hypot(X, Z)` of the bent point. The silhouette cosine is therefore the least
//! of these over the profile. As a tangent, with `a = k s`,
//!
//! `q(s, z) = -Z / X = -k z / ((1 + k z) sin a) + tan(a / 2)`,
//!
//! and no height above 0 lies beyond `tan(a / 2) = q`, which bounds the search. Stretches of the profile are skipped where even
//! their highest texel would not lower `q`. Between lines through texel centres the profile is a parabola; `q` is evaluated at both ends
//! and the middle, and where the parabola through the three has its vertex.

use glam::Vec2;

use crate::micro::HeightField;
use crate::silhouette::largest_cosine;

/// Longest distance that is searched, UV units. Curvatures for which a ray could travel farther, under `depth / 512`, have
/// silhouette cosines under `depth / 16`, and what lies farther lowers them less than what is searched.
const LONGEST: f32 = 64.0;

/// Texels in a long and in a short stretch.
pub(super) const STRETCHES: [f32; 2] = [32.0, 8.0];

/// A height field prepared for finding silhouettes.
#[derive(Debug, Clone)]
pub struct Sweep {
    width: usize,
    height: usize,
    /// `z` of the texels, with the first column and row repeated after the last, UV units.
    z: Vec<f32>,
    highest: f32,
    lowest: f32,
    /// UV units per texel.
    per_texel: Vec2,
    /// One map per entry of [`STRETCHES`].
    windows: [WindowMaxima; 2],
}

/// The highest texel in a square window around points that are spaced evenly.
#[derive(Debug, Clone)]
struct WindowMaxima {
    columns: usize,
    rows: usize,
    maxima: Vec<f32>,
}

/// A line over the grid: position in texels is `start + s rate`.
struct Line {
    start: Vec2,
    rate: Vec2,
    kappa: f32,
}

impl Sweep {
    /// Prepares a height field; the windows' maxima are about a tenth of its size.
    #[must_use]
    pub fn new(field: &HeightField) -> Self {
        let grid = field.heights();
        let (width, height) = (grid.width(), grid.height());
        let z_at =
            |i: usize| field.depth() * (grid.texel(i % (width + 1) % width, i / (width + 1) % height) - 1.0);
        let z: Vec<f32> = (0..(width + 1) * (height + 1)).map(z_at).collect();
        let highest = z.iter().copied().fold(f32::MIN, f32::max);
        let lowest = z.iter().copied().fold(f32::MAX, f32::min);
        let windows = STRETCHES.map(|length| WindowMaxima::new(&z, width, height, length));
        let per_texel = Vec2::new(1.0 / width as f32, 1.0 / height as f32);
        Self { width, height, z, highest, lowest, per_texel, windows }
    }

    /// The smallest `cos_o` at which a ray that enters at `uv` and runs along the unit vector `along` hits, in `[0, 1)`; 0
    /// where the bounding surface is flat or concave. `along` is the direction in which the ray travels: away from the viewer.
    ///
    /// Exact for the bilinear surface up to the parabola between its kinks: within 1e-4 of the depth in dip where texels are
    /// 1/64 or smaller.
    #[must_use]
    pub fn silhouette_cosine(&self, uv: Vec2, along: Vec2, kappa: f32) -> f32 {
        if kappa <= 0.0 || kappa.is_nan() || self.highest >= 0.0 && self.z_at(uv) >= 0.0 {
            return 0.0;
        }
        let q = self.least_tangent(uv, along, kappa);
        q / (1.0 + q * q).sqrt()
    }

    /// Whether a ray from the viewer in direction `wo` hits.
    #[must_use]
    pub fn hits(&self, uv: Vec2, wo: glam::Vec3, kappa: f32) -> bool {
        if wo.z <= 0.0 {
            return false;
        }
        let Some(along) = (-wo.truncate()).try_normalize() else { return true };
        wo.z >= self.silhouette_cosine(uv, along, kappa)
    }

    /// `z` at a point, UV units.
    pub(super) fn z_at(&self, uv: Vec2) -> f32 {
        let p = self.wrapped(self.texels(uv));
        self.cell(p.0, p.1).at(p.2)
    }

    fn texels(&self, uv: Vec2) -> Vec2 {
        let inside = |x: f32| if x.is_finite() { x - x.floor() } else { 0.0 };
        Vec2::new(inside(uv.x) * self.width as f32 - 0.5, inside(uv.y) * self.height as f32 - 0.5)
    }

    fn least_tangent(&self, uv: Vec2, along: Vec2, kappa: f32) -> f32 {
        // The surface is nowhere below its lowest texel, so that a ray that could pass above that all the way is the limit.
        let floor = largest_cosine(kappa, -self.lowest).min(1.0 - 1e-6);
        let mut q = floor / (1.0 - floor * floor).sqrt();
        let rate = along * Vec2::new(self.width as f32, self.height as f32);
        let line = Line { start: self.texels(uv), rate, kappa };
        let per_texel = 1.0 / rate.abs().max_element();
        let stretch = STRETCHES.map(|texels| texels * per_texel);
        // A sample from the middle of each long stretch: the lower q is, the more stretches are skipped.
        let mut s = 0.5 * stretch[0];
        while s < farthest(q, kappa) {
            let (column, row, f) = self.wrapped(line.start + s * line.rate);
            q = q.min(tangent(s, self.cell(column, row).at(f).min(0.0), kappa));
            s += stretch[0];
        }
        // Then the most promising stretch, and all others that can matter.
        let mut best = (f32::INFINITY, 0.0);
        s = 0.0;
        while s < farthest(q, kappa) {
            let z = self.highest_around(0, &line, s, s + stretch[0]);
            let bound = lower_bound(z, kappa, s, s + stretch[0]);
            if bound < best.0 {
                best = (bound, s);
            }
            s += stretch[0];
        }
        self.search(&line, best.1, stretch, &mut q);
        s = 0.0;
        while s < farthest(q, kappa) {
            let z = self.highest_around(0, &line, s, s + stretch[0]);
            if s != best.1 && may_lower(z, kappa, s, s + stretch[0], q) {
                self.search(&line, s, stretch, &mut q);
            }
            s += stretch[0];
        }
        q
    }

    /// Lowers `q` to its least in one long stretch.
    fn search(&self, line: &Line, start: f32, stretch: [f32; 2], q: &mut f32) {
        let end = start + stretch[0];
        let mut s = start;
        while s < end {
            let next = s + stretch[1];
            if may_lower(self.highest_around(1, line, s, next), line.kappa, s, next, *q) {
                self.search_cells(line, s, next.min(farthest(*q, line.kappa)).max(s), q);
            }
            s = next;
        }
    }

    /// Lowers `q` to its least between two arc lengths, cell by cell.
    fn search_cells(&self, line: &Line, from: f32, to: f32, q: &mut f32) {
        let position = line.start + from * line.rate;
        // Rounding may put a position beside a grid line into the wrong cell, where the bilinear form only extrapolates.
        let (mut column, mut row, _) = self.wrapped(position);
        let mut cell = position.floor();
        let step = Vec2::new(1.0_f32.copysign(line.rate.x), 1.0_f32.copysign(line.rate.y));
        let ahead = |cell: f32, step: f32| if step > 0.0 { cell + 1.0 } else { cell };
        let arc = |axis: usize, cell: Vec2| {
            let rate = line.rate[axis];
            if rate == 0.0 {
                f32::INFINITY
            } else {
                (ahead(cell[axis], step[axis]) - line.start[axis]) / rate
            }
        };
        let mut s = from;
        let mut next = [arc(0, cell), arc(1, cell)];
        loop {
            let end = next[0].min(next[1]).min(to).max(s);
            let texels = self.cell(column, row);
            if may_lower(texels.highest(), line.kappa, s, end, *q) {
                texels.lower(line, cell, s, end, q);
            }
            if end >= to {
                return;
            }
            s = end;
            let axis = usize::from(next[1] < next[0]);
            cell[axis] += step[axis];
            next[axis] = arc(axis, cell);
            let (index, count) = if axis == 0 { (&mut column, self.width) } else { (&mut row, self.height) };
            *index = if step[axis] > 0.0 {
                if *index + 1 == count { 0 } else { *index + 1 }
            } else if *index == 0 {
                count - 1
            } else {
                *index - 1
            };
        }
    }

    /// Lowest and highest `z`.
    pub(super) fn z_range(&self) -> [f32; 2] {
        [self.lowest, self.highest]
    }

    /// The shorter side of a texel, UV units.
    pub(super) fn texel(&self) -> f32 {
        1.0 / self.width.max(self.height) as f32
    }

    /// The highest `z` within half a stretch of [`STRETCHES`]`[level]` texels around a point.
    pub(super) fn highest_near(&self, level: usize, uv: Vec2) -> f32 {
        self.windows[level].lookup(uv - 0.5 * self.per_texel)
    }

    /// No point of the profile between the arc lengths is higher.
    #[inline]
    fn highest_around(&self, level: usize, line: &Line, from: f32, to: f32) -> f32 {
        let middle = line.start + (0.5 * (from + to)) * line.rate;
        self.windows[level].lookup(middle * self.per_texel)
    }

    /// Cell and position in it.
    #[inline]
    fn wrapped(&self, position: Vec2) -> (usize, usize, Vec2) {
        let cell = [whole_below(position.x), whole_below(position.y)];
        #[allow(
            clippy::cast_possible_truncation,
            clippy::cast_possible_wrap,
            clippy::cast_sign_loss,
            reason = "a grid's size"
        )]
        let wrap = |x: i32, n: usize| {
            if n.is_power_of_two() { x as usize & (n - 1) } else { x.rem_euclid(n as i32) as usize }
        };
        let inside = position - Vec2::new(cell[0] as f32, cell[1] as f32);
        (wrap(cell[0], self.width), wrap(cell[1], self.height), inside)
    }

    #[inline]
    fn cell(&self, column: usize, row: usize) -> Cell {
        let first = row * (self.width + 1) + column;
        let (low, high) =
            (&self.z[first..first + 2], &self.z[first + self.width + 1..first + self.width + 3]);
        Cell([low[0], low[1], high[0], high[1]])
    }
}

/// Beyond this arc length no height under 0 has a smaller tangent than `q`.
fn farthest(q: f32, kappa: f32) -> f32 {
    // The arc tangent is slow, and at most its argument.
    let far = if q < 0.5 { q } else { q.atan() };
    (2.0 * far / kappa).min(LONGEST)
}

/// A lower bound on `q` for heights up to `z` between two arc lengths: `1 / sin a >= 1 / a`, which falls, and
/// `tan x >= x + x^3 / 3`, which grows.
#[inline]
fn lower_bound(z: f32, kappa: f32, from: f32, to: f32) -> f32 {
    let half = 0.5 * kappa * from;
    let core = (1.0 + kappa * z).max(1e-3);
    // Scaled down by more than the rounding of both sides.
    (-z / (core * to) + half + half * half * half * (1.0 / 3.0)) * (1.0 - 2e-6)
}

/// Whether [`lower_bound`] is below `q`, without its division.
#[inline]
fn may_lower(z: f32, kappa: f32, from: f32, to: f32, q: f32) -> bool {
    let half = 0.5 * kappa * from;
    let core = (1.0 + kappa * z).max(1e-3);
    -z < (q * (1.0 + 4e-6) - half - half * half * half * (1.0 / 3.0)) * (core * to)
}

/// The whole number below `x`, for `|x| < 2^31`; the library's is a call on processors without SSE 4.1.
#[inline]
#[allow(clippy::cast_possible_truncation, reason = "numbers of texels within 64 tiles")]
fn whole_below(x: f32) -> i32 {
    let towards_zero = x as i32;
    towards_zero - i32::from(x < towards_zero as f32)
}

/// `q` at a point, by the continued fraction of the tangent: within 1e-6 of it, relative, for `a < pi`.
#[inline]
fn tangent(s: f32, z: f32, kappa: f32) -> f32 {
    let half = 0.5 * kappa * s;
    let x2 = half * half;
    // tan(a / 2) = k n / d.
    let n = 0.5 * s * (945.0 + x2 * (x2 - 105.0));
    let d = 945.0 + x2 * (15.0 * x2 - 420.0);
    let core = (1.0 + kappa * z).max(1e-3);
    let z = if core > 1e-3 { z } else { (1e-3 - 1.0) / kappa };
    if d <= 0.0 || half > std::f32::consts::FRAC_PI_2 {
        return f32::INFINITY;
    }
    let kn = kappa * n;
    (-z * (d * d + kn * kn) + 2.0 * kn * n * core) / (2.0 * n * d * core)
}

/// `z` at the corners of a cell: `[z00, z10, z01, z11]`.
#[derive(Clone, Copy)]
struct Cell([f32; 4]);

impl Cell {
    #[inline]
    fn highest(self) -> f32 {
        let [a, b, c, d] = self.0;
        a.max(b).max(c.max(d))
    }

    #[inline]
    fn at(self, f: Vec2) -> f32 {
        let [a, b, c, d] = self.0;
        let (low, high) = (a + (b - a) * f.x, c + (d - c) * f.x);
        low + (high - low) * f.y
    }

    /// Lowers `q` to its least on the piece of the line in this cell.
    #[inline]
    fn lower(self, line: &Line, cell: Vec2, from: f32, to: f32, q: &mut f32) {
        let origin = line.start - cell;
        let at = |s: f32| {
            let z = self.at(origin + s * line.rate).min(0.0);
            let found = tangent(s, z, line.kappa);
            // At the entry point itself a height of 0 gives 0 / 0.
            if found.is_nan() { f32::INFINITY } else { found }
        };
        let middle = 0.5 * (from + to);
        let (a, m, b) = (at(from), at(middle), at(to));
        *q = q.min(a).min(m).min(b);
        let bulge = a + b - 2.0 * m;
        // The vertex lies inside.
        if (a - b).abs() < 2.0 * bulge && bulge.is_finite() {
            let vertex = middle + 0.25 * (a - b) / bulge * (to - from);
            *q = q.min(at(vertex.clamp(from, to)));
        }
    }
}

impl WindowMaxima {
    /// Maxima for stretches of this length in texels, at points an eighth of the length apart or so.
    #[allow(clippy::cast_possible_truncation, clippy::cast_sign_loss, reason = "sizes of grids")]
    fn new(z: &[f32], width: usize, height: usize, length: f32) -> Self {
        let spacing = length / 4.0;
        let count = |n: usize| ((n as f32 / spacing).ceil() as usize).max(1);
        let (columns, rows) = (count(width), count(height));
        // Half a stretch, half the spacing, and the texels around the ends.
        let reach = |n: usize, points: usize| 0.5 * length + 0.5 * n as f32 / points as f32 + 1.01;
        let range = |i: usize, n: usize, points: usize| {
            let centre = (i as f32 + 0.5) * n as f32 / points as f32;
            let r = reach(n, points).min(n as f32);
            let first = (centre - r).floor() as i64;
            (first..=(centre + r).ceil() as i64).map(move |x| x.rem_euclid(n as i64) as usize)
        };
        // Rows first, then columns.
        let narrow: Vec<f32> = (0..height * columns)
            .map(|i| {
                let row = &z[i / columns * (width + 1)..];
                range(i % columns, width, columns).map(|x| row[x]).fold(f32::MIN, f32::max)
            })
            .collect();
        let maxima = (0..rows * columns)
            .map(|i| {
                range(i / columns, height, rows)
                    .map(|y| narrow[y * columns + i % columns])
                    .fold(f32::MIN, f32::max)
            })
            .collect();
        Self { columns, rows, maxima }
    }

    /// The maximum around the nearest point; positions are in tiles.
    #[inline]
    #[allow(clippy::cast_possible_truncation, clippy::cast_sign_loss, reason = "wrapped into the grid first")]
    fn lookup(&self, position: Vec2) -> f32 {
        let f = position - Vec2::new(whole_below(position.x) as f32, whole_below(position.y) as f32);
        let index = |f: f32, n: usize| ((f * n as f32) as usize).min(n - 1);
        self.maxima[index(f.y, self.rows) * self.columns + index(f.x, self.columns)]
    }
}

#[cfg(test)]
mod tests;

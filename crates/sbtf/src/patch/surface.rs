//! [`Patch`]: a tile bent to one curvature in one direction, and rays in it.
//!
//! The patch has no border. All copies of a tile on a cylinder are congruent: a screw motion takes one to the other. Triangles of
//! one copy are therefore bent and put into hierarchies once, and a ray is moved to each copy that it passes.
//! Strongly bent tiles are cut into blocks, so that none wraps around its cylinder.

use std::sync::Arc;

use glam::{DVec2, DVec3, Vec2, Vec3};
use osculate_geom::rays::{Bvh, Hit, Ray};

use super::shell::Shell;
use super::{Bend, TileSurface};

/// Angle over which a block may extend, radians. More than pi would make a block hide itself.
const WIDEST_BLOCK: f64 = 2.0;

/// Distance over the bounding surface after which a ray counts as lost, UV units. Only rays that graze a flat patch go so far.
const LONGEST: f64 = 64.0;

/// A microstructure on a cylinder.
#[derive(Debug)]
pub struct Patch {
    tile: Arc<TileSurface>,
    bend: Bend,
    /// Direction across the cylinder's axis in UV.
    across: DVec2,
    shell: Shell,
    /// Blocks along each side of a tile.
    divisions: i32,
    blocks: Vec<Block>,
    /// How far triangles reach over the square of their block, UV units.
    margin: f64,
}

#[derive(Debug)]
struct Block {
    bvh: Bvh,
    /// The tile's triangle for each of the hierarchy's, and its corners over the block's middle.
    sources: Vec<(u32, [Vec3; 3])>,
}

/// A place that rays start from: coordinates around the middle of a block.
#[derive(Debug, Clone, Copy)]
pub(super) struct LocalRay {
    /// Block, counted from block 0 of tile 0.
    pub block: [i32; 2],
    pub origin: Vec3,
    pub direction: Vec3,
}

/// What a ray meets.
#[derive(Debug, Clone, Copy)]
pub(super) enum Trace {
    Hit(PatchHit),
    /// It left through the bounding surface, or below a see-through material.
    Left,
    /// It found nothing where something must be: it went too far, or through a gap of rounding.
    Lost,
}

/// A hit, in the coordinates of its block.
#[derive(Debug, Clone, Copy)]
pub(super) struct PatchHit {
    pub block: [i32; 2],
    hit: Hit,
}

/// A triangle's point as shading wants it.
pub(super) struct SurfaceHit {
    /// The tile's triangle.
    pub triangle: usize,
    pub weights: [f32; 3],
    /// Texture coordinates from the middle of the block, and `z`.
    pub local: Vec3,
    pub point: osculate_geom::rays::SurfacePoint,
}

impl Patch {
    /// Bends a tile: `rotation` is the angle in radians from +u to the direction across the axis.
    ///
    /// # Panics
    ///
    /// If curvature or rotation is not finite.
    #[must_use]
    pub fn new(tile: Arc<TileSurface>, kappa: f32, rotation: f32) -> Self {
        assert!(
            kappa.is_finite() && rotation.is_finite(),
            "finite curvature {kappa} and rotation {rotation}"
        );
        let bend = Bend { kappa: f64::from(kappa) };
        let across = DVec2::from_angle(f64::from(rotation));
        #[allow(clippy::cast_possible_truncation, reason = "a small count")]
        let divisions =
            (bend.kappa.abs() * std::f64::consts::SQRT_2 / WIDEST_BLOCK).ceil().clamp(1.0, 64.0) as i32;
        // Chords of arcs bow out of the heights of their ends.
        let bow =
            bend.kappa.abs() * f64::from(tile.longest_edge).powi(2) / 8.0 + 1e-6 * f64::from(tile.depth());
        let [low, high] = tile.z_range.map(f64::from);
        let shell = Shell { bend, low: low - bow, high: high + bow };
        let mut patch = Self { tile, bend, across, shell, divisions, blocks: Vec::new(), margin: 0.0 };
        patch.fill_blocks();
        patch
    }

    /// Curvature across the axis, 1/UV units.
    #[must_use]
    pub fn kappa(&self) -> f64 {
        self.bend.kappa
    }

    /// The unit vector across the axis, in UV: the direction of rays, up to its sign.
    #[must_use]
    pub fn across(&self) -> DVec2 {
        self.across
    }

    /// The triangles before bending.
    #[must_use]
    pub fn tile(&self) -> &TileSurface {
        &self.tile
    }

    pub(super) fn bend(&self) -> Bend {
        self.bend
    }

    #[allow(
        clippy::cast_possible_truncation,
        clippy::cast_sign_loss,
        reason = "geometry becomes f32; small counts"
    )]
    fn fill_blocks(&mut self) {
        let n = self.divisions;
        let mut blocks = vec![(Vec::new(), Vec::new()); (n * n) as usize];
        let scale = n as f32;
        for (index, corners) in (0_u32..).zip(&self.tile.triangles) {
            let corners = corners.map(|i| self.tile.vertices[i as usize]);
            let middle = (corners[0] + corners[1] + corners[2]).truncate() / 3.0;
            let block = (middle * scale).floor();
            let centre = (block + 0.5) / scale;
            let local = corners.map(|p| p - centre.extend(0.0));
            for p in &local {
                let over = p.truncate().abs().max_element() - 0.5 / scale;
                self.margin = self.margin.max(f64::from(over));
            }
            let bent = local.map(|p| self.bend.point(self.patch_from_uv(p.as_dvec3())).as_vec3());
            let slot = &mut blocks[self.slot([block.x as i32, block.y as i32])];
            slot.0.push(bent);
            slot.1.push((index, local));
        }
        // Chords do not follow straight lines in UV exactly; a tenth of an edge is far more than they deviate.
        self.margin += 0.1 * f64::from(self.tile.longest_edge);
        self.blocks =
            blocks.into_iter().map(|(bent, sources)| Block { bvh: Bvh::new(bent), sources }).collect();
    }

    #[allow(clippy::cast_sign_loss, reason = "a remainder is positive")]
    fn slot(&self, block: [i32; 2]) -> usize {
        let n = self.divisions;
        (block[1].rem_euclid(n) * n + block[0].rem_euclid(n)) as usize
    }

    /// `(s, r, z)` of a vector `(u, v, z)`.
    pub(super) fn patch_from_uv(&self, p: DVec3) -> DVec3 {
        let (c, s) = (self.across.x, self.across.y);
        DVec3::new(c * p.x + s * p.y, c * p.y - s * p.x, p.z)
    }

    /// `(u, v, z)` of a vector `(s, r, z)`.
    pub(super) fn uv_from_patch(&self, p: DVec3) -> DVec3 {
        let (c, s) = (self.across.x, self.across.y);
        DVec3::new(c * p.x - s * p.y, s * p.x + c * p.y, p.z)
    }

    /// The block that holds a point of the tile, and the point from the block's middle.
    #[allow(clippy::cast_possible_truncation, reason = "inside a tile")]
    pub(super) fn locate(&self, uv: Vec2) -> ([i32; 2], DVec2) {
        let inside = DVec2::from(uv) - DVec2::from(uv).floor();
        let inside = if inside.is_finite() { inside } else { DVec2::ZERO };
        let n = f64::from(self.divisions);
        let block = (inside * n).floor();
        ([block.x as i32, block.y as i32], inside - (block + 0.5) / n)
    }

    /// Texture coordinates of a block's middle.
    pub(super) fn middle(&self, block: [i32; 2]) -> DVec2 {
        (DVec2::new(f64::from(block[0]), f64::from(block[1])) + 0.5) / f64::from(self.divisions)
    }

    /// Arc length and position along the axis of one block's middle as seen from another's.
    pub(super) fn shift(&self, from: [i32; 2], to: [i32; 2]) -> DVec2 {
        self.patch_from_uv((self.middle(to) - self.middle(from)).extend(0.0)).truncate()
    }

    /// Steps back from a point of the bounding surface, so that the ray starts above everything.
    pub(super) fn backed_off(&self, point: DVec3, wo: DVec3, cos_o: f64) -> DVec3 {
        let clear =
            Shell { high: self.shell.high.max(0.0) + 1e-5 * f64::from(self.tile.depth()), ..self.shell };
        // A line that grazes a hollow surface may never be so high: its own highest point then.
        let apex = if self.bend.kappa < 0.0 { -cos_o / self.bend.kappa } else { f64::INFINITY };
        let back = clear.exit(point, wo).unwrap_or(apex).min(apex).min(1.0);
        point + back * wo
    }

    /// The first hit, or with `ANY` whether there is one (then of any triangle).
    pub(super) fn trace<const ANY: bool>(&self, ray: &LocalRay) -> Trace {
        let (o, d) = (ray.origin.as_dvec3(), ray.direction.as_dvec3());
        let Some([start, end]) = self.shell.span(o, d) else { return Trace::Left };
        let speed = d.x.hypot(d.y).max(1e-9);
        let far = start + LONGEST / speed;
        let stop = end.min(far);
        let walk = Walk::new(self, ray.block, o, d, [start, stop]);
        match walk.run::<ANY>(ray) {
            Some(hit) => Trace::Hit(hit),
            None if end > far => Trace::Lost,
            None if self.tile.is_closed() && !self.leaves_upwards(o + end * d) => Trace::Lost,
            None => Trace::Left,
        }
    }

    fn leaves_upwards(&self, p: DVec3) -> bool {
        self.bend.unbend(p).z > 0.5 * (self.shell.low + self.shell.high)
    }

    /// What shading wants to know.
    pub(super) fn surface_hit(&self, found: &PatchHit) -> SurfaceHit {
        let block = &self.blocks[self.slot(found.block)];
        let (triangle, corners) = &block.sources[found.hit.triangle as usize];
        let [a, b, c] = found.hit.barycentrics;
        SurfaceHit {
            triangle: *triangle as usize,
            weights: found.hit.barycentrics,
            local: a * corners[0] + b * corners[1] + c * corners[2],
            point: block.bvh.surface_point(&found.hit),
        }
    }
}

/// A ray's way over the blocks.
struct Walk<'a> {
    patch: &'a Patch,
    home: [i32; 2],
    origin: DVec3,
    direction: DVec3,
    range: [f64; 2],
    steps: u32,
}

impl<'a> Walk<'a> {
    fn new(patch: &'a Patch, home: [i32; 2], origin: DVec3, direction: DVec3, range: [f64; 2]) -> Self {
        let [a, b] = range.map(|t| origin + t * direction);
        let length = patch.bend.travel(a, b).abs() + (b.y - a.y).abs();
        // The blocks around each step are visited, so that long steps visit many in vain and short ones cost themselves.
        #[allow(
            clippy::cast_possible_truncation,
            clippy::cast_sign_loss,
            reason = "at most 64 tiles of 64 blocks"
        )]
        let steps = (length * f64::from(patch.divisions) / 0.75).ceil().clamp(1.0, 1e4) as u32;
        Self { patch, home, origin, direction, range, steps }
    }

    fn run<const ANY: bool>(&self, ray: &LocalRay) -> Option<PatchHit> {
        let [start, stop] = self.range;
        let mut best: Option<PatchHit> = None;
        let mut best_t = stop;
        let mut visited = [[0, 0], [-1, -1]];
        let mut from = start;
        for step in 1..=self.steps {
            let to = start + (stop - start) * f64::from(step) / f64::from(self.steps);
            let near = self.blocks_near(from, to);
            for row in near[0][1]..=near[1][1] {
                for column in near[0][0]..=near[1][0] {
                    let inside = |x: i32, axis: usize| (visited[0][axis]..=visited[1][axis]).contains(&x);
                    if inside(column, 0) && inside(row, 1) {
                        continue;
                    }
                    if let Some((hit, t)) = self.trace_block::<ANY>([column, row], ray, from, best_t) {
                        if ANY {
                            return Some(hit);
                        }
                        (best, best_t) = (Some(hit), t);
                    }
                }
            }
            if best_t <= to {
                break;
            }
            visited = near;
            from = to;
        }
        best
    }

    /// The corners of the rectangle of blocks that may hold what the ray meets between two parameters. Arc length and position along
    /// the axis change monotonically on the way.
    #[allow(clippy::cast_possible_truncation, reason = "block numbers within 64 tiles")]
    fn blocks_near(&self, from: f64, to: f64) -> [[i32; 2]; 2] {
        let patch = self.patch;
        let foot = |t: f64| {
            let p = self.origin + t * self.direction;
            DVec2::new(patch.bend.travel(DVec3::ZERO, p), p.y)
        };
        let a = foot(from);
        let travelled =
            patch.bend.travel(self.origin + from * self.direction, self.origin + to * self.direction);
        let b = DVec2::new(a.x + travelled, self.origin.y + to * self.direction.y);
        let half = (0.5 * (b - a)).abs();
        let (c, s) = (patch.across.x.abs(), patch.across.y.abs());
        let half_uv = DVec2::new(c * half.x + s * half.y, s * half.x + c * half.y) + patch.margin;
        let middle = patch.uv_from_patch((0.5 * (a + b)).extend(0.0)).truncate();
        let n = f64::from(patch.divisions);
        let number = |x: f64, axis: usize| self.home[axis] + (x * n + 0.5).floor() as i32;
        let (low, high) = (middle - half_uv, middle + half_uv);
        [[number(low.x, 0), number(low.y, 1)], [number(high.x, 0), number(high.y, 1)]]
    }

    #[allow(clippy::cast_possible_truncation, reason = "tracing is in f32")]
    fn trace_block<const ANY: bool>(
        &self,
        block: [i32; 2],
        ray: &LocalRay,
        from: f64,
        best_t: f64,
    ) -> Option<(PatchHit, f64)> {
        let patch = self.patch;
        // In its own block the ray keeps its bits: its origin clears the triangle that it starts from.
        let (local, offset) = if block == self.home {
            (Ray::segment(ray.origin, ray.direction, best_t.next_up() as f32), 0.0)
        } else {
            let shift = patch.shift(self.home, block);
            let origin = patch.bend.seen_from(shift.x, shift.y, self.origin + from * self.direction);
            let direction = patch.bend.direction_seen_from(shift.x, self.direction);
            (Ray::segment(origin.as_vec3(), direction.as_vec3(), (best_t - from) as f32), from)
        };
        let bvh = &patch.blocks[patch.slot(block)].bvh;
        if ANY {
            let hit = Hit { t: 0.0, triangle: 0, barycentrics: [1.0, 0.0, 0.0] };
            return bvh.any_hit(&local).then_some((PatchHit { block, hit }, from));
        }
        let hit = bvh.closest_hit(&local)?;
        Some((PatchHit { block, hit }, offset + f64::from(hit.t)))
    }
}

//! [`BentMesh`]: a tile mesh bent for one query, and rays in it.
//!
//! Nothing is built per curvature and direction. A ray, straight where the layer is bent, is a curve where the layer is flat; there
//! it is followed in short straight pieces through one hierarchy, which holds the tile and a margin of its copies. The
//! triangles are those of the mesh, bent without error; a piece is off its curve by [`DEVIATION`] of the depth at most.

use glam::{DVec2, DVec3, Vec2, Vec3};
use osculate_geom::rays::{Bvh, Ray};

use super::shell::Shell;
use super::transport::{Space, Transport, Vertex};
use super::{Bend, TileSurface};

/// Distance after which a ray counts as lost, UV units.
const LONGEST: f64 = 64.0;
/// Longest piece of a ray over the surface, UV units.
const PIECE: f64 = 0.15;
/// Width of the margin of copies around the tile, UV units: pieces begin inside the tile, and are a third longer than planned at
/// most, where a curved ray runs fastest.
const MARGIN: f32 = 0.2;
/// How far a piece may be off the ray, in depths.
const DEVIATION: f64 = 1e-3;
/// Distance from the surface at which rays leave it, UV units: thirty roundings of a coordinate in the tile.
const CLEAR: f32 = 4e-6;

/// Triangles of a tile and of a margin of its copies.
#[derive(Debug)]
pub(super) struct TileBvh {
    bvh: Bvh,
    /// The tile's triangle for each of the hierarchy's.
    sources: Vec<u32>,
}

/// A tile mesh on a cylinder, around the point where a viewer's ray enters; the origin of coordinates is there.
pub(super) struct BentMesh<'a> {
    tile: &'a TileSurface,
    flat: &'a TileBvh,
    shell: Shell,
    uv: DVec2,
    /// Direction across the axis in UV.
    across: DVec2,
    light: DVec3,
}

/// A half line.
#[derive(Debug, Clone, Copy)]
pub(super) struct MeshRay {
    origin: DVec3,
    direction: DVec3,
}

/// What a ray meets.
#[derive(Debug, Clone, Copy)]
pub(super) struct MeshHit {
    /// Point in `(u, v, z)` from where the viewer's ray enters.
    from_entry: DVec3,
    /// Index in the hierarchy.
    triangle: u32,
    weights: [f32; 3],
}

enum Found {
    Hit(MeshHit),
    Left,
    /// It went too far.
    Lost,
}

impl TileBvh {
    /// Puts a tile's triangles into a hierarchy.
    pub fn new(tile: &TileSurface) -> Self {
        let (mut triangles, mut sources) = (Vec::new(), Vec::new());
        for (index, corners) in (0_u32..).zip(&tile.triangles) {
            let corners = corners.map(|i| tile.vertices[i as usize]);
            let [low, high] = [Vec3::min, Vec3::max].map(|f| f(f(corners[0], corners[1]), corners[2]));
            // The copies that reach into the square with its margin.
            let first = (-MARGIN - high.truncate()).ceil();
            let last = (1.0 + MARGIN - low.truncate()).floor();
            let mut shift = first;
            while shift.y <= last.y {
                while shift.x <= last.x {
                    triangles.push(corners.map(|p| p + shift.extend(0.0)));
                    sources.push(index);
                    shift.x += 1.0;
                }
                shift = Vec2::new(first.x, shift.y + 1.0);
            }
        }
        Self { bvh: Bvh::new(triangles), sources }
    }

    /// The first triangle under a point of the tile: its index, the weights of its corners, and `z`.
    pub fn under(&self, uv: Vec2) -> Option<(usize, [f32; 3], f32)> {
        let from = (uv - uv.floor()).extend(1.0);
        let hit = self.bvh.closest_hit(&Ray::new(from, Vec3::NEG_Z))?;
        Some((self.sources[hit.triangle as usize] as usize, hit.barycentrics, 1.0 - hit.t))
    }
}

impl<'a> BentMesh<'a> {
    /// Bends a tile along the way of a viewer's ray. `wo` and `wi` are in the frame of the entry point.
    pub fn new(
        tile: &'a TileSurface,
        flat: &'a TileBvh,
        uv: Vec2,
        kappa: f32,
        wo: Vec3,
        wi: Vec3,
    ) -> (Self, MeshRay) {
        let across = DVec2::from(-wo.truncate()).try_normalize().unwrap_or(DVec2::X);
        let [low, high] = tile.z_range.map(f64::from);
        // What is level with the bounding surface is to be found too.
        let slack = 1e-5 * f64::from(tile.depth());
        let shell = Shell { bend: Bend { kappa: f64::from(kappa) }, low: low - slack, high: high + slack };
        let inside = DVec2::from(uv) - DVec2::from(uv).floor();
        let uv = if inside.is_finite() { inside } else { DVec2::ZERO };
        let mut mesh = Self { tile, flat, shell, uv, across, light: DVec3::Z };
        mesh.light = mesh.patch_from_uv(wi.as_dvec3());
        let origin = DVec3::new(0.0, 0.0, 2.0 * slack);
        let ray = MeshRay { origin, direction: -mesh.patch_from_uv(wo.as_dvec3()) };
        (mesh, ray)
    }

    /// Whether a ray hits.
    pub fn hits(&self, ray: &MeshRay) -> bool {
        matches!(self.find::<true>(ray), Found::Hit(_))
    }

    /// Texture coordinates of a hit less those of the entry point.
    pub fn offset(hit: &MeshHit) -> Vec2 {
        hit.from_entry.truncate().as_vec2()
    }

    fn patch_from_uv(&self, p: DVec3) -> DVec3 {
        let (c, s) = (self.across.x, self.across.y);
        DVec3::new(c * p.x + s * p.y, c * p.y - s * p.x, p.z)
    }

    fn uv_from_patch(&self, p: DVec3) -> DVec3 {
        let (c, s) = (self.across.x, self.across.y);
        DVec3::new(c * p.x - s * p.y, s * p.x + c * p.y, p.z)
    }

    /// A point on a ray in `(u, v, z)` of the flat layer, from the entry point.
    fn flat_point(&self, ray: &MeshRay, t: f64) -> DVec3 {
        self.uv_from_patch(self.shell.bend.unbend(ray.origin + t * ray.direction))
    }

    /// How many pieces a stretch takes. The curve turns by the curvature times the length over the surface, sideways where
    /// it goes down and downwards where it goes along.
    #[allow(clippy::cast_possible_truncation, clippy::cast_sign_loss, reason = "at most 64 tiles of pieces")]
    fn pieces(&self, ray: &MeshRay, start: f64, stop: f64) -> u32 {
        let [a, b] = [start, stop].map(|t| ray.origin + t * ray.direction);
        let along = self.shell.bend.travel(a, b).abs();
        let down = (self.shell.high - self.shell.low).min(stop - start);
        let turn = self.shell.bend.kappa.abs() * along * (along + 2.0 * down);
        let curved = (turn / (8.0 * DEVIATION * f64::from(self.tile.depth()))).sqrt();
        curved.max((along + (b.y - a.y).abs()) / PIECE).ceil().clamp(1.0, 4096.0) as u32
    }

    /// The first hit, or with `ANY` any.
    #[allow(clippy::cast_possible_truncation, reason = "tracing is in f32, inside the tile")]
    fn find<const ANY: bool>(&self, ray: &MeshRay) -> Found {
        let Some([start, end]) = self.shell.span(ray.origin, ray.direction) else { return Found::Left };
        let stop = end.min(start + LONGEST);
        let pieces = self.pieces(ray, start, stop);
        let mut from = self.flat_point(ray, start);
        for piece in 1..=pieces {
            let share = f64::from(piece) / f64::from(pieces);
            let to = self.flat_point(ray, start + (stop - start) * share);
            let tile = (self.uv + from.truncate()).floor().extend(0.0);
            let local = |p: DVec3| (p + self.uv.extend(0.0) - tile).as_vec3();
            let direction = local(to) - local(from);
            if direction != Vec3::ZERO {
                // One rounding over the end: the next piece starts in another tile.
                let segment = Ray::segment(local(from), direction, 1.0 + 1e-6);
                let hit = if ANY {
                    let any = || MeshHit { from_entry: from, triangle: 0, weights: [1.0, 0.0, 0.0] };
                    self.flat.bvh.any_hit(&segment).then(any)
                } else {
                    self.flat.bvh.closest_hit(&segment).map(|hit| MeshHit {
                        from_entry: from + f64::from(hit.t) * (to - from),
                        triangle: hit.triangle,
                        weights: hit.barycentrics,
                    })
                };
                if let Some(hit) = hit {
                    return Found::Hit(hit);
                }
            }
            from = to;
        }
        if stop < end { Found::Lost } else { Found::Left }
    }
}

impl Space for BentMesh<'_> {
    type Ray = MeshRay;
    type Hit = MeshHit;
    type Start = DVec3;

    fn closest(&self, ray: &MeshRay) -> Option<MeshHit> {
        match self.find::<false>(ray) {
            Found::Hit(hit) => Some(hit),
            Found::Left | Found::Lost => None,
        }
    }

    fn leaves(&self, ray: &MeshRay) -> bool {
        matches!(self.find::<true>(ray), Found::Left)
    }

    fn vertex(&self, ray: &MeshRay, hit: &MeshHit, transport: &Transport) -> Option<Vertex<DVec3>> {
        let bend = self.shell.bend;
        let [a, b, c] = self.flat.bvh.triangles()[hit.triangle as usize];
        let flat_normal = (b - a).cross(c - a).try_normalize()?;
        let foot = self.patch_from_uv(hit.from_entry);
        let bent = |n: Vec3| bend.normal(foot.x, foot.z, self.patch_from_uv(n.as_dvec3())).as_vec3();
        let wo = -ray.direction.as_vec3();
        let facet = bent(flat_normal);
        let side = if facet.dot(wo) < 0.0 { -1.0 } else { 1.0 };
        let uv = self.uv + hit.from_entry.truncate();
        let triangle = self.flat.sources[hit.triangle as usize] as usize;
        let point = self.tile.point(triangle, hit.weights, (uv - uv.floor()).as_vec2());
        let smooth = if point.normal == Vec3::ZERO { Vec3::ZERO } else { bent(point.normal) };
        let start = foot + self.patch_from_uv((side * CLEAR * flat_normal).as_dvec3());
        Some(Vertex::new(bend.point(start), wo, side * facet, smooth, transport.bsdf(&point.reflectance)))
    }

    fn ray_from(&self, start: &DVec3, direction: Vec3) -> MeshRay {
        MeshRay { origin: *start, direction: direction.as_dvec3() }
    }

    fn light_at(&self, _start: &DVec3) -> Vec3 {
        self.light.as_vec3()
    }
}

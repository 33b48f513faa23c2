//! [`Met`]: a ray that meets a bounding surface with a silhouette BTF under it.
//!
//! The material has a metric of its own: lengths in tiles, of `tile_size` in the world. A mesh lays its UV out with another one.
//! Along a ray whose UV go on at the rate `q` (tiles per world unit, a vector), the material passes by `rate = |q| tile_size`
//! times as fast as where it was made for. In its metric the ray's azimuth is `q / |q|`, its tangential component is `rate`
//! times as long, and the curvature is `kappa tile_size / rate^2`. With `rate = 1` that is the paper's correction for scale
//! (Kuznetsov et al. 2022, Sec. 4.5).
//!
//! Patches that materials learn from are bent in the ray's plane only. Where the surface is bent across it too, the neighbours that throw
//! shadows stand lower there, or higher, than in a patch. With the chord query, light that comes across is lifted by as much: see
//! [`Bend`].

use glam::{Mat2, Vec2, Vec3};
use osculate_geom::rays::{Hit, SurfacePoint};
use osculate_sbtf::{Entry, Incidence, SilhouetteBtf};

use crate::bend::Bend;
use crate::counters::Counters;
use crate::math::Frame;
use crate::prepared::{Facet, Prepared};
use crate::present::{OFFSET, OPACITY};
use crate::scene::{QueryForm, RayCurvature, SilhouetteMaterial};

/// What answers queries.
pub(crate) type Btf = dyn SilhouetteBtf + Send + Sync;

/// What a ray wants to know.
#[derive(Debug, Clone, Copy, PartialEq, Eq)]
pub(crate) enum Purpose {
    /// To go on from there.
    Path,
    /// To know what gets through.
    Shadow,
}

/// A ray that meets the bounding surface of a material with silhouettes.
pub(crate) enum Met<'a> {
    /// From inside: nothing is there.
    Back,
    /// What stops every ray, and that was all that was asked.
    Opaque,
    /// Where it enters.
    Front(SilhouettePoint<'a>),
}

/// Where a ray enters a bounding surface, and how its material is asked.
#[derive(Debug, Clone, Copy)]
pub(crate) struct SilhouettePoint<'a> {
    material: &'a SilhouetteMaterial,
    surface: SurfacePoint,
    /// Around the smooth normal, which is not bent towards the viewer: it decides where the silhouette is.
    frame: Frame,
    /// UV of tiles, per world unit along the frame's tangents.
    uv_from_tangent: Mat2,
    /// Turns (and mirrors, if the UV are) the frame's tangents so that the way of the ray becomes that of its query. Directions to
    /// the light are drawn in the turned frame, which keeps densities as they are.
    turn: Mat2,
    /// `wo` in the turned frame.
    turned_wo: Vec3,
    /// Of the query.
    uv: Vec2,
    wo: Vec3,
    kappa_hat: f32,
    /// Of the surface across the ray's plane.
    bend: Bend,
    /// Whether the opacity is not known beforehand.
    asks_opacity: bool,
    /// Whether what it shows may lie beside the point.
    asks_offset: bool,
}

impl<'a> Met<'a> {
    /// What the ray that comes from direction `wo` (unit) meets; `None` if the triangle's material has no silhouettes.
    pub(crate) fn new(
        scene: &'a Prepared,
        hit: &Hit,
        wo: Vec3,
        purpose: Purpose,
        counters: &mut Counters,
    ) -> Option<Self> {
        let material = scene.material_of(hit.triangle)?.silhouette.as_ref()?;
        let surface = scene.geometry.surface_point(hit);
        let [a, b, c] = hit.barycentrics;
        let Facet { corners, normals, uvs } = scene.facet(hit.triangle);
        let blended = a * normals[0] + b * normals[1] + c * normals[2];
        let normal = blended.try_normalize().unwrap_or(surface.normal);
        if surface.normal.dot(wo) <= 0.0 || normal.dot(wo) <= 0.0 {
            return Some(Self::Back);
        }
        let (object, triangle) = scene.object_of(hit.triangle)?;
        let told = scene.told(object);
        if purpose == Purpose::Shadow && !told.opacity {
            return Some(Self::Opaque);
        }
        let frame = Frame::new(normal);
        let uvs = uvs.unwrap_or_default().map(|uv| Vec2::from(uv) * Vec2::from(material.tiles));
        let uv = a * uvs[0] + b * uvs[1] + c * uvs[2];
        let uv_from_tangent = uv_per_length(corners, uvs, &frame);
        if told.steep_is_opaque && purpose == Purpose::Shadow {
            let flat = SilhouettePoint::new(material, surface, frame, uv, uv_from_tangent, None, wo);
            if flat.wo.z >= material.btf.opaque_from() {
                counters.curvature_skips += 1;
                return Some(Self::Opaque);
            }
        }
        let along = if told.curvature {
            scene.ray_curvature((object, triangle), hit.barycentrics, wo, counters)
        } else {
            None
        };
        let point = SilhouettePoint::new(material, surface, frame, uv, uv_from_tangent, along, wo);
        Some(Self::Front(SilhouettePoint { asks_opacity: told.opacity, asks_offset: told.offset, ..point }))
    }
}

impl<'a> SilhouettePoint<'a> {
    fn new(
        material: &'a SilhouetteMaterial,
        surface: SurfacePoint,
        frame: Frame,
        uv: Vec2,
        uv_from_tangent: Mat2,
        along: Option<RayCurvature>,
        wo: Vec3,
    ) -> Self {
        let local = frame.local_from_world(wo);
        let tangential = local.truncate();
        let sine = tangential.length();
        // The way the ray goes, tiles per world unit; at normal incidence any direction will do.
        let forward = if sine > 0.0 { -tangential / sine } else { Vec2::X };
        let across = along.and_then(|a| a.across).unwrap_or(0.0);
        let mean = match material.query {
            QueryForm::Chord => along.and_then(|a| a.uv_rate),
            QueryForm::Paper => None,
        };
        let q = mean.map_or(uv_from_tangent * forward, |q| Vec2::from(q) * Vec2::from(material.tiles));
        let rate = (q.length() * material.tile_size).clamp(1e-3, 1e3);
        let azimuth = q.try_normalize().unwrap_or(forward);
        let mirrored = if uv_from_tangent.determinant() < 0.0 { -1.0 } else { 1.0 };
        let turn = Mat2::from_cols(azimuth, mirrored * azimuth.perp())
            * Mat2::from_cols(forward, forward.perp()).transpose();
        Self {
            material,
            surface,
            frame,
            uv_from_tangent,
            turn,
            turned_wo: (turn * tangential).extend(local.z),
            uv,
            wo: (-rate * sine * azimuth).extend(local.z).normalize(),
            kappa_hat: along.map_or(0.0, |a| a.kappa) * material.tile_size / (rate * rate),
            bend: match material.query {
                QueryForm::Chord => Bend::new(forward.perp(), across * material.tile_size * material.depth),
                QueryForm::Paper => Bend::NONE,
            },
            asks_opacity: true,
            asks_offset: true,
        }
    }

    /// What is asked.
    pub(crate) fn btf(&self) -> &'a Btf {
        &*self.material.btf
    }

    /// The query without a light.
    pub(crate) fn incidence(&self) -> Incidence {
        Incidence { uv: self.uv, wo: self.wo, kappa_hat: self.kappa_hat }
    }

    /// Whether the opacity has to be asked for; otherwise it is 1.
    #[inline(always)]
    pub(crate) fn asks_opacity(&self) -> bool {
        OPACITY && self.asks_opacity
    }

    /// Share of rays that hit.
    pub(crate) fn alpha(&self, counters: &mut Counters) -> f32 {
        if !self.asks_opacity() {
            return 1.0;
        }
        counters.opacity_queries += 1;
        self.btf().alpha(self.uv, self.wo, self.kappa_hat)
    }

    /// Whether it has to be asked where the material is hit; otherwise that is [`Self::unmoved`].
    #[inline(always)]
    pub(crate) fn asks_offset(&self) -> bool {
        OFFSET && self.asks_offset
    }

    /// The material hit where the ray meets the surface.
    pub(crate) fn unmoved(&self) -> Entry {
        Entry { uv: self.uv, wo: self.wo, kappa_hat: self.kappa_hat, hit_uv: self.uv }
    }

    /// The point as a path vertex.
    pub(crate) fn enter(&self, counters: &mut Counters) -> SilhouetteVertex<'_> {
        if !self.asks_offset() {
            return self.entered(self.unmoved());
        }
        counters.offset_queries += 1;
        self.entered(self.btf().enter(self.uv, self.wo, self.kappa_hat))
    }

    /// The same with the material's answer.
    pub(crate) fn entered(&self, entry: Entry) -> SilhouetteVertex<'_> {
        SilhouetteVertex { point: self, entry }
    }
}

/// A point where the ray hits the material, ready for any number of lights.
#[derive(Debug, Clone, Copy)]
pub(crate) struct SilhouetteVertex<'v> {
    point: &'v SilhouettePoint<'v>,
    entry: Entry,
}

impl<'v> SilhouetteVertex<'v> {
    /// The smooth normal of the bounding surface.
    pub(crate) fn normal(&self) -> Vec3 {
        self.point.frame.n
    }

    /// Where rays start that go on in this direction.
    pub(crate) fn origin_towards(&self, direction: Vec3) -> Vec3 {
        self.point.surface.origin_towards(direction)
    }

    /// What is asked for a colour.
    pub(crate) fn btf(&self) -> &'v Btf {
        self.point.btf()
    }

    /// What lights share.
    pub(crate) fn entry(&self) -> &Entry {
        &self.entry
    }

    /// Reflected radiance for light of unit irradiance from the world direction `wi`, and the density with which
    /// [`Self::draw`] draws it.
    pub(crate) fn eval(&self, wi: Vec3) -> (Vec3, f32) {
        (self.btf().rgb(&self.entry, self.query_wi(wi)), self.pdf(wi))
    }

    /// The world direction `wi` in the material's metric.
    pub(crate) fn query_wi(&self, wi: Vec3) -> Vec3 {
        let &SilhouettePoint { material, frame, uv_from_tangent, .. } = self.point;
        let local = self.point.bend.lifted(frame.local_from_world(wi));
        let tangent = uv_from_tangent * local.truncate() * material.tile_size;
        // Zero only on a triangle without UV area, lit along it.
        tangent.extend(local.z).try_normalize().unwrap_or(Vec3::Z)
    }

    /// The density of [`Self::draw`] over solid angle.
    pub(crate) fn pdf(&self, wi: Vec3) -> f32 {
        let &SilhouettePoint { material, frame, turn, bend, .. } = self.point;
        let local = frame.local_from_world(wi);
        let lifted = bend.lifted(local);
        material.sampler.pdf(&self.turned(), (turn * lifted.truncate()).extend(lifted.z))
            * bend.magnification(local)
    }

    /// What directions are drawn for: the query, with `wo` as it is in the world. Materials that make nothing of curvature may or may not be
    /// told it, which must not change what is drawn.
    fn turned(&self) -> Incidence {
        let &SilhouettePoint { turned_wo, uv, kappa_hat, .. } = self.point;
        let kappa_hat = if self.btf().uses_curvature() { kappa_hat } else { 0.0 };
        Incidence { uv, wo: turned_wo, kappa_hat }
    }

    /// Draws a world direction.
    pub(crate) fn draw(&self, pick: f32, u: [f32; 2]) -> Vec3 {
        let &SilhouettePoint { material, frame, turn, bend, .. } = self.point;
        let turned = material.sampler.draw(&self.turned(), pick, u.into());
        frame.world_from_local(bend.lowered((turn.transpose() * turned.truncate()).extend(turned.z)))
    }
}

/// UV per world unit along the tangents of a frame, from the triangle's plane; zero for triangles without area.
fn uv_per_length([p0, p1, p2]: [Vec3; 3], [a, b, c]: [Vec2; 3], frame: &Frame) -> Mat2 {
    let flat = |p: Vec3| Vec2::new((p - p0).dot(frame.t), (p - p0).dot(frame.b));
    let edges = Mat2::from_cols(flat(p1), flat(p2));
    if edges.determinant() == 0.0 {
        return Mat2::ZERO;
    }
    Mat2::from_cols(b - a, c - a) * edges.inverse()
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn uv_rates_of_a_stretched_triangle() {
        let corners = [Vec3::ZERO, Vec3::new(2.0, 0.0, 0.0), Vec3::new(1.0, 4.0, 0.0)];
        // u is x / 2 and v is -y.
        let uvs = [Vec2::ZERO, Vec2::new(1.0, 0.0), Vec2::new(0.5, -4.0)];
        let frame = Frame { t: Vec3::X, b: Vec3::Y, n: Vec3::Z };
        let rate = uv_per_length(corners, uvs, &frame);
        assert!((rate * Vec2::X - Vec2::new(0.5, 0.0)).length() < 1e-6);
        assert!((rate * Vec2::Y - Vec2::new(0.0, -1.0)).length() < 1e-6);
        assert_eq!(uv_per_length([Vec3::ZERO; 3], uvs, &frame), Mat2::ZERO);
    }
}

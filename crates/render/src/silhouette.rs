//! [`SilhouettePoint`]: a ray that meets a bounding surface with a silhouette BTF under it.
//!
//! The material has a metric of its own: lengths in tiles, of `tile_size` in the world. A mesh lays its UV out with another one.
//! Along a ray whose UV go on at the rate `q` (tiles per world unit, a vector), the material passes by `rate = |q| tile_size`
//! times as fast as where it was made for. In its metric the ray's azimuth is `q / |q|`, its tangential component is `rate`
//! times as long, and the curvature is `kappa tile_size / rate^2`. With `rate = 1` that is the paper's correction for scale
//! (Kuznetsov et al. 2022, Sec. 4.5).

use glam::{Mat2, Vec2, Vec3};
use osculate_geom::rays::{Hit, SurfacePoint};
use osculate_sbtf::Query;

use crate::math::Frame;
use crate::prepared::Prepared;
use crate::scene::{QueryForm, SilhouetteMaterial};

/// Where a ray enters a bounding surface, and how its material is asked.
#[derive(Debug, Clone, Copy)]
pub(crate) struct SilhouettePoint<'a> {
    material: &'a SilhouetteMaterial,
    surface: SurfacePoint,
    /// Around the smooth normal, which is not bent towards the viewer: it decides where the silhouette is.
    pub frame: Frame,
    /// UV of tiles, per world unit along the frame's tangents.
    uv_from_tangent: Mat2,
    /// Turns (and mirrors, if the UV are) the frame's tangents so that the way of the ray becomes that of its query. Directions to
    /// the light are drawn in the turned frame, which keeps densities as they are.
    turn: Mat2,
    /// `wo` in the turned frame.
    turned_wo: Vec3,
    query: Query,
    pub alpha: f32,
}

impl<'a> SilhouettePoint<'a> {
    /// The point where the ray that comes from direction `wo` (unit) enters; `None` if the triangle's material has no
    /// silhouettes. On back faces nothing is hit: `alpha` is 0.
    pub(crate) fn new(scene: &'a Prepared, hit: &Hit, wo: Vec3) -> Option<Self> {
        let triangle = hit.triangle as usize;
        let number = *scene.material_of.get(triangle)? as usize;
        let material = scene.materials[number].silhouette.as_ref()?;
        let surface = scene.bvh.surface_point(hit);
        let corners = scene.indices[triangle].map(|i| i as usize);
        let [a, b, c] = hit.barycentrics;
        let blend = |values: [Vec3; 3]| a * values[0] + b * values[1] + c * values[2];
        let normal = blend(corners.map(|i| scene.normals[i])).try_normalize().unwrap_or(surface.normal);
        let frame = Frame::new(normal);
        let uvs = corners.map(|i| Vec2::from(scene.uvs[i]) * Vec2::from(material.tiles));
        let uv_from_tangent = uv_per_length(scene.bvh.triangles()[triangle], uvs, &frame);
        let uv = a * uvs[0] + b * uvs[1] + c * uvs[2];
        let mut point = Self {
            material,
            surface,
            frame,
            uv_from_tangent,
            turn: Mat2::IDENTITY,
            turned_wo: Vec3::Z,
            query: Query { uv, wo: Vec3::Z, wi: Vec3::Z, kappa_hat: 0.0 },
            alpha: 0.0,
        };
        if surface.normal.dot(wo) > 0.0 && normal.dot(wo) > 0.0 {
            point.look(scene, hit, wo);
        }
        Some(point)
    }

    /// Fills in what depends on the viewer.
    fn look(&mut self, scene: &Prepared, hit: &Hit, wo: Vec3) {
        let local = self.frame.local_from_world(wo);
        let tangential = local.truncate();
        let sine = tangential.length();
        let along = scene.ray_curvature(hit, wo);
        let kappa = along.map_or(0.0, |a| a.kappa);
        // The way the ray goes, tiles per world unit; at normal incidence any direction will do.
        let forward = if sine > 0.0 { -tangential / sine } else { Vec2::X };
        let mean = match self.material.query {
            QueryForm::Chord => along.and_then(|a| a.uv_rate),
            QueryForm::Paper => None,
        };
        let q =
            mean.map_or(self.uv_from_tangent * forward, |q| Vec2::from(q) * Vec2::from(self.material.tiles));
        let size = self.material.tile_size;
        let rate = (q.length() * size).clamp(1e-3, 1e3);
        let azimuth = q.try_normalize().unwrap_or(forward);
        let mirrored = if self.uv_from_tangent.determinant() < 0.0 { -1.0 } else { 1.0 };
        self.turn = Mat2::from_cols(azimuth, mirrored * azimuth.perp())
            * Mat2::from_cols(forward, forward.perp()).transpose();
        self.turned_wo = (self.turn * tangential).extend(local.z);
        self.query.wo = (-rate * sine * azimuth).extend(local.z).normalize();
        self.query.kappa_hat = kappa * size / (rate * rate);
        self.alpha = self.material.btf.alpha(self.query.uv, self.query.wo, self.query.kappa_hat);
    }

    /// Whether the material was asked: not on back faces.
    pub(crate) fn is_asked(&self) -> bool {
        self.query.wo != Vec3::Z || self.alpha > 0.0
    }

    /// Where rays start that go on in this direction.
    pub(crate) fn origin_towards(&self, direction: Vec3) -> Vec3 {
        self.surface.origin_towards(direction)
    }

    /// Reflected radiance for light of unit irradiance from the world direction `wi`, and the density with which
    /// [`Self::sample`] draws it.
    pub(crate) fn eval(&self, wi: Vec3) -> (Vec3, f32) {
        let local = self.frame.local_from_world(wi);
        let tangent = self.uv_from_tangent * local.truncate() * self.material.tile_size;
        let query = Query { wi: tangent.extend(local.z).normalize(), ..self.query };
        let turned = (self.turn * local.truncate()).extend(local.z);
        let pdf = self.material.sampler.pdf(self.query.uv, self.turned_wo, turned);
        (self.material.btf.eval(&query).rgb, pdf)
    }

    /// Draws a direction: world direction, reflected radiance over density, and density.
    pub(crate) fn sample(&self, pick: f32, u: [f32; 2]) -> Option<(Vec3, Vec3, f32)> {
        let (turned, _) = self.material.sampler.sample(self.query.uv, self.turned_wo, pick, u.into());
        let local = (self.turn.transpose() * turned.truncate()).extend(turned.z);
        let wi = self.frame.world_from_local(local);
        let (value, pdf) = self.eval(wi);
        (pdf > 0.0 && value != Vec3::ZERO).then(|| (wi, value / pdf, pdf))
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

//! [`FieldTracer`]: a height field that is bent for each query on its own.

use glam::{Vec2, Vec3};

use super::Sweep;
use super::first_features::first_features;
use super::march::{BentField, FieldRay};
use super::tile::{FieldShading, Shading};
use super::transport::{PatchSample, Space, Transport};
use crate::micro::HeightField;
use crate::model::TextureShape;
use crate::query::Query;
use crate::random::Random;
use crate::samples::Features;

/// Traces a height field without triangles: silhouettes by [`Sweep`], colours by marching. Nothing is prepared per curvature or direction.
#[derive(Debug)]
pub(crate) struct FieldTracer {
    pub sweep: Sweep,
    shading: FieldShading,
}

impl FieldTracer {
    pub fn new(field: &HeightField, shading: Shading) -> Self {
        Self { sweep: Sweep::new(field), shading: FieldShading::new(field, shading) }
    }

    /// The field around the point where a viewer's ray enters, and that ray.
    pub fn bent(&self, uv: Vec2, kappa: f32, wo: Vec3, wi: Vec3) -> (BentField<'_>, FieldRay) {
        BentField::new(&self.sweep, &self.shading, uv, kappa, wo, wi)
    }

    /// What feature textures may begin with.
    pub fn first_features(&self, which: Features, shape: TextureShape, random: &mut Random) -> Vec<f32> {
        first_features(self.shading.field(), &self.shading.normals(), which, shape, random)
    }

    /// Texture coordinates of the first hit less those of the entry point; `None` where the ray passes.
    pub fn offset(&self, uv: Vec2, wo: Vec3, kappa: f32) -> Option<Vec2> {
        if !self.sweep.hits(uv, wo, kappa) {
            return None;
        }
        let (space, ray) = self.bent(uv, kappa, wo, Vec3::Z);
        Some(space.closest(&ray).map_or(Vec2::ZERO, |t| space.offset(&ray, t)))
    }

    /// Where a query's ray hits, and the mean of so many paths from there; `None` where it passes.
    ///
    /// A ray that is opaque but meets nothing (it grazes for 64 tiles, or a peak thinner than half a texel) sees black at once.
    pub fn sample(
        &self,
        transport: &Transport,
        query: &Query,
        paths: u32,
        random: &mut Random,
    ) -> Option<PatchSample> {
        let Query { uv, wo, wi, kappa_hat } = *query;
        if !self.sweep.hits(uv, wo, kappa_hat) {
            return None;
        }
        let (space, ray) = self.bent(uv, kappa_hat, wo, wi);
        let Some(hit) = space.closest(&ray) else {
            return Some(PatchSample { offset: Vec2::ZERO, rgb: Vec3::ZERO });
        };
        let sum: Vec3 = (0..paths).map(|_| transport.radiance(&space, ray, hit, random)).sum();
        Some(PatchSample { offset: space.offset(&ray, hit), rgb: sum / paths as f32 })
    }
}

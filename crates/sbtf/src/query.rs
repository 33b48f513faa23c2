//! [`Query`], [`Answer`], and [`SilhouetteBtf`], which turns the one into the other.

use glam::{Vec2, Vec3};

/// What a renderer asks of a material, at the point where a ray enters the bounding surface.
#[derive(Debug, Clone, Copy, PartialEq)]
pub struct Query {
    /// Texture coordinates of the entry point; any finite value, the material repeats.
    pub uv: Vec2,
    /// Unit direction to the viewer in the frame of the entry point. `wo.z <= 0` looks at the back and hits nothing.
    pub wo: Vec3,
    /// Unit direction to the light; the whole sphere.
    pub wi: Vec3,
    /// Curvature along the ray times the length of a UV unit.
    pub kappa_hat: f32,
}

/// What the material shows.
#[derive(Debug, Clone, Copy, PartialEq, Default)]
pub struct Answer {
    /// Radiance towards the viewer under a directional light that would give a surface facing it unit irradiance; the cosine
    /// is included. Zero where `alpha` is.
    pub rgb: Vec3,
    /// Share of rays that hit the material, in `[0, 1]`; 0 where the ray passes above it.
    pub alpha: f32,
}

/// A material that can be asked: a trained model, or the exact tracer that judges it.
pub trait SilhouetteBtf: Sync {
    /// The answer to one query.
    fn eval(&self, query: &Query) -> Answer;

    /// Opacity alone; never depends on the light.
    fn alpha(&self, uv: Vec2, wo: Vec3, kappa_hat: f32) -> f32;

    /// The answers to many queries, in their order.
    fn eval_batch(&self, queries: &[Query], answers: &mut [Answer]) {
        for (query, answer) in queries.iter().zip(answers) {
            *answer = self.eval(query);
        }
    }
}

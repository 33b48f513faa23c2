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

/// A query without its light.
#[derive(Debug, Clone, Copy, PartialEq)]
pub struct Incidence {
    /// As in [`Query`].
    pub uv: Vec2,
    /// As in [`Query`].
    pub wo: Vec3,
    /// As in [`Query`].
    pub kappa_hat: f32,
}

/// Where a ray that hits meets the material: what does not depend on the light.
#[derive(Debug, Clone, Copy, PartialEq)]
pub struct Entry {
    /// As in [`Query`].
    pub uv: Vec2,
    /// As in [`Query`].
    pub wo: Vec3,
    /// As in [`Query`].
    pub kappa_hat: f32,
    /// Texture coordinates of the hit, for materials that find it before they know the light.
    pub hit_uv: Vec2,
}

/// Where a material may let rays pass.
#[derive(Debug, Clone, Copy, PartialEq, Eq)]
pub enum SeeThrough {
    /// Nowhere that is seen from outside.
    Nowhere,
    /// Where `kappa_hat` is positive, as a height field does; opaque elsewhere.
    WhereConvex,
    /// Anywhere.
    Anywhere,
}

/// A material that can be asked: a trained model, or the exact tracer that judges it.
pub trait SilhouetteBtf: Sync {
    /// The answer to one query.
    fn eval(&self, query: &Query) -> Answer;

    /// Opacity alone; never depends on the light.
    fn alpha(&self, uv: Vec2, wo: Vec3, kappa_hat: f32) -> f32;

    /// What is known of the opacity before anybody asks for it, for all `wo` above the horizon. By default nothing.
    fn see_through(&self) -> SeeThrough {
        SeeThrough::Anywhere
    }

    /// Whether any answer depends on `kappa_hat`. By default yes.
    fn uses_curvature(&self) -> bool {
        true
    }

    /// The least `wo.z` from which on the opacity is 1, whatever the texture coordinates and the curvature, for `wo` above the horizon. By
    /// default infinity: nothing is known.
    fn opaque_from(&self) -> f32 {
        f32::INFINITY
    }

    /// Does for a ray that hits what several lights will share.
    fn enter(&self, uv: Vec2, wo: Vec3, kappa_hat: f32) -> Entry {
        Entry { uv, wo, kappa_hat, hit_uv: uv }
    }

    /// [`Answer::rgb`] of an entry that [`Self::enter`] returned, under light from `wi`.
    fn rgb(&self, entry: &Entry, wi: Vec3) -> Vec3 {
        let Entry { uv, wo, kappa_hat, .. } = *entry;
        self.eval(&Query { uv, wo, wi, kappa_hat }).rgb
    }

    /// [`Self::alpha`] of many rays, in their order. An answer does not depend on what else is in the batch; it may differ from the
    /// single one by the order of sums.
    ///
    /// # Panics
    ///
    /// If there are not as many opacities as rays.
    fn alpha_batch(&self, rays: &[Incidence], alphas: &mut [f32]) {
        assert_eq!(rays.len(), alphas.len(), "an opacity for every ray");
        for (ray, alpha) in rays.iter().zip(alphas) {
            *alpha = self.alpha(ray.uv, ray.wo, ray.kappa_hat);
        }
    }

    /// [`Self::enter`] of many rays that hit; otherwise as [`Self::alpha_batch`].
    ///
    /// # Panics
    ///
    /// If there are not as many entries as rays.
    fn enter_batch(&self, rays: &[Incidence], entries: &mut [Entry]) {
        assert_eq!(rays.len(), entries.len(), "an entry for every ray");
        for (ray, entry) in rays.iter().zip(entries) {
            *entry = self.enter(ray.uv, ray.wo, ray.kappa_hat);
        }
    }

    /// [`Self::rgb`] of many entries, each under its own light; otherwise as [`Self::alpha_batch`].
    ///
    /// # Panics
    ///
    /// If there are not as many lights and colours as entries.
    fn rgb_batch(&self, entries: &[Entry], wi: &[Vec3], rgb: &mut [Vec3]) {
        assert!(entries.len() == wi.len() && wi.len() == rgb.len(), "a light and a colour for every entry");
        for ((entry, &wi), rgb) in entries.iter().zip(wi).zip(rgb) {
            *rgb = self.rgb(entry, wi);
        }
    }

    /// The answers to many queries, in their order.
    fn eval_batch(&self, queries: &[Query], answers: &mut [Answer]) {
        for (query, answer) in queries.iter().zip(answers) {
            *answer = self.eval(query);
        }
    }
}

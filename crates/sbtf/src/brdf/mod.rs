//! Reflection at a surface: a Lambert base under a GGX layer, or a GGX metal.
//!
//! Dielectric: `f = f_GGX + (1 - E(o)) (1 - E(i)) / (1 - E_avg) * color / pi`, where `E` is the GGX layer's directional
//! albedo (Kelemen and Szirmay-Kalos 2001). It is reciprocal, and a white base reflects exactly what it receives.
//! Metal: `f_GGX (1 + F0 (1 - E) / E)` (Turquin, "Practical multiple scattering compensation for microfacet models", 2019).
//! `alpha = roughness^2`, Fresnel after Schlick, masking after Smith (height-correlated), visible normals are sampled.

mod energy;
mod frame;
mod ggx;
mod sampling;

use glam::Vec3;

pub use energy::EnergyTable;
pub use frame::{Frame, tangents};
pub use sampling::{concentric_disk, cosine_hemisphere, luminance};

/// What a surface point reflects with, in its local frame (normal +z).
#[derive(Debug, Clone, Copy)]
pub struct Bsdf {
    /// Albedo of the base, after metalness.
    diffuse: Vec3,
    /// `1 / (1 - E_avg)` of the layer on the base.
    diffuse_scale: f32,
    /// Weight, reflectance at normal and at grazing incidence of the dielectric layer.
    dielectric: [f32; 3],
    /// Weight times reflectance of the metal, compensated for multiple scattering.
    metal: Vec3,
    metallic: f32,
    roughness: f32,
    alpha: f32,
    has_layer: bool,
}

/// A sampled direction.
#[derive(Debug, Clone, Copy)]
pub struct BsdfSample {
    /// Unit direction that the light comes from.
    pub wi: Vec3,
    /// `f cos_i / pdf`.
    pub weight: Vec3,
    /// Density over solid angle.
    pub pdf: f32,
}

/// The numbers of a material that the BSDF is made from, for one surface point.
#[derive(Debug, Clone, Copy)]
pub struct BsdfParameters {
    /// Linear RGB in `[0, 1]`: albedo of the base, or reflectance of the metal at normal incidence.
    pub base_color: Vec3,
    /// 0 for a dielectric, 1 for a metal.
    pub metallic: f32,
    /// Perceptual roughness in `[0, 1]`.
    pub roughness: f32,
    /// 0.5 gives the 4 % reflectance of common plastics; 0 removes the layer.
    pub specular: f32,
}

impl Bsdf {
    /// The reflection at a point with these parameters.
    #[must_use]
    pub fn new(p: &BsdfParameters, table: &EnergyTable) -> Self {
        let f0 = 0.08 * p.specular;
        // A grazing reflectance that vanishes with f0, so that specular 0 is exactly Lambert.
        let f90 = (50.0 * f0).min(1.0);
        let average = table.average(p.roughness);
        let dielectric_weight = 1.0 - p.metallic;
        Self {
            diffuse: dielectric_weight * p.base_color,
            diffuse_scale: 1.0 / (1.0 - (f0 * average[0] + f90 * average[1])).max(1e-3),
            dielectric: [dielectric_weight, f0, f90],
            metal: p.base_color,
            metallic: p.metallic,
            roughness: p.roughness,
            alpha: ggx::alpha(p.roughness),
            has_layer: f0 > 0.0 || p.metallic > 0.0,
        }
    }

    /// `f cos_i` and the density with which [`Self::sample`] draws `wi`. Both are 0 below the horizon.
    #[must_use]
    pub fn eval(&self, wo: Vec3, wi: Vec3, table: &EnergyTable) -> (Vec3, f32) {
        if wo.z <= 0.0 || wi.z <= 0.0 {
            return (Vec3::ZERO, 0.0);
        }
        let cosine_pdf = wi.z * std::f32::consts::FRAC_1_PI;
        if !self.has_layer {
            return (self.diffuse * cosine_pdf, cosine_pdf);
        }
        let split = table.split(wo.z, self.roughness);
        let chance = self.layer_chance(split);
        let h = (wo + wi).normalize();
        let ggx = ggx::reflect(self.alpha, wo, wi, h);
        let f = self.diffuse_cos(wi, split, table) + self.fresnel(wo.dot(h), split) * ggx.value_cos;
        (f, chance * ggx.pdf + (1.0 - chance) * cosine_pdf)
    }

    /// Draws `wi` for `wo`, or `None` where nothing is reflected. `pick` and `u` are uniform in `[0, 1)`;
    /// `pick` chooses the lobe.
    #[must_use]
    pub fn sample(&self, wo: Vec3, pick: f32, u: [f32; 2], table: &EnergyTable) -> Option<BsdfSample> {
        if wo.z <= 0.0 {
            return None;
        }
        if !self.has_layer {
            let wi = cosine_hemisphere(u);
            let pdf = wi.z * std::f32::consts::FRAC_1_PI;
            return (pdf > 0.0).then_some(BsdfSample { wi, weight: self.diffuse, pdf });
        }
        let chance = self.layer_chance(table.split(wo.z, self.roughness));
        let wi = if pick < chance {
            let h = ggx::sample_visible_normal(self.alpha, wo, u);
            2.0 * wo.dot(h) * h - wo
        } else {
            cosine_hemisphere(u)
        };
        let (f, pdf) = self.eval(wo, wi, table);
        (pdf > 0.0).then(|| BsdfSample { wi, weight: f / pdf, pdf })
    }

    fn diffuse_cos(&self, wi: Vec3, split: [f32; 2], table: &EnergyTable) -> Vec3 {
        let [_, f0, f90] = self.dielectric;
        let passed = |s: [f32; 2]| 1.0 - (f0 * s[0] + f90 * s[1]);
        let coupling = passed(split) * passed(table.split(wi.z, self.roughness)) * self.diffuse_scale;
        self.diffuse * (coupling * wi.z * std::f32::consts::FRAC_1_PI)
    }

    /// Schlick's Fresnel term of layer and metal together.
    fn fresnel(&self, cosine: f32, split: [f32; 2]) -> Vec3 {
        let m = (1.0 - cosine).clamp(0.0, 1.0);
        let schlick = (m * m) * (m * m) * m;
        let [weight, f0, f90] = self.dielectric;
        let layer = Vec3::splat(weight * (f0 + (f90 - f0) * schlick));
        if self.metallic == 0.0 {
            return layer;
        }
        let metal = self.metal + (Vec3::ONE - self.metal) * schlick;
        layer + self.metallic * metal * self.compensation(split)
    }

    /// What scattering between microfacets adds, relative to single scattering.
    fn compensation(&self, split: [f32; 2]) -> Vec3 {
        let single = (split[0] + split[1]).max(1e-3);
        Vec3::ONE + self.metal * (1.0 / single - 1.0)
    }

    /// Probability of sampling the GGX lobe: its share of the reflected light.
    fn layer_chance(&self, split: [f32; 2]) -> f32 {
        let [weight, f0, f90] = self.dielectric;
        let layer = f0 * split[0] + f90 * split[1];
        let metal = (self.metal * split[0] + split[1]) * self.compensation(split);
        let specular = weight * layer + self.metallic * luminance(metal);
        let diffuse = luminance(self.diffuse) * (1.0 - layer);
        // Never 0 or 1 where both lobes exist, so that no direction has f > 0 and pdf = 0.
        let share = specular / (specular + diffuse).max(1e-6);
        if diffuse > 0.0 { share.clamp(0.1, 0.9) } else { 1.0 }
    }
}

#[cfg(test)]
mod tests;

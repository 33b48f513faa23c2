//! The isotropic GGX distribution with Smith masking, without Fresnel.

use glam::Vec3;

/// Least `alpha`. Below it the lobe is narrower than f32 cosines resolve near normal incidence.
const LEAST_ALPHA: f32 = 1e-3;

/// The width of the distribution for a perceptual roughness.
pub(super) fn alpha(roughness: f32) -> f32 {
    (roughness * roughness).max(LEAST_ALPHA)
}

/// Reflection at `h`, per unit of Fresnel reflectance.
pub(super) struct Reflection {
    /// `D G2 / (4 cos_o cos_i) cos_i`.
    pub value_cos: f32,
    /// Density of `wi` when `h` is drawn from the visible normals.
    pub pdf: f32,
}

pub(super) fn reflect(alpha: f32, wo: Vec3, wi: Vec3, h: Vec3) -> Reflection {
    let d = distribution(alpha, h);
    let (lambda_o, lambda_i) = (lambda(alpha, wo), lambda(alpha, wi));
    let quarter = d / (4.0 * wo.z);
    Reflection { value_cos: quarter / (1.0 + lambda_o + lambda_i), pdf: quarter / (1.0 + lambda_o) }
}

/// A microfacet normal among those that `wo` sees.
///
/// Dupuy and Benyoub, "Sampling Visible GGX Normals with Spherical Caps", HPG 2023.
pub(super) fn sample_visible_normal(alpha: f32, wo: Vec3, u: [f32; 2]) -> Vec3 {
    let stretched = Vec3::new(alpha * wo.x, alpha * wo.y, wo.z).normalize();
    let phi = std::f32::consts::TAU * u[0];
    let z = (1.0 - u[1]) * (1.0 + stretched.z) - stretched.z;
    let r = (1.0 - z * z).clamp(0.0, 1.0).sqrt();
    let cap = Vec3::new(r * phi.cos(), r * phi.sin(), z) + stretched;
    Vec3::new(alpha * cap.x, alpha * cap.y, cap.z.max(0.0)).normalize()
}

fn distribution(alpha: f32, h: Vec3) -> f32 {
    let a2 = alpha * alpha;
    // 1 - z^2 from x and y, without cancellation near the normal.
    let denominator = (h.x * h.x + h.y * h.y) + a2 * h.z * h.z;
    a2 / (std::f32::consts::PI * denominator * denominator)
}

/// Smith's Lambda.
fn lambda(alpha: f32, w: Vec3) -> f32 {
    let tan2 = (w.x * w.x + w.y * w.y) / (w.z * w.z);
    0.5 * ((1.0 + alpha * alpha * tan2).sqrt() - 1.0)
}

//! Small helpers that sampling and shading share; those that the BRDF needs too come from there.

pub(crate) use osculate_sbtf::brdf::{Frame, concentric_disk, cosine_hemisphere, luminance, tangents};

/// The power heuristic (Veach 1997) with exponent 2 for one sample from each of two densities.
pub(crate) fn power_heuristic(this: f32, other: f32) -> f32 {
    // Divided first, so that densities near the largest float do not overflow.
    let ratio = other / this;
    1.0 / (1.0 + ratio * ratio)
}

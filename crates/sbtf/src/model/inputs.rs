//! What the networks are told besides features, and where features are fetched.

use glam::{Vec2, Vec3};

use super::{Architecture, LONGEST_REACH};
use crate::silhouette::reach;

/// Smallest `wo.z` that [`OffsetForm::AlongRay`](super::OffsetForm::AlongRay) divides by.
pub const STEEPEST_RAY: f32 = 0.05;

/// Unit direction in UV in which a ray that comes from the viewer travels, `-wo.xy / |wo.xy|`; +x where it comes down along the
/// normal and has none.
#[must_use]
pub fn azimuth(wo: Vec3) -> Vec2 {
    let length = wo.truncate().length();
    if length > 0.0 { -wo.truncate() / length } else { Vec2::X }
}

impl Architecture {
    /// The nearest curvature inside the trained range; NaN becomes its low end.
    #[must_use]
    #[inline]
    pub fn clamp_curvature(&self, kappa_hat: f32) -> f32 {
        kappa_hat.max(self.kappa_range[0]).min(self.kappa_range[1])
    }

    /// Distance in UV between fraction 0 and fraction 1 of [`opacity_taps`](Self::opacity_taps).
    #[must_use]
    pub fn opacity_reach(&self, kappa_hat: f32) -> f32 {
        reach(kappa_hat, self.depth, LONGEST_REACH)
    }

    /// Distance in UV between fraction 0 and fraction 1 of [`offset_taps`](Self::offset_taps): what the ray travels along the
    /// surface before it is `depth` below a flat one or, if that is shorter, before it leaves the circle, whose chord is
    /// `2 cos_o / kappa`; at most [`LONGEST_REACH`].
    #[must_use]
    pub fn offset_reach(&self, wo: Vec3, kappa_hat: f32) -> f32 {
        let (sine, cosine) = (wo.truncate().length(), wo.z.max(f32::MIN_POSITIVE));
        let flat = (self.depth * sine / cosine).min(LONGEST_REACH);
        if kappa_hat > 0.0 { flat.min(2.0 * cosine * sine / kappa_hat) } else { flat }
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn a_ray_travels_to_the_bottom_or_out_of_the_circle() {
        let form = Architecture::paper(0.1);
        // 45 degrees on a plane: as far as it is deep.
        let diagonal = Vec3::new(0.5_f32.sqrt(), 0.0, 0.5_f32.sqrt());
        assert!((form.offset_reach(diagonal, 0.0) - 0.1).abs() < 1e-6);
        // Grazing on a cylinder of radius 2: the chord of cosine c is 2 c r long and starts along the ray.
        let grazing = Vec3::new(0.05_f32.acos().sin(), 0.0, 0.05);
        assert!((form.offset_reach(grazing, 0.5) - 0.2).abs() < 1e-3);
        assert!((form.offset_reach(Vec3::X, 0.0) - LONGEST_REACH).abs() < 1e-6);
        assert!(form.offset_reach(Vec3::X, 1.0) < 1e-30);
        assert_eq!(azimuth(Vec3::new(0.6, 0.0, 0.8)), -Vec2::X);
        assert_eq!(azimuth(Vec3::Z), Vec2::X);
    }
}

//! The silhouette cosine and the dip: two measures of where a grazing ray begins to hit.
//!
//! A ray that enters a circle of curvature `kappa > 0` at the angle of cosine `c` runs inside it at most `(1 - sqrt(1 - c^2)) / kappa` below
//! it: it *dips* that deep. Opacity as a function of the dip is a step at the height of what stands in the ray's way, nearly whatever the
//! curvature is, while the cosine of the step goes with its square root. Networks therefore predict the dip over the depth, in
//! `[0, 1]`. Seen from afar the dip is the distance between the outlines of bounding surface and material, so that an error in it is an error
//! in the silhouette's area, one for one.

/// The largest `cos_o` at which a ray can pass above everything in a material of this depth: it touches the circle of
/// curvature `kappa / (1 - kappa depth)`. 0 where the bounding surface is flat or concave: every ray that enters goes on down.
#[must_use]
#[inline]
pub fn largest_cosine(kappa: f32, depth: f32) -> f32 {
    cosine_of_dip(1.0, kappa, depth)
}

/// The silhouette cosine for a dip in `[0, 1]` depths. Products `kappa depth` over 1 (the material reaches beyond the centre) count as 1.
#[must_use]
#[inline]
pub fn cosine_of_dip(dip: f32, kappa: f32, depth: f32) -> f32 {
    let x = (kappa * depth * dip).clamp(0.0, 1.0);
    // 1 - (1 - x)^2 without cancellation.
    (x * (2.0 - x)).sqrt()
}

/// The dip in depths, clamped to `[0, 1]`, for a silhouette cosine in `[0, 1]`; 0 where the surface is flat or concave.
#[must_use]
pub fn dip_of_cosine(cosine: f32, kappa: f32, depth: f32) -> f32 {
    if kappa <= 0.0 {
        return 0.0;
    }
    // 1 - sqrt(1 - c^2) without cancellation.
    let squared = cosine * cosine;
    let x = squared / (1.0 + (1.0 - squared).max(0.0).sqrt());
    (x / (kappa * depth)).clamp(0.0, 1.0)
}

/// Arc length over which a ray that dips to the full depth travels down, in UV units: half of the longest chord above a
/// material. At most `longest`, which it is on flat and concave surfaces.
#[must_use]
pub fn reach(kappa: f32, depth: f32, longest: f32) -> f32 {
    let x = (kappa * depth).clamp(0.0, 1.0);
    // acos(1 - x) / kappa; for small x this is sqrt(2 depth / kappa).
    let angle = (x * (2.0 - x)).sqrt().atan2(1.0 - x);
    if angle < kappa * longest { angle / kappa } else { longest }
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn dip_and_cosine_invert_each_other() {
        for kappa in [1e-4, 0.1, 1.0, 2.5] {
            for dip in [0.0, 1e-4, 0.3, 1.0] {
                let cosine = cosine_of_dip(dip, kappa, 0.2);
                assert!((dip_of_cosine(cosine, kappa, 0.2) - dip).abs() < 2e-6, "{kappa} {dip}");
            }
        }
    }

    #[test]
    fn the_steepest_free_ray_touches_the_inner_circle() {
        let (kappa, depth) = (2.0, 0.1);
        // Distance of the ray from the centre, by the sine of its angle to the radius.
        let cosine: f32 = largest_cosine(kappa, depth);
        let closest = (1.0 - cosine * cosine).sqrt() / kappa;
        assert!((closest - (1.0 / kappa - depth)).abs() < 1e-6);
        // Half its chord spans the angle whose cosine is the ratio of the radii.
        let angle = reach(kappa, depth, 10.0) * kappa;
        assert!((angle.cos() - (1.0 - kappa * depth)).abs() < 1e-6);
    }

    #[test]
    fn flat_and_concave_surfaces_hide_everything() {
        for kappa in [0.0, -1.0] {
            assert_eq!(largest_cosine(kappa, 0.1), 0.0);
            assert_eq!(dip_of_cosine(0.3, kappa, 0.1), 0.0);
            assert_eq!(reach(kappa, 0.1, 2.0), 2.0);
        }
        assert!((reach(1e-6, 0.1, 1e9) / (0.2_f32 / 1e-6).sqrt() - 1.0).abs() < 1e-3);
    }
}

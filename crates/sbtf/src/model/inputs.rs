//! What the networks are told besides features, and where features are fetched.

use glam::{Vec2, Vec3};

use super::{Architecture, LONGEST_REACH, Way};
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

    /// Distance in UV between fraction 0 and fraction 1 of taps along this way, for a ray to a viewer in the direction `wo`; at most
    /// [`LONGEST_REACH`]. The curvature is [clamped](Self::clamp_curvature) already.
    #[must_use]
    pub fn way_length(&self, way: Way, wo: Vec3, kappa_hat: f32) -> f32 {
        match way {
            Way::Graze => reach(kappa_hat, self.depth, LONGEST_REACH),
            Way::Descend => self.descent(wo, kappa_hat),
            Way::Through => self.way_through(wo, kappa_hat),
        }
    }

    /// The descent below a flat surface, at most the circle's chord `2 cos_o / kappa`, as seen from above.
    fn descent(&self, wo: Vec3, kappa_hat: f32) -> f32 {
        let (sine, cosine) = (wo.truncate().length(), wo.z.max(f32::MIN_POSITIVE));
        let flat = (self.depth * sine / cosine).min(LONGEST_REACH);
        if kappa_hat > 0.0 { flat.min(2.0 * cosine * sine / kappa_hat) } else { flat }
    }

    /// Arc between the circle of curvature `kappa` and the one `depth` further in, or between the two ends of the chord if the ray
    /// passes above that one. With `x = kappa depth` the ray is `depth (2 - x) / (cos_o + sqrt(cos_o^2 - x (2 - x)))` long to the
    /// inner circle; products over 1 count as 1.
    fn way_through(&self, wo: Vec3, kappa_hat: f32) -> f32 {
        let (sine, cosine) = (wo.truncate().length(), wo.z.max(f32::MIN_POSITIVE));
        let x = (kappa_hat * self.depth).min(1.0);
        let square = cosine * cosine - x * (2.0 - x);
        let arc = if square >= 0.0 {
            let length = self.depth * (2.0 - x) / (cosine + square.sqrt());
            let tangent = length * sine / (1.0 - kappa_hat * length * cosine).max(f32::MIN_POSITIVE);
            let y = kappa_hat * tangent;
            // The next term of the arc is a third of the square.
            if y.abs() < 1e-4 { tangent } else { y.atan() / kappa_hat }
        } else {
            2.0 * cosine.atan2(sine) / kappa_hat
        };
        arc.min(LONGEST_REACH)
    }
}

#[cfg(test)]
mod tests {
    use glam::DVec3;

    use super::*;
    use crate::patch::Bend;

    #[test]
    fn a_ray_travels_to_the_bottom_or_out_of_the_circle() {
        let form = Architecture::paper(0.1);
        let descent = |wo: Vec3, kappa: f32| form.way_length(Way::Descend, wo, kappa);
        // 45 degrees on a plane: as far as it is deep.
        let diagonal = Vec3::new(0.5_f32.sqrt(), 0.0, 0.5_f32.sqrt());
        assert!((descent(diagonal, 0.0) - 0.1).abs() < 1e-6);
        // Grazing on a cylinder of radius 2: the chord of cosine c is 2 c r long and starts along the ray.
        let grazing = Vec3::new(0.05_f32.acos().sin(), 0.0, 0.05);
        assert!((descent(grazing, 0.5) - 0.2).abs() < 1e-3);
        assert!((descent(Vec3::X, 0.0) - LONGEST_REACH).abs() < 1e-6);
        assert!(descent(Vec3::X, 1.0) < 1e-30);
        assert_eq!(azimuth(Vec3::new(0.6, 0.0, 0.8)), -Vec2::X);
        assert_eq!(azimuth(Vec3::Z), Vec2::X);
    }

    /// Against the bend that training traces in: at the end of the way the ray is at the floor, or back on the surface.
    #[test]
    fn the_way_through_ends_where_the_ray_leaves_the_layer() {
        for (depth, kappa) in
            [(0.1, 0.0), (0.1, 1e-5), (0.1, 1.0), (0.1, 2.5), (0.1, -2.5), (0.3, 2.5), (0.1, -1e-4)]
        {
            let form = Architecture::paper(depth);
            let bend = Bend { kappa: f64::from(kappa) };
            let (mut floors, mut tops) = (0, 0);
            for i in 1..200_u8 {
                let cosine = f32::from(i) / 200.0;
                let wo = Vec3::new(0.0, (1.0 - cosine * cosine).sqrt(), cosine);
                let found = f64::from(form.way_length(Way::Through, wo, kappa));
                if found >= f64::from(LONGEST_REACH) {
                    continue;
                }
                // The first sign change of either distance along the ray.
                let at = |t: f64| bend.unbend(t * DVec3::new(f64::from(wo.y), 0.0, -f64::from(cosine)));
                let inside = |t: f64| (-f64::from(depth)..0.0).contains(&at(t).z);
                let mut out = 1e-4;
                while inside(out) {
                    out += 1e-4;
                }
                let end = at(out);
                *(if end.z > -0.5 * f64::from(depth) { &mut tops } else { &mut floors }) += 1;
                // One step of the search, and f32 where the ray grazes the floor.
                assert!(
                    (found - end.x).abs() < 4e-4 + 1e-3 * found,
                    "{depth} {kappa} {cosine}: {found} {}",
                    end.x
                );
            }
            assert!(floors > 4 && (tops > 20 || kappa < 0.5), "{kappa}: {floors} {tops}");
        }
        let form = Architecture::paper(0.1);
        assert_eq!(form.way_length(Way::Through, Vec3::X, -0.0), LONGEST_REACH);
        assert!(form.way_length(Way::Through, Vec3::X, 1.0) < 1e-30);
        assert_eq!(form.way_length(Way::Through, Vec3::Z, 1.0), 0.0);
    }
}

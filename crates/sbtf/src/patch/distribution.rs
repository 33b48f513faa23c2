//! What queries the samples are of. Only where the network looks hardest depends on these choices, not what it learns.

use glam::Vec3;

use crate::random::Random;
use crate::silhouette::{cosine_of_dip, dip_of_cosine, largest_cosine};

/// Curvatures in a range: 5 % are 0, 15 % evenly negative, the others positive, evenly in the square root, which is how the networks
/// see curvature and how distances along grazing rays change.
#[derive(Debug, Clone, Copy)]
pub(super) struct KappaDistribution {
    range: [f32; 2],
}

impl KappaDistribution {
    /// `least <= most`. Shares of curvatures outside the range go to the others.
    pub fn new(range: [f32; 2]) -> Self {
        Self { range }
    }

    pub fn sample(&self, random: &mut Random) -> f32 {
        let [least, most] = self.range;
        let (pick, x) = (random.unit(), random.unit());
        let root = |from: f32, to: f32| (from.sqrt() + (to.sqrt() - from.sqrt()) * x).powi(2);
        if most <= 0.0 || least < 0.0 && pick < 0.15 {
            let nearest = most.min(0.0);
            return if most <= 0.0 && most == 0.0 && pick >= 0.95 {
                0.0
            } else {
                least + (nearest - least) * x
            };
        }
        if least <= 0.0 && pick < 0.2 {
            return 0.0;
        }
        root(least.max(0.0), most).clamp(least, most)
    }
}

/// `cos_o` of an opacity sample: a third around the silhouette where it is known, a third evenly in dip over what a ray can pass above,
/// the rest evenly in `(0, 1]`.
pub(super) fn opacity_cosine(silhouette: Option<f32>, kappa: f32, depth: f32, random: &mut Random) -> f32 {
    let (pick, x) = (random.unit(), random.unit());
    let even = 1.0 - x;
    if kappa <= 0.0 || pick < 1.0 / 3.0 {
        return even;
    }
    let dip = match silhouette {
        // A triangle of a tenth of the depth on either side.
        Some(cosine) if pick < 2.0 / 3.0 => dip_of_cosine(cosine, kappa, depth) + 0.1 * (x - random.unit()),
        _ => 1.1 * even,
    };
    let cosine = cosine_of_dip(dip.max(1e-6), kappa, depth);
    // Dips beyond the depth are the cosines just above the largest that can pass.
    let beyond = (dip - 1.0).max(0.0) * (1.0 - largest_cosine(kappa, depth));
    (cosine + beyond).clamp(1e-6, 1.0)
}

/// `cos_o` of an opacity sample of a see-through material: this share evenly in dip over what a ray can pass above, where the patch is
/// convex, the rest evenly in `(0, 1]`.
pub(super) fn see_through_cosine(grazing: f32, kappa: f32, depth: f32, random: &mut Random) -> f32 {
    let (pick, x) = (random.unit(), 1.0 - random.unit());
    if kappa > 0.0 && pick < grazing { cosine_of_dip(x, kappa, depth).max(1e-6) } else { x }
}

/// `cos_o` of an appearance sample: 70 % evenly over the hemisphere, 30 % with a density that goes with `1 / sqrt(cos_o)`.
pub(super) fn appearance_cosine(random: &mut Random) -> f32 {
    let (pick, x) = (random.unit(), 1.0 - random.unit());
    (if pick < 0.7 { x } else { x * x }).max(1e-4)
}

/// A light: half evenly over the sphere, a third with a cosine around the normal, the rest around the mirrored viewer.
pub(super) fn light(wo: Vec3, random: &mut Random) -> Vec3 {
    let (pick, sphere) = (random.unit(), sphere(random));
    if pick < 0.5 {
        return sphere;
    }
    let around = if pick < 5.0 / 6.0 { Vec3::Z } else { 2.5 * Vec3::new(-wo.x, -wo.y, wo.z) };
    (around + sphere).try_normalize().unwrap_or(Vec3::Z)
}

/// A direction from the whole sphere.
fn sphere(random: &mut Random) -> Vec3 {
    let z = 1.0 - 2.0 * random.unit();
    let (sin, cos) = (std::f32::consts::TAU * random.unit()).sin_cos();
    let r = (1.0 - z * z).max(0.0).sqrt();
    Vec3::new(r * cos, r * sin, z)
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn curvatures_have_their_shares() {
        let kappas = KappaDistribution::new([-1.0, 4.0]);
        let count = 20_000_u64;
        let drawn: Vec<f32> = (0..count).map(|i| kappas.sample(&mut Random::new(1, 0, i))).collect();
        let share =
            |holds: &dyn Fn(f32) -> bool| drawn.iter().filter(|k| holds(**k)).count() as f64 / count as f64;
        // Five standard deviations.
        let near = |found: f64, p: f64| {
            assert!((found - p).abs() < 5.0 * (p * (1.0 - p) / count as f64).sqrt(), "{found} {p}");
        };
        near(share(&|k| k < 0.0), 0.15);
        near(share(&|k| k == 0.0), 0.05);
        near(share(&|k| k > 1.0), 0.4);
        assert!(drawn.iter().all(|k| (-1.0..=4.0).contains(k)));
    }

    #[test]
    fn ranges_on_one_side_or_of_one_number_are_kept() {
        for range in [[0.5, 2.0], [-2.0, -1.0], [0.0, 0.0], [1.0, 1.0], [-1.0, 0.0], [0.0, 3.0]] {
            let kappas = KappaDistribution::new(range);
            for i in 0..1000 {
                let kappa = kappas.sample(&mut Random::new(2, 0, i));
                assert!((range[0]..=range[1]).contains(&kappa), "{kappa} in {range:?}");
            }
        }
    }
}

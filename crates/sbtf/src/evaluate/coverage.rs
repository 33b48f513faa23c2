//! Opacity of see-through materials on held-out cylinders.
//!
//! Rays of every elevation are asked, since holes are seen from everywhere: even over the tile, over azimuths and over the hemisphere. A ray
//! counts as stopped where the opacity is at least one half. Of two sets of rays, those that a material stops in truth and by
//! the tested one, the intersection over the union is 1 where they agree; the same of the rays that pass says how well the
//! holes are met, which are the smaller set mostly.

use glam::{Vec2, Vec3};
use rayon::prelude::*;

use crate::query::{Incidence, SilhouetteBtf};
use crate::random::Random;

/// What rays are asked.
#[derive(Debug, Clone, PartialEq)]
pub struct CoverageOptions {
    /// Curvatures of the cylinders, 1/UV units.
    pub kappas: Vec<f32>,
    /// Rays for each of them.
    pub rays: u32,
    /// Where the rays come from; any but what training used.
    pub seed: u64,
}

impl Default for CoverageOptions {
    /// Seven curvatures of both signs, 100,000 rays each.
    fn default() -> Self {
        Self { kappas: vec![-2.0, -0.7, 0.0, 0.3, 0.8, 1.6, 2.4], rays: 100_000, seed: 0x00c0_fe7a_6e00 }
    }
}

/// What came of the rays at one curvature, or at several.
#[derive(Debug, Clone, Copy, PartialEq, Eq, Default)]
pub struct Coverage {
    /// Rays that both stop.
    pub stopped: u64,
    /// Rays that pass by both.
    pub passed: u64,
    /// Rays that the tested material stops and should not.
    pub excess: u64,
    /// Rays that the tested material should stop and does not.
    pub missing: u64,
}

impl Coverage {
    /// Intersection over union of the rays that are stopped; 1 where there are none.
    #[must_use]
    pub fn opaque_iou(&self) -> f64 {
        self.iou(self.stopped)
    }

    /// Intersection over union of the rays that pass; 1 where there are none.
    #[must_use]
    pub fn hole_iou(&self) -> f64 {
        self.iou(self.passed)
    }

    /// Share of the rays that pass in truth.
    #[must_use]
    pub fn open(&self) -> f64 {
        let all = self.stopped + self.passed + self.excess + self.missing;
        (self.passed + self.excess) as f64 / all.max(1) as f64
    }

    fn iou(&self, both: u64) -> f64 {
        let union = both + self.excess + self.missing;
        if union == 0 { 1.0 } else { both as f64 / union as f64 }
    }

    /// The rays of both.
    #[must_use]
    pub fn plus(self, other: Self) -> Self {
        Self {
            stopped: self.stopped + other.stopped,
            passed: self.passed + other.passed,
            excess: self.excess + other.excess,
            missing: self.missing + other.missing,
        }
    }
}

/// Rays that are asked at once.
const AT_ONCE: u32 = 2048;

/// Compares which rays two materials stop; one result per curvature.
pub fn coverage(
    truth: &dyn SilhouetteBtf,
    test: &dyn SilhouetteBtf,
    options: &CoverageOptions,
) -> Vec<Coverage> {
    let one = |&kappa: &f32| {
        let parts = (0..options.rays.div_ceil(AT_ONCE)).into_par_iter();
        parts.map(|part| compare(truth, test, kappa, part, options)).reduce(Coverage::default, Coverage::plus)
    };
    options.kappas.iter().map(one).collect()
}

fn compare(
    truth: &dyn SilhouetteBtf,
    test: &dyn SilhouetteBtf,
    kappa: f32,
    part: u32,
    options: &CoverageOptions,
) -> Coverage {
    let first = part * AT_ONCE;
    let rays: Vec<Incidence> =
        (first..options.rays.min(first + AT_ONCE)).map(|index| ray(kappa, index, options.seed)).collect();
    let ask = |btf: &dyn SilhouetteBtf| {
        let mut alphas = vec![0.0; rays.len()];
        btf.alpha_batch(&rays, &mut alphas);
        alphas
    };
    let mut found = Coverage::default();
    for (truth, test) in ask(truth).into_iter().zip(ask(test)) {
        let count = match (truth >= 0.5, test >= 0.5) {
            (true, true) => &mut found.stopped,
            (false, false) => &mut found.passed,
            (false, true) => &mut found.excess,
            (true, false) => &mut found.missing,
        };
        *count += 1;
    }
    found
}

fn ray(kappa_hat: f32, index: u32, seed: u64) -> Incidence {
    let mut random = Random::new(seed, u64::from(kappa_hat.to_bits()), index.into());
    let uv = Vec2::new(random.unit(), random.unit());
    let cosine = 1.0 - random.unit();
    let (y, x) = (std::f32::consts::TAU * random.unit()).sin_cos();
    let sine = (1.0 - cosine * cosine).sqrt();
    Incidence { uv, wo: Vec3::new(sine * x, sine * y, cosine), kappa_hat }
}

#[cfg(test)]
mod tests {
    use super::*;
    use crate::query::{Answer, Query};

    /// Opaque where `u` is over a limit, by this much.
    struct Half(f32, f32);

    impl SilhouetteBtf for Half {
        fn eval(&self, _: &Query) -> Answer {
            unreachable!("only opacity is asked")
        }

        fn alpha(&self, uv: Vec2, _: Vec3, _: f32) -> f32 {
            if uv.x > self.0 { self.1 } else { 0.4 }
        }
    }

    #[test]
    fn shares_of_known_sets() {
        let options = CoverageOptions { rays: 20_000, kappas: vec![0.0, 1.0], ..Default::default() };
        let of = |truth: Half, test: Half| {
            coverage(&truth, &test, &options).into_iter().fold(Coverage::default(), Coverage::plus)
        };
        // Stopped: 0.7 and 0.6 of the tile. Five standard deviations of 40,000 rays.
        let found = of(Half(0.3, 1.0), Half(0.4, 0.5));
        let near = |a: f64, b: f64| assert!((a - b).abs() < 5.0 * (0.25_f64 / 40_000.0).sqrt(), "{a} {b}");
        near(found.opaque_iou(), 6.0 / 7.0);
        near(found.hole_iou(), 0.75);
        near(found.open(), 0.3);
        assert_eq!(found.excess, 0);
        assert!(of(Half(0.4, 1.0), Half(0.3, 1.0)).missing == 0);
        let same = of(Half(0.3, 1.0), Half(0.3, 0.9));
        assert_eq!((same.opaque_iou(), same.hole_iou()), (1.0, 1.0));
        // An opacity under a half stops nothing.
        assert_eq!(of(Half(0.3, 1.0), Half(0.3, 0.49)).opaque_iou(), 0.0);
        assert_eq!(of(Half(2.0, 1.0), Half(2.0, 1.0)).opaque_iou(), 1.0);
    }
}

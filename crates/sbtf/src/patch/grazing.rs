//! Silhouette cosines of any material, by tracing: a scan of the opacity over the grazing angle, and bisection of its step.
//!
//! Opacity of a height field is a step in `cos_o`. Elsewhere rays may pass under a thread and over the next, so that the scan finds
//! more than one change; such a query has no silhouette cosine, and a material with many of them wants the direct head
//! (paper, section 4.3).

use glam::Vec2;

use super::Patch;
use crate::model::OpacityHead;
use crate::silhouette::{cosine_of_dip, largest_cosine};

/// How a silhouette is looked for.
#[derive(Debug, Clone, Copy, PartialEq)]
pub struct GrazingOptions {
    /// Dips, from none to the whole depth, at which opacity is looked at; half as many steeper angles follow. Islands of opacity
    /// narrower than their distance are missed. Default 32.
    pub scan: u32,
    /// Bisections of the step that the scan found; each halves the bracket. Default 12, so that the dip is known to 1/100,000
    /// of the depth.
    pub bisections: u32,
}

impl Default for GrazingOptions {
    fn default() -> Self {
        Self { scan: 32, bisections: 12 }
    }
}

/// How many queries of a material have a silhouette cosine.
#[derive(Debug, Clone, Copy, PartialEq, Eq)]
pub struct OpacityStudy {
    /// Queries that were looked at.
    pub queries: u32,
    /// Those whose opacity is no step: it changes more than once, or never becomes 1.
    pub not_steps: u32,
}

impl OpacityStudy {
    /// Share of the queries whose opacity is no step.
    #[must_use]
    pub fn share(&self) -> f64 {
        f64::from(self.not_steps) / f64::from(self.queries.max(1))
    }

    /// The head that suits: the direct one where more than one query in a hundred has no silhouette cosine.
    #[must_use]
    pub fn advice(&self) -> OpacityHead {
        if self.share() > 0.01 { OpacityHead::Direct } else { OpacityHead::Silhouette }
    }
}

impl Patch {
    /// The smallest `cos_o` from which on rays that enter at `uv` and run along the unit vector `along` hit, in `[0, 1)`; `None` where
    /// opacity is no step. `along` ought to be [`Self::across`] or its opposite.
    #[must_use]
    pub fn silhouette_cosine(&self, uv: Vec2, along: Vec2, options: &GrazingOptions) -> Option<f32> {
        let hits =
            |cosine: f32| self.hits(uv, ((1.0 - cosine * cosine).max(0.0).sqrt() * -along).extend(cosine));
        let (dips, steeper) = (options.scan.max(2), options.scan.max(2) / 2);
        #[allow(clippy::cast_possible_truncation, reason = "the curvature was an f32")]
        let (kappa, depth) = (self.kappa() as f32, self.tile().depth());
        // Over flat and hollow surfaces all rays dip deeper than the depth.
        let largest = largest_cosine(kappa, depth).max(1e-3);
        let angle = |i: u32| {
            if i <= dips && kappa > 0.0 {
                cosine_of_dip((i as f32 / dips as f32).max(1e-6), kappa, depth)
            } else {
                let x = i.saturating_sub(dips) as f32 / steeper as f32;
                (largest + (1.0 - largest) * x).min(1.0)
            }
        };
        let mut step: Option<[f32; 2]> = None;
        let mut last = 0.0;
        for i in 0..=dips + steeper {
            let cosine = angle(i);
            match (hits(cosine), step) {
                (true, None) => step = Some([last, cosine]),
                (false, Some(_)) => return None,
                _ => {}
            }
            last = cosine;
        }
        let [mut passes, mut opaque] = step?;
        for _ in 0..options.bisections {
            let middle = 0.5 * (passes + opaque);
            if hits(middle) { opaque = middle } else { passes = middle }
        }
        // Opaque from the first angle on: as far as can be told, from 0 on.
        Some(if opaque <= angle(0) { 0.0 } else { opaque.min(1.0_f32.next_down()) })
    }
}

#[cfg(test)]
mod tests {
    use std::sync::Arc;

    use super::*;
    use crate::patch::test_fields::{bumps, strip};
    use crate::patch::{Sweep, TileOptions, TileSurface};
    use crate::random::Random;
    use crate::silhouette::dip_of_cosine;

    #[test]
    fn agrees_with_the_sweep_on_height_fields() {
        let field = bumps(64, 0.15);
        let tile = Arc::new(TileSurface::from_field(&field, &TileOptions::default()));
        let sweep = Sweep::new(&field);
        let mut random = Random::new(1, 1, 1);
        for (kappa, rotation) in [(0.5, 0.3), (2.0, 4.0), (0.0, 1.0), (-1.0, 1.0)] {
            let patch = Patch::new(tile.clone(), kappa, rotation);
            let along = Vec2::from_angle(rotation);
            for _ in 0..40 {
                let uv = Vec2::new(random.unit(), random.unit());
                let traced = patch.silhouette_cosine(uv, along, &GrazingOptions::default());
                let swept = sweep.silhouette_cosine(uv, along, kappa);
                let traced = traced.unwrap_or_else(|| panic!("{kappa} {uv}: no step"));
                let [a, b] = [traced, swept].map(|c| dip_of_cosine(c, kappa, 0.15));
                // The triangles' tolerance, with what it becomes at cliffs.
                assert!(
                    (a - b).abs() < 0.03 && (kappa > 0.0 || traced == 0.0),
                    "{kappa} {uv}: {traced} {swept}"
                );
            }
        }
    }

    #[test]
    fn see_through_materials_are_found_out() {
        let tile = Arc::new(TileSurface::from_mesh(&strip(0.1), &TileOptions::default()));
        // Across the strap: rays from beside it pass below or over it, steep ones always.
        let patch = Patch::new(tile, 1.0, std::f32::consts::FRAC_PI_2);
        let find = |v: f32| patch.silhouette_cosine(Vec2::new(0.3, v), Vec2::Y, &GrazingOptions::default());
        assert_eq!(find(0.1), None);
        // Over the strap's middle: a step, at the cosine that its far end, 0.25 away and 0.05 deep, or its nearness gives.
        let cosine = find(0.5).expect("a step");
        let bent = crate::patch::Bend { kappa: 1.0 }.point(glam::DVec3::new(0.25, 0.0, -0.05));
        let expected = -bent.z / bent.x.hypot(bent.z);
        assert!((f64::from(cosine) - expected).abs() < 0.003, "{cosine} {expected}");
        let study = OpacityStudy { queries: 200, not_steps: 2 };
        assert_eq!(study.advice(), OpacityHead::Silhouette);
        assert_eq!(OpacityStudy { not_steps: 3, ..study }.advice(), OpacityHead::Direct);
    }
}

//! [`Told`]: what the material of an object is told and asked while a picture is traced; [`crate::demand`] has the reasons.

use crate::demand::{Demand, demands};
use crate::present::{CURVATURE, OFFSET, OPACITY};
use crate::scene::Scene;

/// What a material with silhouettes is told.
#[derive(Debug, Clone, Copy, PartialEq, Eq)]
pub(crate) struct Told {
    /// The curvature and the rate of UV along the ray; otherwise it takes the surface for flat.
    pub curvature: bool,
    /// Whether it is asked for its opacity at all.
    pub opacity: bool,
    /// Whether it is asked where it is hit; otherwise that is where the ray meets the surface.
    pub offset: bool,
    /// Whether rays to lights that come steeply enough are stopped without being told the curvature.
    pub steep_is_opaque: bool,
}

impl Told {
    pub(crate) const ALL: Self =
        Self { curvature: true, opacity: true, offset: true, steep_is_opaque: false };

    /// Without what the build lacks.
    #[inline(always)]
    pub(crate) fn in_this_build(self) -> Self {
        Self {
            curvature: CURVATURE && self.curvature,
            opacity: OPACITY && self.opacity,
            offset: OFFSET && self.offset,
            ..self
        }
    }
}

/// An entry per object; all of it where there are no silhouettes.
pub(crate) fn told(scene: &Scene) -> Vec<Told> {
    let of = |demand: Demand| Told {
        curvature: demand.curvature.is_ok(),
        opacity: demand.opacity.is_ok(),
        offset: demand.offset,
        steep_is_opaque: demand.opaque_from.is_some(),
    };
    demands(scene).into_iter().map(|demand| demand.map_or(Told::ALL, of)).collect()
}

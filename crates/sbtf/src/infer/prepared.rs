//! [`Prepared`]: a block of queries, and where it will fetch features.

use super::ahead::Ahead;
use super::kernels::{BLOCK, Row};
use super::lane_math::{self, azimuth, inside_tile, per_lane};
use super::material::Material;
use super::packed_texture::{Corners, PackedTexture, Places, TexelRows};
use crate::model::{OffsetForm, Way};
use crate::query::Query;

/// Taps whose places are kept; those of the others are found again when they are fetched.
const KEPT: usize = 14;

/// One block of queries, a row per number.
#[derive(Debug)]
pub(super) struct Lanes {
    pub uv: [Row; 2],
    pub wo: [Row; 3],
    pub wi: [Row; 3],
    pub kappa: Row,
}

/// A block of queries on its way to the opacity or to the offset network.
#[derive(Debug)]
pub(super) struct Prepared {
    pub lanes: Lanes,
    /// Unit directions in UV in which the rays travel.
    pub along: [Row; 2],
    /// How far it is to a tap at 1; zero where no tap is apart.
    pub step: [Row; 2],
    rows: [TexelRows; KEPT],
    fractions: [[Row; 2]; KEPT],
    kept: usize,
    /// Whether its texels were asked for.
    is_near: bool,
}

impl Prepared {
    #[inline(always)]
    pub fn new() -> Self {
        let row = [0.0; BLOCK];
        Self {
            lanes: Lanes { uv: [row; 2], wo: [row; 3], wi: [row; 3], kappa: row },
            along: [row; 2],
            step: [row; 2],
            rows: [[[0; BLOCK]; 2]; KEPT],
            fractions: [[row; 2]; KEPT],
            kept: 0,
            is_near: false,
        }
    }

    /// Prepares a block of `count` queries for the opacity network.
    #[inline(always)]
    pub fn for_opacity(&mut self, material: &Material, count: usize, query: impl Fn(usize) -> Query) {
        let Some(module) = &material.opacity else { return };
        let architecture = &material.architecture;
        self.fill::<false>(material, count, query);
        self.along = self.lanes.azimuths();
        self.set_step(material, apart(&architecture.opacity_taps), architecture.opacity_way);
        self.place(&module.texture, &architecture.opacity_taps);
    }

    /// Prepares a block of `count` queries for the offset network.
    #[inline(always)]
    pub fn for_offset(&mut self, material: &Material, count: usize, query: impl Fn(usize) -> Query) {
        let architecture = &material.architecture;
        self.fill::<true>(material, count, query);
        let wanted = architecture.offset == OffsetForm::AlongReach || apart(&architecture.offset_taps);
        if wanted {
            self.along = self.lanes.azimuths();
        }
        self.set_step(material, wanted, architecture.offset_way);
        self.place(&material.offset.texture, &architecture.offset_taps);
    }

    /// Gathers a block of `count` queries, with their lights if `LIT`. Those that are missing are copies of the first.
    #[inline(always)]
    pub fn fill<const LIT: bool>(
        &mut self,
        material: &Material,
        count: usize,
        query: impl Fn(usize) -> Query,
    ) {
        let lanes = &mut self.lanes;
        for k in 0..BLOCK {
            let query = query(if k < count { k } else { 0 });
            lanes.uv[0][k] = query.uv.x;
            lanes.uv[1][k] = query.uv.y;
            for axis in 0..3 {
                lanes.wo[axis][k] = query.wo[axis];
                if LIT {
                    lanes.wi[axis][k] = query.wi[axis];
                }
            }
            lanes.kappa[k] = query.kappa_hat;
        }
        for row in &mut lanes.uv {
            *row = per_lane(row, inside_tile);
        }
        lanes.kappa = per_lane(&lanes.kappa, |kappa| material.architecture.clamp_curvature(kappa));
    }

    /// The azimuth times the length of a way, per lane. Nothing is computed where it is not wanted.
    #[inline(always)]
    fn set_step(&mut self, material: &Material, wanted: bool, way: Way) {
        if !wanted {
            self.step = [[0.0; BLOCK]; 2];
            return;
        }
        let reach = way_lengths(material, way, &self.lanes);
        for (step, along) in self.step.iter_mut().zip(&self.along) {
            for k in 0..BLOCK {
                step[k] = along[k] * reach[k];
            }
        }
    }

    #[inline(always)]
    fn place(&mut self, texture: &PackedTexture, taps: &[f32]) {
        self.kept = taps.len().min(KEPT);
        for (k, &fraction) in taps.iter().take(KEPT).enumerate() {
            let corners = self.corners(texture, fraction);
            (self.rows[k], self.fractions[k]) = (corners.rows, corners.fractions);
        }
        self.is_near = false;
    }

    /// Where the features of a tap are.
    #[inline(always)]
    pub fn corners(&self, texture: &PackedTexture, fraction: f32) -> Corners {
        let mut uv = self.lanes.uv;
        for (uv, step) in uv.iter_mut().zip(&self.step) {
            for k in 0..BLOCK {
                uv[k] += step[k] * fraction;
            }
        }
        texture.corners(&uv[0], &uv[1])
    }

    /// Where the features of a tap are, if that was kept.
    #[inline(always)]
    pub fn tap(&self, material: &Material, tap: usize) -> Option<Places<'_>> {
        let kept = &self.rows[..self.kept];
        let next = kept.get(tap + 1).filter(|_| material.is_large);
        Some(Places { rows: kept.get(tap)?, fractions: &self.fractions[tap], next })
    }

    /// Texels that were prepared [for the opacity](Self::for_opacity), unless they were asked for already or textures are so small that they
    /// are near anyway.
    #[inline(always)]
    pub fn opacity_ahead(&mut self, material: &Material) -> Ahead<'_> {
        material.opacity.as_ref().map_or(Ahead::nothing(), |module| self.ahead(material, &module.texture))
    }

    /// The same of those [for the offset](Self::for_offset).
    #[inline(always)]
    pub fn offset_ahead(&mut self, material: &Material) -> Ahead<'_> {
        self.ahead(material, &material.offset.texture)
    }

    #[inline(always)]
    fn ahead(&mut self, material: &Material, texture: &PackedTexture) -> Ahead<'_> {
        if self.is_near || !material.is_large {
            return Ahead::nothing();
        }
        self.is_near = true;
        Ahead::new(texture, &self.rows[..self.kept])
    }
}

impl Lanes {
    #[inline(always)]
    fn azimuths(&self) -> [Row; 2] {
        let mut along = [self.wo[0], self.wo[1]];
        let [xs, ys] = &mut along;
        for (x, y) in xs.iter_mut().zip(ys) {
            [*x, *y] = azimuth(*x, *y);
        }
        along
    }
}

/// Lengths of the ways, lane by lane; which way is decided outside the loops, so that each compiles to vectors.
#[inline(always)]
fn way_lengths(material: &Material, way: Way, Lanes { wo: [x, y, z], kappa, .. }: &Lanes) -> Row {
    let depth = material.architecture.depth;
    let wo = |k: usize| [x[k], y[k], z[k]];
    let mut lengths = [0.0; BLOCK];
    match way {
        Way::Graze => lengths = per_lane(kappa, |kappa| lane_math::graze(kappa, depth)),
        Way::Descend => {
            for k in 0..BLOCK {
                lengths[k] = lane_math::descend(wo(k), kappa[k], depth);
            }
        }
        Way::Through => {
            for k in 0..BLOCK {
                lengths[k] = lane_math::through(wo(k), kappa[k], depth);
            }
        }
    }
    lengths
}

/// Whether features are fetched anywhere but at the entry point.
#[inline(always)]
pub(super) fn apart(taps: &[f32]) -> bool {
    taps.iter().any(|&fraction| fraction != 0.0)
}

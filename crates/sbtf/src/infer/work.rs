//! [`Work`]: the three networks over a prepared block of queries.

use super::ahead::Ahead;
use super::kernels::{BLOCK, Buffers, Isa, Row, Rows};
use super::lane_math::{exp_less_one, per_lane};
use super::material::Material;
use super::packed_mlp::PackedMlp;
use super::packed_texture::PackedTexture;
use super::prepared::{Lanes, Prepared};
use crate::model::{OffsetForm, OpacityHead, STEEPEST_RAY};

/// Where networks keep their numbers.
pub(super) struct Work<const INPUTS: usize, const WIDTH: usize> {
    pub inputs: Rows<INPUTS>,
    odd: Rows<WIDTH>,
    even: Rows<WIDTH>,
}

impl<const INPUTS: usize, const WIDTH: usize> Work<INPUTS, WIDTH> {
    #[inline(always)]
    pub fn new() -> Self {
        Self { inputs: Rows::zeroed(), odd: Rows::zeroed(), even: Rows::zeroed() }
    }

    /// Opacities by the network.
    #[inline(always)]
    pub fn alphas<I: Isa>(
        &mut self,
        isa: I,
        material: &Material,
        block: &Prepared,
        ahead: &mut Ahead<'_>,
    ) -> Row {
        let Some(module) = &material.opacity else { return [1.0; BLOCK] };
        let (architecture, lanes) = (&material.architecture, &block.lanes);
        let next = self.fetch_taps(isa, material, &module.texture, block, &architecture.opacity_taps);
        let direction = match architecture.opacity {
            OpacityHead::Silhouette => &block.along,
            OpacityHead::Direct | OpacityHead::Opaque => &[lanes.wo[0], lanes.wo[1]],
        };
        self.inputs.0[next..next + 2].copy_from_slice(direction);
        self.put_curvature(material, lanes, next + 2);
        let mut alpha = self.forward(isa, &module.mlp, ahead)[0];
        for (k, alpha) in alpha.iter_mut().enumerate() {
            *alpha = material.alpha_of_output(*alpha, lanes.wo[2][k], lanes.kappa[k]);
        }
        alpha
    }

    /// Where rays hit.
    #[inline(always)]
    pub fn hit_uvs<I: Isa>(
        &mut self,
        isa: I,
        material: &Material,
        block: &Prepared,
        ahead: &mut Ahead<'_>,
    ) -> [Row; 2] {
        let (module, architecture, lanes) = (&material.offset, &material.architecture, &block.lanes);
        let next = self.fetch_taps(isa, material, &module.texture, block, &architecture.offset_taps);
        self.inputs.0[next..next + 2].copy_from_slice(&lanes.wo[..2]);
        self.put_curvature(material, lanes, next + 2);
        let outputs = self.forward(isa, &module.mlp, ahead);
        let mut uv = lanes.uv;
        for (axis, row) in uv.iter_mut().enumerate() {
            for k in 0..BLOCK {
                row[k] += match architecture.offset {
                    OffsetForm::Free => outputs[axis][k],
                    OffsetForm::AlongRay => {
                        -lanes.wo[axis][k] * (outputs[0][k] / lanes.wo[2][k].max(STEEPEST_RAY))
                    }
                    OffsetForm::AlongReach => block.step[axis][k] * outputs[0][k],
                };
            }
        }
        uv
    }

    /// Colours of rays that hit at `hit_uv`.
    #[inline(always)]
    pub fn colours<I: Isa>(
        &mut self,
        isa: I,
        material: &Material,
        lanes: &Lanes,
        hit_uv: &[Row; 2],
        ahead: &mut Ahead<'_>,
    ) -> [Row; 3] {
        let module = &material.colour;
        let corners = module.texture.corners(&hit_uv[0], &hit_uv[1]);
        isa.fetch_block(&module.texture, corners.places(), &mut self.inputs.0);
        let next = module.texture.channels;
        self.inputs.0[next..next + 3].copy_from_slice(&lanes.wi);
        self.inputs.0[next + 3..next + 5].copy_from_slice(&lanes.wo[..2]);
        self.put_curvature(material, lanes, next + 5);
        let outputs = self.forward(isa, &module.mlp, ahead);
        [
            per_lane(&outputs[0], exp_less_one),
            per_lane(&outputs[1], exp_less_one),
            per_lane(&outputs[2], exp_less_one),
        ]
    }

    /// Runs a network on the inputs.
    #[inline(always)]
    pub fn forward<I: Isa>(&mut self, isa: I, mlp: &PackedMlp, ahead: &mut Ahead<'_>) -> &[Row] {
        let buffers = Buffers { a: &self.inputs.0, b: &mut self.odd.0, c: &mut self.even.0 };
        isa.forward_block(mlp, buffers, ahead);
        if mlp.layers.len() % 2 == 1 { &self.odd.0 } else { &self.even.0 }
    }

    /// Fetches features at every tap; returns the row after them.
    #[inline(always)]
    fn fetch_taps<I: Isa>(
        &mut self,
        isa: I,
        material: &Material,
        texture: &PackedTexture,
        block: &Prepared,
        taps: &[f32],
    ) -> usize {
        let mut next = 0;
        for (tap, &fraction) in taps.iter().enumerate() {
            let rows = &mut self.inputs.0[next..];
            match block.tap(material, tap) {
                Some(places) => isa.fetch_block(texture, places, rows),
                None => isa.fetch_block(texture, block.corners(texture, fraction).places(), rows),
            }
            next += texture.channels;
        }
        next
    }

    /// Writes the curvature input, if the networks have one.
    #[inline(always)]
    fn put_curvature(&mut self, material: &Material, lanes: &Lanes, row: usize) {
        if material.architecture.curvature_inputs() > 0 {
            self.inputs.0[row] =
                per_lane(&lanes.kappa, |kappa| material.architecture.encode_curvature(kappa));
        }
    }
}

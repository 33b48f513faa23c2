//! Single queries: registers run across the outputs of a layer.

use glam::{Vec2, Vec3};

use super::kernels::{Buffers, Column, GROUP, Isa, Task};
use super::lane_math::{azimuth, exp_less_one, per_lane};
use super::material::{Material, PackedModule};
use super::packed_texture::PackedTexture;
use crate::model::{OffsetForm, OpacityHead, STEEPEST_RAY, inside_tile};

/// The part of a query that does not depend on the light.
#[derive(Debug, Clone, Copy)]
pub(super) struct View {
    /// Inside the tile.
    uv: Vec2,
    wo: Vec3,
    /// Clamped.
    kappa: f32,
}

impl View {
    #[inline(always)]
    pub fn new(material: &Material, uv: Vec2, wo: Vec3, kappa_hat: f32) -> Self {
        Self {
            uv: Vec2::new(inside_tile(uv.x), inside_tile(uv.y)),
            wo,
            kappa: material.architecture.clamp_curvature(kappa_hat),
        }
    }
}

/// The opacity that the network gives.
pub(super) struct Alpha<'a, const INPUTS: usize, const WIDTH: usize> {
    pub material: &'a Material,
    pub view: View,
}

impl<const INPUTS: usize, const WIDTH: usize> Task for Alpha<'_, INPUTS, WIDTH> {
    type Output = f32;

    #[inline(always)]
    fn run<I: Isa>(self, isa: I) -> f32 {
        let Self { material, view } = self;
        let Some(module) = &material.opacity else { return 1.0 };
        let mut inputs = Column::<INPUTS>::zeroed();
        let along = Vec2::from(azimuth(view.wo.x, view.wo.y));
        let way = material.architecture.opacity_way;
        let step = along * material.way_length(way, view.wo.to_array(), view.kappa);
        let next = fetch_taps(isa, module, view.uv, step, &material.architecture.opacity_taps, &mut inputs.0);
        let direction = match material.architecture.opacity {
            OpacityHead::Silhouette => along,
            OpacityHead::Direct | OpacityHead::Opaque => view.wo.truncate(),
        };
        inputs.0[next..next + 2].copy_from_slice(&direction.to_array());
        put_curvature(material, view, &mut inputs.0, next + 2);
        let [output] = forward::<I, 1, WIDTH>(isa, module, &inputs.0);
        material.alpha_of_output(output, view.wo.z, view.kappa)
    }
}

/// Inputs of the colour network, with room for the light.
#[derive(Debug, Clone)]
pub(super) struct ColourInputs<const INPUTS: usize>(Column<INPUTS>);

/// Where the ray hits, and the features there.
pub(super) struct Offset<'a, const INPUTS: usize, const WIDTH: usize, const COLOUR: usize> {
    pub material: &'a Material,
    pub view: View,
}

impl<const INPUTS: usize, const WIDTH: usize, const COLOUR: usize> Task
    for Offset<'_, INPUTS, WIDTH, COLOUR>
{
    type Output = (Vec2, ColourInputs<COLOUR>);

    #[inline(always)]
    fn run<I: Isa>(self, isa: I) -> Self::Output {
        let Self { material, view } = self;
        let (module, architecture) = (&material.offset, &material.architecture);
        let mut inputs = Column::<INPUTS>::zeroed();
        let reach = material.way_length(architecture.offset_way, view.wo.to_array(), view.kappa);
        let step = Vec2::from(azimuth(view.wo.x, view.wo.y)) * reach;
        let next = fetch_taps(isa, module, view.uv, step, &architecture.offset_taps, &mut inputs.0);
        inputs.0[next..next + 2].copy_from_slice(&[view.wo.x, view.wo.y]);
        put_curvature(material, view, &mut inputs.0, next + 2);
        let output = forward::<I, 2, WIDTH>(isa, module, &inputs.0);
        let uv = match architecture.offset {
            OffsetForm::Free => view.uv + Vec2::from(output),
            OffsetForm::AlongRay => view.uv - view.wo.truncate() * (output[0] / view.wo.z.max(STEEPEST_RAY)),
            OffsetForm::AlongReach => view.uv + step * output[0],
        };
        (uv, ColourInputs::at(isa, material, view, uv))
    }
}

impl<const INPUTS: usize> ColourInputs<INPUTS> {
    /// For a ray that hits at `uv`.
    #[inline(always)]
    fn at<I: Isa>(isa: I, material: &Material, view: View, uv: Vec2) -> Self {
        let mut inputs = Column::<INPUTS>::zeroed();
        let next = fetch(isa, &material.colour.texture, uv, &mut inputs.0, 0);
        inputs.0[next + 3..next + 5].copy_from_slice(&[view.wo.x, view.wo.y]);
        put_curvature(material, view, &mut inputs.0, next + 5);
        Self(inputs)
    }
}

/// The colour of a ray that is known to hit at `uv`.
pub(super) struct ColourAt<'a, const INPUTS: usize, const WIDTH: usize> {
    pub material: &'a Material,
    pub view: View,
    pub uv: Vec2,
    pub wi: Vec3,
}

impl<const INPUTS: usize, const WIDTH: usize> Task for ColourAt<'_, INPUTS, WIDTH> {
    type Output = Vec3;

    #[inline(always)]
    fn run<I: Isa>(self, isa: I) -> Vec3 {
        let Self { material, view, uv, wi } = self;
        let inputs = &ColourInputs::<INPUTS>::at(isa, material, view, uv);
        let mut rgb = [Vec3::ZERO];
        Colours::<INPUTS, WIDTH> { material, inputs, wi: &[wi], rgb: &mut rgb }.run(isa);
        rgb[0]
    }
}

/// The colour under one light after another.
pub(super) struct Colours<'a, const INPUTS: usize, const WIDTH: usize> {
    pub material: &'a Material,
    pub inputs: &'a ColourInputs<INPUTS>,
    pub wi: &'a [Vec3],
    pub rgb: &'a mut [Vec3],
}

impl<const INPUTS: usize, const WIDTH: usize> Task for Colours<'_, INPUTS, WIDTH> {
    type Output = ();

    #[inline(always)]
    fn run<I: Isa>(self, isa: I) {
        let module = &self.material.colour;
        let mut inputs = self.inputs.0.clone();
        for (wi, rgb) in self.wi.iter().zip(self.rgb) {
            inputs.0[module.texture.channels..module.texture.channels + 3].copy_from_slice(&wi.to_array());
            let output = forward::<I, 3, WIDTH>(isa, module, &inputs.0);
            *rgb = Vec3::from(per_lane(&output, exp_less_one));
        }
    }
}

#[inline(always)]
fn put_curvature(material: &Material, view: View, inputs: &mut [f32], index: usize) {
    if material.architecture.curvature_inputs() > 0 {
        inputs[index] = material.architecture.encode_curvature(view.kappa);
    }
}

/// Fetches features to `first`; returns the index after them. Overwrites up to a whole group.
#[inline(always)]
fn fetch<I: Isa>(isa: I, texture: &PackedTexture, uv: Vec2, inputs: &mut [f32], first: usize) -> usize {
    let corners = texture.corners(&[uv.x], &[uv.y]);
    isa.fetch_one(texture, &corners, &mut inputs[first..]);
    first + texture.channels
}

#[inline(always)]
fn fetch_taps<I: Isa>(
    isa: I,
    module: &PackedModule,
    uv: Vec2,
    step: Vec2,
    taps: &[f32],
    inputs: &mut [f32],
) -> usize {
    let mut next = 0;
    for &fraction in taps {
        next = fetch(isa, &module.texture, uv + step * fraction, inputs, next);
    }
    next
}

#[inline(always)]
fn forward<I: Isa, const OUTPUTS: usize, const WIDTH: usize>(
    isa: I,
    module: &PackedModule,
    inputs: &[f32],
) -> [f32; OUTPUTS] {
    const { assert!(OUTPUTS <= GROUP, "outputs fill one group at most") };
    let (mut odd, mut even) = (Column::<WIDTH>::zeroed(), Column::<WIDTH>::zeroed());
    isa.forward_one(&module.mlp, Buffers { a: inputs, b: &mut odd.0, c: &mut even.0 });
    let outputs = if module.mlp.layers.len() % 2 == 1 { &odd.0 } else { &even.0 };
    let mut result = [0.0; OUTPUTS];
    result.copy_from_slice(&outputs[..OUTPUTS]);
    result
}

//! Single queries: registers run across the outputs of a layer.

use glam::{Vec2, Vec3};

use super::kernels::{Buffers, COLUMN, Column, Isa, Task};
use super::lane_math::{azimuth, exp_less_one, per_lane};
use super::material::{Material, PackedModule};
use super::prepared::apart;
use crate::model::{OffsetForm, OpacityHead, STEEPEST_RAY, inside_tile};
use crate::query::{Answer, Query};

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
        put_opacity::<I>(isa, material, module, view, &mut inputs.0);
        let [output] = forward::<I, 1, WIDTH>(isa, module, &inputs.0);
        material.alpha_of_output(output, view.wo.z, view.kappa)
    }
}

/// Writes the inputs of the opacity network.
#[inline(always)]
fn put_opacity<I: Isa>(isa: I, material: &Material, module: &PackedModule, view: View, inputs: &mut [f32]) {
    let architecture = &material.architecture;
    let along = Vec2::from(azimuth(view.wo.x, view.wo.y));
    let step = if apart(&architecture.opacity_taps) {
        along * material.way_length(architecture.opacity_way, view.wo.to_array(), view.kappa)
    } else {
        Vec2::ZERO
    };
    let next = fetch_taps(isa, module, view.uv, step, &architecture.opacity_taps, inputs);
    let direction = match architecture.opacity {
        OpacityHead::Silhouette => along,
        OpacityHead::Direct | OpacityHead::Opaque => view.wo.truncate(),
    };
    inputs[next..next + 2].copy_from_slice(&direction.to_array());
    put_curvature(material, view, inputs, next + 2);
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
        let mut inputs = Column::<INPUTS>::zeroed();
        let step = put_offset::<I>(isa, material, view, &mut inputs.0);
        let output = forward::<I, 2, WIDTH>(isa, &material.offset, &inputs.0);
        let uv = hit_uv(material, view, step, output);
        let mut inputs = ColourInputs::nowhere();
        inputs.put(isa, material, view, uv);
        (uv, inputs)
    }
}

/// Writes the inputs of the offset network; returns how far it is to a tap at 1.
#[inline(always)]
fn put_offset<I: Isa>(isa: I, material: &Material, view: View, inputs: &mut [f32]) -> Vec2 {
    let (module, architecture) = (&material.offset, &material.architecture);
    let wanted = architecture.offset == OffsetForm::AlongReach || apart(&architecture.offset_taps);
    let step = if wanted {
        let reach = material.way_length(architecture.offset_way, view.wo.to_array(), view.kappa);
        Vec2::from(azimuth(view.wo.x, view.wo.y)) * reach
    } else {
        Vec2::ZERO
    };
    let next = fetch_taps(isa, module, view.uv, step, &architecture.offset_taps, inputs);
    inputs[next..next + 2].copy_from_slice(&[view.wo.x, view.wo.y]);
    put_curvature(material, view, inputs, next + 2);
    step
}

/// Where a ray hits by the output of the offset network.
#[inline(always)]
fn hit_uv(material: &Material, view: View, step: Vec2, output: [f32; 2]) -> Vec2 {
    match material.architecture.offset {
        OffsetForm::Free => view.uv + Vec2::from(output),
        OffsetForm::AlongRay => view.uv - view.wo.truncate() * (output[0] / view.wo.z.max(STEEPEST_RAY)),
        OffsetForm::AlongReach => view.uv + step * output[0],
    }
}

/// Opacity of one ray and where it hits; `None` where it misses.
///
/// Opacity and offset do not wait for each other: most rays that are asked for hit.
#[inline(always)]
fn enter<I: Isa, const INPUTS: usize, const WIDTH: usize>(
    isa: I,
    material: &Material,
    view: View,
    known: Option<f32>,
) -> Option<(f32, Vec2)> {
    let mut inputs = Column::<INPUTS>::zeroed();
    let step = put_offset::<I>(isa, material, view, &mut inputs.0);
    let (alpha, output) = match (known, &material.opacity) {
        (None, Some(opacity)) => {
            let mut others = Column::<INPUTS>::zeroed();
            put_opacity::<I>(isa, material, opacity, view, &mut others.0);
            let modules = [opacity, &material.offset];
            let (alpha, offset) = forward_two::<I, WIDTH>(isa, modules, [&others.0, &inputs.0]);
            (material.alpha_of_output(alpha, view.wo.z, view.kappa), offset)
        }
        _ => (1.0, forward::<I, 2, WIDTH>(isa, &material.offset, &inputs.0)),
    };
    (alpha > 0.0).then(|| (alpha, hit_uv(material, view, step, output)))
}

/// Opacity, place of the hit and features there of one ray; `None` where it misses.
pub(super) struct Begin<'a, const INPUTS: usize, const WIDTH: usize, const COLOUR: usize> {
    pub material: &'a Material,
    pub uv: Vec2,
    pub wo: Vec3,
    pub kappa_hat: f32,
}

impl<const INPUTS: usize, const WIDTH: usize, const COLOUR: usize> Task for Begin<'_, INPUTS, WIDTH, COLOUR> {
    type Output = Option<(f32, Vec2, ColourInputs<COLOUR>)>;

    #[inline(always)]
    fn run<I: Isa>(self, isa: I) -> Self::Output {
        let Self { material, uv, wo, kappa_hat } = self;
        let known = material.known_alpha(wo.z, kappa_hat);
        if known == Some(0.0) {
            return None;
        }
        let view = View::new(material, uv, wo, kappa_hat);
        let (alpha, uv) = enter::<I, INPUTS, WIDTH>(isa, material, view, known)?;
        let mut inputs = ColourInputs::nowhere();
        inputs.put(isa, material, view, uv);
        Some((alpha, uv, inputs))
    }
}

/// The whole answer to one query. Numbers stay where they are written: wide copies would wait for the narrow writes before them.
pub(super) struct Whole<'a, const INPUTS: usize, const WIDTH: usize, const COLOUR: usize> {
    pub material: &'a Material,
    pub query: &'a Query,
}

impl<const INPUTS: usize, const WIDTH: usize, const COLOUR: usize> Task for Whole<'_, INPUTS, WIDTH, COLOUR> {
    type Output = Answer;

    #[inline(always)]
    fn run<I: Isa>(self, isa: I) -> Answer {
        let Self { material, query } = self;
        let known = material.known_alpha(query.wo.z, query.kappa_hat);
        if known == Some(0.0) {
            return Answer::default();
        }
        let view = View::new(material, query.uv, query.wo, query.kappa_hat);
        let Some((alpha, uv)) = enter::<I, INPUTS, WIDTH>(isa, material, view, known) else {
            return Answer::default();
        };
        let mut inputs = ColourInputs::<COLOUR>::nowhere();
        inputs.put(isa, material, view, uv);
        Answer { rgb: inputs.colour::<I, WIDTH>(isa, material, query.wi), alpha }
    }
}

impl<const INPUTS: usize> ColourInputs<INPUTS> {
    /// Not those of any ray.
    #[inline(always)]
    fn nowhere() -> Self {
        Self(Column::zeroed())
    }

    /// Writes those of a ray that hits at `uv`.
    #[inline(always)]
    fn put<I: Isa>(&mut self, isa: I, material: &Material, view: View, uv: Vec2) {
        let inputs = &mut self.0.0;
        let next = fetch_taps(isa, &material.colour, uv, Vec2::ZERO, &[0.0], inputs);
        inputs[next + 3..next + 5].copy_from_slice(&[view.wo.x, view.wo.y]);
        put_curvature(material, view, inputs, next + 5);
    }

    /// The colour under light from `wi`.
    #[inline(always)]
    fn colour<I: Isa, const WIDTH: usize>(&mut self, isa: I, material: &Material, wi: Vec3) -> Vec3 {
        let module = &material.colour;
        let light = module.texture.channels;
        self.0.0[light..light + 3].copy_from_slice(&wi.to_array());
        // Four fill a register; the last is always zero.
        let output = forward::<I, 4, WIDTH>(isa, module, &self.0.0);
        let [red, green, blue, _] = per_lane(&output, exp_less_one);
        Vec3::new(red, green, blue)
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
        let mut inputs = ColourInputs::<INPUTS>::nowhere();
        inputs.put(isa, material, view, uv);
        inputs.colour::<I, WIDTH>(isa, material, wi)
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
        let mut inputs = self.inputs.clone();
        for (&wi, rgb) in self.wi.iter().zip(self.rgb) {
            *rgb = inputs.colour::<I, WIDTH>(isa, self.material, wi);
        }
    }
}

#[inline(always)]
fn put_curvature(material: &Material, view: View, inputs: &mut [f32], index: usize) {
    if material.architecture.curvature_inputs() > 0 {
        inputs[index] = material.architecture.encode_curvature(view.kappa);
    }
}

/// Taps whose places are computed side by side.
const TOGETHER: usize = 16;

/// Fetches features at several places along `step`; returns the index after them. Overwrites up to a whole group more.
#[inline(always)]
fn fetch_taps<I: Isa>(
    isa: I,
    module: &PackedModule,
    uv: Vec2,
    step: Vec2,
    taps: &[f32],
    inputs: &mut [f32],
) -> usize {
    let texture = &module.texture;
    let mut next = 0;
    if let [fraction] = taps {
        let uv = uv + step * *fraction;
        isa.fetch_one(texture, texture.corners(&[uv.x], &[uv.y]).of(0), inputs);
        return texture.channels;
    }
    for taps in taps.chunks(TOGETHER) {
        let mut at = [[0.0; TOGETHER]; 2];
        for (k, &fraction) in taps.iter().enumerate() {
            at[0][k] = uv.x + step.x * fraction;
            at[1][k] = uv.y + step.y * fraction;
        }
        let corners = texture.corners(&at[0], &at[1]);
        for k in 0..taps.len() {
            isa.fetch_one(texture, corners.of(k), &mut inputs[next..]);
            next += texture.channels;
        }
    }
    next
}

#[inline(always)]
fn forward<I: Isa, const OUTPUTS: usize, const WIDTH: usize>(
    isa: I,
    module: &PackedModule,
    inputs: &[f32],
) -> [f32; OUTPUTS] {
    const { assert!(OUTPUTS <= COLUMN, "outputs fill one register at most") };
    let (mut odd, mut even) = (Column::<WIDTH>::zeroed(), Column::<WIDTH>::zeroed());
    isa.forward_one(&module.mlp, Buffers { a: inputs, b: &mut odd.0, c: &mut even.0 });
    let outputs = if module.mlp.layers.len() % 2 == 1 { &odd.0 } else { &even.0 };
    let mut result = [0.0; OUTPUTS];
    result.copy_from_slice(&outputs[..OUTPUTS]);
    result
}

/// The output of the first network, and two of the second.
#[inline(always)]
fn forward_two<I: Isa, const WIDTH: usize>(
    isa: I,
    modules: [&PackedModule; 2],
    inputs: [&[f32]; 2],
) -> (f32, [f32; 2]) {
    let column = Column::<WIDTH>::zeroed;
    let (mut odd, mut even) = ([column(), column()], [column(), column()]);
    let ([odd0, odd1], [even0, even1]) = (&mut odd, &mut even);
    let buffers = [
        Buffers { a: inputs[0], b: &mut odd0.0, c: &mut even0.0 },
        Buffers { a: inputs[1], b: &mut odd1.0, c: &mut even1.0 },
    ];
    isa.forward_two([&modules[0].mlp, &modules[1].mlp], buffers);
    let outputs = |k: usize| if modules[k].mlp.layers.len() % 2 == 1 { &odd[k].0 } else { &even[k].0 };
    (outputs(0)[0], [outputs(1)[0], outputs(1)[1]])
}

//! Batches: 32 queries at a time through each network that they need.
//!
//! Queries that need no opacity network (they look at the back, or more steeply than any silhouette) do not go through it, and those
//! that miss do not go on to the colour: both stages gather what is left into full blocks.

use super::kernels::{BLOCK, Buffers, Isa, Row, Rows, Task};
use super::lane_math::{self, azimuth, exp_less_one, per_lane};
use super::material::{BatchReport, Material};
use super::packed_mlp::PackedMlp;
use super::packed_texture::PackedTexture;
use crate::model::{OffsetForm, OpacityHead, STEEPEST_RAY, Way, inside_tile};
use crate::query::{Answer, Query};

/// Queries by number.
pub(super) trait Source {
    fn len(&self) -> usize;
    fn query(&self, index: usize) -> Query;
}

/// Where answers go.
pub(super) trait Sink {
    fn put(&mut self, index: usize, answer: Answer);
}

/// What all batches have in common: the compiled loop for networks of at most `INPUTS` inputs and `WIDTH` neurons a layer.
pub(super) struct Batch<'a, S, A, const INPUTS: usize, const WIDTH: usize> {
    pub material: &'a Material,
    pub source: &'a S,
    pub sink: &'a mut A,
}

impl<S: Source, A: Sink, const INPUTS: usize, const WIDTH: usize> Task for Batch<'_, S, A, INPUTS, WIDTH> {
    type Output = BatchReport;

    #[inline(always)]
    fn run<I: Isa>(self, isa: I) -> BatchReport {
        let Self { material, source, sink } = self;
        let mut work = Work::<INPUTS, WIDTH>::new();
        let (mut opacity, mut shade) = (Queue::new(), Queue::new());
        let mut report = BatchReport::default();
        let (mut index, count) = (0, source.len());
        // Full blocks while there are queries, whatever is left at the end.
        loop {
            while index < count && opacity.len < BLOCK && shade.len < BLOCK {
                let query = source.query(index);
                report.clamped += u64::from(!material.covers(query.kappa_hat));
                match material.known_alpha(query.wo.z, query.kappa_hat) {
                    Some(alpha) if alpha > 0.0 => shade.push(index, alpha),
                    Some(_) => sink.put(index, Answer::default()),
                    None => opacity.push(index, 0.0),
                }
                index += 1;
            }
            if shade.len >= BLOCK || (index == count && opacity.len == 0 && shade.len > 0) {
                shade_block(isa, material, source, sink, &mut work, &mut shade);
                report.shade_blocks += 1;
            } else if opacity.len > 0 {
                opacity_block(isa, material, source, sink, &mut work, &mut opacity, &mut shade);
                report.opacity_blocks += 1;
            } else {
                break;
            }
        }
        report.queries = count as u64;
        report
    }
}

/// The networks of so many blocks and nothing else, to be timed; returns a number that depends on all of it.
pub(super) struct Networks<'a, const INPUTS: usize, const WIDTH: usize> {
    pub material: &'a Material,
    pub blocks: usize,
}

impl<const INPUTS: usize, const WIDTH: usize> Task for Networks<'_, INPUTS, WIDTH> {
    type Output = f32;

    #[inline(always)]
    fn run<I: Isa>(self, isa: I) -> f32 {
        let Self { material, blocks } = self;
        let mut work = Work::<INPUTS, WIDTH>::new();
        let mut sum = 0.0;
        for _ in 0..blocks {
            for module in material.opacity.iter().chain([&material.offset, &material.colour]) {
                let output = work.forward(isa, &module.mlp)[0][0];
                work.inputs.0[0][0] = output;
                sum += output;
            }
        }
        sum
    }
}

/// Numbers of queries that wait for a full block: at most one block and what another hands over.
struct Queue {
    index: [usize; 2 * BLOCK],
    alpha: [f32; 2 * BLOCK],
    len: usize,
}

impl Queue {
    #[inline(always)]
    fn new() -> Self {
        Self { index: [0; 2 * BLOCK], alpha: [0.0; 2 * BLOCK], len: 0 }
    }

    #[inline(always)]
    fn push(&mut self, index: usize, alpha: f32) {
        self.index[self.len] = index;
        self.alpha[self.len] = alpha;
        self.len += 1;
    }

    /// Forgets the first block.
    #[inline(always)]
    fn drop_block(&mut self) {
        self.index.copy_within(BLOCK.., 0);
        self.alpha.copy_within(BLOCK.., 0);
        self.len = self.len.saturating_sub(BLOCK);
    }
}

/// One block of queries, a row per number.
struct Lanes {
    uv: [Row; 2],
    wo: [Row; 3],
    wi: [Row; 3],
    kappa: Row,
}

pub(super) struct Work<const INPUTS: usize, const WIDTH: usize> {
    inputs: Rows<INPUTS>,
    odd: Rows<WIDTH>,
    even: Rows<WIDTH>,
    lanes: Lanes,
}

impl<const INPUTS: usize, const WIDTH: usize> Work<INPUTS, WIDTH> {
    #[inline(always)]
    pub fn new() -> Self {
        let row = [0.0; BLOCK];
        let lanes = Lanes { uv: [row; 2], wo: [row; 3], wi: [row; 3], kappa: row };
        Self { inputs: Rows::zeroed(), odd: Rows::zeroed(), even: Rows::zeroed(), lanes }
    }

    /// Gathers the first block of a queue.
    #[inline(always)]
    fn load<S: Source>(&mut self, material: &Material, source: &S, queue: &Queue) {
        self.fill(material, queue.len, |k| source.query(queue.index[k]));
    }

    /// Gathers a block of `count` queries. Those that are missing are copies of the first.
    #[inline(always)]
    pub fn fill(&mut self, material: &Material, count: usize, query: impl Fn(usize) -> Query) {
        let lanes = &mut self.lanes;
        for k in 0..BLOCK {
            let query = query(if k < count { k } else { 0 });
            lanes.uv[0][k] = query.uv.x;
            lanes.uv[1][k] = query.uv.y;
            for axis in 0..3 {
                lanes.wo[axis][k] = query.wo[axis];
                lanes.wi[axis][k] = query.wi[axis];
            }
            lanes.kappa[k] = query.kappa_hat;
        }
        for row in &mut lanes.uv {
            *row = per_lane(row, inside_tile);
        }
        lanes.kappa = per_lane(&lanes.kappa, |kappa| material.architecture.clamp_curvature(kappa));
    }

    /// Fetches features into the rows from `first`; returns the row after them.
    #[inline(always)]
    fn fetch<I: Isa>(&mut self, isa: I, texture: &PackedTexture, uv: &[Row; 2], first: usize) -> usize {
        let corners = texture.corners(&uv[0], &uv[1]);
        isa.fetch_block(texture, &corners, &mut self.inputs.0[first..]);
        first + texture.channels
    }

    /// Fetches features at several places along `step`.
    #[inline(always)]
    fn fetch_taps<I: Isa>(
        &mut self,
        isa: I,
        texture: &PackedTexture,
        step: &[Row; 2],
        taps: &[f32],
    ) -> usize {
        let mut next = 0;
        for &fraction in taps {
            let mut uv = self.lanes.uv;
            for (uv, step) in uv.iter_mut().zip(step) {
                for k in 0..BLOCK {
                    uv[k] += step[k] * fraction;
                }
            }
            next = self.fetch(isa, texture, &uv, next);
        }
        next
    }

    /// Writes the curvature input, if the networks have one.
    #[inline(always)]
    fn put_curvature(&mut self, material: &Material, row: usize) {
        if material.architecture.curvature_inputs() > 0 {
            self.inputs.0[row] =
                per_lane(&self.lanes.kappa, |kappa| material.architecture.encode_curvature(kappa));
        }
    }

    /// Runs a network on the inputs.
    #[inline(always)]
    fn forward<I: Isa>(&mut self, isa: I, mlp: &PackedMlp) -> &[Row] {
        isa.forward_block(mlp, Buffers { a: &self.inputs.0, b: &mut self.odd.0, c: &mut self.even.0 });
        if mlp.layers.len() % 2 == 1 { &self.odd.0 } else { &self.even.0 }
    }

    /// How far it is to a tap at 1: the azimuth times the length of a way, per lane. Nothing is computed where it is not wanted.
    #[inline(always)]
    fn step(&self, wanted: bool, material: &Material, way: Way) -> [Row; 2] {
        if !wanted {
            return [[0.0; BLOCK]; 2];
        }
        let (mut step, reach) = (self.azimuths(), way_lengths(material, way, &self.lanes));
        for row in &mut step {
            for (step, reach) in row.iter_mut().zip(&reach) {
                *step *= reach;
            }
        }
        step
    }

    #[inline(always)]
    fn azimuths(&self) -> [Row; 2] {
        let mut along = [self.lanes.wo[0], self.lanes.wo[1]];
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

/// Opacity of the first block of a queue; those that hit go on to the other queue.
#[inline(always)]
fn opacity_block<I: Isa, S: Source, A: Sink, const INPUTS: usize, const WIDTH: usize>(
    isa: I,
    material: &Material,
    source: &S,
    sink: &mut A,
    work: &mut Work<INPUTS, WIDTH>,
    queue: &mut Queue,
    shade: &mut Queue,
) {
    let count = queue.len.min(BLOCK);
    work.load(material, source, queue);
    let alphas = alphas(isa, material, work);
    for (k, &alpha) in alphas.iter().enumerate().take(count) {
        if alpha > 0.0 {
            shade.push(queue.index[k], alpha);
        } else {
            sink.put(queue.index[k], Answer::default());
        }
    }
    queue.drop_block();
}

/// Opacities of the block by the network.
#[inline(always)]
pub(super) fn alphas<I: Isa, const INPUTS: usize, const WIDTH: usize>(
    isa: I,
    material: &Material,
    work: &mut Work<INPUTS, WIDTH>,
) -> Row {
    let Some(module) = &material.opacity else { return [1.0; BLOCK] };
    let architecture = &material.architecture;
    let along = work.azimuths();
    let step = work.step(apart(&architecture.opacity_taps), material, architecture.opacity_way);
    let next = work.fetch_taps(isa, &module.texture, &step, &architecture.opacity_taps);
    let direction = match architecture.opacity {
        OpacityHead::Silhouette => along,
        OpacityHead::Direct | OpacityHead::Opaque => [work.lanes.wo[0], work.lanes.wo[1]],
    };
    work.inputs.0[next..next + 2].copy_from_slice(&direction);
    work.put_curvature(material, next + 2);
    let mut alpha = work.forward(isa, &module.mlp)[0];
    for (k, alpha) in alpha.iter_mut().enumerate() {
        *alpha = material.alpha_of_output(*alpha, work.lanes.wo[2][k], work.lanes.kappa[k]);
    }
    alpha
}

/// Colours of the first block of a queue.
#[inline(always)]
fn shade_block<I: Isa, S: Source, A: Sink, const INPUTS: usize, const WIDTH: usize>(
    isa: I,
    material: &Material,
    source: &S,
    sink: &mut A,
    work: &mut Work<INPUTS, WIDTH>,
    queue: &mut Queue,
) {
    let count = queue.len.min(BLOCK);
    work.load(material, source, queue);
    let hit_uv = hit_uvs(isa, material, work);
    let rgb = colours(isa, material, work, &hit_uv);
    for k in 0..count {
        let rgb = [rgb[0][k], rgb[1][k], rgb[2][k]];
        sink.put(queue.index[k], Answer { rgb: rgb.into(), alpha: queue.alpha[k] });
    }
    queue.drop_block();
}

/// Where the rays of the block hit.
#[inline(always)]
pub(super) fn hit_uvs<I: Isa, const INPUTS: usize, const WIDTH: usize>(
    isa: I,
    material: &Material,
    work: &mut Work<INPUTS, WIDTH>,
) -> [Row; 2] {
    let (module, architecture) = (&material.offset, &material.architecture);
    let wanted = architecture.offset == OffsetForm::AlongReach || apart(&architecture.offset_taps);
    let step = work.step(wanted, material, architecture.offset_way);
    let next = work.fetch_taps(isa, &module.texture, &step, &architecture.offset_taps);
    for axis in 0..2 {
        work.inputs.0[next + axis] = work.lanes.wo[axis];
    }
    work.put_curvature(material, next + 2);
    let outputs = work.forward(isa, &module.mlp);
    let outputs = [outputs[0], outputs[1]];
    let mut uv = work.lanes.uv;
    for (axis, row) in uv.iter_mut().enumerate() {
        for k in 0..BLOCK {
            row[k] += match architecture.offset {
                OffsetForm::Free => outputs[axis][k],
                OffsetForm::AlongRay => {
                    -work.lanes.wo[axis][k] * (outputs[0][k] / work.lanes.wo[2][k].max(STEEPEST_RAY))
                }
                OffsetForm::AlongReach => step[axis][k] * outputs[0][k],
            };
        }
    }
    uv
}

#[inline(always)]
pub(super) fn colours<I: Isa, const INPUTS: usize, const WIDTH: usize>(
    isa: I,
    material: &Material,
    work: &mut Work<INPUTS, WIDTH>,
    hit_uv: &[Row; 2],
) -> [Row; 3] {
    let module = &material.colour;
    let next = work.fetch(isa, &module.texture, hit_uv, 0);
    work.inputs.0[next..next + 3].copy_from_slice(&work.lanes.wi);
    work.inputs.0[next + 3..next + 5].copy_from_slice(&work.lanes.wo[..2]);
    work.put_curvature(material, next + 5);
    let outputs = work.forward(isa, &module.mlp);
    [
        per_lane(&outputs[0], exp_less_one),
        per_lane(&outputs[1], exp_less_one),
        per_lane(&outputs[2], exp_less_one),
    ]
}

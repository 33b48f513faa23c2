//! Batches: 32 queries at a time through each network that they need.
//!
//! Queries that need no opacity network (they look at the back, or more steeply than any silhouette) do not go through it, and those
//! that miss do not go on to the colour: both stages gather what is left into full blocks. A block is prepared before another one runs, so
//! that the texels that it needs come near meanwhile.

use super::ahead::Ahead;
use super::kernels::{BLOCK, Isa, Task};
use super::material::{BatchReport, Material};
use super::prepared::Prepared;
use super::work::Work;
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
        // While a block of one kind runs, the texels of one of the other kind come near, or of the second of its own.
        let (mut opacity, mut shade) = (Stage::<1>::new(), Stage::<2>::new());
        let mut report = BatchReport { queries: source.len() as u64, ..BatchReport::default() };
        let (mut index, mut was_opacity) = (0, false);
        // Full blocks while there are queries, whatever is left at the end.
        loop {
            while index < source.len() && opacity.queue.len < BLOCK && shade.queue.len < 2 * BLOCK {
                let query = source.query(index);
                report.clamped += u64::from(!material.covers(query.kappa_hat));
                match material.known_alpha(query.wo.z, query.kappa_hat) {
                    Some(alpha) if alpha > 0.0 => shade.queue.push(index, alpha),
                    Some(_) => sink.put(index, Answer::default()),
                    None => opacity.queue.push(index, 0.0),
                }
                index += 1;
            }
            let is_end = index == source.len();
            opacity.form(is_end, |block, count, index| {
                block.for_opacity(material, count, |k| source.query(index[k]));
            });
            shade.form(is_end && opacity.formed == 0, |block, count, index| {
                block.for_offset(material, count, |k| source.query(index[k]));
            });
            // Room for all of a block that hit.
            let is_shades_turn = shade.formed > 0 && (was_opacity || shade.queue.len > BLOCK);
            let (opacity_block, shade_blocks) = (opacity.front(), shade.front_two());
            match (opacity_block, shade_blocks) {
                (Some(block), (other, _)) if !is_shades_turn => {
                    let mut ahead =
                        other.map_or(Ahead::nothing(), |other| other.prepared.offset_ahead(material));
                    let alphas = work.alphas(isa, material, &block.prepared, &mut ahead);
                    for (k, &alpha) in alphas.iter().enumerate().take(block.count) {
                        if alpha > 0.0 {
                            shade.queue.push(block.index[k], alpha);
                        } else {
                            sink.put(block.index[k], Answer::default());
                        }
                    }
                    opacity.drop_block();
                    report.opacity_blocks += 1;
                    was_opacity = true;
                }
                (other, (Some(block), later)) => {
                    let mut ahead = match (other, later) {
                        (Some(other), _) => other.prepared.opacity_ahead(material),
                        (None, Some(later)) => later.prepared.offset_ahead(material),
                        (None, None) => Ahead::nothing(),
                    };
                    shade_block(isa, material, &mut work, block, &mut ahead, sink);
                    shade.drop_block();
                    report.shade_blocks += 1;
                    was_opacity = false;
                }
                _ => break,
            }
        }
        report
    }
}

/// Answers of a block of rays that hit.
#[inline(always)]
fn shade_block<I: Isa, A: Sink, const INPUTS: usize, const WIDTH: usize>(
    isa: I,
    material: &Material,
    work: &mut Work<INPUTS, WIDTH>,
    block: &Formed,
    ahead: &mut Ahead<'_>,
    sink: &mut A,
) {
    let hit_uv = work.hit_uvs(isa, material, &block.prepared, ahead);
    let rgb = work.colours(isa, material, &block.prepared.lanes, &hit_uv, ahead);
    for k in 0..block.count {
        let rgb = [rgb[0][k], rgb[1][k], rgb[2][k]];
        sink.put(block.index[k], Answer { rgb: rgb.into(), alpha: block.alpha[k] });
    }
}

/// Queries that wait for the same networks, the first ones in up to `N` prepared blocks.
struct Stage<const N: usize> {
    queue: Queue,
    blocks: [Formed; N],
    first: usize,
    formed: usize,
}

/// A prepared block, and which queries it is of.
struct Formed {
    prepared: Prepared,
    index: [usize; BLOCK],
    alpha: [f32; BLOCK],
    count: usize,
}

impl<const N: usize> Stage<N> {
    #[inline(always)]
    fn new() -> Self {
        let formed =
            || Formed { prepared: Prepared::new(), index: [0; BLOCK], alpha: [0.0; BLOCK], count: 0 };
        Self { queue: Queue::new(), blocks: std::array::from_fn(|_| formed()), first: 0, formed: 0 }
    }

    /// Makes blocks of what waits, and of less than a block at the end. `prepare` gets the number of queries and which they are.
    #[inline(always)]
    fn form(&mut self, is_end: bool, prepare: impl Fn(&mut Prepared, usize, &[usize; BLOCK])) {
        while self.formed < N && (self.queue.len >= BLOCK || (is_end && self.queue.len > 0)) {
            let block = &mut self.blocks[(self.first + self.formed) % N];
            block.index.copy_from_slice(&self.queue.index[..BLOCK]);
            block.alpha.copy_from_slice(&self.queue.alpha[..BLOCK]);
            block.count = self.queue.len.min(BLOCK);
            prepare(&mut block.prepared, block.count, &block.index);
            self.queue.drop_block();
            self.formed += 1;
        }
    }

    /// The first block.
    #[inline(always)]
    fn front(&mut self) -> Option<&mut Formed> {
        self.front_two().0
    }

    /// The first block and the second.
    #[inline(always)]
    fn front_two(&mut self) -> (Option<&mut Formed>, Option<&mut Formed>) {
        let (first, formed) = (self.first, self.formed);
        let (low, high) = self.blocks.split_at_mut(1);
        let (front, later) = match first {
            0 => (low.first_mut(), high.first_mut()),
            _ => (high.first_mut(), low.first_mut()),
        };
        (front.filter(|_| formed > 0), later.filter(|_| formed > 1))
    }

    /// Forgets the first block.
    #[inline(always)]
    fn drop_block(&mut self) {
        self.first = (self.first + 1) % N;
        self.formed -= 1;
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
                let output = work.forward(isa, &module.mlp, &mut Ahead::nothing())[0][0];
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

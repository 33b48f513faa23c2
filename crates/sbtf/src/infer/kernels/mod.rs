//! What is compiled once per instruction set: networks over 32 queries or one, and texture fetches.
//!
//! The only files of this crate with `unsafe` are in this directory. A value of an [`Isa`] type exists only where its
//! instructions were detected, so that its methods are safe to call; [`Simd::run`] compiles a whole [`Task`] for the instructions, and
//! everything in it that is `#[inline(always)]` with it.
//!
//! AVX-512 and AVX2 do the same fused operations in the same order and give the same bits for batches; the portable twin rounds products
//! before adding.

#![allow(unsafe_code, reason = "SIMD kernels; each has a portable twin that tests it")]

mod column;
#[cfg(target_arch = "x86_64")]
mod fetch;
mod portable;
mod tile;
#[cfg(target_arch = "x86_64")]
mod x86;

use super::ahead::Ahead;
use super::packed_mlp::PackedMlp;
use super::packed_texture::{Corner, PackedTexture, Places};

pub(super) use portable::Portable;
#[cfg(target_arch = "x86_64")]
pub(super) use x86::{Avx2, Avx512};

/// Queries that the batch kernels take at a time: two AVX-512 registers, which hide the latency of a fused multiply-add.
pub(super) const BLOCK: usize = 32;

/// Features that a fetch loads at a time; textures are stored in groups of so many channels.
pub(super) const GROUP: usize = 8;

/// Outputs of a layer are filled up to whole registers of so many, the widest of any instruction set.
pub(super) const COLUMN: usize = 16;

/// One number of each query of a block.
pub(super) type Row = [f32; BLOCK];

/// Rows of numbers, one row per neuron.
#[derive(Debug, Clone)]
#[repr(align(64))]
pub(super) struct Rows<const N: usize>(pub [Row; N]);

impl<const N: usize> Rows<N> {
    /// All zero.
    #[inline(always)]
    pub fn zeroed() -> Self {
        Self([[0.0; BLOCK]; N])
    }
}

/// Numbers of one query, one per neuron.
#[derive(Debug, Clone)]
#[repr(align(64))]
pub(super) struct Column<const N: usize>(pub [f32; N]);

impl<const N: usize> Column<N> {
    /// All zero.
    #[inline(always)]
    pub fn zeroed() -> Self {
        Self([0.0; N])
    }
}

/// Where a module keeps its numbers between layers. All have at least the rows that the network needs; the output is in `b` after an odd
/// number of layers, in `c` otherwise.
#[derive(Debug)]
pub(super) struct Buffers<'a, T> {
    /// Inputs.
    pub a: &'a [T],
    /// Outputs of the first layer and every second one.
    pub b: &'a mut [T],
    /// Outputs of the other layers.
    pub c: &'a mut [T],
}

/// The operations of an instruction set.
pub(super) trait Isa: Copy {
    /// A network over 32 queries; meanwhile what is planned is brought near.
    fn forward_block(self, mlp: &PackedMlp, buffers: Buffers<'_, Row>, ahead: &mut Ahead<'_>);

    /// The network on one query; `b` and `c` have room for a multiple of [`COLUMN`].
    fn forward_one(self, mlp: &PackedMlp, buffers: Buffers<'_, f32>);

    /// Two networks on one query each, a layer of one after a layer of the other: a layer waits for the one before it, and the other
    /// network fills the time.
    fn forward_two(self, mlps: [&PackedMlp; 2], buffers: [Buffers<'_, f32>; 2]);

    /// Features of 32 queries, a row per channel.
    fn fetch_block(self, texture: &PackedTexture, places: Places<'_>, rows: &mut [Row]);

    /// Features of one query; `features` has room for a multiple of [`GROUP`].
    fn fetch_one(self, texture: &PackedTexture, corner: Corner, features: &mut [f32]);
}

/// Something to be compiled for every instruction set.
pub(super) trait Task {
    /// What it returns.
    type Output;

    /// Does it. Must be `#[inline(always)]`.
    fn run<I: Isa>(self, isa: I) -> Self::Output;
}

/// Which instructions the kernels use.
#[derive(Debug, Clone, Copy, PartialEq, Eq)]
pub enum Instructions {
    /// 512-bit registers.
    Avx512,
    /// 256-bit registers with fused multiply-add.
    Avx2,
    /// No particular ones.
    Portable,
}

/// Instructions that this processor has.
#[derive(Debug, Clone, Copy)]
pub(super) enum Simd {
    #[cfg(target_arch = "x86_64")]
    Avx512(Avx512),
    #[cfg(target_arch = "x86_64")]
    Avx2(Avx2),
    Portable(Portable),
}

impl Simd {
    /// The kernels for these instructions; `None` where the processor lacks them.
    pub fn new(instructions: Instructions) -> Option<Self> {
        match instructions {
            #[cfg(target_arch = "x86_64")]
            Instructions::Avx512 => Avx512::detect().map(Self::Avx512),
            #[cfg(target_arch = "x86_64")]
            Instructions::Avx2 => Avx2::detect().map(Self::Avx2),
            #[cfg(not(target_arch = "x86_64"))]
            Instructions::Avx512 | Instructions::Avx2 => None,
            Instructions::Portable => Some(Self::Portable(Portable)),
        }
    }

    /// The best there is.
    pub fn detect() -> Self {
        [Instructions::Avx512, Instructions::Avx2]
            .into_iter()
            .find_map(Self::new)
            .unwrap_or(Self::Portable(Portable))
    }

    /// Which ones they are.
    pub fn instructions(self) -> Instructions {
        match self {
            #[cfg(target_arch = "x86_64")]
            Self::Avx512(_) => Instructions::Avx512,
            #[cfg(target_arch = "x86_64")]
            Self::Avx2(_) => Instructions::Avx2,
            Self::Portable(_) => Instructions::Portable,
        }
    }

    /// Runs a task compiled for these instructions.
    #[inline]
    pub fn run<T: Task>(self, task: T) -> T::Output {
        match self {
            #[cfg(target_arch = "x86_64")]
            Self::Avx512(isa) => isa.run(task),
            #[cfg(target_arch = "x86_64")]
            Self::Avx2(isa) => isa.run(task),
            Self::Portable(isa) => task.run(isa),
        }
    }
}

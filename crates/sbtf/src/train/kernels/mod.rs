//! The inner loops of training, compiled for each instruction set.

mod dispatch;
mod features;
mod lanes;
mod network;
mod parameters;
mod products;
mod shape;

pub(crate) use features::{Tap, add_footprints, fetch};
pub(crate) use network::{backward, drain, forward};
pub(crate) use parameters::{AdamStep, accumulate, adam};
pub(crate) use shape::{BLOCK, ROW, Shape};

/// What the processor can do; only sets that are present are ever made.
#[derive(Debug, Clone, Copy, PartialEq, Eq)]
pub(crate) enum InstructionSet {
    /// Plain Rust. Where the target has no fused multiply-add this is slow, but right.
    Portable,
    /// AVX2 and FMA.
    #[cfg(target_arch = "x86_64")]
    Avx2,
    /// AVX-512 F, VL, DQ and BW, and what comes before it.
    #[cfg(target_arch = "x86_64")]
    Avx512,
}

impl InstructionSet {
    /// The fastest one that is present.
    pub(crate) fn best() -> Self {
        Self::present().last().unwrap_or(Self::Portable)
    }

    /// All that are present, the slowest first.
    pub(crate) fn present() -> impl Iterator<Item = Self> {
        let mut sets = vec![Self::Portable];
        #[cfg(target_arch = "x86_64")]
        {
            if std::arch::is_x86_feature_detected!("avx2") && std::arch::is_x86_feature_detected!("fma") {
                sets.push(Self::Avx2);
            }
            if std::arch::is_x86_feature_detected!("avx512f")
                && std::arch::is_x86_feature_detected!("avx512vl")
                && std::arch::is_x86_feature_detected!("avx512dq")
                && std::arch::is_x86_feature_detected!("avx512bw")
            {
                sets.push(Self::Avx512);
            }
        }
        sets.into_iter()
    }
}

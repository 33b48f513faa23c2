//! AVX-512 and AVX2 kernels.

use std::arch::x86_64::*;

use super::super::ahead::Ahead;
use super::super::packed_texture::{Corner, PackedTexture, Places};
use super::tile::{self, Vector};
use super::{Buffers, Isa, PackedMlp, Row, Task, column, fetch};

/// Proof that the processor has AVX-512 F, DQ, BW and VL, and all of [`Avx2`].
#[derive(Debug, Clone, Copy)]
pub struct Avx512(());

/// Proof that the processor has AVX2, FMA and F16C.
#[derive(Debug, Clone, Copy)]
pub struct Avx2(());

impl Avx512 {
    pub(super) fn detect() -> Option<Self> {
        let wide = is_x86_feature_detected!("avx512f")
            && is_x86_feature_detected!("avx512dq")
            && is_x86_feature_detected!("avx512bw")
            && is_x86_feature_detected!("avx512vl");
        (wide && Avx2::detect().is_some()).then_some(Self(()))
    }

    #[inline]
    pub(super) fn run<T: Task>(self, task: T) -> T::Output {
        #[target_feature(enable = "avx512f,avx512dq,avx512bw,avx512vl,avx2,fma,f16c")]
        fn compiled<T: Task>(isa: Avx512, task: T) -> T::Output {
            task.run(isa)
        }
        // SAFETY: a value of this type exists only where `detect` found the instructions.
        unsafe { compiled(self, task) }
    }
}

impl Avx2 {
    pub(super) fn detect() -> Option<Self> {
        let all = is_x86_feature_detected!("avx2")
            && is_x86_feature_detected!("fma")
            && is_x86_feature_detected!("f16c");
        all.then_some(Self(()))
    }

    #[inline]
    pub(super) fn run<T: Task>(self, task: T) -> T::Output {
        #[target_feature(enable = "avx2,fma,f16c")]
        fn compiled<T: Task>(isa: Avx2, task: T) -> T::Output {
            task.run(isa)
        }
        // SAFETY: a value of this type exists only where `detect` found the instructions.
        unsafe { compiled(self, task) }
    }
}

macro_rules! vector {
    ($register:ty, $lanes:literal, $half:ty, $has_half:literal, $halve:expr, $set1:ident, $load:ident, $store:ident, $fma:ident, $add:ident, $max:ident, $zero:ident) => {
        // SAFETY of all bodies: the caller vouches for the instructions and the pointers.
        impl Vector for $register {
            const LANES: usize = $lanes;
            type Half = $half;
            const HAS_HALF: bool = $has_half;

            #[inline(always)]
            #[allow(unused_unsafe, reason = "a register that has no half is its own")]
            unsafe fn half(self) -> $half {
                unsafe { $halve(self) }
            }

            #[inline(always)]
            unsafe fn splat(x: f32) -> Self {
                unsafe { $set1(x) }
            }

            #[inline(always)]
            unsafe fn load(from: *const f32) -> Self {
                unsafe { $load(from) }
            }

            #[inline(always)]
            unsafe fn store(self, to: *mut f32) {
                unsafe { $store(to, self) }
            }

            #[inline(always)]
            unsafe fn plus_product(self, a: Self, b: Self) -> Self {
                unsafe { $fma(a, b, self) }
            }

            #[inline(always)]
            unsafe fn add(self, other: Self) -> Self {
                unsafe { $add(self, other) }
            }

            #[inline(always)]
            // Not into the innermost cache: what a block fetches is more than that holds beside the networks' own numbers.
            unsafe fn bring_near(address: *const u8) {
                unsafe { _mm_prefetch::<_MM_HINT_T1>(address.cast()) }
            }

            // The instruction returns its second operand where the first is NaN.
            #[inline(always)]
            unsafe fn rectified(self) -> Self {
                unsafe { $max(self, $zero()) }
            }
        }
    };
}
vector!(
    __m512,
    16,
    __m256,
    true,
    _mm512_castps512_ps256,
    _mm512_set1_ps,
    _mm512_loadu_ps,
    _mm512_storeu_ps,
    _mm512_fmadd_ps,
    _mm512_add_ps,
    _mm512_max_ps,
    _mm512_setzero_ps
);
vector!(
    __m256,
    8,
    __m256,
    false,
    std::convert::identity,
    _mm256_set1_ps,
    _mm256_loadu_ps,
    _mm256_storeu_ps,
    _mm256_fmadd_ps,
    _mm256_add_ps,
    _mm256_max_ps,
    _mm256_setzero_ps
);

/// One compiled copy of each kernel per instruction set, whatever calls it.
macro_rules! isa {
    ($isa:ty, $features:literal, $register:ty, $tile:literal, $wide:literal) => {
        impl Isa for $isa {
            #[inline(always)]
            fn forward_block(self, mlp: &PackedMlp, buffers: Buffers<'_, Row>, ahead: &mut Ahead<'_>) {
                #[target_feature(enable = $features)]
                fn compiled(mlp: &PackedMlp, buffers: Buffers<'_, Row>, ahead: &mut Ahead<'_>) {
                    // SAFETY: compiled for these instructions.
                    unsafe { tile::forward_block::<$register, $tile>(mlp, buffers, ahead) }
                }
                // SAFETY: the instructions are there, as `self` proves. The same below.
                unsafe { compiled(mlp, buffers, ahead) }
            }

            #[inline(always)]
            fn forward_one(self, mlp: &PackedMlp, buffers: Buffers<'_, f32>) {
                #[target_feature(enable = $features)]
                fn compiled(mlp: &PackedMlp, buffers: Buffers<'_, f32>) {
                    // SAFETY: as above.
                    unsafe { column::forward_one::<$register>(mlp, buffers) }
                }
                // SAFETY: as above.
                unsafe { compiled(mlp, buffers) }
            }

            #[inline(always)]
            fn forward_two(self, mlps: [&PackedMlp; 2], buffers: [Buffers<'_, f32>; 2]) {
                #[target_feature(enable = $features)]
                fn compiled(mlps: [&PackedMlp; 2], buffers: [Buffers<'_, f32>; 2]) {
                    // SAFETY: as above.
                    unsafe { column::forward_two::<$register>(mlps, buffers) }
                }
                // SAFETY: as above.
                unsafe { compiled(mlps, buffers) }
            }

            #[inline(always)]
            fn fetch_block(self, texture: &PackedTexture, places: Places<'_>, rows: &mut [Row]) {
                #[target_feature(enable = $features)]
                fn compiled(texture: &PackedTexture, places: Places<'_>, rows: &mut [Row]) {
                    // SAFETY: as above.
                    unsafe { fetch::fetch_block::<$wide>(texture, places, rows) }
                }
                // SAFETY: as above.
                unsafe { compiled(texture, places, rows) }
            }

            #[inline(always)]
            fn fetch_one(self, texture: &PackedTexture, corner: Corner, features: &mut [f32]) {
                #[target_feature(enable = $features)]
                fn compiled(texture: &PackedTexture, corner: Corner, features: &mut [f32]) {
                    // SAFETY: as above.
                    unsafe { fetch::fetch_one::<$wide>(texture, corner, features) }
                }
                // SAFETY: as above.
                unsafe { compiled(texture, corner, features) }
            }
        }
    };
}
isa!(Avx512, "avx512f,avx512dq,avx512bw,avx512vl,avx2,fma,f16c", __m512, 12, true);
isa!(Avx2, "avx2,fma,f16c", __m256, 6, false);

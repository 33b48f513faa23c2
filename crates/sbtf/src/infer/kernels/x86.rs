//! AVX-512 and AVX2 kernels.

use std::arch::x86_64::*;

use super::super::packed_texture::{Corner, Corners, PackedTexels, PackedTexture};
use super::tile::{self, Vector};
use super::{BLOCK, Buffers, GROUP, Isa, PackedMlp, Row, Task};

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
    ($register:ty, $lanes:literal, $set1:ident, $load:ident, $store:ident, $fma:ident, $add:ident, $max:ident, $zero:ident) => {
        // SAFETY of all bodies: the caller vouches for the instructions and the pointers.
        impl Vector for $register {
            const LANES: usize = $lanes;

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
            fn forward_block(self, mlp: &PackedMlp, buffers: Buffers<'_, Row>) {
                #[target_feature(enable = $features)]
                fn compiled(mlp: &PackedMlp, buffers: Buffers<'_, Row>) {
                    // SAFETY: compiled for these instructions.
                    unsafe { tile::forward_block::<$register, $tile>(mlp, buffers) }
                }
                // SAFETY: the instructions are there, as `self` proves. The same below.
                unsafe { compiled(mlp, buffers) }
            }

            #[inline(always)]
            fn forward_one(self, mlp: &PackedMlp, buffers: Buffers<'_, f32>) {
                #[target_feature(enable = $features)]
                fn compiled(mlp: &PackedMlp, buffers: Buffers<'_, f32>) {
                    // SAFETY: as above.
                    unsafe { tile::forward_one::<$register>(mlp, buffers) }
                }
                // SAFETY: as above.
                unsafe { compiled(mlp, buffers) }
            }

            #[inline(always)]
            fn forward_two(self, mlps: [&PackedMlp; 2], buffers: [Buffers<'_, f32>; 2]) {
                #[target_feature(enable = $features)]
                fn compiled(mlps: [&PackedMlp; 2], buffers: [Buffers<'_, f32>; 2]) {
                    // SAFETY: as above.
                    unsafe { tile::forward_two::<$register>(mlps, buffers) }
                }
                // SAFETY: as above.
                unsafe { compiled(mlps, buffers) }
            }

            #[inline(always)]
            fn fetch_block(self, texture: &PackedTexture, corners: &Corners, rows: &mut [Row]) {
                #[target_feature(enable = $features)]
                fn compiled(texture: &PackedTexture, corners: &Corners, rows: &mut [Row]) {
                    // SAFETY: as above.
                    unsafe { fetch_block::<$wide>(texture, corners, rows) }
                }
                // SAFETY: as above.
                unsafe { compiled(texture, corners, rows) }
            }

            #[inline(always)]
            fn fetch_one(self, texture: &PackedTexture, corner: Corner, features: &mut [f32]) {
                #[target_feature(enable = $features)]
                fn compiled(texture: &PackedTexture, corner: Corner, features: &mut [f32]) {
                    // SAFETY: as above.
                    unsafe { fetch_one::<$wide>(texture, corner, features) }
                }
                // SAFETY: as above.
                unsafe { compiled(texture, corner, features) }
            }
        }
    };
}
isa!(Avx512, "avx512f,avx512dq,avx512bw,avx512vl,avx2,fma,f16c", __m512, 12, true);
isa!(Avx2, "avx2,fma,f16c", __m256, 6, false);

/// Numbers that textures are stored in.
trait Texel {
    /// One group of a texel.
    unsafe fn group(from: *const Self) -> __m256;
    /// The same of it and of its right neighbour, which follows.
    unsafe fn pair(from: *const Self) -> __m512;
}

impl Texel for f32 {
    #[inline(always)]
    unsafe fn group(from: *const Self) -> __m256 {
        unsafe { _mm256_loadu_ps(from) }
    }

    #[inline(always)]
    unsafe fn pair(from: *const Self) -> __m512 {
        unsafe { _mm512_loadu_ps(from) }
    }
}

/// Halves, as bits.
impl Texel for u16 {
    #[inline(always)]
    unsafe fn group(from: *const Self) -> __m256 {
        unsafe { _mm256_cvtph_ps(_mm_loadu_si128(from.cast())) }
    }

    #[inline(always)]
    unsafe fn pair(from: *const Self) -> __m512 {
        unsafe { _mm512_cvtph_ps(_mm256_loadu_si256(from.cast())) }
    }
}

impl Texel for u8 {
    #[inline(always)]
    unsafe fn group(from: *const Self) -> __m256 {
        unsafe { _mm256_cvtepi32_ps(_mm256_cvtepu8_epi32(_mm_loadl_epi64(from.cast()))) }
    }

    #[inline(always)]
    unsafe fn pair(from: *const Self) -> __m512 {
        unsafe { _mm512_cvtepi32_ps(_mm512_cvtepu8_epi32(_mm_loadu_si128(from.cast()))) }
    }
}

#[inline(always)]
unsafe fn fetch_block<const WIDE: bool>(texture: &PackedTexture, corners: &Corners, rows: &mut [Row]) {
    assert!(texture.channels <= rows.len(), "a row for every channel");
    // SAFETY: forwarded from the caller.
    unsafe {
        match &texture.texels {
            PackedTexels::F32(texels) => block_from::<f32, WIDE>(texture, texels, corners, rows),
            PackedTexels::F16(texels) => block_from::<u16, WIDE>(texture, texels, corners, rows),
            PackedTexels::U8(texels) => block_from::<u8, WIDE>(texture, texels, corners, rows),
        }
    }
}

#[inline(always)]
unsafe fn block_from<T: Texel, const WIDE: bool>(
    texture: &PackedTexture,
    texels: &[T],
    corners: &Corners,
    rows: &mut [Row],
) {
    for group in 0..texture.channels.div_ceil(GROUP) {
        let first = group * GROUP;
        let channels = (texture.channels - first).min(GROUP);
        for query in (0..BLOCK).step_by(8) {
            // SAFETY: corners point into the texture they were made for; scale and offset are padded to whole groups;
            // `fetch_block` checked the rows.
            unsafe {
                let from = texels.as_ptr().add(group * texture.group_stride);
                let mut features = [_mm256_setzero_ps(); 8];
                for (k, feature) in features.iter_mut().enumerate() {
                    *feature = bilinear::<T, WIDE>(from, corners.of(query + k));
                }
                let features = transposed(features);
                for (k, &feature) in features.iter().enumerate().take(channels) {
                    let scale = _mm256_set1_ps(*texture.scale.get_unchecked(first + k));
                    let offset = _mm256_set1_ps(*texture.offset.get_unchecked(first + k));
                    let to = rows.as_mut_ptr().add(first + k).cast::<f32>().add(query);
                    _mm256_storeu_ps(to, _mm256_fmadd_ps(feature, scale, offset));
                }
            }
        }
    }
}

#[inline(always)]
unsafe fn fetch_one<const WIDE: bool>(texture: &PackedTexture, corner: Corner, features: &mut [f32]) {
    assert!(texture.scale.len() <= features.len(), "room for every group");
    // SAFETY: forwarded from the caller.
    unsafe {
        match &texture.texels {
            PackedTexels::F32(texels) => one_from::<f32, WIDE>(texture, texels, corner, features),
            PackedTexels::F16(texels) => one_from::<u16, WIDE>(texture, texels, corner, features),
            PackedTexels::U8(texels) => one_from::<u8, WIDE>(texture, texels, corner, features),
        }
    }
}

#[inline(always)]
unsafe fn one_from<T: Texel, const WIDE: bool>(
    texture: &PackedTexture,
    texels: &[T],
    corner: Corner,
    features: &mut [f32],
) {
    for group in 0..texture.channels.div_ceil(GROUP) {
        // SAFETY: as in `block_from`.
        unsafe {
            let from = texels.as_ptr().add(group * texture.group_stride);
            let mixed = bilinear::<T, WIDE>(from, corner);
            let scale = _mm256_loadu_ps(texture.scale.as_ptr().add(group * GROUP));
            let offset = _mm256_loadu_ps(texture.offset.as_ptr().add(group * GROUP));
            let to = features.as_mut_ptr().add(group * GROUP);
            _mm256_storeu_ps(to, _mm256_fmadd_ps(mixed, scale, offset));
        }
    }
}

/// Eight features of one query, before scale and offset.
#[inline(always)]
unsafe fn bilinear<T: Texel, const WIDE: bool>(from: *const T, corner: Corner) -> __m256 {
    // SAFETY: corners point into the texture, which ends with a copy of its first column in every row.
    unsafe {
        let (row0, row1) = (from.add(corner.rows[0] as usize), from.add(corner.rows[1] as usize));
        let [fx, fy] = corner.fractions;
        let (left, right) = if WIDE {
            let (top, bottom) = (T::pair(row0), T::pair(row1));
            let both = _mm512_fmadd_ps(_mm512_sub_ps(bottom, top), _mm512_set1_ps(fy), top);
            (_mm512_castps512_ps256(both), _mm512_extractf32x8_ps::<1>(both))
        } else {
            let fy = _mm256_set1_ps(fy);
            let down = |offset: usize| {
                let (top, bottom) = (T::group(row0.add(offset)), T::group(row1.add(offset)));
                _mm256_fmadd_ps(_mm256_sub_ps(bottom, top), fy, top)
            };
            (down(0), down(GROUP))
        };
        _mm256_fmadd_ps(_mm256_sub_ps(right, left), _mm256_set1_ps(fx), left)
    }
}

/// Rows become columns.
#[inline(always)]
unsafe fn transposed(m: [__m256; 8]) -> [__m256; 8] {
    // SAFETY: the caller vouches for the instructions.
    unsafe {
        let pair = |a: __m256, b: __m256| (_mm256_unpacklo_ps(a, b), _mm256_unpackhi_ps(a, b));
        let ((a0, a1), (a2, a3)) = (pair(m[0], m[1]), pair(m[2], m[3]));
        let ((a4, a5), (a6, a7)) = (pair(m[4], m[5]), pair(m[6], m[7]));
        let quad = |a: __m256, b: __m256| {
            (_mm256_shuffle_ps::<0b01_00_01_00>(a, b), _mm256_shuffle_ps::<0b11_10_11_10>(a, b))
        };
        let ((b0, b1), (b2, b3)) = (quad(a0, a2), quad(a1, a3));
        let ((b4, b5), (b6, b7)) = (quad(a4, a6), quad(a5, a7));
        let low = |a: __m256, b: __m256| _mm256_permute2f128_ps::<0x20>(a, b);
        let high = |a: __m256, b: __m256| _mm256_permute2f128_ps::<0x31>(a, b);
        [
            low(b0, b4),
            low(b1, b5),
            low(b2, b6),
            low(b3, b7),
            high(b0, b4),
            high(b1, b5),
            high(b2, b6),
            high(b3, b7),
        ]
    }
}

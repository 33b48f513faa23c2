//! Texture fetches for AVX-512 and AVX2.

use std::arch::x86_64::*;

use super::super::packed_texture::{Corner, PackedTexels, PackedTexture, Places};
use super::{BLOCK, GROUP, Row};

/// Numbers that textures are stored in.
trait Texel {
    /// Whether numbers are codes, of which scale and offset make features.
    const CODED: bool = false;
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
        // Not `cvtph`, which suppresses exceptions and therefore cannot take its operand from memory.
        unsafe {
            let halves = _mm256_loadu_si256(from.cast());
            _mm512_cvt_roundph_ps::<_MM_FROUND_CUR_DIRECTION>(halves)
        }
    }
}

impl Texel for u8 {
    const CODED: bool = true;

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
pub(super) unsafe fn fetch_block<const WIDE: bool>(
    texture: &PackedTexture,
    places: Places<'_>,
    rows: &mut [Row],
) {
    assert!(texture.channels <= rows.len(), "a row for every channel");
    // SAFETY: forwarded from the caller.
    unsafe {
        match &texture.texels {
            PackedTexels::F32(texels) => block_from::<f32, WIDE>(texture, texels, places, rows),
            PackedTexels::F16(texels) => block_from::<u16, WIDE>(texture, texels, places, rows),
            PackedTexels::U8(texels) => block_from::<u8, WIDE>(texture, texels, places, rows),
        }
    }
}

#[inline(always)]
unsafe fn block_from<T: Texel, const WIDE: bool>(
    texture: &PackedTexture,
    texels: &[T],
    places: Places<'_>,
    rows: &mut [Row],
) {
    for (group, rows) in rows[..texture.channels].chunks_mut(GROUP).enumerate() {
        // SAFETY: corners point into the texture they were made for; scale and offset are padded to whole groups.
        unsafe {
            let from = texels.as_ptr().byte_add(group * texture.group_bytes);
            if WIDE {
                for query in (0..BLOCK).step_by(16) {
                    let features = sixteen(from, places, query);
                    let put = |channel: usize, to: *mut f32| {
                        let feature = features[channel];
                        let feature = if T::CODED {
                            let [scale, offset] = texture.decode(group * GROUP + channel);
                            _mm512_fmadd_ps(feature, _mm512_set1_ps(scale), _mm512_set1_ps(offset))
                        } else {
                            feature
                        };
                        _mm512_storeu_ps(to.add(query), feature);
                    };
                    each(rows, put);
                }
            } else {
                for query in (0..BLOCK).step_by(8) {
                    let features = eight(from, places, query);
                    let put = |channel: usize, to: *mut f32| {
                        let feature = features[channel];
                        let feature = if T::CODED {
                            let [scale, offset] = texture.decode(group * GROUP + channel);
                            _mm256_fmadd_ps(feature, _mm256_set1_ps(scale), _mm256_set1_ps(offset))
                        } else {
                            feature
                        };
                        _mm256_storeu_ps(to.add(query), feature);
                    };
                    each(rows, put);
                }
            }
        }
    }
}

/// Calls `put` with every channel of a group and its row.
#[inline(always)]
fn each(rows: &mut [Row], put: impl Fn(usize, *mut f32)) {
    // Usual groups are full: without a check per channel.
    if let Ok(rows) = <&mut [Row; GROUP]>::try_from(&mut *rows) {
        for (channel, row) in rows.iter_mut().enumerate() {
            put(channel, row.as_mut_ptr());
        }
    } else {
        for (channel, row) in rows.iter_mut().enumerate() {
            put(channel, row.as_mut_ptr());
        }
    }
}

/// Eight features of eight queries, a register per feature.
#[inline(always)]
unsafe fn eight<T: Texel>(from: *const T, places: Places<'_>, query: usize) -> [__m256; 8] {
    // SAFETY: forwarded from the caller.
    unsafe {
        let mut features = [_mm256_setzero_ps(); 8];
        for (k, feature) in features.iter_mut().enumerate() {
            *feature = bilinear::<T, false>(from, places.of(query + k));
            ask_for_next(from, places, query + k);
        }
        transposed(features)
    }
}

/// Eight features of sixteen queries, a register per feature.
#[inline(always)]
unsafe fn sixteen<T: Texel>(from: *const T, places: Places<'_>, query: usize) -> [__m512; 8] {
    // SAFETY: forwarded from the caller.
    unsafe {
        let mut m = [_mm512_setzero_ps(); 8];
        for (k, pair) in m.iter_mut().enumerate() {
            // Two queries that are four apart, in such an order that the last step below leaves all sixteen in turn.
            let first = query + k / 4 * 8 + k % 4;
            let (a, b) = (places.of(first), places.of(first + 4));
            ask_for_next(from, places, first);
            ask_for_next(from, places, first + 4);
            let (down_a, down_b) = (down(from, a), down(from, b));
            let left = _mm512_shuffle_f32x4::<0b01_00_01_00>(down_a, down_b);
            let right = _mm512_shuffle_f32x4::<0b11_10_11_10>(down_a, down_b);
            let fraction = _mm512_set1_ps(a.fractions[0]);
            let fraction = _mm512_mask_broadcastss_ps(fraction, 0xff00, _mm_set_ss(b.fractions[0]));
            *pair = _mm512_fmadd_ps(_mm512_sub_ps(right, left), fraction, left);
        }
        let words = |a: __m512, b: __m512| (_mm512_unpacklo_ps(a, b), _mm512_unpackhi_ps(a, b));
        let ((a0, a1), (a2, a3)) = (words(m[0], m[1]), words(m[2], m[3]));
        let ((a4, a5), (a6, a7)) = (words(m[4], m[5]), words(m[6], m[7]));
        let quad = |a: __m512, b: __m512| {
            (_mm512_shuffle_ps::<0b01_00_01_00>(a, b), _mm512_shuffle_ps::<0b11_10_11_10>(a, b))
        };
        let ((b0, b1), (b2, b3)) = (quad(a0, a2), quad(a1, a3));
        let ((b4, b5), (b6, b7)) = (quad(a4, a6), quad(a5, a7));
        let low = |a: __m512, b: __m512| _mm512_shuffle_f32x4::<0b10_00_10_00>(a, b);
        let high = |a: __m512, b: __m512| _mm512_shuffle_f32x4::<0b11_01_11_01>(a, b);
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

#[inline(always)]
pub(super) unsafe fn fetch_one<const WIDE: bool>(
    texture: &PackedTexture,
    corner: Corner,
    features: &mut [f32],
) {
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
            let from = texels.as_ptr().byte_add(group * texture.group_bytes);
            let mut mixed = bilinear::<T, WIDE>(from, corner);
            if T::CODED {
                let scale = _mm256_loadu_ps(texture.scale.as_ptr().add(group * GROUP));
                let offset = _mm256_loadu_ps(texture.offset.as_ptr().add(group * GROUP));
                mixed = _mm256_fmadd_ps(mixed, scale, offset);
            }
            _mm256_storeu_ps(features.as_mut_ptr().add(group * GROUP), mixed);
        }
    }
}

/// Asks for the texels that the query fetches next: the second level of the cache has them, and even that is worth not waiting for.
#[inline(always)]
unsafe fn ask_for_next<T>(from: *const T, places: Places<'_>, query: usize) {
    if let Some(next) = places.next {
        for row in next {
            let texel = from.wrapping_byte_add(row[query] as usize);
            let last = texel.wrapping_add(2 * GROUP).wrapping_byte_sub(1);
            // SAFETY: asking for any address is harmless.
            unsafe {
                _mm_prefetch::<_MM_HINT_T0>(texel.cast());
                _mm_prefetch::<_MM_HINT_T0>(last.cast());
            }
        }
    }
}

/// Eight features of one query, before scale and offset.
#[inline(always)]
unsafe fn bilinear<T: Texel, const WIDE: bool>(from: *const T, corner: Corner) -> __m256 {
    // SAFETY: forwarded from the caller.
    unsafe {
        let (left, right) = if WIDE {
            let both = down(from, corner);
            (_mm512_castps512_ps256(both), _mm512_extractf32x8_ps::<1>(both))
        } else {
            let [row0, row1] = corner.rows.map(|row| from.byte_add(row as usize));
            let fraction = _mm256_set1_ps(corner.fractions[1]);
            let down = |offset: usize| {
                let (top, bottom) = (T::group(row0.add(offset)), T::group(row1.add(offset)));
                _mm256_fmadd_ps(_mm256_sub_ps(bottom, top), fraction, top)
            };
            (down(0), down(GROUP))
        };
        _mm256_fmadd_ps(_mm256_sub_ps(right, left), _mm256_set1_ps(corner.fractions[0]), left)
    }
}

/// Eight features at the left of one query, and eight at its right, between its two rows.
#[inline(always)]
unsafe fn down<T: Texel>(from: *const T, corner: Corner) -> __m512 {
    // SAFETY: corners point into the texture, which ends with a copy of its first column in every row.
    unsafe {
        let [top, bottom] = corner.rows.map(|row| T::pair(from.byte_add(row as usize)));
        _mm512_fmadd_ps(_mm512_sub_ps(bottom, top), _mm512_set1_ps(corner.fractions[1]), top)
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

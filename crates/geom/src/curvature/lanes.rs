//! Eight numbers side by side: portable, and as one AVX-512 register.
//!
//! The two modules have the same functions, so that code written once as a macro compiles against both. Every operation
//! rounds alike in both and none is fused, so they give the same bits. (A trait would say it better, but code behind one is
//! not inlined into functions that are compiled for an instruction set.)

/// Arrays, for any processor.
pub(super) mod portable {
    /// Eight numbers.
    pub(crate) type Lane = [f64; 8];
    /// Eight answers.
    pub(crate) type Mask = [bool; 8];

    #[inline(always)]
    pub(crate) fn splat(x: f64) -> Lane {
        [x; 8]
    }

    #[inline(always)]
    pub(crate) fn load(from: &[f64; 8]) -> Lane {
        *from
    }

    #[inline(always)]
    pub(crate) fn store(lane: Lane, to: &mut [f64; 8]) {
        *to = lane;
    }

    #[inline(always)]
    pub(crate) fn add(a: Lane, b: Lane) -> Lane {
        std::array::from_fn(|i| a[i] + b[i])
    }

    #[inline(always)]
    pub(crate) fn sub(a: Lane, b: Lane) -> Lane {
        std::array::from_fn(|i| a[i] - b[i])
    }

    #[inline(always)]
    pub(crate) fn mul(a: Lane, b: Lane) -> Lane {
        std::array::from_fn(|i| a[i] * b[i])
    }

    #[inline(always)]
    pub(crate) fn div(a: Lane, b: Lane) -> Lane {
        std::array::from_fn(|i| a[i] / b[i])
    }

    /// Inner products of vectors side by side.
    #[inline(always)]
    pub(crate) fn dot(a: &[Lane; 3], b: &[Lane; 3]) -> Lane {
        add(add(mul(a[0], b[0]), mul(a[1], b[1])), mul(a[2], b[2]))
    }

    /// The second where the first is not a number.
    #[inline(always)]
    pub(crate) fn max(a: Lane, b: Lane) -> Lane {
        std::array::from_fn(|i| if a[i] > b[i] { a[i] } else { b[i] })
    }

    #[inline(always)]
    pub(crate) fn sqrt(a: Lane) -> Lane {
        a.map(f64::sqrt)
    }

    #[inline(always)]
    pub(crate) fn abs(a: Lane) -> Lane {
        a.map(f64::abs)
    }

    /// Where the first is less; nowhere that one is not a number.
    #[inline(always)]
    pub(crate) fn less(a: Lane, b: Lane) -> Mask {
        std::array::from_fn(|i| a[i] < b[i])
    }

    #[inline(always)]
    pub(crate) fn and(a: Mask, b: Mask) -> Mask {
        std::array::from_fn(|i| a[i] && b[i])
    }

    /// The first where the mask is set, the second elsewhere.
    #[inline(always)]
    pub(crate) fn select(mask: Mask, a: Lane, b: Lane) -> Lane {
        std::array::from_fn(|i| if mask[i] { a[i] } else { b[i] })
    }

    /// Bit `i` for number `i`.
    #[inline(always)]
    pub(crate) fn bits(mask: Mask) -> u8 {
        (0..8).fold(0, |bits, i| bits | u8::from(mask[i]) << i)
    }

    /// The first three numbers of eight quadruples, as three times eight numbers.
    #[inline(always)]
    pub(crate) fn columns(rows: [&[f64; 4]; 8]) -> [Lane; 3] {
        std::array::from_fn(|column| std::array::from_fn(|row| rows[row][column]))
    }

    /// `1, x, x^2, ... x^7`.
    #[inline(always)]
    pub(crate) fn powers(x: f64) -> Lane {
        let x2 = x * x;
        let (x3, x4) = (x * x2, x2 * x2);
        [1.0, x, x2, x3, x4, x * x4, x2 * x4, x3 * x4]
    }
}

/// Registers.
#[cfg(target_arch = "x86_64")]
pub(super) mod avx512 {
    use std::arch::x86_64::{
        __m512d, __mmask8, _CMP_LT_OQ, _mm256_loadu_pd, _mm512_abs_pd, _mm512_add_pd, _mm512_castpd256_pd512,
        _mm512_cmp_pd_mask, _mm512_div_pd, _mm512_insertf64x4, _mm512_loadu_pd, _mm512_mask_mov_pd,
        _mm512_mask_mul_pd, _mm512_max_pd, _mm512_mul_pd, _mm512_permutex2var_pd, _mm512_set1_pd,
        _mm512_setr_epi64, _mm512_sqrt_pd, _mm512_storeu_pd, _mm512_sub_pd, _mm512_unpackhi_pd,
        _mm512_unpacklo_pd,
    };

    /// Eight numbers.
    pub(crate) type Lane = __m512d;
    /// Eight answers.
    pub(crate) type Mask = __mmask8;

    #[inline]
    #[target_feature(enable = "avx512f")]
    pub(crate) fn splat(x: f64) -> Lane {
        _mm512_set1_pd(x)
    }

    #[inline]
    #[target_feature(enable = "avx512f")]
    #[allow(unsafe_code, reason = "loads take pointers")]
    pub(crate) fn load(from: &[f64; 8]) -> Lane {
        // SAFETY: eight numbers are readable.
        unsafe { _mm512_loadu_pd(from.as_ptr()) }
    }

    #[inline]
    #[target_feature(enable = "avx512f")]
    #[allow(unsafe_code, reason = "stores take pointers")]
    pub(crate) fn store(lane: Lane, to: &mut [f64; 8]) {
        // SAFETY: eight numbers are writable.
        unsafe { _mm512_storeu_pd(to.as_mut_ptr(), lane) }
    }

    #[inline]
    #[target_feature(enable = "avx512f")]
    pub(crate) fn add(a: Lane, b: Lane) -> Lane {
        _mm512_add_pd(a, b)
    }

    #[inline]
    #[target_feature(enable = "avx512f")]
    pub(crate) fn sub(a: Lane, b: Lane) -> Lane {
        _mm512_sub_pd(a, b)
    }

    #[inline]
    #[target_feature(enable = "avx512f")]
    pub(crate) fn mul(a: Lane, b: Lane) -> Lane {
        _mm512_mul_pd(a, b)
    }

    #[inline]
    #[target_feature(enable = "avx512f")]
    pub(crate) fn div(a: Lane, b: Lane) -> Lane {
        _mm512_div_pd(a, b)
    }

    #[inline]
    #[target_feature(enable = "avx512f")]
    pub(crate) fn dot(a: &[Lane; 3], b: &[Lane; 3]) -> Lane {
        add(add(mul(a[0], b[0]), mul(a[1], b[1])), mul(a[2], b[2]))
    }

    /// The second where the first is not a number, as the instruction has it.
    #[inline]
    #[target_feature(enable = "avx512f")]
    pub(crate) fn max(a: Lane, b: Lane) -> Lane {
        _mm512_max_pd(a, b)
    }

    #[inline]
    #[target_feature(enable = "avx512f")]
    pub(crate) fn sqrt(a: Lane) -> Lane {
        _mm512_sqrt_pd(a)
    }

    #[inline]
    #[target_feature(enable = "avx512f")]
    pub(crate) fn abs(a: Lane) -> Lane {
        _mm512_abs_pd(a)
    }

    /// Where the first is less; nowhere that one is not a number.
    #[inline]
    #[target_feature(enable = "avx512f")]
    pub(crate) fn less(a: Lane, b: Lane) -> Mask {
        _mm512_cmp_pd_mask::<_CMP_LT_OQ>(a, b)
    }

    #[inline]
    #[target_feature(enable = "avx512f")]
    pub(crate) fn and(a: Mask, b: Mask) -> Mask {
        a & b
    }

    /// The first where the mask is set, the second elsewhere.
    #[inline]
    #[target_feature(enable = "avx512f")]
    pub(crate) fn select(mask: Mask, a: Lane, b: Lane) -> Lane {
        _mm512_mask_mov_pd(b, mask, a)
    }

    /// Bit `i` for number `i`.
    #[inline]
    #[target_feature(enable = "avx512f")]
    pub(crate) fn bits(mask: Mask) -> u8 {
        mask
    }

    /// The first three numbers of eight quadruples, as three times eight numbers.
    #[inline]
    #[target_feature(enable = "avx512f")]
    pub(crate) fn columns(rows: [&[f64; 4]; 8]) -> [Lane; 3] {
        // Rows i and i + 4 side by side: what follows works within halves.
        let pairs =
            [pair(rows[0], rows[4]), pair(rows[1], rows[5]), pair(rows[2], rows[6]), pair(rows[3], rows[7])];
        // x0 x1 z0 z1 | x4 x5 z4 z5, and so on.
        let even = [_mm512_unpacklo_pd(pairs[0], pairs[1]), _mm512_unpacklo_pd(pairs[2], pairs[3])];
        let odd = [_mm512_unpackhi_pd(pairs[0], pairs[1]), _mm512_unpackhi_pd(pairs[2], pairs[3])];
        let front = _mm512_setr_epi64(0, 1, 8, 9, 4, 5, 12, 13);
        let back = _mm512_setr_epi64(2, 3, 10, 11, 6, 7, 14, 15);
        [
            _mm512_permutex2var_pd(even[0], front, even[1]),
            _mm512_permutex2var_pd(odd[0], front, odd[1]),
            _mm512_permutex2var_pd(even[0], back, even[1]),
        ]
    }

    #[inline]
    #[target_feature(enable = "avx512f")]
    #[allow(unsafe_code, reason = "loads take pointers")]
    fn pair(low: &[f64; 4], high: &[f64; 4]) -> Lane {
        // SAFETY: four numbers are readable at both places.
        let (low, high) = unsafe { (_mm256_loadu_pd(low.as_ptr()), _mm256_loadu_pd(high.as_ptr())) };
        _mm512_insertf64x4::<1>(_mm512_castpd256_pd512(low), high)
    }

    /// `1, x, x^2, ... x^7`.
    #[inline]
    #[target_feature(enable = "avx512f")]
    pub(crate) fn powers(x: f64) -> Lane {
        let x2 = x * x;
        let ones_and_x = _mm512_mask_mov_pd(_mm512_set1_pd(1.0), 0b1010_1010, _mm512_set1_pd(x));
        let to_x3 = _mm512_mask_mul_pd(ones_and_x, 0b1100_1100, ones_and_x, _mm512_set1_pd(x2));
        _mm512_mask_mul_pd(to_x3, 0b1111_0000, to_x3, _mm512_set1_pd(x2 * x2))
    }
}

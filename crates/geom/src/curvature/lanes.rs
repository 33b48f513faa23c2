//! Eight numbers side by side: portable, and as one AVX-512 register.
//!
//! The two modules have the same functions, so that code written once as a macro compiles against both. Every operation
//! rounds alike in both and none is fused, so they give the same bits. (A trait would say it better, but code behind one is
//! not inlined into functions that are compiled for an instruction set.)

/// Arrays, for any processor.
pub(super) mod portable {
    /// Eight numbers.
    pub(crate) type Lane = [f64; 8];

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

    /// The second where the first is not a number.
    #[inline(always)]
    pub(crate) fn max(a: Lane, b: Lane) -> Lane {
        std::array::from_fn(|i| if a[i] > b[i] { a[i] } else { b[i] })
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
        __m512d, _mm512_add_pd, _mm512_div_pd, _mm512_loadu_pd, _mm512_mask_mov_pd, _mm512_mask_mul_pd,
        _mm512_max_pd, _mm512_mul_pd, _mm512_set1_pd, _mm512_storeu_pd, _mm512_sub_pd,
    };

    /// Eight numbers.
    pub(crate) type Lane = __m512d;

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

    /// The second where the first is not a number, as the instruction has it.
    #[inline]
    #[target_feature(enable = "avx512f")]
    pub(crate) fn max(a: Lane, b: Lane) -> Lane {
        _mm512_max_pd(a, b)
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

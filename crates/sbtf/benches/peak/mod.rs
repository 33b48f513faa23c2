//! The most fused multiply-adds that one thread does: independent ones, in registers.

#![allow(unsafe_code, reason = "calling functions compiled for detected instructions")]

use osculate_sbtf::infer::Instructions;

/// What the loop uses.
pub fn instructions() -> Instructions {
    #[cfg(target_arch = "x86_64")]
    {
        if is_x86_feature_detected!("avx512f") {
            return Instructions::Avx512;
        }
        if is_x86_feature_detected!("avx2") && is_x86_feature_detected!("fma") {
            return Instructions::Avx2;
        }
    }
    Instructions::Portable
}

/// Runs so many rounds; returns the number of multiply-adds, lanes counted.
pub fn fused_multiply_adds(rounds: usize) -> f64 {
    match instructions() {
        #[cfg(target_arch = "x86_64")]
        // SAFETY: the instructions were detected.
        Instructions::Avx512 => unsafe { x86::avx512(rounds) },
        #[cfg(target_arch = "x86_64")]
        // SAFETY: the instructions were detected.
        Instructions::Avx2 => unsafe { x86::avx2(rounds) },
        _ => portable(rounds),
    }
}

fn portable(rounds: usize) -> f64 {
    let mut sums = [[0.0f32; 8]; 8];
    for _ in 0..rounds {
        sums.iter_mut().flatten().for_each(|sum| *sum = *sum * 0.5 + 1.0);
    }
    std::hint::black_box(sums);
    (rounds * 64) as f64
}

#[cfg(target_arch = "x86_64")]
mod x86 {
    use std::arch::x86_64::*;

    #[target_feature(enable = "avx512f")]
    pub fn avx512(rounds: usize) -> f64 {
        let (a, b) = (_mm512_set1_ps(0.5), _mm512_set1_ps(1.0));
        let mut sums = [_mm512_setzero_ps(); 24];
        for _ in 0..rounds {
            for sum in &mut sums {
                *sum = _mm512_fmadd_ps(*sum, a, b);
            }
        }
        std::hint::black_box(sums);
        (rounds * 24 * 16) as f64
    }

    #[target_feature(enable = "avx2,fma")]
    pub fn avx2(rounds: usize) -> f64 {
        let (a, b) = (_mm256_set1_ps(0.5), _mm256_set1_ps(1.0));
        let mut sums = [_mm256_setzero_ps(); 12];
        for _ in 0..rounds {
            for sum in &mut sums {
                *sum = _mm256_fmadd_ps(*sum, a, b);
            }
        }
        std::hint::black_box(sums);
        (rounds * 12 * 8) as f64
    }
}

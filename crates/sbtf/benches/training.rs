//! A training step of a bare 16-24-24-24-4 network on 65,536 samples, one thread, beside the processor's peak; for `PyTorch` on the
//! same step: `python tools/reference/torch_gradients.py --time`.
#![allow(missing_docs, reason = "criterion makes the functions")]

use std::hint::black_box;

use criterion::{Criterion, Throughput, criterion_group, criterion_main};
use osculate_sbtf::train::BareNetwork;

fn step(criterion: &mut Criterion) {
    let mut group = criterion.benchmark_group("training");
    group.sample_size(20);
    for (name, sizes) in
        [("16-24-24-24-4", [16, 24, 24, 24, 4]), ("59-24-24-24-1 (seven taps)", [59, 24, 24, 24, 1])]
    {
        let mut network = BareNetwork::new(&sizes, 65_536);
        group.throughput(Throughput::Elements(network.multiply_adds() as u64));
        group.bench_function(name, |bencher| bencher.iter(|| network.step()));
    }
    group.throughput(Throughput::Elements((PEAK_ROUNDS * 24 * 16) as u64));
    group.bench_function("peak of multiply-adds", |bencher| bencher.iter(|| peak(black_box(1.0))));
    group.finish();
}

const PEAK_ROUNDS: usize = 100_000;

/// Independent multiply-adds, as many at a time as hide their latency. 0 where there is no AVX-512.
fn peak(x: f32) -> f32 {
    #[cfg(target_arch = "x86_64")]
    if std::arch::is_x86_feature_detected!("avx512f") {
        #[allow(unsafe_code, reason = "calling a function compiled for AVX-512 requires it")]
        // SAFETY: the processor has AVX-512F, as was just checked.
        return unsafe { peak_avx512(x) };
    }
    0.0 * x
}

#[cfg(target_arch = "x86_64")]
#[target_feature(enable = "avx512f")]
fn peak_avx512(x: f32) -> f32 {
    use std::arch::x86_64::{_mm512_fmadd_ps, _mm512_reduce_add_ps, _mm512_set1_ps};
    let factor = _mm512_set1_ps(0.999 * x);
    let mut sums = [_mm512_set1_ps(x); 24];
    for _ in 0..PEAK_ROUNDS {
        for sum in &mut sums {
            *sum = _mm512_fmadd_ps(*sum, factor, factor);
        }
    }
    sums.iter().map(|&sum| _mm512_reduce_add_ps(sum)).sum()
}

criterion_group!(benches, step);
criterion_main!(benches);

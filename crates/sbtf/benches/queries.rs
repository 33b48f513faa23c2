//! Nanoseconds a query and share of the processor's peak, one thread.
//!
//! `cargo bench -p osculate-sbtf --bench queries [FILTER]`. The peak is a loop of independent fused multiply-adds, measured in the same run;
//! shares count the multiply-adds of the networks only, so that fetches, `exp` and sorting count as loss. Queries graze, so that all
//! of them go through all networks; the last column is a batch of all directions and curvatures, of which most are known to hit.
#![allow(missing_docs, reason = "criterion_group makes an undocumented function")]
#![allow(clippy::print_stdout, reason = "shares of the peak are what it measures")]

use std::hint::black_box;
use std::time::{Duration, Instant};

use criterion::{BenchmarkId, Criterion, Throughput, criterion_group, criterion_main};
use glam::{Vec2, Vec3};
use osculate_sbtf::infer::{Instructions, Material, Precision, StoredModel};
use osculate_sbtf::model::{Architecture, Model, TextureShape};
use osculate_sbtf::silhouette::largest_cosine;
use osculate_sbtf::{Answer, Query, SilhouetteBtf};

#[path = "peak/mod.rs"]
mod peak;

const COUNT: usize = 1 << 14;

/// Queries that all need the opacity network, at random places.
#[allow(clippy::cast_possible_truncation, reason = "rounded on purpose")]
fn grazing(count: usize, depth: f32) -> Vec<Query> {
    let fraction = |i: usize, step: f64| (i as f64 * step).fract() as f32;
    let query = |i: usize| {
        let kappa_hat = 0.2 + 2.2 * fraction(i, 0.618_033_988_7);
        let cosine = largest_cosine(kappa_hat, depth) * (0.05 + 0.94 * fraction(i, 0.754_877_666_2));
        let (sine, angle) =
            ((1.0 - cosine * cosine).sqrt(), std::f32::consts::TAU * fraction(i, 0.569_840_290_9));
        Query {
            uv: Vec2::new(fraction(i, 0.819_172_513_4), fraction(i, 0.671_043_606_7)),
            wo: Vec3::new(sine * angle.cos(), sine * angle.sin(), cosine),
            wi: Vec3::new(0.3, fraction(i, 0.549_7) - 0.5, 0.7).normalize(),
            kappa_hat,
        }
    };
    (0..count).map(query).collect()
}

/// Queries from all over the hemisphere and of all curvatures that models are trained for, evenly; most need no opacity network.
fn spread(count: usize, [low, high]: [f32; 2]) -> Vec<Query> {
    let lifted = |(i, query): (usize, Query)| {
        let cosine = (i as f32 * 0.754_877_7).fract().max(1e-3);
        let flat = query.wo.truncate().normalize() * (1.0 - cosine * cosine).sqrt();
        let kappa_hat = low + (high - low) * (i as f32 * 0.618_034).fract();
        Query { wo: flat.extend(cosine), kappa_hat, ..query }
    };
    grazing(count, 0.1).into_iter().enumerate().map(lifted).collect()
}

/// A model whose rays all hit, so that every query goes through all networks.
fn model(form: Architecture) -> Model {
    let mut model = Model::untrained(form, 1);
    if let Some(module) = &mut model.opacity {
        let last = module.mlp.layers.last_mut().expect("networks have layers");
        last.weights.fill(0.0);
        last.biases.fill(-1.0);
    }
    model
}

/// Textures so small that they stay in the innermost cache: what is left is networks.
fn tiny(form: Architecture) -> Architecture {
    let tiny = |shape: TextureShape| TextureShape { width: 4, height: 4, ..shape };
    Architecture {
        opacity_texture: tiny(form.opacity_texture),
        offset_texture: tiny(form.offset_texture),
        colour_texture: tiny(form.colour_texture),
        ..form
    }
}

/// Seconds of the fastest of many calls, each shorter than a time slice, so that other programs disturb it least; `call` gets its number.
fn fastest(mut call: impl FnMut(usize)) -> f64 {
    let time = |number| {
        let start = Instant::now();
        call(number);
        start.elapsed().as_secs_f64()
    };
    (0..REPEATS).map(time).skip(REPEATS / 10).fold(f64::INFINITY, f64::min)
}

/// Plain loops over the same weights, without allocations; the compiler may vectorise them as it likes for its target.
#[inline(never)]
fn scalar(model: &Model, inputs: &[f32; 64]) -> f32 {
    let modules = model.opacity.iter().chain([&model.offset, &model.colour]);
    let mut total = 0.0;
    for module in modules {
        let (mut x, mut y) = (*inputs, [0.0f32; 64]);
        for layer in &module.mlp.layers {
            for (output, row) in layer.weights.chunks_exact(layer.inputs).enumerate() {
                let sum: f32 = layer.biases[output] + row.iter().zip(&x).map(|(w, x)| w * x).sum::<f32>();
                y[output] = sum.max(0.0);
            }
            x = y;
        }
        total += x[0];
    }
    total
}

const REPEATS: usize = 1000;
/// Queries of a call; calls go through all of them in turn, so that textures are touched all over.
const WINDOW: usize = 1024;

fn window<T>(all: &[T], number: usize, count: usize) -> &[T] {
    &all[number * count % COUNT..][..count]
}

fn shares(_: &mut Criterion) {
    let rounds = 1 << 13;
    let per_second = || {
        peak::fused_multiply_adds(rounds)
            / fastest(|_| {
                black_box(peak::fused_multiply_adds(rounds));
            })
    };
    println!("peak: {:.1} G multiply-adds a second ({:?})", per_second() / 1e9, peak::instructions());
    println!("form, textures: batched ns, of peak; single ns, over batched; batched ns from all over");
    for (name, form) in [
        ("paper", Architecture::paper(0.1)),
        ("taps", Architecture::taps(0.1)),
        ("neumip", Architecture::neumip(0.1)),
    ] {
        let tiny_model = model(tiny(form.clone()));
        measure(&format!("{name}, 4x4 f32"), &tiny_model, Precision::F32, per_second());
        alone(name, &tiny_model, per_second());
        let full = model(form);
        for precision in Precision::ALL {
            measure(&format!("{name}, 256x256 {}", precision.name()), &full, precision, per_second());
        }
        let inputs = std::array::from_fn(|k| (k as f32).sin());
        let seconds = fastest(|_| {
            for _ in 0..32 {
                black_box(scalar(&tiny_model, black_box(&inputs)));
            }
        });
        println!("{name}, scalar loops, networks alone: {:.0} ns", seconds / 32.0 * 1e9);
    }
}

/// The networks without queries.
fn alone(name: &str, model: &Model, peak: f64) {
    let material = Material::new(&StoredModel::new(model, Precision::F32));
    let blocks = WINDOW / 32;
    let seconds = fastest(|_| {
        black_box(material.run_networks(black_box(blocks)));
    }) / WINDOW as f64;
    let share = 100.0 * material.products() as f64 / seconds / peak;
    println!("{name}, networks alone: {:.1} ns, {share:.0} %", seconds * 1e9);
}

fn measure(name: &str, model: &Model, precision: Precision, peak: f64) {
    let queries = grazing(COUNT, 0.1);
    let mut answers = vec![Answer::default(); WINDOW];
    let material = Material::new(&StoredModel::new(model, precision));
    let batch = fastest(|number| {
        material.eval_batch(black_box(window(&queries, number, WINDOW)), &mut answers);
    }) / WINDOW as f64;
    let few = 256;
    let single = fastest(|number| {
        for query in window(&queries, number, few) {
            black_box(material.eval(black_box(query)));
        }
    }) / few as f64;
    let all_over = spread(COUNT, model.architecture.kappa_range);
    let usual = fastest(|number| {
        material.eval_batch(black_box(window(&all_over, number, WINDOW)), &mut answers);
    }) / WINDOW as f64;
    let share = 100.0 * material.products() as f64 / batch / peak;
    let [batch, single, usual, ratio] = [batch * 1e9, single * 1e9, usual * 1e9, single / batch];
    println!("{name}: {batch:.1} ns, {share:.0} %; {single:.1} ns, {ratio:.2}; {usual:.1} ns");
}

fn bench_instructions(c: &mut Criterion) {
    let mut group = c.benchmark_group("paper, 256x256 f16");
    group.sample_size(10).measurement_time(Duration::from_secs(2));
    let queries = grazing(COUNT, 0.1);
    let mut answers = vec![Answer::default(); COUNT];
    let stored = StoredModel::new(&model(Architecture::paper(0.1)), Precision::F16);
    group.throughput(Throughput::Elements(COUNT as u64));
    for instructions in [Instructions::Avx512, Instructions::Avx2, Instructions::Portable] {
        let Some(material) = Material::with_instructions(&stored, instructions) else { continue };
        group.bench_function(BenchmarkId::new("batched", format!("{instructions:?}")), |b| {
            b.iter(|| material.eval_batch(black_box(&queries), &mut answers));
        });
    }
    group.finish();
}

criterion_group!(benches, shares, bench_instructions);
criterion_main!(benches);

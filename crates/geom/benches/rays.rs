//! Rays per second against closed meshes: primary rays, and the cosine-weighted second segment of their paths.
#![allow(missing_docs, reason = "criterion_group makes an undocumented function")]

use criterion::{Criterion, Throughput, criterion_group, criterion_main};
use glam::Vec3;
use osculate_geom::rays::{Bvh, Ray};
use std::hint::black_box;

/// Image side. 1024 gives the protocol's one ray per pixel of 1024 x 1024.
const SIDE: u16 = 1024;

/// A bumpy torus of `2 n^2` triangles.
fn bumpy_torus(n: u16) -> Vec<[Vec3; 3]> {
    let point = |i: u16, j: u16| {
        let (u, v) = (f32::from(i % n), f32::from(j % n));
        let (u, v) = (u / f32::from(n) * std::f32::consts::TAU, v / f32::from(n) * std::f32::consts::TAU);
        let r = 0.45 + 0.04 * (9.0 * u).sin() * (7.0 * v).cos();
        Vec3::new((1.0 + r * v.cos()) * u.cos(), r * v.sin(), (1.0 + r * v.cos()) * u.sin())
    };
    let mut triangles = Vec::new();
    for i in 0..n {
        for j in 0..n {
            let (a, b, c, d) = (point(i, j), point(i + 1, j), point(i + 1, j + 1), point(i, j + 1));
            triangles.extend([[a, b, c], [a, c, d]]);
        }
    }
    triangles
}

/// One ray through each pixel centre of a pinhole camera that looks at the mesh from `center + 1.6 diagonal`.
fn primary_rays(bvh: &Bvh) -> Vec<Ray> {
    let corners = || bvh.triangles().iter().flatten().copied();
    let (lower, upper) =
        (corners().fold(Vec3::INFINITY, Vec3::min), corners().fold(Vec3::NEG_INFINITY, Vec3::max));
    let backward = Vec3::new(0.0, 0.35, 1.0).normalize();
    let origin = 0.5 * (lower + upper) + 1.6 * (upper - lower).length() * backward;
    let right = Vec3::Y.cross(backward).normalize();
    let up = backward.cross(right);
    let half = 20.0_f32.to_radians().tan();
    let at = |i: u16| (2.0 * (f32::from(i) + 0.5) / f32::from(SIDE) - 1.0) * half;
    let direction = |x, y| (at(x) * right - at(y) * up - backward).normalize();
    (0..SIDE)
        .flat_map(|y| (0..SIDE).map(move |x| (x, y)))
        .map(|(x, y)| Ray::new(origin, direction(x, y)))
        .collect()
}

fn cosine_rays(bvh: &Bvh, primary: &[Ray]) -> Vec<Ray> {
    let mut state = 1_u64;
    let mut unit = move || {
        state = state.wrapping_mul(6_364_136_223_846_793_005).wrapping_add(1_442_695_040_888_963_407);
        (state >> 40) as f32 / 16_777_216.0
    };
    let mut rays = Vec::new();
    for ray in primary {
        let Some(hit) = bvh.closest_hit(ray) else { continue };
        let point = bvh.surface_point(&hit);
        let normal = if point.normal.dot(ray.direction) > 0.0 { -point.normal } else { point.normal };
        // A point on the unit sphere around the normal's tip is cosine-distributed.
        let (z, phi) = (2.0 * unit() - 1.0, std::f32::consts::TAU * unit());
        let r = (1.0 - z * z).max(0.0).sqrt();
        let direction = (normal + Vec3::new(r * phi.cos(), r * phi.sin(), z)).normalize_or(normal);
        rays.push(Ray::new(point.origin_towards(direction), direction));
    }
    rays
}

fn trace(c: &mut Criterion) {
    let mut group = c.benchmark_group("rays");
    group.sample_size(10);
    for n in [40_u16, 318, 1000] {
        let bvh = Bvh::new(bumpy_torus(n));
        let primary = primary_rays(&bvh);
        let random = cosine_rays(&bvh, &primary);
        for (name, rays) in [("primary", &primary), ("random", &random)] {
            group.throughput(Throughput::Elements(rays.len() as u64));
            group.bench_function(format!("{name}/{}", 2 * usize::from(n) * usize::from(n)), |b| {
                b.iter(|| rays.iter().filter(|ray| bvh.closest_hit(black_box(ray)).is_some()).count());
            });
        }
        group.throughput(Throughput::Elements(primary.len() as u64));
        group.bench_function(format!("primary together/{}", 2 * usize::from(n) * usize::from(n)), |b| {
            let mut hits = vec![None; primary.len()];
            b.iter(|| {
                bvh.closest_hits(black_box(&primary), &mut hits);
                hits.iter().flatten().count()
            });
        });
        group.throughput(Throughput::Elements(random.len() as u64));
        group.bench_function(format!("shadow/{}", 2 * usize::from(n) * usize::from(n)), |b| {
            b.iter(|| random.iter().filter(|ray| bvh.any_hit(black_box(ray))).count());
        });
    }
    group.finish();
    let soup = bumpy_torus(318);
    c.bench_function("build/202248", |b| b.iter(|| Bvh::new(black_box(soup.clone()))));
}

criterion_group! { name = benches; config = Criterion::default().sample_size(10); targets = trace }
criterion_main!(benches);

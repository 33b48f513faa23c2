//! Nanoseconds per query of every curvature filter beside a ray cast, over the distance that it looks and the degenerate rays.
#![allow(missing_docs, reason = "criterion_group makes an undocumented function")]

use std::hint::black_box;
use std::sync::Arc;

use criterion::{BenchmarkId, Criterion, Throughput, criterion_group, criterion_main};
use osculate_geom::Mesh;
use osculate_geom::curvature::{CurvatureOptions, estimate};
use osculate_geom::field::{
    BakedChord, BakedMinimum, CurvatureField, Filter, FilterQuery, SkipBounds, WalkLength, spread_queries,
};
use osculate_geom::mesh::{Surface, Weld};
use osculate_geom::rays::{Bvh, Ray, to_f32};
use osculate_geom::shapes;

fn field(mesh: &Mesh) -> CurvatureField<'_> {
    let surface = Surface::new(mesh, Weld::Exact);
    let curvature = estimate(&surface, &CurvatureOptions::default()).expect("default options are valid");
    CurvatureField::new(surface, curvature).with_uv_set(mesh, 0)
}

fn filters(c: &mut Criterion) {
    let mesh = shapes::torus_with_uv(1.0, 0.45, 128, 64);
    let field = field(&mesh);
    let bvh = Bvh::from_mesh(&mesh);
    let mut group = c.benchmark_group("filter");
    for share in [0.001, 0.01, 0.05] {
        let length = WalkLength::Shell { depth: share * field.diagonal() }.for_table();
        let queries = spread_queries(&field, 2000, length);
        let bounds = Arc::new(SkipBounds::new(&field, length.nominal(field.diagonal())));
        let tolerance = 3.0 / field.diagonal();
        group.throughput(Throughput::Elements(queries.len() as u64));
        for (name, filter) in [
            ("point", Filter::Point),
            ("march", Filter::March),
            ("march_within", Filter::MarchWithin { bounds, tolerance }),
            ("baked", Filter::Baked(Arc::new(BakedMinimum::new(&field, 16, length)))),
            ("chord", Filter::Chord),
            ("baked_chord", Filter::BakedChord(Arc::new(BakedChord::new(&field, 16, length)))),
        ] {
            group.bench_with_input(BenchmarkId::new(name, share), &queries, |b, queries| {
                b.iter(|| queries.iter().filter_map(|q| filter.ask(&field, black_box(q))).count());
            });
        }
    }
    let queries = spread_queries(&field, 2000, WalkLength::Fixed(0.1));
    let degenerate: Vec<_> = queries.iter().map(|q| grazing_from_a_corner(&field, q)).collect();
    for (name, filter) in [("march_degenerate", Filter::March), ("chord_degenerate", Filter::Chord)] {
        group.bench_function(name, |b| {
            b.iter(|| degenerate.iter().filter_map(|q| filter.ask(&field, black_box(q))).count());
        });
    }
    let ray = |q: &FilterQuery| {
        Ray::new(to_f32(&(field.position(q.point) + q.w * (2.0 * field.diagonal()))), -to_f32(&q.w))
    };
    let rays: Vec<Ray> = queries.iter().map(ray).collect();
    group.bench_function("ray_cast", |b| {
        b.iter(|| rays.iter().filter(|ray| bvh.closest_hit(black_box(ray)).is_some()).count());
    });
    group.finish();
    c.bench_function("filter_bake/16", |b| {
        b.iter(|| BakedMinimum::new(&field, 16, WalkLength::Fixed(0.1)));
    });
    c.bench_function("filter_bounds", |b| b.iter(|| SkipBounds::new(&field, 0.1)));
}

/// A ray from a corner that grazes the surface along an edge.
fn grazing_from_a_corner(field: &CurvatureField<'_>, query: &FilterQuery) -> FilterQuery {
    let mut query = *query;
    query.point.barycentric = [1.0, 0.0, 0.0];
    let [a, b, _] = field.surface().corners(query.point.triangle);
    let n = field.unit_normal(query.point).unwrap_or_default();
    let edge = (b - a) - n * n.dot(&(b - a));
    query.w = n * 1e-8 - edge.normalize();
    query
}

criterion_group! { name = benches; config = Criterion::default().sample_size(20); targets = filters }
criterion_main!(benches);

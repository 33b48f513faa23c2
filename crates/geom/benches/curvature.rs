//! Time per vertex of the estimators, over neighbourhood and mesh size.
//!
//! The meshes are jittered tori of valence 6; the last one has its vertices in random order, which shows what memory
//! locality is worth. One thread; for ratios to libigl see `tools/reference/time_libigl.py`.

use criterion::{BenchmarkId, Criterion, SamplingMode, Throughput, criterion_group, criterion_main};
use osculate_geom::curvature::{CurvatureOptions, Method, Neighbourhood, estimate};
use osculate_geom::mesh::{Surface, Weld};
use osculate_geom::{Mesh, shapes};

fn shuffled(mesh: &Mesh) -> Mesh {
    // A stride coprime to the count visits every vertex once, far from the one before.
    let n = mesh.positions().len();
    let stride = (n * 618 / 1000) | 1;
    let gcd = |mut a: usize, mut b: usize| {
        while b != 0 {
            (a, b) = (b, a % b);
        }
        a
    };
    let stride = (stride..).find(|&s| gcd(s, n) == 1).expect("n + 1 is coprime to n");
    let place = |v: usize| v * stride % n;
    let mut positions = vec![osculate_geom::Vec3::zeros(); n];
    for (v, p) in mesh.positions().iter().enumerate() {
        positions[place(v)] = *p;
    }
    let renumber = |v: u32| u32::try_from(place(v as usize)).expect("32-bit");
    let triangles = mesh.triangles().iter().map(|t| t.map(renumber)).collect();
    Mesh::new(positions, triangles).expect("a renumbered mesh is a mesh")
}

fn estimators(criterion: &mut Criterion) {
    let torus = |nu, nv| shapes::torus(1.0, 0.4, nu, nv);
    let meshes = [
        ("30k", torus(274, 110)),
        ("500k", torus(1118, 448)),
        ("500k shuffled", shuffled(&torus(1118, 448))),
    ];
    let pool = rayon::ThreadPoolBuilder::new().num_threads(1).build().expect("one thread");
    for (name, mesh) in &meshes {
        let surface = Surface::new(mesh, Weld::Off);
        let mut group = criterion.benchmark_group(format!("curvature {name}"));
        group.sample_size(10).sampling_mode(SamplingMode::Flat);
        group.throughput(Throughput::Elements(mesh.positions().len() as u64));
        for method in [Method::Libigl, Method::Quadric] {
            for rings in [2, 5] {
                let neighbourhood = Some(Neighbourhood::Rings(rings));
                let options = CurvatureOptions { method, neighbourhood, ..Default::default() };
                group.bench_function(BenchmarkId::new(format!("{method:?}"), rings), |bencher| {
                    pool.install(|| bencher.iter(|| estimate(&surface, &options)));
                });
            }
        }
    }
}

criterion_group!(benches, estimators);
criterion_main!(benches);

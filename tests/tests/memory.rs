//! Peak memory of an estimate, beyond the mesh. The only test of its binary, so that nothing else allocates beside it.

use std::alloc::System;

use osculate_geom::Mesh;
use osculate_geom::curvature::{CurvatureOptions, Method, Neighbourhood, estimate};
use osculate_geom::mesh::{Surface, Weld};
use osculate_geom::shapes;
use peakmem_alloc::{INSTRUMENTED_SYSTEM, PeakMemAlloc, PeakMemAllocTrait};

#[global_allocator]
static ALLOCATOR: &PeakMemAlloc<System> = &INSTRUMENTED_SYSTEM;

/// Bytes a vertex on so many threads.
fn bytes_per_vertex(mesh: &Mesh, options: &CurvatureOptions, threads: usize) -> f64 {
    let pool = rayon::ThreadPoolBuilder::new().num_threads(threads).build().expect("a pool");
    ALLOCATOR.reset_peak_memory();
    let surface = Surface::new(mesh, Weld::Exact);
    let estimates = pool.install(|| estimate(&surface, options)).expect("valid options");
    assert_eq!(estimates.len(), mesh.positions().len());
    ALLOCATOR.get_peak_memory() as f64 / mesh.positions().len() as f64
}

#[test]
fn estimate_takes_at_most_200_bytes_a_vertex() {
    let mesh = shapes::torus(1.0, 0.4, 500, 200);
    for threads in [1, 2] {
        for method in Method::ALL {
            let options = CurvatureOptions { method, ..CurvatureOptions::default() };
            let bytes = bytes_per_vertex(&mesh, &options, threads);
            // The result alone takes 88.
            assert!(
                (88.0..200.0).contains(&bytes),
                "{method:?}, {threads} threads: {bytes:.0} bytes a vertex"
            );
            println!("{method:?}, {threads} threads: {bytes:.0} bytes a vertex");
        }
    }
    memory_grows_in_proportion();
    a_scattered_mesh_takes_little_more();
}

/// Its copy in another order is given back, as far as it can be, before there is a result.
#[expect(clippy::print_stdout, reason = "these are the figures that the documents quote")]
fn a_scattered_mesh_takes_little_more() {
    /// Prime, and so coprime to the number of vertices.
    const STEP: u64 = 16_411;
    let mesh = shapes::torus(1.0, 0.4, 500, 200);
    let count = mesh.positions().len() as u64;
    let place = |vertex: u64| vertex * STEP % count;
    let mut positions = mesh.positions().to_vec();
    for (vertex, position) in (0..).zip(mesh.positions()) {
        positions[usize::try_from(place(vertex)).expect("a small number")] = *position;
    }
    let moved = |v: u32| u32::try_from(place(v.into())).expect("a small number");
    let triangles = mesh.triangles().iter().map(|t| t.map(moved)).collect();
    let scattered = Mesh::new(positions, triangles).expect("the same mesh");
    for method in Method::ALL {
        let options = CurvatureOptions { method, ..CurvatureOptions::default() };
        let bytes = bytes_per_vertex(&scattered, &options, 2);
        assert!(bytes < 200.0, "{method:?}: {bytes:.0} bytes a vertex");
        println!("{method:?}, vertices in a scattered order: {bytes:.0} bytes a vertex");
    }
}

/// From 100 to 500 thousand vertices (two million give the same figures, and take four times as long; `osculate study curvature
/// --part growth` goes that far). Neighbourhoods are small, for speed: how far a walk goes is nothing beside these meshes.
#[expect(clippy::print_stdout, reason = "these are the figures that the documents quote")]
fn memory_grows_in_proportion() {
    let large = shapes::torus(1.0, 0.4, 1118, 448);
    let small = shapes::torus(1.0, 0.4, 500, 200);
    for method in Method::ALL {
        let rings = if method == Method::Normals { 1 } else { 2 };
        let options = CurvatureOptions {
            method,
            neighbourhood: Some(Neighbourhood::Rings(rings)),
            degree: 2,
            tolerance: 10.0,
            ..CurvatureOptions::default()
        };
        let [few, many] = [&small, &large].map(|mesh| bytes_per_vertex(mesh, &options, 2));
        println!("{method:?}: {few:.1} bytes a vertex of 100 thousand, {many:.1} of 500 thousand");
        // Scratch of a fixed size counts less in a larger mesh; nothing else may change.
        assert!(many < 1.01 * few && many < 200.0, "{method:?}: {few} and {many} bytes a vertex");
    }
}

//! Peak memory of an estimate, beyond the mesh. The only test of its binary, so that nothing else allocates beside it.

use osculate_geom::curvature::{CurvatureOptions, Method, estimate};
use osculate_geom::mesh::{Surface, Weld};
use osculate_geom::shapes;

#[global_allocator]
static ALLOCATOR: peak_alloc::PeakAlloc = peak_alloc::PeakAlloc;

#[test]
fn estimate_takes_at_most_200_bytes_a_vertex() {
    let mesh = shapes::torus(1.0, 0.4, 500, 200);
    let vertices = mesh.positions().len() as f64;
    for threads in [1, 2] {
        let pool = rayon::ThreadPoolBuilder::new().num_threads(threads).build().expect("a pool");
        for method in Method::ALL {
            ALLOCATOR.reset_peak_usage();
            let before = ALLOCATOR.current_usage();
            let options = CurvatureOptions { method, ..CurvatureOptions::default() };
            let surface = Surface::new(&mesh, Weld::Exact);
            let estimates = pool.install(|| estimate(&surface, &options)).expect("valid options");
            let bytes = (ALLOCATOR.peak_usage() - before) as f64 / vertices;
            assert_eq!(estimates.len(), mesh.positions().len());
            // The result alone takes 88.
            assert!(
                (88.0..200.0).contains(&bytes),
                "{method:?}, {threads} threads: {bytes:.0} bytes a vertex"
            );
            println!("{method:?}, {threads} threads: {bytes:.0} bytes a vertex");
        }
    }
}

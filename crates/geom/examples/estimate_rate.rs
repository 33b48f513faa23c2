//! How long estimates of one mesh take in a process that is warm: see `tools/reference/bench_curvature.py`.
//!
//! ```text
//! cargo run --release -p osculate-geom --example estimate_rate -- MESH METHOD RINGS THREADS RUNS
//! ```
//!
//! A run is all from the mesh to one estimate per vertex: equal positions are merged, adjacency and normals are built, creases are
//! looked for; giving the estimates' memory back is not part of it. The first run is not counted. Printed are the number of vertices and the
//! seconds of every other run.

use std::hint::black_box;
use std::path::Path;
use std::time::Instant;

use osculate_geom::curvature::{CurvatureOptions, Method, Neighbourhood, estimate};
use osculate_geom::io::read_mesh;
use osculate_geom::mesh::{Surface, Weld};

const USAGE: &str = "usage: estimate_rate MESH METHOD RINGS THREADS RUNS";

#[allow(clippy::print_stdout, reason = "an example reports on standard output")]
fn main() -> Result<(), Box<dyn std::error::Error>> {
    let arguments: Vec<String> = std::env::args().skip(1).collect();
    let [path, method, rings, threads, runs] = arguments.as_slice() else { return Err(USAGE.into()) };
    let named = |m: &Method| format!("{m:?}").eq_ignore_ascii_case(method);
    let options = CurvatureOptions {
        method: Method::ALL.into_iter().find(named).ok_or(USAGE)?,
        neighbourhood: Some(Neighbourhood::Rings(rings.parse()?)),
        ..CurvatureOptions::default()
    };
    options.validate()?;
    let runs: usize = runs.parse()?;
    let mesh = read_mesh(Path::new(path))?.mesh;
    let pool = rayon::ThreadPoolBuilder::new().num_threads(threads.parse()?).build()?;
    let run = || {
        let start = Instant::now();
        let surface = Surface::new(&mesh, Weld::Exact);
        let estimates = black_box(estimate(&surface, &options));
        let seconds = start.elapsed().as_secs_f64();
        drop(estimates);
        seconds
    };
    let seconds: Vec<f64> = pool.install(|| (0..=runs).map(|_| run()).skip(1).collect());
    let seconds: Vec<String> = seconds.iter().map(f64::to_string).collect();
    println!("{} {}", mesh.positions().len(), seconds.join(" "));
    Ok(())
}

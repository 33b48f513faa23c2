//! One estimate on a torus of random points, for tools that count instructions and cache misses: see
//! `tools/reference/count_instructions.sh`.
//!
//! ```text
//! cargo run --release -p osculate-geom --example estimate_torus -- VERTICES METHOD [RINGS [DEGREE]]
//! ```
//!
//! METHOD is one of the estimators, or `none`, which makes the mesh and stops. RINGS and DEGREE are the estimator's own by default. One
//! thread. Printed is the mean number of vertices within RINGS.

use std::collections::HashSet;

use osculate_geom::curvature::{CurvatureOptions, Method, Neighbourhood, estimate};
use osculate_geom::mesh::{Surface, Weld};
use osculate_geom::shapes::study::StudyShape;

const USAGE: &str = "usage: estimate_torus VERTICES METHOD [RINGS [DEGREE]]";
/// Vertices over which the size of a neighbourhood is averaged.
const COUNTED: u32 = 500;

#[allow(clippy::print_stdout, reason = "an example reports on standard output")]
fn main() -> Result<(), Box<dyn std::error::Error>> {
    let arguments: Vec<String> = std::env::args().skip(1).collect();
    let [vertices, method, knobs @ ..] = arguments.as_slice() else { return Err(USAGE.into()) };
    let mesh = StudyShape::Torus.mesh(vertices.parse()?, 1);
    let surface = Surface::new(&mesh, Weld::Off);
    let mut knobs = knobs.iter();
    let rings: Option<u32> = knobs.next().map(|text| text.parse()).transpose()?;
    if method == "none" {
        println!("{:.1}", mean_size(surface.triangles(), surface.positions().len(), rings.unwrap_or(1)));
        return Ok(());
    }
    let mut options = CurvatureOptions {
        method: Method::ALL
            .into_iter()
            .find(|m| format!("{m:?}").eq_ignore_ascii_case(method))
            .ok_or(USAGE)?,
        neighbourhood: rings.map(Neighbourhood::Rings),
        ..CurvatureOptions::default()
    };
    if let Some(degree) = knobs.next() {
        options.degree = degree.parse()?;
    }
    let pool = rayon::ThreadPoolBuilder::new().num_threads(1).build()?;
    let estimates = pool.install(|| estimate(&surface, &options))?;
    println!("{}", estimates.iter().filter(|e| e.principal.is_some()).count());
    Ok(())
}

/// Mean number of vertices at most so many edges from a vertex, itself included.
fn mean_size(triangles: &[[u32; 3]], vertices: usize, rings: u32) -> f64 {
    let mut neighbours = vec![HashSet::new(); vertices];
    for &[a, b, c] in triangles {
        for (v, w) in [(a, b), (b, c), (c, a)] {
            neighbours[v as usize].insert(w);
            neighbours[w as usize].insert(v);
        }
    }
    let size = |start: u32| {
        let mut found = HashSet::from([start]);
        for _ in 0..rings {
            let next: Vec<u32> = found.iter().flat_map(|&v| &neighbours[v as usize]).copied().collect();
            found.extend(next);
        }
        found.len()
    };
    let counted = COUNTED.min(u32::try_from(vertices).unwrap_or(u32::MAX)).max(1);
    let stride = u32::try_from(vertices).unwrap_or(u32::MAX) / counted;
    (0..counted).map(|i| size(i * stride)).sum::<usize>() as f64 / f64::from(counted)
}

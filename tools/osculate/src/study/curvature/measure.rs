//! Error, time, memory and honesty of one setting on one mesh.

use std::time::Instant;

use anyhow::{Context, Result};
use osculate_geom::curvature::{Principal, VertexCurvature, Workspace, estimate};
use osculate_geom::mesh::{Surface, Weld};
use osculate_geom::reference::Quantiles;
use peakmem_alloc::PeakMemAllocTrait as _;
use rayon::ThreadPool;

use super::rows::Row;
use super::settings::Setting;
use super::subjects::Subject;
use crate::ALLOCATOR;

/// Two exact curvatures closer than this over the radius have no direction worth the name.
const DISTINCT: f64 = 0.05;

/// How often and on how many threads a setting is timed.
#[derive(Debug)]
pub struct Effort {
    one: ThreadPool,
    all: ThreadPool,
    runs: usize,
}

impl Effort {
    /// `runs` on one thread and as many on `threads`; the median counts.
    pub fn new(threads: usize, runs: usize) -> Result<Self> {
        let pool =
            |n| rayon::ThreadPoolBuilder::new().num_threads(n).build().context("threads cannot be started");
        Ok(Self { one: pool(1)?, all: pool(threads)?, runs: runs.max(1) })
    }
}

/// Vertices from which on an allocator gets memory from the system for every estimate; below, it has some.
const LARGE: usize = 100_000;

/// Runs a setting on a mesh. Time is that of the estimate alone, adjacency and normals included, with its memory at hand (see
/// [`Workspace`]); memory is the most that a single estimate has allocated at a time beyond the mesh, on all threads.
pub fn measure(subject: &Subject, setting: &Setting, effort: &Effort) -> Result<Row> {
    let surface = Surface::new(&subject.mesh, Weld::Off);
    let vertices = surface.positions().len();
    ALLOCATOR.reset_peak_memory();
    let estimates = effort.all.install(|| estimate(&surface, &setting.options))?;
    let bytes = ALLOCATOR.get_peak_memory();
    let mut workspace = Workspace::default();
    let mut run = || workspace.estimate(&surface, &setting.options).map(|_| ());
    if vertices >= LARGE {
        effort.all.install(&mut run)?;
    }
    let mut timed = |pool: &ThreadPool| -> Result<f64> {
        let one = |_| {
            let start = Instant::now();
            pool.install(&mut run).map(|()| start.elapsed().as_secs_f64())
        };
        let mut seconds = (0..effort.runs).map(one).collect::<Result<Vec<f64>, _>>()?;
        seconds.sort_unstable_by(f64::total_cmp);
        Ok(1e6 * seconds[seconds.len() / 2] / vertices as f64)
    };
    let row = Row {
        mesh: subject.name.clone(),
        shape: subject.shape.clone(),
        purpose: subject.purpose.name().to_owned(),
        vertices,
        noise: subject.noise,
        program: "osculate".to_owned(),
        method: setting.method.clone(),
        setting: setting.knobs.clone(),
        us_per_vertex: Some(timed(&effort.one)?),
        us_per_vertex_all_threads: Some(timed(&effort.all)?),
        bytes_per_vertex: Some(bytes as f64 / vertices as f64),
        ..Row::default()
    };
    Ok(with_errors(row, &estimates, subject))
}

fn with_errors(row: Row, estimates: &[VertexCurvature], subject: &Subject) -> Row {
    let pairs = || estimates.iter().zip(&subject.exact).filter_map(|(e, exact)| Some((e, (*exact)?)));
    let error = |e: &VertexCurvature, exact: &Principal| {
        e.principal.map_or(f64::INFINITY, |p| {
            (p.kappa_max - exact.kappa_max).abs().max((p.kappa_min - exact.kappa_min).abs())
        })
    };
    let errors = Quantiles::new(pairs().map(|(e, exact)| error(e, &exact) * subject.radius).collect());
    let distinct =
        pairs().filter(|(_, exact)| (exact.kappa_max - exact.kappa_min) * subject.radius > DISTINCT);
    let angles = Quantiles::new(distinct.map(|(e, exact)| angle(e, &exact).to_degrees()).collect());
    let determined: Vec<(f64, f64)> = pairs()
        .filter(|(e, _)| e.principal.is_some() && e.error.is_finite())
        .map(|(e, exact)| (e.error, error(e, &exact)))
        .collect();
    let covered = determined.iter().filter(|(stated, true_error)| true_error <= stated).count();
    let ratios = determined.iter().filter(|(_, t)| *t > 0.0).map(|(stated, t)| stated / t).collect();
    Row {
        median: Some(errors.median),
        p95: Some(errors.p95),
        direction_median_deg: (angles.count > 0).then_some(angles.median),
        direction_p95_deg: (angles.count > 0).then_some(angles.p95),
        undetermined: estimates.iter().filter(|e| e.principal.is_none()).count(),
        covered: (!determined.is_empty()).then(|| covered as f64 / determined.len() as f64),
        stated_over_true: (!determined.is_empty()).then(|| Quantiles::new(ratios).median),
        ..row
    }
}

/// Between the exact direction and the estimated line, in `[0, pi/2]`; a vertex without an estimate has the largest.
fn angle(e: &VertexCurvature, exact: &Principal) -> f64 {
    e.principal.map_or(std::f64::consts::FRAC_PI_2, |p| {
        p.d1.cross(&exact.d1).norm().atan2(p.d1.dot(&exact.d1).abs())
    })
}

#[cfg(test)]
mod tests {
    use osculate_geom::Vec3;
    use osculate_geom::curvature::Status;
    use osculate_geom::shapes;

    use super::super::subjects::Use;
    use super::*;

    #[test]
    fn errors_are_of_the_worse_curvature_and_missing_answers_count() {
        let exact = Principal { kappa_max: 2.0, kappa_min: 1.0, d1: Vec3::x(), d2: Vec3::y() };
        let found = Principal {
            kappa_max: 2.1,
            kappa_min: 0.7,
            d1: Vec3::new(-1.0, 1.0, 0.0).normalize(),
            d2: Vec3::y(),
        };
        let good = VertexCurvature { principal: Some(found), error: 0.4, status: Status::Ok };
        let bold = VertexCurvature { error: 0.1, ..good };
        let subject = Subject {
            name: String::new(),
            shape: String::new(),
            noise: 0.0,
            radius: 0.5,
            purpose: Use::Accuracy,
            mesh: shapes::plane(1, 1),
            exact: vec![Some(exact), Some(exact), None, Some(exact)],
        };
        let estimates = [good, bold, bold, VertexCurvature::undetermined(Status::Isolated)];
        let row = with_errors(Row::default(), &estimates, &subject);
        let near = |x: Option<f64>, y: f64| (x.unwrap() - y).abs() < 1e-12;
        assert!(near(row.median, 0.15), "{row:?}");
        assert_eq!(row.p95, Some(f64::INFINITY));
        assert!(near(row.direction_median_deg, 45.0) && near(row.direction_p95_deg, 90.0), "{row:?}");
        assert_eq!(row.undetermined, 1);
        assert!(near(row.covered, 0.5), "0.4 covers 0.3, 0.1 does not: {row:?}");
    }
}

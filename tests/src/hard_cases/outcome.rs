//! What an estimator made of a mesh, and what must hold of that whatever the mesh is.

use std::sync::OnceLock;

use osculate_geom::curvature::{
    CurvatureOptions, Method, Neighbourhood, Principal, Status, VertexCurvature, estimate,
};
use osculate_geom::mesh::{Adjacency, Surface, Weld, triangle_normal};
use osculate_geom::{Mesh, Vec3};
use rayon::ThreadPool;

use super::ensure;

/// The estimates of one estimator for one mesh, with its default neighbourhood; for libigl's method that is two rings here.
#[derive(Debug)]
pub struct Outcome<'m> {
    /// The estimator.
    pub method: Method,
    /// The mesh.
    pub mesh: &'m Mesh,
    /// One entry per vertex of the mesh, equal positions merged.
    pub estimates: Vec<VertexCurvature>,
}

impl<'m> Outcome<'m> {
    /// Runs an estimator on one thread.
    #[must_use]
    pub fn new(mesh: &'m Mesh, method: Method) -> Self {
        Self { method, mesh, estimates: pools()[0].install(|| run(mesh, method)) }
    }

    /// The same estimator on another mesh.
    #[must_use]
    pub fn again(&self, mesh: &Mesh) -> Vec<VertexCurvature> {
        Outcome::new(mesh, self.method).estimates
    }

    /// The estimate at a vertex, or a message that there is none.
    pub(super) fn principal(&self, vertex: usize) -> Result<Principal, String> {
        let estimate = &self.estimates[vertex];
        estimate.principal.ok_or_else(|| format!("vertex {vertex} has no estimate: {estimate:?}"))
    }

    /// Checks the status of every vertex; an error over the tolerance is no defect of the mesh.
    pub(super) fn statuses(&self, expected: impl Fn(usize) -> Status) -> Result<(), String> {
        for (vertex, estimate) in self.estimates.iter().enumerate() {
            let expected = expected(vertex);
            let unmet = estimate.status == Status::OverTolerance && expected == Status::Ok;
            ensure(unmet || estimate.status == expected, || {
                format!("vertex {vertex} should be {expected:?}: {estimate:?}")
            })?;
        }
        Ok(())
    }
}

fn run(mesh: &Mesh, method: Method) -> Vec<VertexCurvature> {
    let surface = Surface::new(mesh, Weld::Exact);
    // libigl's own five rings, and the eight for noise of algebraic spheres, are half of a coarse sphere: that would be a test
    // of bias.
    let neighbourhood = match method {
        Method::Libigl => Some(Neighbourhood::Rings(2)),
        Method::Algebraic => Some(Neighbourhood::Rings(3)),
        _ => None,
    };
    let options = CurvatureOptions { method, neighbourhood, ..CurvatureOptions::default() };
    surface.spread(estimate(&surface, &options).expect("default options are valid"))
}

/// One thread, and three.
fn pools() -> &'static [ThreadPool; 2] {
    static POOLS: OnceLock<[ThreadPool; 2]> = OnceLock::new();
    POOLS.get_or_init(|| {
        [1, 3].map(|threads| {
            rayon::ThreadPoolBuilder::new().num_threads(threads).build().expect("threads can be started")
        })
    })
}

/// What holds for every estimator on every mesh that [`Mesh::new`] accepts.
///
/// One row a vertex; an estimate is finite, ordered, has unit and orthogonal directions that turn counter-clockwise around the
/// normal of at least one triangle there, and an error that is not negative; a vertex without an estimate has an infinite
/// error and a status that says why; three threads give the same bits as one.
///
/// # Errors
///
/// The first that does not hold, with the vertex.
pub fn invariants(outcome: &Outcome<'_>) -> Result<(), String> {
    let Outcome { method, mesh, estimates } = outcome;
    ensure(estimates.len() == mesh.positions().len(), || format!("{} rows", estimates.len()))?;
    let normals = triangle_normals(mesh);
    for (vertex, estimate) in estimates.iter().enumerate() {
        sound(estimate, &normals[vertex]).map_err(|why| format!("vertex {vertex}: {why}: {estimate:?}"))?;
    }
    let parallel = pools()[1].install(|| run(mesh, *method));
    let first_other = std::iter::zip(estimates, &parallel).position(|(one, three)| one != three);
    ensure(first_other.is_none(), || format!("vertex {first_other:?} differs on three threads"))
}

fn sound(estimate: &VertexCurvature, normals: &[Vec3]) -> Result<(), &'static str> {
    let VertexCurvature { principal, error, status } = *estimate;
    let Some(Principal { kappa_max, kappa_min, d1, d2 }) = principal else {
        let reasons = [Status::FewNeighbours, Status::RankDeficient, Status::NonManifold, Status::Isolated];
        return if error != f64::INFINITY {
            Err("no estimate, but a finite error")
        } else if reasons.contains(&status) {
            Ok(())
        } else {
            Err("no estimate and no reason")
        };
    };
    // Unit and orthogonal to a few roundings.
    let close = |x: f64, y: f64| (x - y).abs() < 1e-14;
    if !(kappa_max.is_finite() && kappa_min.is_finite()) {
        Err("not finite")
    } else if kappa_min > kappa_max {
        Err("the smaller curvature is the larger one")
    } else if !(close(d1.norm(), 1.0) && close(d2.norm(), 1.0) && close(d1.dot(&d2), 0.0)) {
        Err("directions are not unit and orthogonal")
    } else if error.is_nan() || error < 0.0 {
        Err("the error is negative or not a number")
    } else if !normals.is_empty() && normals.iter().all(|n| d1.cross(&d2).dot(n) <= 0.0) {
        Err("the directions turn clockwise around every outward normal")
    } else {
        Ok(())
    }
}

/// The unit normals of the triangles at every vertex, equal positions merged. Each is taken at all three corners: of a needle
/// whose short side is lost in the rounding of the long ones, only the corners of the short side know where it faces.
fn triangle_normals(mesh: &Mesh) -> Vec<Vec<Vec3>> {
    let surface = Surface::new(mesh, Weld::Exact);
    let incident = Adjacency::triangles_of_vertices(surface.triangles(), surface.positions().len());
    let at = |vertex: usize| {
        let corners = incident.row(vertex).iter().map(|&t| surface.corners(t as usize));
        corners.flat_map(|[a, b, c]| [[a, b, c], [b, c, a], [c, a, b]]).filter_map(triangle_normal).collect()
    };
    surface.spread((0..surface.positions().len()).map(at).collect())
}

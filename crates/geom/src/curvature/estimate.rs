//! The loop over vertices that all estimators share.

use std::sync::Mutex;

use rayon::prelude::*;

use super::libigl_normals::libigl_vertex_normals;
use super::moments::Points;
use super::walker::Walker;
use super::{CurvatureOptions, Method, OptionsError, Status, VertexCurvature, libigl, quadric};
use crate::Vec3;
use crate::mesh::{Adjacency, Link, Surface, area_weighted_normals, triangle_normal, vertex_link};

/// Estimates principal curvature at every vertex of a surface; entry `i` belongs to surface vertex `i`.
///
/// Never fails on geometry: a vertex without an estimate has `principal: None`, an infinite error and a status that says
/// why. Runs on rayon's current pool; the result has the same bits for any number of threads.
///
/// Memory beyond the surface: 28 bytes a vertex for adjacency, 25 for normals and flags, 88 for the result, and 4 a
/// vertex and thread for the walks, on a closed mesh of valence 6.
///
/// # Errors
///
/// Options out of range, see [`CurvatureOptions::validate`].
pub fn estimate(
    surface: &Surface<'_>,
    options: &CurvatureOptions,
) -> Result<Vec<VertexCurvature>, OptionsError> {
    options.validate()?;
    let prepared = Prepared::new(surface, options);
    let mut result = vec![VertexCurvature::undetermined(Status::Isolated); surface.positions().len()];
    // A worker takes the scratch of its own index, so blocks do not pay for the walker's stamps again.
    let workers: Vec<Mutex<Scratch<'_>>> =
        (0..=rayon::current_num_threads()).map(|_| Mutex::new(Scratch::new(&prepared))).collect();
    const BLOCK: usize = 1024;
    result.par_chunks_mut(BLOCK).enumerate().for_each(|(block, rows)| {
        let worker = rayon::current_thread_index().map_or(0, |index| index + 1).min(workers.len() - 1);
        let mut scratch = workers[worker].lock().unwrap_or_else(std::sync::PoisonError::into_inner);
        for (offset, row) in rows.iter_mut().enumerate() {
            *row = prepared.estimate_vertex(block * BLOCK + offset, &mut scratch);
        }
    });
    Ok(result)
}

/// What every vertex's fit reads.
#[derive(Debug)]
pub(crate) struct Prepared<'a> {
    pub(crate) positions: &'a [Vec3],
    pub(crate) ring: Adjacency,
    pub(crate) normals: Vec<Vec3>,
    pub(crate) mean_edge: f64,
    status: Vec<Status>,
    options: CurvatureOptions,
}

/// What one worker reuses from vertex to vertex.
#[derive(Debug)]
pub(crate) struct Scratch<'a> {
    pub(crate) walker: Walker<'a>,
    /// All points of a fit, or the near ones where the fit tells them apart.
    pub(crate) inner: Points,
    /// The far ones.
    pub(crate) outer: Points,
}

impl<'a> Scratch<'a> {
    fn new(prepared: &'a Prepared<'a>) -> Self {
        let walker = Walker::new(prepared.positions, &prepared.ring);
        Self { walker, inner: Points::default(), outer: Points::default() }
    }
}

impl<'a> Prepared<'a> {
    fn new(surface: &'a Surface<'_>, options: &CurvatureOptions) -> Self {
        let (positions, triangles) = (surface.positions(), surface.triangles());
        let incident = Adjacency::triangles_of_vertices(triangles, positions.len());
        let normals = match options.method {
            Method::Libigl => libigl_vertex_normals(positions, triangles, &incident),
            Method::Quadric => usable_normals(positions, triangles, &incident),
        };
        let status = vertex_status(positions, triangles, &incident);
        let ring = Adjacency::vertices_of_vertices(triangles, &incident);
        Self {
            positions,
            ring,
            normals,
            mean_edge: mean_edge(positions, triangles),
            status,
            options: *options,
        }
    }

    fn estimate_vertex(&self, vertex: usize, scratch: &mut Scratch<'_>) -> VertexCurvature {
        let status = self.status[vertex];
        if status == Status::Isolated {
            return VertexCurvature::undetermined(status);
        }
        let neighbourhood = self.options.neighbourhood();
        let mut estimate = match self.options.method {
            Method::Libigl => libigl::estimate_vertex(self, vertex, neighbourhood, scratch),
            Method::Quadric => quadric::estimate_vertex(self, vertex, neighbourhood, scratch),
        };
        estimate.status = estimate.status.max(status);
        estimate
    }
}

/// Mean length of all triangle sides (a side that two triangles share counts twice, as libigl has it).
fn mean_edge(positions: &[Vec3], triangles: &[[u32; 3]]) -> f64 {
    let side = |a: u32, b: u32| (positions[a as usize] - positions[b as usize]).norm();
    let sum: f64 = triangles.iter().map(|&[a, b, c]| side(a, b) + side(b, c) + side(c, a)).sum();
    sum / (3 * triangles.len().max(1)) as f64
}

fn vertex_status(positions: &[Vec3], triangles: &[[u32; 3]], incident: &Adjacency) -> Vec<Status> {
    (0..positions.len())
        .into_par_iter()
        .with_min_len(1024)
        .map_init(Vec::new, |scratch, vertex| {
            let number = u32::try_from(vertex).expect("vertex numbers are 32-bit");
            match vertex_link(number, incident.row(vertex), triangles, scratch) {
                Link::Closed => Status::Ok,
                Link::Open => Status::Boundary,
                Link::NonManifold => Status::NonManifold,
                Link::Empty => Status::Isolated,
            }
        })
        .collect()
}

/// Area-weighted normals with a stand-in where the incident ones cancel (double-sided leftovers): the normal of the
/// first incident triangle that has one. Zero where there is none.
fn usable_normals(positions: &[Vec3], triangles: &[[u32; 3]], incident: &Adjacency) -> Vec<Vec3> {
    let stand_in = |vertex: usize| {
        let mut incident = incident.row(vertex).iter();
        incident.find_map(|&t| triangle_normal(triangles[t as usize].map(|v| positions[v as usize])))
    };
    let normals = area_weighted_normals(positions, triangles, incident);
    let usable = |(vertex, normal): (usize, Option<Vec3>)| normal.or_else(|| stand_in(vertex));
    normals.into_iter().enumerate().map(|n| usable(n).unwrap_or_else(Vec3::zeros)).collect()
}

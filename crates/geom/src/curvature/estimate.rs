//! The loop over vertices that all estimators share.

use std::sync::{Mutex, PoisonError};

use rayon::prelude::*;

use super::batch::{self, Batch, Site};
use super::creases::{Cut, LEAST_TURN_COSINE};
use super::libigl_normals::libigl_vertex_normals;
use super::local_fit::Cloud;
use super::moments::Points;
use super::normals;
use super::walker::Walker;
use super::{
    CurvatureOptions, Features, Method, Neighbourhood, OptionsError, Status, VertexCurvature, algebraic,
    auto, jet, libigl, quadric,
};
use crate::Vec3;
use crate::mesh::{Adjacency, Fan, Rings, Surface, Survey, index_u32};

/// Fewest vertices handled by one task.
const BLOCK: usize = 1024;

/// Estimates principal curvature at every vertex of a surface; entry `i` belongs to surface vertex `i`.
///
/// Never fails on geometry: a vertex without an estimate has `principal: None`, an infinite error and a status that says
/// why. Runs on rayon's current pool; the result has the same bits for any number of threads.
///
/// Memory beyond the surface, on a closed mesh of valence 6: 32 bytes a vertex for adjacency, 25 for normals and fans (65 for
/// [`Method::Quadric`], which keeps positions beside the normals), 88 for the result, and 4 a vertex and thread for the walks;
/// 28 more with [`Method::Normals`]. Before the result is there, the tables of triangles, neighbours and normals take 85 while they
/// are built, and looking for creases, where there are many, 133. Where there are creases, the cut surface is a copy (48).
///
/// # Errors
///
/// Options out of range, see [`CurvatureOptions::validate`].
pub fn estimate(
    surface: &Surface<'_>,
    options: &CurvatureOptions,
) -> Result<Vec<VertexCurvature>, OptionsError> {
    options.validate()?;
    // Steps that follow each other are begun by a thread of the pool: a thread outside would fall asleep and wake up with every one.
    Ok(rayon::scope(|_| estimate_in_pool(surface, options)))
}

fn estimate_in_pool(surface: &Surface<'_>, options: &CurvatureOptions) -> Vec<VertexCurvature> {
    let (positions, triangles) = (surface.positions(), surface.triangles());
    let keep = options.features == Features::Keep && options.method != Method::Libigl;
    let incident = Adjacency::triangles_of_vertices(triangles, positions.len());
    let survey = Survey::new(positions, triangles, &incident, LEAST_TURN_COSINE);
    let cut = if keep { Cut::along_creases(positions, triangles, &incident, &survey.turning) } else { None };
    match cut {
        None => estimate_all(positions, triangles, incident, survey, options),
        Some(cut) => {
            drop((incident, survey));
            let incident = Adjacency::triangles_of_vertices(&cut.triangles, cut.positions.len());
            let survey = Survey::new(&cut.positions, &cut.triangles, &incident, LEAST_TURN_COSINE);
            let estimates = estimate_all(&cut.positions, &cut.triangles, incident, survey, options);
            cut.join(estimates, positions.len())
        }
    }
}

fn estimate_all(
    positions: &[Vec3],
    triangles: &[[u32; 3]],
    incident: Adjacency,
    survey: Survey,
    options: &CurvatureOptions,
) -> Vec<VertexCurvature> {
    let prepared = Prepared::new(positions, triangles, incident, survey, options);
    let pool = Mutex::new(Vec::new());
    // Collecting in parallel also touches the result's memory for the first time in parallel.
    let vertices = (0..positions.len()).into_par_iter().with_min_len(BLOCK);
    let leased = || Lease::new(&pool, &prepared);
    vertices.map_init(leased, |lease, vertex| prepared.estimate_vertex(vertex, lease.scratch())).collect()
}

/// Scratch on loan from a pool. There are never more than threads, so that the many small jobs that a parallel loop splits
/// into do not each pay for a walker's stamps.
struct Lease<'p, 's> {
    pool: &'p Mutex<Vec<Scratch<'s>>>,
    scratch: Option<Scratch<'s>>,
}

impl<'p, 's> Lease<'p, 's> {
    fn new(pool: &'p Mutex<Vec<Scratch<'s>>>, prepared: &'s Prepared<'s>) -> Self {
        let returned = pool.lock().unwrap_or_else(PoisonError::into_inner).pop();
        Self { pool, scratch: Some(returned.unwrap_or_else(|| Scratch::new(prepared))) }
    }

    fn scratch(&mut self) -> &mut Scratch<'s> {
        self.scratch.as_mut().expect("given back only on drop")
    }
}

impl Drop for Lease<'_, '_> {
    fn drop(&mut self) {
        self.pool.lock().unwrap_or_else(PoisonError::into_inner).extend(self.scratch.take());
    }
}

/// What every vertex's fit reads.
#[derive(Debug)]
pub(crate) struct Prepared<'a> {
    pub(crate) positions: &'a [Vec3],
    pub(super) triangles: &'a [[u32; 3]],
    /// Triangles of each vertex; empty unless the method reads them.
    pub(super) incident: Adjacency,
    pub(crate) ring: Rings,
    /// Empty where there are sites.
    normals: Vec<Vec3>,
    /// Positions and normals for fits in groups; empty where vertices are fitted one by one.
    pub(super) sites: Vec<Site>,
    fans: Vec<Fan>,
    /// Rings of fits in groups.
    in_groups: Option<usize>,
    options: CurvatureOptions,
    /// Never [`Neighbourhood::MeanEdges`]: that has become a radius.
    neighbourhood: Neighbourhood,
}

/// What one worker reuses from vertex to vertex.
#[derive(Debug)]
pub(crate) struct Scratch<'a> {
    pub(crate) walker: Walker<'a>,
    pub(crate) points: Points,
    pub(super) cloud: Cloud,
    pub(super) levels: Vec<auto::Level>,
    pub(super) faces: Vec<normals::Face>,
    pub(super) batch: Batch,
    /// Squared distances and vertices, to sort.
    pub(super) order: Vec<(f64, u32)>,
}

impl<'a> Scratch<'a> {
    pub(super) fn new(prepared: &'a Prepared<'a>) -> Self {
        Self {
            walker: Walker::new(prepared.positions, &prepared.ring),
            points: Points::default(),
            cloud: Cloud::default(),
            levels: Vec::new(),
            faces: Vec::new(),
            batch: Batch::default(),
            order: Vec::new(),
        }
    }
}

impl<'a> Prepared<'a> {
    pub(super) fn new(
        positions: &'a [Vec3],
        triangles: &'a [[u32; 3]],
        incident: Adjacency,
        survey: Survey,
        options: &CurvatureOptions,
    ) -> Self {
        let Survey { ring, fans, mut normals, .. } = survey;
        if options.method == Method::Libigl {
            normals = libigl_vertex_normals(positions, triangles, &incident);
        }
        if options.method == Method::Normals {
            normals::make_exact_on_spheres(&mut normals, positions, triangles, &incident);
        }
        let in_groups =
            if options.method == Method::Quadric { batch::rings_of(options.neighbourhood()) } else { None };
        let sites = match in_groups {
            Some(_) => {
                let pairs = positions.par_iter().zip(&normals).with_min_len(BLOCK);
                let sites = pairs.map(|(p, n)| Site::new(p, n)).collect();
                normals = Vec::new();
                sites
            }
            None => Vec::new(),
        };
        let neighbourhood = match options.neighbourhood() {
            Neighbourhood::MeanEdges(edges) => Neighbourhood::Radius(edges * mean_edge(positions, triangles)),
            other => other,
        };
        // Given back early where it is not needed, which is most of what is held here.
        let incident = if options.method == Method::Normals { incident } else { Adjacency::none() };
        Self {
            positions,
            triangles,
            incident,
            ring,
            normals,
            sites,
            fans,
            in_groups,
            options: *options,
            neighbourhood,
        }
    }

    fn estimate_vertex(&self, vertex: usize, scratch: &mut Scratch<'_>) -> VertexCurvature {
        let status = match self.fans[vertex] {
            Fan::Closed => Status::Ok,
            Fan::Open => Status::Boundary,
            Fan::NonManifold => Status::NonManifold,
            Fan::Empty => return VertexCurvature::undetermined(Status::Isolated),
        };
        // libigl has its own way with normals that vanish.
        if self.options.method != Method::Libigl && self.normal(index_u32(vertex)) == Vec3::zeros() {
            return VertexCurvature::undetermined(Status::Isolated);
        }
        if let Some(rings) = self.in_groups {
            let Scratch { walker, batch, .. } = scratch;
            let eligible =
                |v: usize| self.fans[v] != Fan::Empty && self.normal(index_u32(v)) != Vec3::zeros();
            if let Some(mut estimate) = batch.estimate(self, walker, rings, vertex, eligible) {
                estimate.status = estimate.status.worse(status);
                return estimate;
            }
        }
        let vertex = index_u32(vertex);
        let mut estimate = match (self.options.method, self.neighbourhood) {
            (Method::Libigl, hood) => libigl::estimate_vertex(self, vertex, hood, scratch),
            (Method::Quadric, hood) => quadric::estimate_vertex(self, vertex, hood, scratch),
            (Method::Algebraic, hood) => algebraic::estimate_vertex(self, vertex, hood, scratch),
            (Method::Normals, _) => normals::estimate_vertex(self, vertex, scratch),
            (Method::Auto, Neighbourhood::Rings(rings)) => {
                auto::estimate_vertex(self, vertex, self.options.tolerance, rings, scratch)
            }
            (Method::Jet | Method::Auto, hood) => {
                jet::estimate_vertex(self, vertex, usize::from(self.options.degree), hood, scratch)
            }
        };
        estimate.status = estimate.status.worse(status);
        estimate
    }

    /// Unit normal of a vertex; zero where it has none.
    #[inline]
    pub(crate) fn normal(&self, vertex: u32) -> Vec3 {
        match self.sites.get(vertex as usize) {
            Some(site) => site.normal_vector(),
            None => self.normals[vertex as usize],
        }
    }

    /// What the rounding of a vertex's coordinates can do to a second difference over `length`, 1/length.
    pub(super) fn rounding_error(&self, vertex: u32, length: f64) -> f64 {
        // A second difference quadruples the rounding of one point, and fits magnify it by up to ten.
        40.0 * f64::EPSILON * (self.positions[vertex as usize].amax().max(length) / length) / length
    }
}

/// Mean length of all triangle sides (a side that two triangles share counts twice, as libigl has it).
fn mean_edge(positions: &[Vec3], triangles: &[[u32; 3]]) -> f64 {
    let side = |a: u32, b: u32| (positions[a as usize] - positions[b as usize]).norm();
    let sum: f64 = triangles.iter().map(|&[a, b, c]| side(a, b) + side(b, c) + side(c, a)).sum();
    sum / (3 * triangles.len().max(1)) as f64
}

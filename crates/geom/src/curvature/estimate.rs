//! The loop over vertices that all estimators share.

use std::borrow::Cow;
use std::sync::{Mutex, PoisonError};

use rayon::prelude::*;

use super::batch::{self, Batch, Site};
use super::creases::{Cut, LEAST_TURN_COSINE};
use super::libigl_normals::libigl_vertex_normals;
use super::local_fit::Cloud;
use super::moments::Points;
use super::normals;
use super::walker::Walker;
use super::workspace::{Kept, Workspace};
use super::{
    CurvatureOptions, Features, Method, Neighbourhood, OptionsError, Status, VertexCurvature, algebraic,
    auto, jet, libigl, quadric,
};
use crate::Vec3;
use crate::mesh::{Adjacency, Fan, Lookahead, Renumbered, Rings, Surface, Survey, index_u32, inverse};

/// Fewest vertices handled by one task.
const BLOCK: usize = 1024;

/// Estimates principal curvature at every vertex of a surface; entry `i` belongs to surface vertex `i`.
///
/// Never fails on geometry: a vertex without an estimate has `principal: None`, an infinite error and a status that says
/// why. Runs on rayon's current pool; the result has the same bits for any number of threads.
///
/// A large mesh whose numbering is scattered is copied in an order that keeps neighbours together; its estimates differ by rounding from those
/// of the same mesh numbered otherwise, as they always do.
///
/// Memory beyond the surface, on a closed mesh of valence 6: 32 bytes a vertex for adjacency, 25 for normals and fans (65 for
/// [`Method::Quadric`], which keeps positions beside the normals), 88 for the result, and 4 a vertex and thread for the walks;
/// 28 more with [`Method::Normals`]. Before the result is there, the tables of triangles, neighbours and normals take 85 while they
/// are built (125 for [`Method::Quadric`]), and looking for creases, where there are many, 133 (173). Where there are creases, the cut surface is a copy (48), and so is a mesh in
/// another order (52), of which 4 to 28 are left when the result is there.
///
/// # Errors
///
/// Options out of range, see [`CurvatureOptions::validate`].
pub fn estimate(
    surface: &Surface<'_>,
    options: &CurvatureOptions,
) -> Result<Vec<VertexCurvature>, OptionsError> {
    estimate_with(&mut Workspace::for_one(), surface, options)
}

pub(super) fn estimate_with(
    workspace: &mut Workspace,
    surface: &Surface<'_>,
    options: &CurvatureOptions,
) -> Result<Vec<VertexCurvature>, OptionsError> {
    options.validate()?;
    // Steps that follow each other are begun by a thread of the pool: a thread outside would fall asleep and wake up with every one.
    Ok(rayon::scope(|_| estimate_in_pool(workspace, surface, options)))
}

/// Rings of fits in groups, if they are.
fn groups(options: &CurvatureOptions) -> Option<usize> {
    if options.method == Method::Quadric { batch::rings_of(options.neighbourhood()) } else { None }
}

fn estimate_in_pool(
    workspace: &mut Workspace,
    surface: &Surface<'_>,
    options: &CurvatureOptions,
) -> Vec<VertexCurvature> {
    let estimate = if groups(options).is_some() { estimate_cut::<Site> } else { estimate_cut::<Vec3> };
    let (positions, triangles) = (surface.positions(), surface.triangles());
    // What libigl returns hangs on the numbering. `Normals` reads triangles to the end: with a copy of them it would take over 200 bytes a vertex.
    let may_be_renumbered = !matches!(options.method, Method::Libigl | Method::Normals);
    match may_be_renumbered.then(|| Renumbered::of(positions, triangles)).flatten() {
        None => estimate(workspace, Cow::Borrowed(positions), Cow::Borrowed(triangles), options),
        Some(Renumbered { positions, triangles, originals }) => {
            let estimates = estimate(workspace, Cow::Owned(positions), Cow::Owned(triangles), options);
            let copies = inverse(&originals);
            copies.into_par_iter().with_min_len(BLOCK).map(|copy| estimates[copy as usize]).collect()
        }
    }
}

/// Cuts the surface along its creases, if it has any, and if they are to be kept.
fn estimate_cut<N: Kept>(
    workspace: &mut Workspace,
    positions: Cow<'_, [Vec3]>,
    triangles: Cow<'_, [[u32; 3]]>,
    options: &CurvatureOptions,
) -> Vec<VertexCurvature> {
    let count = positions.len();
    let keep = options.features == Features::Keep && options.method != Method::Libigl;
    let incident = Adjacency::in_memory(workspace.entries(), &triangles, count);
    let survey =
        Survey::<N>::in_memory(workspace.survey(), &positions, &triangles, &incident, LEAST_TURN_COSINE);
    let cut =
        if keep { Cut::along_creases(&positions, &triangles, &incident, &survey.turning) } else { None };
    match cut {
        None => estimate_all(workspace, positions, triangles, incident, survey, options),
        Some(Cut { positions: cut_open, triangles: of_cut, copies }) => {
            drop((positions, triangles, survey.fans, survey.turning));
            workspace.keep_adjacency(incident);
            workspace.keep_survey(survey.ring, N::tables(survey.normals));
            let incident = Adjacency::in_memory(workspace.entries(), &of_cut, cut_open.len());
            let survey =
                Survey::<N>::in_memory(workspace.survey(), &cut_open, &of_cut, &incident, LEAST_TURN_COSINE);
            let estimates =
                estimate_all(workspace, Cow::Owned(cut_open), Cow::Owned(of_cut), incident, survey, options);
            copies.join(estimates, count)
        }
    }
}

fn estimate_all<N: Kept>(
    workspace: &mut Workspace,
    positions: Cow<'_, [Vec3]>,
    triangles: Cow<'_, [[u32; 3]]>,
    incident: Adjacency,
    survey: Survey<N>,
    options: &CurvatureOptions,
) -> Vec<VertexCurvature> {
    let count = positions.len();
    let prepared = Prepared::new(workspace, positions, triangles, incident, survey, options);
    let mut estimates = workspace.estimates();
    let mut scratch = Scratch::new(&prepared);
    let ahead = prepared.lookahead(&mut scratch.walker);
    let pool = Mutex::new(vec![scratch]);
    // Collecting in parallel also touches the result's memory for the first time in parallel.
    let vertices = (0..count).into_par_iter().with_min_len(BLOCK);
    let leased = || Lease::new(&pool, &prepared);
    let estimate = |lease: &mut Lease<'_, '_>, vertex| {
        let scratch = lease.scratch();
        prepared.ask_ahead(ahead, vertex, &scratch.walker);
        prepared.estimate_vertex(vertex, scratch)
    };
    vertices.map_init(leased, estimate).collect_into_vec(&mut estimates);
    drop(pool);
    let Prepared { ring, normals, sites, .. } = prepared;
    workspace.keep_survey(ring, (normals, sites));
    estimates
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
    /// Empty where there are sites.
    positions: Cow<'a, [Vec3]>,
    /// Empty unless the method reads them.
    triangles: Cow<'a, [[u32; 3]]>,
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
            // Walks by rings, which fits in groups are of, look at no position.
            walker: Walker::new(&prepared.positions, &prepared.ring),
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
    pub(super) fn new<N: Kept>(
        workspace: &mut Workspace,
        mut positions: Cow<'a, [Vec3]>,
        mut triangles: Cow<'a, [[u32; 3]]>,
        incident: Adjacency,
        survey: Survey<N>,
        options: &CurvatureOptions,
    ) -> Self {
        let Survey { ring, fans, normals, .. } = survey;
        let (mut normals, sites) = N::tables(normals);
        if options.method == Method::Libigl {
            normals = libigl_vertex_normals(&positions, &triangles, &incident);
        }
        if options.method == Method::Normals {
            normals::make_exact_on_spheres(&mut normals, &positions, &triangles, &incident);
        }
        let neighbourhood = match options.neighbourhood() {
            Neighbourhood::MeanEdges(edges) => {
                Neighbourhood::Radius(edges * mean_edge(&positions, &triangles))
            }
            other => other,
        };
        // Given back early where it is not needed, which is most of what is held here.
        let reads_triangles = options.method == Method::Normals;
        if !reads_triangles {
            triangles = Cow::Borrowed(&[]);
        }
        let incident = if reads_triangles {
            incident
        } else {
            workspace.keep_adjacency(incident);
            Adjacency::none()
        };
        if !sites.is_empty() {
            positions = Cow::Borrowed(&[]);
        }
        Self {
            positions,
            triangles,
            incident,
            ring,
            normals,
            sites,
            fans,
            in_groups: groups(options),
            options: *options,
            neighbourhood,
        }
    }

    /// How far ahead neighbourhoods reach.
    fn lookahead(&self, walker: &mut Walker<'_>) -> Lookahead {
        let mut largest = |vertex| walker.gather(index_u32(vertex), self.neighbourhood).iter().max().copied();
        Lookahead::new(self.fans.len(), |vertex| largest(vertex).unwrap_or(0))
    }

    /// Asks for what fits of vertices further on read.
    #[inline(always)]
    fn ask_ahead(&self, ahead: Lookahead, vertex: usize, walker: &Walker<'_>) {
        walker.ask_ahead(ahead, vertex);
        if self.sites.is_empty() {
            ahead.ask(&self.positions, vertex);
            ahead.ask(&self.normals, vertex);
        } else {
            ahead.ask(&self.sites, vertex);
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

    /// Positions of all vertices; none where fits are in groups, see [`Self::position`].
    #[inline]
    pub(super) fn positions(&self) -> &[Vec3] {
        &self.positions
    }

    /// Triangles, where the method reads them.
    pub(super) fn triangles(&self) -> &[[u32; 3]] {
        &self.triangles
    }

    #[inline]
    pub(super) fn position(&self, vertex: u32) -> Vec3 {
        match self.sites.get(vertex as usize) {
            Some(site) => site.position_vector(),
            None => self.positions[vertex as usize],
        }
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
        40.0 * f64::EPSILON * (self.position(vertex).amax().max(length) / length) / length
    }
}

/// Mean length of all triangle sides (a side that two triangles share counts twice, as libigl has it).
fn mean_edge(positions: &[Vec3], triangles: &[[u32; 3]]) -> f64 {
    let side = |a: u32, b: u32| (positions[a as usize] - positions[b as usize]).norm();
    let sum: f64 = triangles.iter().map(|&[a, b, c]| side(a, b) + side(b, c) + side(c, a)).sum();
    sum / (3 * triangles.len().max(1)) as f64
}

#[cfg(test)]
mod tests {
    use super::*;
    use crate::Mesh;
    use crate::mesh::Weld;
    use crate::shapes::{self, Ends};

    /// Large and scattered enough to be renumbered, with creases to be cut along.
    #[test]
    fn a_scattered_mesh_has_the_estimates_of_the_same_in_order() {
        let roof = |u: f64, v: f64| Vec3::new(4.0 * u, v, 4.0 * (0.5 - u).abs() + 0.05 * (9.0 * v).sin());
        let mesh = shapes::study::add_noise(&shapes::grid(400, 100, [Ends::Open; 2], roof), 0.01, 3);
        let (count, faces) = (mesh.positions().len(), mesh.triangles().len());
        /// Prime, and so coprime to both.
        const STEP: usize = 16_411;
        let place = |vertex: usize| vertex * STEP % count;
        let mut positions = vec![Vec3::zeros(); count];
        for (vertex, position) in mesh.positions().iter().enumerate() {
            positions[place(vertex)] = *position;
        }
        let moved = |triangle: [u32; 3]| triangle.map(|v| index_u32(place(v as usize)));
        let triangles = (0..faces).map(|t| moved(mesh.triangles()[t * STEP % faces])).collect();
        let scattered = Mesh::new(positions, triangles).unwrap();
        assert!(Renumbered::of(scattered.positions(), scattered.triangles()).is_some());
        for method in [Method::Quadric, Method::Jet] {
            let options = CurvatureOptions { method, ..CurvatureOptions::default() };
            let estimates = |mesh: &Mesh| estimate(&Surface::new(mesh, Weld::Off), &options).unwrap();
            let (expected, found) = (estimates(&mesh), estimates(&scattered));
            assert!(expected.iter().any(|e| e.status == Status::Crease));
            for (vertex, expected) in expected.iter().enumerate() {
                let found = &found[place(vertex)];
                assert_eq!(found.status, expected.status, "{method:?}, vertex {vertex}");
                let Some((found, known)) = found.principal.zip(expected.principal) else { continue };
                let apart = (found.tensor() - known.tensor()).norm();
                // Rounding counts for more where a fit is ill-conditioned, as at corners; the stated error says so.
                let most = 1e-9 * (1.0 + known.tensor().norm()) + 1e-3 * expected.error;
                assert!(apart < most, "{method:?}, vertex {vertex}: {apart:e} {most:e}");
            }
        }
    }
}

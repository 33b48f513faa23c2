//! [`Workspace`]: memory of estimates that is used again.

use super::batch::Site;
use super::estimate::estimate_with;
use super::{CurvatureOptions, OptionsError, VertexCurvature};
use crate::Vec3;
use crate::mesh::{Adjacency, Oriented, Rings, SLOT, Surface, SurveyMemory};

/// Memory of estimates, for many of them one after the other: of the frames of a moving mesh, or of many meshes.
///
/// Estimates are those of [`estimate`](super::estimate()). The first one of a mesh gets its memory from the system, page by page, which takes a fifth of the time
/// of `quadric` on two million vertices; later ones of meshes of the same size or smaller find it here. A workspace keeps what its largest mesh took: up to
/// 208 bytes a vertex, the estimates among them (232 where methods change).
///
/// ```
/// use osculate_geom::curvature::{CurvatureOptions, Workspace};
/// use osculate_geom::mesh::{Surface, Weld};
/// use osculate_geom::shapes;
///
/// let mut workspace = Workspace::default();
/// for frame in 1..4 {
///     let mesh = shapes::icosphere(f64::from(frame), 2);
///     let estimates = workspace.estimate(&Surface::new(&mesh, Weld::Off), &CurvatureOptions::default())?;
///     let principal = estimates[0].principal.expect("a sphere has curvature");
///     assert!((principal.kappa_max * f64::from(frame) - 1.0).abs() < 0.01);
/// }
/// # Ok::<(), osculate_geom::curvature::OptionsError>(())
/// ```
#[derive(Debug)]
pub struct Workspace {
    /// Whether there will be a next estimate; otherwise everything is given back as soon as it can be.
    keeps: bool,
    entries: Vec<u32>,
    slots: Vec<[u32; SLOT]>,
    normals: Vec<Vec3>,
    sites: Vec<Site>,
    estimates: Vec<VertexCurvature>,
}

impl Default for Workspace {
    fn default() -> Self {
        Self { keeps: true, ..Self::for_one() }
    }
}

impl Workspace {
    /// Estimates principal curvature at every vertex of a surface; entry `i` belongs to surface vertex `i`.
    ///
    /// # Errors
    ///
    /// As those of [`estimate`](super::estimate()).
    pub fn estimate(
        &mut self,
        surface: &Surface<'_>,
        options: &CurvatureOptions,
    ) -> Result<&[VertexCurvature], OptionsError> {
        self.estimates = estimate_with(self, surface, options)?;
        Ok(&self.estimates)
    }

    /// For a single estimate.
    pub(super) fn for_one() -> Self {
        let (entries, slots, normals, sites, estimates) =
            (Vec::new(), Vec::new(), Vec::new(), Vec::new(), Vec::new());
        Self { keeps: false, entries, slots, normals, sites, estimates }
    }

    /// Memory for an adjacency.
    pub(super) fn entries(&mut self) -> Vec<u32> {
        std::mem::take(&mut self.entries)
    }

    /// Memory for a survey.
    pub(super) fn survey<N: Kept>(&mut self) -> SurveyMemory<N> {
        SurveyMemory { slots: std::mem::take(&mut self.slots), normals: std::mem::take(N::spare(self)) }
    }

    /// Memory for the result.
    pub(super) fn estimates(&mut self) -> Vec<VertexCurvature> {
        std::mem::take(&mut self.estimates)
    }

    pub(super) fn keep_adjacency(&mut self, incident: Adjacency) {
        if self.keeps {
            self.entries = incident.into_memory();
        }
    }

    pub(super) fn keep_survey(&mut self, ring: Rings, (normals, sites): (Vec<Vec3>, Vec<Site>)) {
        if self.keeps {
            self.slots = ring.into_memory();
            // One of them is empty.
            if sites.is_empty() { self.normals = normals } else { self.sites = sites }
        }
    }
}

/// How positions and normals are kept for the fits.
pub(super) trait Kept: Oriented {
    /// Normals by themselves, or sites.
    fn tables(all: Vec<Self>) -> (Vec<Vec3>, Vec<Site>);

    /// Where such a table waits to be used again.
    fn spare(workspace: &mut Workspace) -> &mut Vec<Self>;
}

impl Kept for Vec3 {
    fn tables(normals: Vec<Self>) -> (Vec<Vec3>, Vec<Site>) {
        (normals, Vec::new())
    }

    fn spare(workspace: &mut Workspace) -> &mut Vec<Self> {
        &mut workspace.normals
    }
}

impl Kept for Site {
    fn tables(sites: Vec<Self>) -> (Vec<Vec3>, Vec<Site>) {
        (Vec::new(), sites)
    }

    fn spare(workspace: &mut Workspace) -> &mut Vec<Self> {
        &mut workspace.sites
    }
}

#[cfg(test)]
mod tests {
    use super::*;
    use crate::Mesh;
    use crate::curvature::{Method, Neighbourhood, estimate};
    use crate::mesh::Weld;
    use crate::shapes::{self, Ends, study};

    /// Larger and smaller, with a boundary, a crease, and vertices of many neighbours.
    fn meshes() -> [Mesh; 4] {
        let roof = |u: f64, v: f64| Vec3::new(4.0 * u, v, 4.0 * (0.5 - u).abs() + 0.05 * (9.0 * v).sin());
        let noisy = study::add_noise(&study::StudyShape::Torus.mesh(3000, 3), 0.2, 1);
        let cone = shapes::cylinder(0.5, 2.0, 64, 4);
        [shapes::torus(1.0, 0.4, 70, 40), shapes::grid(40, 20, [Ends::Open; 2], roof), noisy, cone]
    }

    #[test]
    fn what_an_earlier_mesh_left_changes_no_bit() {
        let mut workspace = Workspace::default();
        let quick = CurvatureOptions {
            method: Method::Quadric,
            neighbourhood: Some(Neighbourhood::Rings(2)),
            ..CurvatureOptions::default()
        };
        let methods = Method::ALL.map(|method| CurvatureOptions { method, ..CurvatureOptions::default() });
        for options in [quick].into_iter().chain(methods) {
            for mesh in meshes() {
                let surface = Surface::new(&mesh, Weld::Off);
                let expected = estimate(&surface, &options).unwrap();
                for turn in 0..2 {
                    let found = workspace.estimate(&surface, &options).unwrap();
                    assert!(found == expected, "{:?}, turn {turn}", options.method);
                }
            }
        }
    }

    /// The second and the third time; a surface that is cut along creases is larger than it was before.
    #[test]
    fn a_mesh_of_the_same_size_finds_its_memory() {
        for mesh in meshes() {
            let surface = Surface::new(&mesh, Weld::Off);
            let options = CurvatureOptions { method: Method::Quadric, ..CurvatureOptions::default() };
            let mut workspace = Workspace::default();
            let mut places = || {
                let result = workspace.estimate(&surface, &options).unwrap().as_ptr() as usize;
                let Workspace { entries, slots, sites, .. } = &workspace;
                [result, entries.as_ptr() as usize, slots.as_ptr() as usize, sites.as_ptr() as usize]
            };
            places();
            assert_eq!(places(), places());
        }
    }
}

//! Quadric fits of eight vertices at a time.
//!
//! A fit on two rings is a few hundred multiplications and then a long chain of divisions and roots that each wait for the one
//! before. One after the other, such chains take most of the time; eight side by side take little more than one. So vertices
//! are fitted in groups of eight consecutive ones, each in a lane of its own, from the rotation of the neighbours to the
//! principal directions and the error. A vertex whose rings are unusual (very many neighbours, or fewer rings than asked
//! for), or whose fit is not plainly sound, is left to the scalar code, which knows what to do about it.

mod equations;
mod gather;
mod kernel;
mod sites;

pub(crate) use sites::Site;

use self::gather::{MOST_RINGS, Octet};
use self::kernel::Row;
use super::estimate::Prepared;
use super::walker::Walker;
use super::{Neighbourhood, Principal, Status, VertexCurvature};
use crate::mesh::index_u32;

/// Vertices of a group.
const GROUP: usize = 8;

/// Estimates of the group fitted last, and scratch.
#[derive(Debug, Default)]
pub(super) struct Batch {
    group: Option<usize>,
    estimates: [Option<VertexCurvature>; GROUP],
    octet: Octet,
    rows: Vec<Row>,
}

/// Whether fits in groups pay for a neighbourhood, and the number of rings.
pub(super) fn rings_of(neighbourhood: Neighbourhood) -> Option<usize> {
    let Neighbourhood::Rings(rings) = neighbourhood else { return None };
    usize::try_from(rings).ok().filter(|rings| (1..=MOST_RINGS).contains(rings))
}

impl Batch {
    /// The estimate at a vertex where its group's fit gave one. `eligible` says which vertices have triangles and a normal.
    pub(super) fn estimate(
        &mut self,
        prepared: &Prepared<'_>,
        walker: &mut Walker<'_>,
        rings: usize,
        vertex: usize,
        eligible: impl Fn(usize) -> bool,
    ) -> Option<VertexCurvature> {
        let group = vertex / GROUP;
        if self.group != Some(group) {
            self.fit(prepared, walker, rings, group * GROUP, eligible);
            self.group = Some(group);
        }
        self.estimates[vertex % GROUP]
    }

    fn fit(
        &mut self,
        prepared: &Prepared<'_>,
        walker: &mut Walker<'_>,
        rings: usize,
        first: usize,
        eligible: impl Fn(usize) -> bool,
    ) {
        let Self { estimates, octet, rows, .. } = self;
        octet.begin(rings, index_u32(first));
        let mut gathered = 0_u8;
        for lane in 0..GROUP.min(prepared.sites.len() - first) {
            if eligible(first + lane) && octet.gather(lane, index_u32(first + lane), walker) {
                gathered |= 1 << lane;
            }
        }
        let fits = kernel::fit(&prepared.sites, octet, rows);
        let sound = fits.sound & gathered;
        for (lane, estimate) in estimates.iter_mut().enumerate() {
            *estimate = (sound >> lane & 1 == 1).then(|| {
                let [kappa_max, kappa_min, x1, y1, z1, x2, y2, z2, error] = fits.numbers.map(|row| row[lane]);
                let (d1, d2) = ([x1, y1, z1].into(), [x2, y2, z2].into());
                let error = error + prepared.rounding_error(index_u32(first + lane), fits.length[lane]);
                let principal = Some(Principal { kappa_max, kappa_min, d1, d2 });
                VertexCurvature { principal, error, status: Status::Ok }
            });
        }
    }
}

#[cfg(test)]
mod tests {
    use super::*;
    use crate::Mesh;
    use crate::curvature::estimate::Scratch;
    use crate::curvature::workspace::Workspace;
    use crate::curvature::{CurvatureOptions, Method, quadric};
    use crate::mesh::{Adjacency, Survey};
    use crate::shapes::{self, Ends, study};

    fn prepared(mesh: &Mesh, rings: u32) -> Prepared<'_> {
        let (positions, triangles) = (mesh.positions(), mesh.triangles());
        let incident = Adjacency::triangles_of_vertices(triangles, positions.len());
        let survey = Survey::<Site>::new(positions, triangles, &incident, 0.7);
        let neighbourhood = Some(Neighbourhood::Rings(rings));
        let options =
            CurvatureOptions { method: Method::Quadric, neighbourhood, ..CurvatureOptions::default() };
        Prepared::new(
            &mut Workspace::for_one(),
            positions.into(),
            triangles.into(),
            incident,
            survey,
            &options,
        )
    }

    /// Irregular and random, with valences of 3 to 10 and more; with a boundary; noisy.
    fn meshes() -> Vec<Mesh> {
        let torus = study::StudyShape::Torus.mesh(1500, 3);
        let wave = shapes::grid(23, 17, [Ends::Open; 2], |u, v| {
            crate::Vec3::new(u, v + 0.1 * (7.0 * u).sin(), 0.2 * (3.0 * u).sin() * (5.0 * v).cos())
        });
        vec![study::add_noise(&torus, 0.1, 1), torus, wave]
    }

    #[test]
    fn groups_give_what_single_fits_give() {
        for (index, mesh) in meshes().iter().enumerate() {
            for rings in 1..=MOST_RINGS {
                let prepared = prepared(mesh, u32::try_from(rings).unwrap());
                let (mut scratch, mut single) = (Scratch::new(&prepared), Scratch::new(&prepared));
                let hood = Neighbourhood::Rings(u32::try_from(rings).unwrap());
                let mut fitted = 0;
                for vertex in 0..mesh.positions().len() {
                    let Scratch { walker, batch, .. } = &mut scratch;
                    let Some(found) = batch.estimate(&prepared, walker, rings, vertex, |_| true) else {
                        continue;
                    };
                    fitted += 1;
                    let expected = quadric::estimate_vertex(&prepared, index_u32(vertex), hood, &mut single);
                    let (one, two) = (found.principal.unwrap(), expected.principal.unwrap());
                    let case =
                        format!("mesh {index}, {rings} rings, vertex {vertex}: {found:?} {expected:?}");
                    // The rounding of a fit, 1e-16 over its least pivot, in units of the curvature's own scale.
                    let scale = one.kappa_max.abs().max(one.kappa_min.abs());
                    let apart =
                        (one.kappa_max - two.kappa_max).abs().max((one.kappa_min - two.kappa_min).abs());
                    assert!(apart < 1e-8 * scale, "{apart:e} {case}");
                    // The squared error hangs on what is left of squared heights, which carry roundings of their own.
                    let squares = (found.error * found.error - expected.error * expected.error).abs();
                    assert!(
                        squares < 1e-6 * expected.error * expected.error + 1e-9 * scale * scale,
                        "{squares:e} {case}"
                    );
                    let tensors = (one.tensor() - two.tensor()).norm();
                    assert!(tensors < 1e-8 * scale, "{tensors:e} {case}");
                    assert!((one.normal() - two.normal()).norm() < 1e-9, "{case}");
                    assert!(
                        (one.d1.norm() - 1.0).abs() < 1e-15 && one.d1.dot(&one.d2).abs() < 1e-14,
                        "{case}"
                    );
                }
                // One ring often has too few neighbours, and a crowded one goes its own way.
                let share = fitted as f64 / mesh.positions().len() as f64;
                assert!(share > if rings == 1 { 0.3 } else { 0.9 }, "mesh {index}, {rings} rings: {share}");
            }
        }
    }

    #[test]
    fn instruction_sets_give_the_same_bits() {
        for mesh in meshes() {
            for rings in [1, 2, 5] {
                let prepared = prepared(&mesh, 2);
                let mut scratch = Scratch::new(&prepared);
                let (mut octet, mut rows) = (Octet::default(), Vec::new());
                for first in (0..mesh.positions().len() - 8).step_by(56) {
                    octet.begin(rings, index_u32(first));
                    for lane in 0..8 {
                        octet.gather(lane, index_u32(first + lane), &mut scratch.walker);
                    }
                    let bits = |fits: kernel::Fits| {
                        (fits.sound, fits.numbers.map(|row| row.map(f64::to_bits)), fits.length)
                    };
                    let plain = bits(kernel::fit_portable(&prepared.sites, &octet, &mut rows));
                    let found = bits(kernel::fit(&prepared.sites, &octet, &mut rows));
                    // What is not sound may be any not-a-number.
                    if plain.0 == u8::MAX {
                        assert_eq!(found, plain, "{rings} rings, vertex {first}");
                    }
                    assert_eq!(found.0, plain.0, "{rings} rings, vertex {first}");
                }
            }
        }
    }
}

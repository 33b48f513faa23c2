//! Meshes of everyday objects with exact curvature: vertices on the limit surface of Loop subdivision.
//!
//! A scanned or modelled mesh has no true curvature to compare with. The smooth surface that Loop's subdivision scheme makes of
//! it (C. Loop, Smooth subdivision surfaces based on triangles, 1987) has: around a vertex of valence 6 it is a quartic
//! box spline, whose derivatives at the vertex are finite combinations of the vertex and its six neighbours. So nothing needs to
//! converge, and the connectivity is the object's own.

use std::collections::HashMap;
use std::f64::consts::TAU;

use nalgebra::{Matrix2, Matrix3x2};
use thiserror::Error;

use crate::curvature::Principal;
use crate::mesh::{Surface, index_u32};
use crate::reference::level_set_curvature;
use crate::{Mesh, Vec3};

/// A mesh whose vertices lie on a Loop limit surface.
#[derive(Debug, Clone)]
pub struct LimitMesh {
    /// The triangles of the refined control mesh between the limits of its vertices.
    pub mesh: Mesh,
    /// Exact curvature of the limit surface, or `None` where it has none: at vertices of valence other than 6, and where its
    /// parametrisation is singular.
    pub exact: Vec<Option<Principal>>,
}

/// Why a control mesh has no limit surface here.
#[derive(Debug, Clone, PartialEq, Eq, Error)]
pub enum LimitError {
    /// An edge with one triangle, with three, or between two that face different ways.
    #[error(
        "the edge from vertex {0} to vertex {1} has not one triangle on each side; take a closed manifold mesh"
    )]
    Edge(u32, u32),
    /// A vertex that is not in the middle of one fan.
    #[error(
        "vertex {0} has {1} fans of triangles, not one; take a closed manifold mesh without unused vertices"
    )]
    Vertex(usize, usize),
}

/// Refines a closed surface `levels` times (each makes four triangles of one) and moves every vertex to its limit. Vertices of
/// the control mesh keep their numbers.
///
/// # Errors
///
/// A surface that is not closed, manifold and consistently oriented.
pub fn loop_limit(control: &Surface<'_>, levels: u32) -> Result<LimitMesh, LimitError> {
    let mut control =
        Control { positions: control.positions().to_vec(), triangles: control.triangles().to_vec() };
    for _ in 0..levels {
        control = control.refined(&control.rings()?);
    }
    let rings = control.rings()?;
    let limits = rings.iter().zip(&control.positions).map(|(ring, p)| {
        let n = ring.len() as f64;
        let weight = 1.0 / (3.0 / (8.0 * beta(ring.len())) + n);
        p * (1.0 - n * weight) + control.sum(ring) * weight
    });
    let exact = (0..rings.len()).map(|v| control.curvature(v, &rings[v])).collect();
    let mesh = Mesh::new(limits.collect(), control.triangles).expect("convex combinations of finite points");
    Ok(LimitMesh { mesh, exact })
}

/// Loop's weight of each neighbour for the new place of a vertex of this valence.
fn beta(valence: usize) -> f64 {
    let n = valence as f64;
    let c = 0.375 + 0.25 * (TAU / n).cos();
    (0.625 - c * c) / n
}

struct Control {
    positions: Vec<Vec3>,
    triangles: Vec<[u32; 3]>,
}

impl Control {
    /// The neighbours of every vertex, counter-clockwise.
    fn rings(&self) -> Result<Vec<Vec<u32>>, LimitError> {
        // After neighbour b of a comes c, if (a, b, c) is a triangle.
        let mut after: HashMap<(u32, u32), u32> = HashMap::with_capacity(3 * self.triangles.len());
        let mut first = vec![None; self.positions.len()];
        let mut valence = vec![0_usize; self.positions.len()];
        for &[a, b, c] in &self.triangles {
            for (a, b, c) in [(a, b, c), (b, c, a), (c, a, b)] {
                if after.insert((a, b), c).is_some() {
                    return Err(LimitError::Edge(a, b));
                }
                first[a as usize] = Some(b);
                valence[a as usize] += 1;
            }
        }
        let rings = first.iter().enumerate().map(|(vertex, first)| {
            let first = first.ok_or(LimitError::Vertex(vertex, 0))?;
            let mut ring = vec![first];
            loop {
                let last = *ring.last().unwrap_or(&first);
                let next = after.get(&(index_u32(vertex), last));
                let next = *next.ok_or(LimitError::Edge(index_u32(vertex), last))?;
                if next == first {
                    break;
                }
                ring.push(next);
            }
            if ring.len() == valence[vertex] { Ok(ring) } else { Err(LimitError::Vertex(vertex, 2)) }
        });
        rings.collect()
    }

    fn sum(&self, ring: &[u32]) -> Vec3 {
        ring.iter().map(|&i| self.positions[i as usize]).sum()
    }

    fn refined(&self, rings: &[Vec<u32>]) -> Self {
        let moved = rings.iter().zip(&self.positions).map(|(ring, p)| {
            let weight = beta(ring.len());
            p * (1.0 - ring.len() as f64 * weight) + self.sum(ring) * weight
        });
        let mut positions: Vec<Vec3> = moved.collect();
        let mut middles: HashMap<(u32, u32), u32> = HashMap::with_capacity(2 * self.triangles.len());
        let mut triangles = Vec::with_capacity(4 * self.triangles.len());
        for &[a, b, c] in &self.triangles {
            let [ab, bc, ca] = [(a, b), (b, c), (c, a)].map(|(i, j)| {
                *middles.entry((i.min(j), i.max(j))).or_insert_with(|| {
                    positions.push(self.edge_point(i, j, &rings[i as usize]));
                    index_u32(positions.len() - 1)
                })
            });
            triangles.extend([[a, ab, ca], [b, bc, ab], [c, ca, bc], [ab, bc, ca]]);
        }
        Self { positions, triangles }
    }

    /// Three eighths of the ends, one eighth of the two vertices across.
    fn edge_point(&self, i: u32, j: u32, ring_of_i: &[u32]) -> Vec3 {
        let at = ring_of_i.iter().position(|&v| v == j).expect("an edge joins neighbours");
        let n = ring_of_i.len();
        let across = [ring_of_i[(at + 1) % n], ring_of_i[(at + n - 1) % n]];
        let ends = self.positions[i as usize] + self.positions[j as usize];
        0.375 * ends + 0.125 * self.sum(&across)
    }

    /// Curvature of the limit surface at a vertex, from the derivatives of the box spline along the lattice directions
    /// `e1` (first neighbour) and `e2` (second): its second derivative along a lattice direction is the plain second
    /// difference of the control points, its first derivative weights the six neighbours by (2, 1, -1, -2, -1, 1) / 6.
    fn curvature(&self, vertex: usize, ring: &[u32]) -> Option<Principal> {
        let c: [Vec3; 6] = <[u32; 6]>::try_from(ring).ok()?.map(|i| self.positions[i as usize]);
        let p = self.positions[vertex];
        let first = |k: usize| {
            let across = |i: usize| c[(k + i) % 6] - c[(k + i + 3) % 6];
            (2.0 * across(0) + across(1) + across(5)) / 6.0
        };
        let second = |k: usize| c[k] + c[k + 3] - 2.0 * p;
        let [f1, f2] = [first(0), first(1)];
        let [f11, f22, f33] = [second(0), second(1), second(2)];
        // The third direction is e2 - e1.
        let f12 = 0.5 * (f11 + f22 - f33);
        let normal = f1.cross(&f2).try_normalize(f64::MIN_POSITIVE)?;
        let metric = Matrix2::new(f1.dot(&f1), f1.dot(&f2), f1.dot(&f2), f2.dot(&f2)).try_inverse()?;
        let bending = -Matrix2::new(f11.dot(&normal), f12.dot(&normal), f12.dot(&normal), f22.dot(&normal));
        let basis = Matrix3x2::from_columns(&[f1, f2]);
        let tensor = basis * (metric * bending * metric) * basis.transpose();
        let (kappa_max, kappa_min, d1) = level_set_curvature(&normal, &tensor);
        let principal = Principal { kappa_max, kappa_min, d1, d2: normal.cross(&d1) };
        principal.tensor().iter().all(|x| x.is_finite()).then_some(principal)
    }
}

#[cfg(test)]
mod tests {
    use super::super::{StudyShape, add_noise};
    use super::*;
    use crate::curvature::{CurvatureOptions, estimate};
    use crate::mesh::Weld;
    use crate::reference::Quantiles;

    /// A control mesh without symmetry and with all kinds of valences.
    fn rough() -> Mesh {
        add_noise(&StudyShape::Torus.mesh(400, 3), 0.1, 4)
    }

    #[test]
    fn refinement_does_not_change_the_limit() {
        let control = rough();
        let surface = Surface::new(&control, Weld::Off);
        let [coarse, fine] = [0, 2].map(|levels| loop_limit(&surface, levels).unwrap());
        assert_eq!(fine.mesh.triangles().len(), 16 * control.triangles().len());
        for (p, q) in coarse.mesh.positions().iter().zip(fine.mesh.positions()) {
            assert!((p - q).norm() < 1e-13, "{p} {q}");
        }
        let mut regular = 0;
        for (a, b) in coarse.exact.iter().zip(&fine.exact) {
            assert_eq!(a.is_some(), b.is_some(), "subdivision keeps the valence");
            let (Some(a), Some(b)) = (a, b) else { continue };
            // Second differences of numbers near 1 over (edge / 4)^2 lose 1e-12.
            let scale = 1.0 + a.kappa_max.abs().max(a.kappa_min.abs());
            assert!((a.tensor() - b.tensor()).amax() < 1e-10 * scale, "{a:?} {b:?}");
            regular += 1;
        }
        assert!(regular > 50, "{regular} regular vertices");
    }

    #[test]
    fn dense_meshes_are_estimated_as_stated() {
        // A second road to the same numbers, which converges with the square of the edge.
        let control = rough();
        let surface = Surface::new(&control, Weld::Off);
        let errors = [2, 3, 4].map(|levels| {
            let LimitMesh { mesh, exact } = loop_limit(&surface, levels).unwrap();
            let found = estimate(&Surface::new(&mesh, Weld::Off), &CurvatureOptions::default()).unwrap();
            let pairs = found.iter().zip(&exact).filter_map(|(f, e)| Some((f.principal?, (*e)?)));
            Quantiles::new(
                pairs.map(|(f, e)| (f.tensor() - e.tensor()).norm() / (1.0 + e.tensor().norm())).collect(),
            )
            .median
        });
        assert!(errors[2] < 0.02 && errors[1] < 0.5 * errors[0] && errors[2] < 0.5 * errors[1], "{errors:?}");
    }

    #[test]
    fn meshes_without_a_limit_are_named() {
        let open = StudyShape::Bump.mesh(200, 1);
        let error = loop_limit(&Surface::new(&open, Weld::Off), 0).unwrap_err();
        assert!(matches!(error, LimitError::Edge(..)), "{error}");
        let p = vec![Vec3::zeros(), Vec3::x(), Vec3::y(), Vec3::z(), Vec3::repeat(1.0)];
        let unused = Mesh::new(p, vec![[0, 2, 1], [0, 3, 2], [0, 1, 3], [1, 2, 3]]).unwrap();
        assert_eq!(loop_limit(&Surface::new(&unused, Weld::Off), 0).unwrap_err(), LimitError::Vertex(4, 0));
    }
}

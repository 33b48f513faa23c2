//! The filtered minimum by slicing the whole mesh: the slow second method that the walk is measured against.

use std::collections::HashMap;

use super::surface_field::{CurvatureField, SurfacePoint};
use crate::curvature::Principal;
use crate::{Mat3, Vec3};

/// Where the plane cuts an edge.
struct Cut {
    position: Vec3,
    kappa: Option<f64>,
    /// The triangles whose section ends here.
    triangles: Vec<usize>,
}

impl CurvatureField<'_> {
    /// What [`minimum_past`](Self::minimum_past) returns as `kappa`, found without a walk: every triangle of the mesh is cut
    /// by the plane, and the pieces are joined where they meet on an edge. `O(n)` in the triangles. It shares no code with the
    /// walk, so that the two check each other.
    ///
    /// `None` where the walk has none, at normal incidence, and for a point on an edge or a corner, where the piece that the
    /// section starts with is ambiguous.
    #[must_use]
    pub fn minimum_by_slicing(&self, point: SurfacePoint, w: Vec3, length: f64) -> Option<f64> {
        let origin = self.position(point);
        let n = self.unit_normal(point)?;
        let w = w.try_normalize(0.0)?;
        let forward = (n * n.dot(&w) - w).try_normalize(2e-8)?;
        let m = n.cross(&forward).normalize();
        let (cuts, edges_of) = self.cuts(origin, m);
        let first = edges_of.get(&point.triangle)?;
        let ahead = first.iter().find(|edge| forward.dot(&(cuts[*edge].position - origin)) > 0.0)?;
        let mut minimum = self.kappa_along(point, w)?.min(self.cut_curvature(point, &m)?);
        let mut walked = 0.0;
        let (mut position, mut kappa) = (origin, self.cut_curvature(point, &m));
        let (mut triangle, mut edge) = (point.triangle, *ahead);
        loop {
            let cut = &cuts[&edge];
            let span = (cut.position - position).norm();
            if walked + span >= length {
                let share = (length - walked) / span;
                let end = kappa.zip(cut.kappa).map(|(from, to)| (1.0 - share) * from + share * to);
                return Some(end.map_or(minimum, |end| minimum.min(end)));
            }
            walked += span;
            minimum = cut.kappa.map_or(minimum, |kappa| minimum.min(kappa));
            (position, kappa) = (cut.position, cut.kappa);
            let &[a, b] = &cut.triangles[..] else { return Some(minimum) };
            triangle = if a == triangle { b } else { a };
            let next = edges_of[&triangle].iter().find(|&&other| other != edge);
            edge = *next.expect("a cut triangle has two cut edges");
            if triangle == point.triangle {
                return Some(cuts[&edge].kappa.map_or(minimum, |kappa| minimum.min(kappa)));
            }
        }
    }

    /// Every edge that the plane cuts, and the cut edges of every cut triangle.
    #[allow(clippy::type_complexity, reason = "two maps that are made and used together")]
    fn cuts(&self, origin: Vec3, m: Vec3) -> (HashMap<[u32; 2], Cut>, HashMap<usize, Vec<[u32; 2]>>) {
        let positions = self.surface().positions();
        let side: Vec<f64> = positions.iter().map(|p| m.dot(&(p - origin))).collect();
        let mut cuts: HashMap<[u32; 2], Cut> = HashMap::new();
        let mut edges_of: HashMap<usize, Vec<[u32; 2]>> = HashMap::new();
        for (triangle, corners) in self.surface().triangles().iter().enumerate() {
            for k in 0..3 {
                let (a, b) = (corners[k].min(corners[(k + 1) % 3]), corners[k].max(corners[(k + 1) % 3]));
                let (ha, hb) = (side[a as usize], side[b as usize]);
                if (ha >= 0.0) == (hb >= 0.0) {
                    continue;
                }
                let share = ha / (ha - hb);
                let cut = cuts.entry([a, b]).or_insert_with(|| Cut {
                    position: positions[a as usize].lerp(&positions[b as usize], share),
                    kappa: blend([(self.principal(a), 1.0 - share), (self.principal(b), share)], &m),
                    triangles: Vec::new(),
                });
                cut.triangles.push(triangle);
                edges_of.entry(triangle).or_default().push([a, b]);
            }
        }
        (cuts, edges_of)
    }

    fn cut_curvature(&self, point: SurfacePoint, m: &Vec3) -> Option<f64> {
        let corners = self.surface().triangles()[point.triangle];
        let [a, b, c] = std::array::from_fn(|k| (self.principal(corners[k]), point.barycentric[k]));
        blend([a, b, c], m)
    }
}

/// The corners' curvatures across `m`, from their tensors, weighted.
fn blend<const N: usize>(corners: [(Option<&Principal>, f64); N], m: &Vec3) -> Option<f64> {
    let (mut sum, mut weights) = (0.0, 0.0);
    for (principal, weight) in corners {
        let Some(principal) = principal.filter(|_| weight > 0.0) else { continue };
        let tensor: Mat3 = principal.tensor();
        let tangent = m.cross(&principal.normal());
        let squared = tangent.norm_squared();
        let kappa =
            if squared == 0.0 { principal.mean() } else { tangent.dot(&(tensor * tangent)) / squared };
        sum += weight * kappa;
        weights += weight;
    }
    (weights > 0.0).then(|| sum / weights)
}

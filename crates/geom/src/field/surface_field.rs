//! [`CurvatureField`]: the estimates of a surface, asked at any of its points.

use std::borrow::Cow;

use super::direction::kappa_along;
use super::march::{self, March};
use crate::curvature::{Principal, VertexCurvature};
use crate::mesh::{Surface, Topology};
use crate::{Mat3, Vec3};

/// A point on a surface: a triangle and the weights of its three corners.
#[derive(Debug, Clone, Copy, PartialEq)]
pub struct SurfacePoint {
    /// Index of the triangle.
    pub triangle: usize,
    /// Weights of its corners, not negative, with sum one.
    pub barycentric: [f64; 3],
}

/// Curvature estimates with the surface they belong to.
#[derive(Debug)]
pub struct CurvatureField<'a> {
    surface: Surface<'a>,
    curvature: Cow<'a, [VertexCurvature]>,
    topology: Topology,
}

impl<'a> CurvatureField<'a> {
    /// Takes one estimate per surface vertex and finds the neighbours of every triangle.
    ///
    /// # Panics
    ///
    /// If `curvature` has not one entry per surface vertex.
    #[must_use]
    pub fn new(surface: Surface<'a>, curvature: impl Into<Cow<'a, [VertexCurvature]>>) -> Self {
        let curvature = curvature.into();
        assert_eq!(curvature.len(), surface.positions().len(), "one estimate per surface vertex");
        let topology = Topology::new(surface.triangles());
        Self { surface, curvature, topology }
    }

    /// World-space position.
    ///
    /// # Panics
    ///
    /// If the triangle is out of range; so do all queries.
    #[must_use]
    pub fn position(&self, point: SurfacePoint) -> Vec3 {
        let [a, b, c] = self.surface.corners(point.triangle);
        let [wa, wb, wc] = point.barycentric;
        a * wa + b * wb + c * wc
    }

    /// The interpolated curvature tensor, or `None` where no corner of the triangle has an estimate. A corner without
    /// one is left out and the other weights are scaled up.
    #[must_use]
    pub fn tensor(&self, point: SurfacePoint) -> Option<Mat3> {
        let mut sum = (Mat3::zeros(), 0.0);
        for (principal, weight) in self.corner_estimates(point) {
            sum = (sum.0 + principal.tensor() * weight, sum.1 + weight);
        }
        (sum.1 > 0.0).then(|| sum.0 / sum.1)
    }

    /// Curvature along the unit direction `w`: evaluated at each corner by the paper's eqs. 1 and 4 with that corner's own
    /// normal, then interpolated ("we interpolate the computation from the triangle's vertices", Sec. 4.2). `None`
    /// as for [`tensor`](Self::tensor). Blended into the mean curvature within about one degree of a corner's normal.
    #[must_use]
    pub fn kappa_along(&self, point: SurfacePoint, w: Vec3) -> Option<f64> {
        self.interpolate(point, |principal| kappa_along(principal, &w))
    }

    /// The minimum curvature along the curve in which the plane of `w` and the point's normal cuts the surface, from the
    /// point onwards against `w` (the way a ray from the viewer travels), over an arc of `length` world units
    /// (Sec. 4.2, Fig. 2 b). `w` points to the viewer. See [`March`] for what is returned.
    ///
    /// Curvature on the way is taken along the curve. `None` where the starting triangle has no estimate. At normal
    /// incidence the plane is undefined and the result is the curvature at the point.
    #[must_use]
    pub fn minimum_past(&self, point: SurfacePoint, w: Vec3, length: f64) -> Option<March> {
        march::minimum_past(self, point, w, length)
    }

    pub(super) fn interpolate(&self, point: SurfacePoint, value: impl Fn(&Principal) -> f64) -> Option<f64> {
        let mut sum = (0.0, 0.0);
        for (principal, weight) in self.corner_estimates(point) {
            sum = (sum.0 + value(principal) * weight, sum.1 + weight);
        }
        (sum.1 > 0.0).then(|| sum.0 / sum.1)
    }

    /// The normal of the fitted surface, interpolated; not unit.
    pub(super) fn normal(&self, point: SurfacePoint) -> Vec3 {
        self.corner_estimates(point).map(|(principal, weight)| principal.normal() * weight).sum()
    }

    fn corner_estimates(&self, point: SurfacePoint) -> impl Iterator<Item = (&Principal, f64)> {
        let corners = self.surface.triangles()[point.triangle];
        let estimate = |(vertex, weight): (u32, f64)| {
            let principal = self.curvature[vertex as usize].principal.as_ref()?;
            (weight > 0.0).then_some((principal, weight))
        };
        corners.into_iter().zip(point.barycentric).filter_map(estimate)
    }

    pub(super) fn surface(&self) -> &Surface<'a> {
        &self.surface
    }

    pub(super) fn topology(&self) -> &Topology {
        &self.topology
    }
}

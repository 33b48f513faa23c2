//! [`Corners`]: the estimates that a point on a triangle is interpolated from.

use std::iter::Sum;
use std::ops::{Div, Mul};

use super::surface_field::{CurvatureField, SurfacePoint};
use crate::Vec3;
use crate::curvature::Principal;

/// The estimates at the corners of a point's triangle, at least one. Corners without an estimate, and those without a share in the point, are
/// left out, and the shares of the others scaled up.
#[derive(Debug, Clone, Copy)]
pub(super) struct Corners<'a> {
    corners: [Option<Corner<'a>>; 3],
    /// Of the corners that are left.
    weight: f64,
}

/// A corner that counts.
#[derive(Debug, Clone, Copy)]
struct Corner<'a> {
    estimate: &'a Principal,
    weight: f64,
}

impl<'a> Corners<'a> {
    /// `None` where no corner counts.
    #[inline]
    pub fn of(field: &'a CurvatureField<'_>, point: SurfacePoint) -> Option<Self> {
        let vertices = field.surface().triangles()[point.triangle];
        let corners = [0, 1, 2].map(|k| {
            let (vertex, weight) = (vertices[k], point.barycentric[k]);
            let estimate = field.principal(vertex).filter(|_| weight > 0.0)?;
            Some(Corner { estimate, weight })
        });
        let weight: f64 = corners.iter().flatten().map(|corner| corner.weight).sum();
        (weight > 0.0).then_some(Self { corners, weight })
    }

    /// Interpolates what `value` makes of an estimate.
    #[inline]
    pub fn mean<T: Sum + Mul<f64, Output = T> + Div<f64, Output = T>>(
        &self,
        value: impl Fn(&Principal) -> T,
    ) -> T {
        self.corners.iter().flatten().map(|corner| value(corner.estimate) * corner.weight).sum::<T>()
            / self.weight
    }

    /// The normal of the fitted surface; unit, `None` where the corners' normals cancel.
    #[inline]
    pub fn normal(&self) -> Option<Vec3> {
        self.mean(Principal::normal).try_normalize(0.0)
    }
}

//! [`CurvatureField`]: the estimates of a surface, asked at any of its points.

use std::borrow::Cow;
use std::sync::OnceLock;

use super::corners::Corners;
use super::direction::kappa_along;
use super::glance::Axes;
use super::march::{self, March};
use super::start::Start;
use super::vertex_bend::VertexBend;
use crate::curvature::{Principal, VertexCurvature};
use crate::mesh::{Surface, Topology};
use crate::{Mat3, Mesh, Vec3};

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
    /// Length of the bounding box's diagonal.
    diagonal: f64,
    /// UVs of the corners of every triangle; empty without.
    corner_uvs: Vec<[[f64; 2]; 3]>,
    /// Per vertex, for walks.
    bends: Vec<VertexBend>,
    /// Per vertex, for tables, once one is asked.
    axes: OnceLock<Vec<Axes>>,
    /// Bit `k` for every triangle: whether UV are others beyond its side `k`; empty without.
    uv_jumps: Vec<u8>,
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
        let diagonal = surface.bbox_diagonal();
        let bends =
            curvature.iter().map(|v| VertexBend::new(v.principal.as_ref(), length_unit(diagonal))).collect();
        Self {
            surface,
            curvature,
            topology,
            diagonal,
            bends,
            axes: OnceLock::new(),
            corner_uvs: Vec::new(),
            uv_jumps: Vec::new(),
        }
    }

    /// The same field with a UV set of the mesh that the surface was made of, for the chord's UV rate. Without such a set
    /// the field stays as it is.
    ///
    /// # Panics
    ///
    /// If `mesh` has not as many triangles as the surface.
    #[must_use]
    pub fn with_uv_set(mut self, mesh: &Mesh, set: usize) -> Self {
        assert_eq!(mesh.triangles().len(), self.surface.triangles().len(), "the mesh of the surface");
        if let Some(uvs) = mesh.uv_sets().get(set) {
            self.corner_uvs = mesh.triangles().iter().map(|t| t.map(|v| uvs[v as usize])).collect();
            self.uv_jumps = (0..self.corner_uvs.len()).map(|t| self.jumps_of(t)).collect();
        }
        self
    }

    fn jumps_of(&self, triangle: usize) -> u8 {
        let corners = |t: usize| std::iter::zip(self.surface.triangles()[t], self.corner_uvs[t]);
        let jumps = |side: usize| {
            let (next, _) = self.topology.across(triangle, side)?;
            let mut ends = corners(triangle).enumerate().filter(|&(k, _)| k != (side + 2) % 3);
            Some(ends.any(|(_, (v, uv))| corners(next).any(|(other, there)| other == v && there != uv)))
        };
        (0..3).filter(|&side| jumps(side) == Some(true)).map(|side| 1 << side).sum()
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
        Some(Corners::of(self, point)?.mean(Principal::tensor))
    }

    /// Curvature along the unit direction `w`: evaluated at each corner by the paper's eqs. 1 and 4 with that corner's own
    /// normal, then interpolated ("we interpolate the computation from the triangle's vertices", Sec. 4.2). `None`
    /// as for [`tensor`](Self::tensor). Blended into the mean curvature within about one degree of a corner's normal.
    #[must_use]
    pub fn kappa_along(&self, point: SurfacePoint, w: Vec3) -> Option<f64> {
        Some(Corners::of(self, point)?.mean(|principal| kappa_along(principal, &w)))
    }

    /// The minimum curvature along the curve in which the plane of `w` and the point's normal cuts the surface, from the
    /// point onwards against `w` (the way a ray from the viewer travels), over an arc of `length` world units
    /// (Sec. 4.2, Fig. 2 b). `w` points to the viewer. See [`March`] for what is returned.
    ///
    /// Curvature on the way is taken along the curve. `None` where the starting triangle has no estimate, or `w` has no
    /// direction. At normal incidence the plane is undefined and the result is the curvature at the point.
    #[must_use]
    pub fn minimum_past(&self, point: SurfacePoint, w: Vec3, length: f64) -> Option<March> {
        Some(march::minimum_past(self, &Start::new(self, point, w)?, length))
    }

    /// The unit normal of the fitted surface, interpolated: what filters measure a ray's elevation against. `None` where no
    /// corner has an estimate, or the corners' normals cancel.
    #[must_use]
    pub fn unit_normal(&self, point: SurfacePoint) -> Option<Vec3> {
        Corners::of(self, point)?.normal()
    }

    /// The estimate at a surface vertex.
    pub(super) fn principal(&self, vertex: u32) -> Option<&Principal> {
        self.curvature[vertex as usize].principal.as_ref()
    }

    /// How the surface is bent at a vertex; lengths in it are of [`Self::bend_scale`].
    pub(super) fn bend(&self, vertex: u32) -> &VertexBend {
        &self.bends[vertex as usize]
    }

    /// The estimates at the vertices in single precision; curvatures in them are those of [`Self::bend_scale`].
    #[inline]
    pub(super) fn axes(&self) -> &[Axes] {
        let scale = self.bend_scale();
        let narrow = || self.curvature.iter().map(|v| Axes::new(v.principal.as_ref(), scale)).collect();
        self.axes.get_or_init(narrow)
    }

    /// The length that curvatures of [`Self::bend`] are the inverse of.
    pub(super) fn bend_scale(&self) -> f64 {
        length_unit(self.diagonal)
    }

    /// UVs of a triangle's corners, if the field has any.
    pub(super) fn corner_uvs(&self, triangle: usize) -> Option<&[[f64; 2]; 3]> {
        self.corner_uvs.get(triangle)
    }

    /// Whether the UV of a triangle do not go on beyond this side of it.
    pub(super) fn uv_jumps(&self, triangle: usize, side: usize) -> bool {
        self.uv_jumps.get(triangle).is_some_and(|jumps| jumps >> side & 1 == 1)
    }

    /// Length of the bounding box's diagonal: no straight way within the surface is longer.
    #[must_use]
    pub fn diagonal(&self) -> f64 {
        self.diagonal
    }

    /// The surface that the estimates belong to.
    #[must_use]
    pub fn surface(&self) -> &Surface<'a> {
        &self.surface
    }

    pub(super) fn topology(&self) -> &Topology {
        &self.topology
    }
}

/// A length to measure a surface of this diagonal by; 1 for one without extent.
fn length_unit(diagonal: f64) -> f64 {
    if diagonal > 0.0 { diagonal } else { 1.0 }
}

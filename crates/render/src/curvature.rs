//! Curvature at a hit: interpolated tensors, and curvature along a direction.

use glam::Vec3;
use osculate_geom::curvature::VertexCurvature;

use crate::math::tangents;
use crate::present::FILTER;
use crate::scene::{MeshInstance, RayCurvature};

/// A point of an object: triangle within the object, and weights of its corners.
#[derive(Debug, Clone, Copy)]
pub(crate) struct ObjectPoint<'a> {
    pub object: &'a MeshInstance,
    pub triangle: usize,
    pub barycentrics: [f32; 3],
}

/// Principal curvatures at a point, in world units.
#[derive(Debug, Clone, Copy, PartialEq)]
pub(crate) struct PointCurvature {
    pub kappa_min: f32,
    pub kappa_max: f32,
    /// Interpolated error estimate.
    pub error: f32,
}

/// Curvature along a direction comes from too little information where its tangential part is shorter than the root of this,
/// relative to 1: there it turns into the mean curvature.
const NORMAL_INCIDENCE: f64 = 1e-4;

impl ObjectPoint<'_> {
    /// The tensor interpolated and projected onto the plane perpendicular to the world-space unit normal.
    ///
    /// Corners without an estimate are left out; `None` if they carry more than half of the weight.
    pub(crate) fn principal(&self, normal: Vec3) -> Option<PointCurvature> {
        let rotation = self.object.placement.rotation;
        let (t, b) = tangents((rotation.transpose() * normal).normalize());
        let (t, b) = (t.as_dvec3(), b.as_dvec3());
        let [mut tt, mut tb, mut bb, mut error] = [0.0; 4];
        self.blend(|weight, corner, principal| {
            let (d1, d2) = (
                glam::DVec3::from_slice(principal.d1.as_slice()),
                glam::DVec3::from_slice(principal.d2.as_slice()),
            );
            let along = |u: glam::DVec3, v: glam::DVec3| {
                principal.kappa_max * d1.dot(u) * d1.dot(v) + principal.kappa_min * d2.dot(u) * d2.dot(v)
            };
            tt += weight * along(t, t);
            tb += weight * along(t, b);
            bb += weight * along(b, b);
            error += weight * corner.error;
        })?;
        let (mean, difference) = (0.5 * (tt + bb), 0.5 * (tt - bb));
        let radius = difference.hypot(tb);
        let scaled = |kappa: f64| narrow(kappa / f64::from(self.object.placement.scale));
        Some(PointCurvature {
            kappa_min: scaled(mean - radius),
            kappa_max: scaled(mean + radius),
            error: scaled(error),
        })
    }

    /// Curvature along a world-space direction: at each corner `x^T T x / x^T x` with the direction's tangential part `x`
    /// (Kuznetsov et al. 2022, equations 1 and 4), then interpolated. From the object's field if it has one.
    pub(crate) fn along(&self, direction: Vec3) -> Option<f32> {
        let placement = &self.object.placement;
        let w = placement.rotation.transpose() * direction;
        if let Some(field) = &self.object.field {
            return field.along(self.triangle, self.barycentrics, w).map(|kappa| kappa / placement.scale);
        }
        let w = osculate_geom::Vec3::new(w.x.into(), w.y.into(), w.z.into()).normalize();
        let mut kappa = 0.0;
        self.blend(|weight, _, principal| {
            let (a, b) = (principal.d1.dot(&w), principal.d2.dot(&w));
            let along = principal.kappa_max * a * a + principal.kappa_min * b * b;
            let regularised =
                (along + NORMAL_INCIDENCE * principal.mean()) / (a * a + b * b + NORMAL_INCIDENCE);
            kappa += weight * regularised;
        })?;
        Some(narrow(kappa / f64::from(placement.scale)))
    }

    /// What the object's filter makes of a ray that comes from this world-space direction; without a field the curvature
    /// along it.
    pub(crate) fn ask(&self, direction: Vec3) -> Option<RayCurvature> {
        let placement = &self.object.placement;
        let Some(field) = &self.object.field else {
            return self.along(direction).map(|kappa| RayCurvature { kappa, across: None, uv_rate: None });
        };
        let w = placement.rotation.transpose() * direction;
        let answer = if FILTER {
            field.ask(self.triangle, self.barycentrics, w)?
        } else {
            field.at_point(self.triangle, self.barycentrics, w)?
        };
        Some(RayCurvature {
            kappa: answer.kappa / placement.scale,
            across: answer.across.map(|kappa| kappa / placement.scale),
            uv_rate: answer.uv_rate.map(|rate| rate.map(|q| q / placement.scale)),
        })
    }

    /// The filtered curvature along a world-space direction, if the object's field offers it.
    pub(crate) fn filtered(&self, direction: Vec3) -> Option<f32> {
        let placement = &self.object.placement;
        let w = placement.rotation.transpose() * direction;
        let field = self.object.field.as_ref()?;
        field.filtered(self.triangle, self.barycentrics, w).map(|kappa| kappa / placement.scale)
    }

    /// Calls `add` with the weight of each corner that has an estimate; the weights sum to 1.
    fn blend(
        &self,
        mut add: impl FnMut(f64, &VertexCurvature, &osculate_geom::curvature::Principal),
    ) -> Option<()> {
        let curvature = self.object.curvature.as_ref()?;
        let corners = self.object.mesh.triangles()[self.triangle];
        let known = |i: usize| curvature[corners[i] as usize].principal.is_some();
        let weight = |i: usize| f64::from(self.barycentrics[i].max(0.0));
        let total: f64 = (0..3).filter(|&i| known(i)).map(weight).sum();
        let all: f64 = (0..3).map(weight).sum();
        if total < 0.5 * all {
            return None;
        }
        for i in 0..3 {
            let corner = &curvature[corners[i] as usize];
            if let Some(principal) = &corner.principal {
                add(weight(i) / total, corner, principal);
            }
        }
        Some(())
    }

    /// A value per mesh vertex, interpolated; `None` if corners with NaN carry more than half of the weight.
    pub(crate) fn interpolate(&self, values: &[f32]) -> Option<f32> {
        let corners = self.object.mesh.triangles()[self.triangle];
        let (mut sum, mut known, mut all) = (0.0, 0.0, 0.0);
        for (corner, weight) in corners.into_iter().zip(self.barycentrics) {
            let value = values[corner as usize];
            all += weight;
            if !value.is_nan() {
                sum += weight * value;
                known += weight;
            }
        }
        (known >= 0.5 * all && known > 0.0).then(|| sum / known)
    }
}

#[allow(clippy::cast_possible_truncation, reason = "pictures are f32")]
fn narrow(x: f64) -> f32 {
    x as f32
}

/// Principal curvatures of all subjects' vertices in world units, for choosing a range: `(kappa_min, kappa_max, error)`.
pub(crate) fn vertex_curvatures(object: &MeshInstance) -> impl Iterator<Item = PointCurvature> + '_ {
    let scale = 1.0 / f64::from(object.placement.scale);
    object.curvature.iter().flat_map(|c| c.iter()).filter_map(move |vertex| {
        let principal = vertex.principal?;
        Some(PointCurvature {
            kappa_min: narrow(principal.kappa_min * scale),
            kappa_max: narrow(principal.kappa_max * scale),
            error: narrow(vertex.error * scale),
        })
    })
}

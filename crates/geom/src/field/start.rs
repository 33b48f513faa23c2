//! What every filter asks first: the ray's frame at its starting point, and the curvature there.

use super::corners::Corners;
use super::direction::{NORMAL_INCIDENCE_SINE, section_curvature, unit};
use super::section::Section;
use super::surface_field::{CurvatureField, SurfacePoint};
use crate::Vec3;

/// A ray at the point where it enters the surface.
#[derive(Debug, Clone, Copy)]
pub(super) struct Start {
    pub point: SurfacePoint,
    /// Unit normal of the fitted surface, interpolated; zero where the corners' normals cancel.
    pub normal: Vec3,
    /// Cosine between the direction to the viewer and the normal, 0 where it is below the horizon.
    pub cosine: f64,
    /// Unit direction to the viewer.
    w: Vec3,
    /// The plane of ray and normal; `None` at normal incidence.
    pub section: Option<StartSection>,
    /// Twice the mean curvature.
    sum_of_principals: f64,
}

/// The plane in which the ray travels.
#[derive(Debug, Clone, Copy)]
pub(super) struct StartSection {
    pub plane: Section,
    /// Unit, tangential, the way the ray travels.
    pub forward: Vec3,
    /// Curvature of the section at the point.
    pub kappa: f64,
}

impl Start {
    /// `None` if no corner has an estimate, or `w` has no direction.
    pub fn new(field: &CurvatureField<'_>, point: SurfacePoint, w: Vec3) -> Option<Self> {
        let w = unit(&w)?;
        let corners = Corners::of(field, point)?;
        let normal = corners.normal().unwrap_or_default();
        let cosine = normal.dot(&w).clamp(0.0, 1.0);
        let tangential = normal * normal.dot(&w) - w;
        // Far below the sine where the point's own curvature is blended, the azimuth of the plane carries no information.
        let has_plane = normal != Vec3::zeros() && tangential.norm() >= NORMAL_INCIDENCE_SINE * 1e-6;
        let section = has_plane.then(|| {
            let forward = tangential.normalize();
            let plane = Section { origin: field.position(point), normal: normal.cross(&forward).normalize() };
            let kappa = corners.mean(|principal| section_curvature(principal, &plane.normal));
            StartSection { plane, forward, kappa }
        });
        let sum_of_principals = corners.mean(|principal| principal.kappa_max + principal.kappa_min);
        Some(Self { point, normal, cosine, w, section, sum_of_principals })
    }

    /// The ray in the same plane that comes in at another cosine; one without a plane stays as it is.
    pub fn at_cosine(&self, cosine: f64) -> Self {
        let Some(section) = &self.section else { return *self };
        let w = self.normal * cosine - section.forward * (1.0 - cosine * cosine).max(0.0).sqrt();
        Self { cosine, w, ..*self }
    }

    /// Curvature along the ray (Kuznetsov et al. 2022, eqs. 1 and 4).
    pub fn along(&self, field: &CurvatureField<'_>) -> f64 {
        field.kappa_along(self.point, self.w).expect("a corner has an estimate")
    }

    /// Curvature across the plane of the section, by Euler's theorem; the mean curvature where there is no plane.
    pub fn across(&self) -> f64 {
        let sum = self.sum_of_principals;
        self.section.map_or(sum / 2.0, |section| sum - section.kappa)
    }

    /// The curvature before any walk: the lesser of the curvature along the ray and that of the section.
    ///
    /// The two differ where the corners' normals do, because the first projects the ray at each corner.
    pub fn kappa(&self, field: &CurvatureField<'_>) -> f64 {
        let along = self.along(field);
        self.section.map_or(along, |section| along.min(section.kappa))
    }
}

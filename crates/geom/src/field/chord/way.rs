//! [`Way`]: what all rays share that enter at a point in one plane.

use std::cell::Cell;

use super::lift::{Patch, lift_on_side};
use crate::Vec3;
use crate::field::section::{Beginning, SideEnd};
use crate::field::start::{Start, StartSection};
use crate::field::surface_field::CurvatureField;
use crate::field::trail::Trail;

/// A point of the lifted section.
#[derive(Debug, Clone, Copy)]
pub(super) struct SectionPoint {
    pub position: Vec3,
    /// The surface normal, as far as it lies in the plane; unit.
    pub normal: Vec3,
    /// Curvature of the section as a plane curve, where an end of the side has an estimate.
    pub kappa: Option<f64>,
}

/// The section, as far as it is known, and where it begins.
pub(in crate::field) struct Way<'a, 'f> {
    pub(super) trail: Trail<'a, 'f>,
    plane_normal: Vec3,
    /// Where rays enter, on the lifted section.
    pub(super) origin: Vec3,
    /// Of the lifted section there; unit, like the direction out of the surface.
    pub(super) tangent: Vec3,
    pub(super) up: Vec3,
    /// The first triangle's longest side.
    pub(super) side: f64,
    /// By the number of the crossing, in order.
    points: Vec<(usize, SectionPoint)>,
}

thread_local! {
    /// Memory of the last way's points, for the next.
    static SPARE: Cell<Vec<(usize, SectionPoint)>> = const { Cell::new(Vec::new()) };
}

impl Drop for Way<'_, '_> {
    fn drop(&mut self) {
        SPARE.set(std::mem::take(&mut self.points));
    }
}

impl<'a, 'f> Way<'a, 'f> {
    /// From a point whose section begins with a piece that has a direction.
    pub fn new(field: &'a CurvatureField<'f>, start: &Start, at: &StartSection, begun: &Beginning) -> Self {
        let mut points = SPARE.take();
        points.clear();
        let piece = &begun.piece;
        let patch = Patch::new(field, piece.from.triangle);
        let tangent = patch.lifted_tangent(start.normal, piece).unwrap_or(at.forward);
        Self {
            trail: Trail::new(field, begun),
            plane_normal: at.plane.normal,
            origin: at.plane.origin + start.normal * patch.lift(piece.from.barycentric),
            tangent,
            // The plane normal is `n x forward`, so crossing it with the tangent gives the outward side.
            up: tangent.cross(&at.plane.normal),
            side: patch.longest_side,
            points,
        }
    }

    /// The lifted section at a crossing of the trail.
    pub(super) fn point(&mut self, crossing: usize) -> SectionPoint {
        match self.points.binary_search_by_key(&crossing, |(known, _)| *known) {
            Ok(at) => self.points[at].1,
            Err(at) => {
                let position = self.trail.known()[crossing].position;
                let point = self.lifted(&position, &self.trail.ends(crossing));
                self.points.insert(at, (crossing, point));
                point
            }
        }
    }

    fn lifted(&self, position: &Vec3, ends: &[SideEnd; 2]) -> SectionPoint {
        let field = self.trail.field();
        let (mut sum, mut kappa, mut weight) = (Vec3::zeros(), 0.0, 0.0);
        for end in ends {
            let bend = field.bend(end.vertex);
            if bend.is_known {
                sum += bend.normal() * end.weight;
                kappa += bend.section(&self.plane_normal) * end.weight;
                weight += end.weight;
            }
        }
        let sum = if sum == Vec3::zeros() { self.up } else { sum };
        let in_plane = sum - self.plane_normal * self.plane_normal.dot(&sum);
        let kappa = kappa / (weight * field.bend_scale());
        let (whole, inside) = (sum.norm(), in_plane.norm());
        // A section that grazes the surface runs along it: the lift's way to the patch within the plane has no limit there.
        let lift = lift_on_side(field, ends);
        let (unit, lift, per_sine) = if inside > LEAST_SINE * whole {
            let inverse = 1.0 / inside;
            let per_sine = whole * inverse;
            (in_plane * inverse, lift * per_sine, per_sine)
        } else {
            let unit = in_plane.try_normalize(0.0).unwrap_or(self.up);
            (unit, lift * (inside / whole) / (LEAST_SINE * LEAST_SINE), 1.0 / LEAST_SINE)
        };
        SectionPoint {
            position: position + unit * lift,
            normal: unit,
            // Meusnier: a section that cuts the surface askew is bent more than the surface.
            kappa: (weight > 0.0).then_some(kappa * per_sine),
        }
    }
}

/// Sine between section plane and surface below which the lift is not followed further: the root of 1 / 20.
const LEAST_SINE: f64 = 0.223_606_797_749_979;

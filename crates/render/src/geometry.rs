//! [`Geometry`]: all triangles of a scene, those of meshes that stand in one place and those of meshes that stand in several.
//!
//! Triangles are numbered through: first those of objects that are alone with their mesh, then those of the area lights, then those
//! of instances, each with its own numbers. So a hit names its instance, and a scene without instances costs nothing for them.

use std::sync::Arc;

use glam::Vec3;
use osculate_geom::rays::{Bvh, Hit, Instances, Ray, Similarity, SurfacePoint};

use crate::scene::Placement;

/// An object that shares its mesh.
#[derive(Debug, Clone)]
pub(crate) struct Placed {
    /// Number of its first triangle.
    pub first: u32,
    /// Which object it is.
    pub object: usize,
    /// Where its mesh's triangles begin in the tables of [`Prepared`](crate::prepared::Prepared).
    pub row: usize,
    /// The material of all of it; otherwise the mesh's own.
    pub material: Option<u32>,
    pub mesh: Arc<Bvh>,
    pub place: Similarity,
}

/// All triangles of a scene.
#[derive(Debug)]
pub(crate) struct Geometry {
    /// Of objects that are alone with their mesh, and of area lights; in the world.
    flat: Bvh,
    /// In ascending order of their numbers.
    placed: Vec<Placed>,
    instances: Instances,
}

impl Geometry {
    pub(crate) fn new(flat: Vec<[Vec3; 3]>, placed: Vec<Placed>) -> Self {
        let instances = Instances::new(placed.iter().map(|p| (p.mesh.clone(), p.place)).collect());
        Self { flat: Bvh::new(flat), placed, instances }
    }

    /// The nearest hit.
    #[inline]
    pub(crate) fn closest_hit(&self, ray: &Ray) -> Option<Hit> {
        let flat = self.flat.closest_hit(ray);
        if self.placed.is_empty() { flat } else { self.closest_of_both(ray, flat) }
    }

    /// The nearest hits of many rays: fastest where those that follow each other go much the same way.
    pub(crate) fn closest_hits(&self, rays: impl Iterator<Item = Ray>) -> Vec<Option<Hit>> {
        let rays: Vec<Ray> = rays.collect();
        let mut hits = vec![None; rays.len()];
        self.flat.closest_hits(&rays, &mut hits);
        if !self.placed.is_empty() {
            let before: Vec<Ray> = rays.iter().zip(&hits).map(|(ray, &flat)| up_to(ray, flat)).collect();
            let mut placed = vec![None; rays.len()];
            self.instances.closest_hits(&before, &mut placed);
            for (hit, placed) in hits.iter_mut().zip(placed) {
                *hit = self.nearer(*hit, placed);
            }
        }
        hits
    }

    /// Whether anything is hit, for many rays.
    pub(crate) fn any_hits(&self, rays: impl Iterator<Item = Ray>) -> Vec<bool> {
        let rays: Vec<Ray> = rays.collect();
        let mut any = vec![false; rays.len()];
        self.flat.any_hits(&rays, &mut any);
        if !self.placed.is_empty() {
            let mut placed = vec![false; rays.len()];
            self.instances.any_hits(&rays, &mut placed);
            any.iter_mut().zip(placed).for_each(|(any, placed)| *any |= placed);
        }
        any
    }

    #[inline(never)]
    fn closest_of_both(&self, ray: &Ray, flat: Option<Hit>) -> Option<Hit> {
        self.nearer(flat, self.instances.closest_hit(&up_to(ray, flat)))
    }

    /// Of a hit and that of an instance; the first of two at the same distance.
    fn nearer(&self, flat: Option<Hit>, placed: Option<(usize, Hit)>) -> Option<Hit> {
        let Some((instance, hit)) = placed else { return flat };
        if flat.is_some_and(|flat| flat.t <= hit.t) {
            return flat;
        }
        Some(Hit { triangle: self.placed[instance].first + hit.triangle, ..hit })
    }

    /// Whether anything is hit.
    #[inline]
    pub(crate) fn any_hit(&self, ray: &Ray) -> bool {
        self.flat.any_hit(ray) || (!self.placed.is_empty() && self.instances.any_hit(ray))
    }

    /// The instance that a triangle belongs to, and its number there.
    #[inline]
    pub(crate) fn placed(&self, triangle: u32) -> Option<(&Placed, usize)> {
        let last = self.placed.partition_point(|p| p.first <= triangle).checked_sub(1)?;
        let placed = &self.placed[last];
        Some((placed, (triangle - placed.first) as usize))
    }

    /// Corners of a triangle in the world.
    #[inline]
    pub(crate) fn corners(&self, triangle: u32) -> [Vec3; 3] {
        match self.placed(triangle) {
            None => self.flat.triangles()[triangle as usize],
            Some((placed, triangle)) => {
                placed.mesh.triangles()[triangle].map(|p| placed.place.world_from_object(p))
            }
        }
    }

    /// The point of a hit, with its error bound and the triangle's normal.
    #[inline(always)]
    pub(crate) fn surface_point(&self, hit: &Hit) -> SurfacePoint {
        let mut point = SurfacePoint::new(self.corners(hit.triangle), hit.barycentrics);
        if let Some((placed, _)) = self.placed(hit.triangle) {
            point.error += placed.place.rounding(point.position);
        }
        point
    }
}

/// The part of a ray before a hit.
fn up_to(ray: &Ray, hit: Option<Hit>) -> Ray {
    Ray { t_max: hit.map_or(ray.t_max, |hit| hit.t), ..*ray }
}

impl From<Placement> for Similarity {
    fn from(placement: Placement) -> Self {
        let Placement { rotation, scale, translation } = placement;
        Self { rotation, scale, translation }
    }
}

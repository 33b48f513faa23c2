//! [`coverage`]: what of a picture the subjects cover, from geometry and opacity, whatever the light.

use osculate_geom::rays::Ray;
use rayon::prelude::*;

use crate::camera::Camera;
use crate::counters::Counters;
use crate::integrator::plain_opacity;
use crate::prepared::{Prepared, SceneError};
use crate::scene::{Role, Scene};
use crate::silhouette::{Met, Purpose};

/// Which samples of a picture are covered.
#[derive(Debug, Clone, PartialEq, Eq)]
pub struct Mask {
    width: u32,
    height: u32,
    covered: Vec<bool>,
}

impl Mask {
    /// Columns and rows.
    #[must_use]
    pub fn size(&self) -> [u32; 2] {
        [self.width, self.height]
    }

    /// All samples, row by row from the top.
    #[must_use]
    pub fn covered(&self) -> &[bool] {
        &self.covered
    }
}

/// Casts one ray through the centre of every pixel, from each of the cameras in turn. A pixel is covered if the ray is stopped by a subject; surfaces
/// whose opacity for the ray is below one half are passed, as are the backs of bounding surfaces. No random numbers: the same
/// scene gives the same masks.
///
/// For several samples a pixel, ask for larger pictures. The scene's own camera is not used.
///
/// # Errors
///
/// A scene that cannot be rendered.
pub fn coverage(scene: &Scene, cameras: &[Camera]) -> Result<Vec<Mask>, SceneError> {
    let (width, height) = (scene.width, scene.height);
    if !(1..=32768).contains(&width) || !(1..=32768).contains(&height) {
        return Err(SceneError::ImageSize { width, height });
    }
    let prepared = Prepared::new(scene)?;
    let mask = |camera: &Camera| {
        let is_covered = |x: u32, y: u32| {
            let at = |i: u32| i as f32 + 0.5;
            let ray = camera.pinhole_ray(at(x), at(y), width as f32, height as f32);
            is_stopped(&prepared, Ray::new(ray.origin, ray.direction))
        };
        let row = |y: u32| (0..width).map(|x| is_covered(x, y)).collect::<Vec<_>>();
        let rows: Vec<Vec<bool>> = (0..height).into_par_iter().map(row).collect();
        Mask { width, height, covered: rows.concat() }
    };
    Ok(cameras.iter().map(mask).collect())
}

fn is_stopped(scene: &Prepared, mut ray: Ray) -> bool {
    let mut counters = Counters::default();
    while let Some(hit) = scene.geometry.closest_hit(&ray) {
        let Some((object, _)) = scene.object_of(hit.triangle) else { return false };
        let opacity = match Met::new(scene, &hit, -ray.direction, Purpose::Shadow, &mut counters) {
            Some(Met::Back) => 0.0,
            Some(Met::Opaque) => 1.0,
            Some(Met::Front(point)) => point.alpha(&mut counters),
            None => plain_opacity(scene, &hit),
        };
        if opacity >= 0.5 {
            return scene.objects[object].role == Role::Subject;
        }
        ray.origin = scene.geometry.surface_point(&hit).origin_towards(ray.direction);
    }
    false
}

//! Pictures of microstructures, to look at: an orthographic camera over a few tiles, a sun with shadows, a sky with ambient
//! occlusion. Single scattering; not the reference that models are judged by.

mod field;
mod mesh;
mod shade;

use glam::{Vec2, Vec3};
use rayon::prelude::*;

use super::{Geometry, Microstructure, Reflectance};
use field::FieldScene;
use mesh::MeshScene;

/// How a picture is taken.
#[derive(Debug, Clone, Copy, PartialEq)]
pub struct PreviewOptions {
    /// Pixels along each side (256).
    pub size: usize,
    /// Tiles along each side (2, so that seams would show).
    pub tiles: f32,
    /// Angle between the camera's direction and the normal, in radians (0.6); below a right angle.
    pub tilt: f32,
    /// Unit direction to the sun (from the upper left, 40 degrees above the surface).
    pub sun: Vec3,
}

impl Default for PreviewOptions {
    fn default() -> Self {
        Self { size: 256, tiles: 2.0, tilt: 0.6, sun: Vec3::new(-0.6, 0.48, 0.64) }
    }
}

/// What a ray hits.
#[derive(Debug, Clone, Copy)]
struct Surface {
    position: Vec3,
    normal: Vec3,
    reflectance: Reflectance,
}

/// Geometry that repeats over the plane.
trait Scene: Sync {
    /// The first hit of a ray that starts above or in the material.
    fn hit(&self, origin: Vec3, direction: Vec3) -> Option<Surface>;
    /// Whether anything is in the way between a point of the surface and the sky.
    fn shadowed(&self, from: &Surface, direction: Vec3) -> bool;
}

/// Takes a picture: linear RGB row by row, the top row first. A chequered ground lies under see-through materials.
///
/// # Panics
///
/// If the tilt is not in `[0, pi / 2)`.
#[must_use]
pub fn preview(micro: &Microstructure, options: &PreviewOptions) -> Vec<Vec3> {
    assert!((0.0..std::f32::consts::FRAC_PI_2).contains(&options.tilt), "a camera above the surface");
    match &micro.geometry {
        Geometry::HeightField(field) => take(&FieldScene::new(field), options),
        Geometry::TileMesh(mesh) => take(&MeshScene::new(mesh, options), options),
    }
}

fn take(scene: &impl Scene, options: &PreviewOptions) -> Vec<Vec3> {
    let size = options.size;
    (0..size * size).into_par_iter().map(|i| pixel(scene, options, i % size, i / size)).collect()
}

/// Mean of two by two rays.
fn pixel(scene: &impl Scene, options: &PreviewOptions, column: usize, row: usize) -> Vec3 {
    let (sin, cos) = options.tilt.sin_cos();
    let towards_camera = Vec3::new(0.0, -sin, cos);
    let up = Vec3::new(0.0, cos, sin);
    let mut sum = Vec3::ZERO;
    for (i, shift) in [(0.25, 0.25), (0.75, 0.25), (0.25, 0.75), (0.75, 0.75)].into_iter().enumerate() {
        let film = (Vec2::new(column as f32, (options.size - 1 - row) as f32) + Vec2::from(shift))
            / options.size as f32;
        let film = (film - 0.5) * options.tiles;
        // On the plane z = 0, on the line of sight of this point of the film.
        let on_film = Vec3::new(film.x, 0.0, 0.0) + film.y * up;
        let entry = on_film - towards_camera * (on_film.z / towards_camera.z);
        // A rotation of the sky's directions per pixel and ray, so that its few samples do not band.
        let seed = ((row * options.size + column) * 4 + i) as u64;
        sum += shade::radiance(scene, options, entry, -towards_camera, seed);
    }
    sum / 4.0
}

//! Tile meshes, traced.

use glam::{Vec3, Vec3Swizzles};
use osculate_geom::rays::{Bvh, Ray};

use super::{PreviewOptions, Scene, Surface};
use crate::micro::TileMesh;

/// The copies of a tile mesh's triangles that a picture can show.
pub(super) struct MeshScene<'a> {
    mesh: &'a TileMesh,
    bvh: Bvh,
    /// Which triangle of the tile each one is a copy of.
    sources: Vec<usize>,
}

impl<'a> MeshScene<'a> {
    pub(super) fn new(mesh: &'a TileMesh, options: &PreviewOptions) -> Self {
        // Half the film, foreshortened, and room for what casts shadows into the picture.
        let half = 0.5 * options.tiles / options.tilt.cos() + 3.0 * mesh.depth();
        let (low, high) = mesh.uv_range();
        let (first, last) = ((-half - high).ceil(), (half - low).floor());
        let (mut triangles, mut sources) = (Vec::new(), Vec::new());
        for y in whole_numbers(first.y, last.y) {
            for x in whole_numbers(first.x, last.x) {
                let shift = Vec3::new(x, y, 0.0);
                for (source, triangle) in mesh.triangles().iter().enumerate() {
                    let corners = triangle.vertices.map(|v| mesh.positions()[v as usize] + shift);
                    if corners.iter().any(|p| p.xy().abs().max_element() <= half) {
                        triangles.push(corners);
                        sources.push(source);
                    }
                }
            }
        }
        Self { mesh, bvh: Bvh::new(triangles), sources }
    }
}

fn whole_numbers(first: f32, last: f32) -> impl Iterator<Item = f32> {
    std::iter::successors(Some(first), |x| Some(x + 1.0)).take_while(move |&x| x <= last)
}

impl Scene for MeshScene<'_> {
    fn hit(&self, origin: Vec3, direction: Vec3) -> Option<Surface> {
        let hit = self.bvh.closest_hit(&Ray::new(origin - direction, direction))?;
        let position = self.bvh.surface_point(&hit).position;
        let source = self.sources[hit.triangle as usize];
        let normal = self.mesh.normal(source, hit.barycentrics);
        // Both sides reflect.
        let normal = if normal.dot(direction) > 0.0 { -normal } else { normal };
        Some(Surface { position, normal, reflectance: self.mesh.reflectance(source, hit.barycentrics) })
    }

    fn shadowed(&self, from: &Surface, direction: Vec3) -> bool {
        // Off the facets of what is meant to be smooth.
        let origin = from.position + from.normal * (0.01 * self.mesh.depth());
        self.bvh.any_hit(&Ray::new(origin, direction))
    }
}

//! Curvature along directions for the renderer, from the estimator's own interpolation.

use std::sync::Arc;

use glam::Vec3;
use osculate_geom::Mesh;
use osculate_geom::curvature::VertexCurvature;
use osculate_geom::field::{CurvatureField, SurfacePoint};
use osculate_geom::mesh::{Surface, Weld};
use osculate_render::scene::DirectionalCurvature;

/// A field that owns its surface.
#[derive(Debug)]
pub struct OwnedField {
    field: CurvatureField<'static>,
    /// Length of the filter's walk, world units.
    length: f64,
}

impl OwnedField {
    /// The field of a mesh whose curvature is given per mesh vertex.
    pub fn shared(mesh: &Mesh, curvature: &[VertexCurvature], length: f64) -> Arc<dyn DirectionalCurvature> {
        let surface = Surface::new(mesh, Weld::Exact).into_owned();
        let mut on_surface = vec![None; surface.positions().len()];
        for (vertex, &estimate) in curvature.iter().enumerate() {
            on_surface[surface.surface_from_vertex(vertex)].get_or_insert(estimate);
        }
        let on_surface: Vec<_> =
            on_surface.into_iter().map(|c| c.expect("every surface vertex has a mesh vertex")).collect();
        Arc::new(Self { field: CurvatureField::new(surface, on_surface), length })
    }
}

fn point(triangle: usize, barycentrics: [f32; 3]) -> SurfacePoint {
    SurfacePoint { triangle, barycentric: barycentrics.map(f64::from) }
}

fn widen(v: Vec3) -> osculate_geom::Vec3 {
    osculate_geom::Vec3::new(v.x.into(), v.y.into(), v.z.into()).normalize()
}

#[expect(clippy::cast_possible_truncation, reason = "pictures are f32")]
fn narrow(kappa: f64) -> f32 {
    kappa as f32
}

impl DirectionalCurvature for OwnedField {
    fn along(&self, triangle: usize, barycentrics: [f32; 3], direction: Vec3) -> Option<f32> {
        self.field.kappa_along(point(triangle, barycentrics), widen(direction)).map(narrow)
    }

    fn filtered(&self, triangle: usize, barycentrics: [f32; 3], direction: Vec3) -> Option<f32> {
        let march = self.field.minimum_past(point(triangle, barycentrics), widen(direction), self.length)?;
        Some(narrow(march.kappa))
    }
}

//! Curvature along directions for the renderer, from the estimator's own interpolation.

use std::sync::Arc;

use glam::Vec3;
use osculate_geom::Mesh;
use osculate_geom::bake::BakedMesh;
use osculate_geom::curvature::VertexCurvature;
use osculate_geom::field::{
    BakedChord, BakedMinimum, CurvatureField, Filter, FilterKind, FilterQuery, SurfacePoint, WalkLength,
};
use osculate_geom::mesh::{Surface, Weld};
use osculate_render::scene::{DirectionalCurvature, RayCurvature};

/// A field that owns its surface.
#[derive(Debug)]
pub struct OwnedField {
    field: CurvatureField<'static>,
    filter: Filter,
    walk: WalkLength,
}

/// Largest error of a walk that is left out, as a share of 1 / diagonal: far below what any material can show.
const SKIP_SHARE: f64 = 1e-3;
/// Directions per vertex of a table of the minimum that no file has.
const AZIMUTHS: usize = 16;

impl OwnedField {
    /// The field of a mesh whose curvature is given per mesh vertex. `walk`: how far the filter looks, by default as far as
    /// a ray can be in a material of the usual depth.
    pub fn of_mesh(
        mesh: &Mesh,
        weld: Weld,
        curvature: &[VertexCurvature],
        filter: FilterKind,
        walk: Option<WalkLength>,
    ) -> Self {
        let (field, walk) = field_of(mesh, weld, curvature, walk);
        let filter = made(&field, filter, walk);
        Self { field, filter, walk }
    }

    /// The field of a baked mesh, with what was baked of the filter where that looks as far as is wanted.
    pub fn of_baked(baked: &BakedMesh, filter: FilterKind, walk: Option<WalkLength>) -> Self {
        let record = baked.provenance.filter;
        let weld = baked.provenance.weld;
        // A table knows one elevation; a walk takes the ray's own.
        let walk = walk.or(record.map(|record| match record.walk {
            WalkLength::ShellAt { depth, .. } => WalkLength::Shell { depth },
            other => other,
        }));
        let Some((rows, record)) = baked.filter().zip(record) else {
            return Self::of_mesh(baked.mesh(), weld, baked.curvature(), filter, walk);
        };
        let (field, walk) = field_of(baked.mesh(), weld, baked.curvature(), walk);
        let filter = match filter {
            FilterKind::Baked if walk.for_table().is_about(&record.walk) => {
                Filter::Baked(Arc::new(rows.minimum(field.surface(), record.walk)))
            }
            FilterKind::March => Filter::MarchWithin {
                bounds: Arc::new(rows.bounds(field.surface(), record.bound_length)),
                tolerance: SKIP_SHARE / field.diagonal(),
            },
            other => made(&field, other, walk),
        };
        Self { field, filter, walk }
    }

    /// What a filter makes of a ray that comes from this direction.
    #[inline]
    fn filtered_by(&self, filter: &Filter, point: SurfacePoint, direction: Vec3) -> Option<RayCurvature> {
        let query = FilterQuery { point, w: widen(direction), length: self.walk };
        let answer = filter.ask(&self.field, &query)?;
        Some(RayCurvature {
            kappa: narrow(answer.kappa),
            across: Some(narrow(answer.across)),
            uv_rate: answer.uv_rate.map(|q| q.map(narrow)),
        })
    }

    /// Makes the whole of a table that is otherwise made where it is asked for.
    pub fn fill_table(&self) {
        match &self.filter {
            Filter::Baked(table) => table.fill(&self.field),
            Filter::BakedChord(table) => table.fill(&self.field),
            _ => {}
        }
    }

    /// Bytes of the filter's table, if it has one.
    pub fn table_bytes(&self) -> usize {
        self.filter.table_bytes()
    }

    /// For a scene.
    pub fn shared(self) -> Arc<dyn DirectionalCurvature> {
        Arc::new(self)
    }
}

/// A filter that nothing was baked for.
fn made(field: &CurvatureField<'_>, filter: FilterKind, walk: WalkLength) -> Filter {
    match filter {
        FilterKind::Point => Filter::Point,
        FilterKind::March => Filter::March,
        FilterKind::Baked => Filter::Baked(Arc::new(BakedMinimum::on_demand(field, AZIMUTHS, walk))),
        FilterKind::Chord => Filter::Chord,
        FilterKind::BakedChord => {
            Filter::BakedChord(Arc::new(BakedChord::on_demand(field, BakedChord::AZIMUTHS, walk)))
        }
    }
}

/// The field of a mesh whose curvature is given per mesh vertex, and how far filters look.
fn field_of(
    mesh: &Mesh,
    weld: Weld,
    curvature: &[VertexCurvature],
    walk: Option<WalkLength>,
) -> (CurvatureField<'static>, WalkLength) {
    let surface = Surface::new(mesh, weld).into_owned();
    let mut on_surface = vec![None; surface.positions().len()];
    for (vertex, &estimate) in curvature.iter().enumerate() {
        on_surface[surface.surface_from_vertex(vertex)].get_or_insert(estimate);
    }
    let on_surface: Vec<_> =
        on_surface.into_iter().map(|c| c.expect("every surface vertex has a mesh vertex")).collect();
    let field = CurvatureField::new(surface, on_surface).with_uv_set(mesh, 0);
    let walk = walk.unwrap_or_else(|| WalkLength::of_mesh(field.diagonal()));
    (field, walk)
}

fn point(triangle: usize, barycentrics: [f32; 3]) -> SurfacePoint {
    SurfacePoint { triangle, barycentric: barycentrics.map(f64::from) }
}

fn widen(v: Vec3) -> osculate_geom::Vec3 {
    osculate_geom::Vec3::new(v.x.into(), v.y.into(), v.z.into())
}

#[expect(clippy::cast_possible_truncation, reason = "pictures are f32")]
fn narrow(kappa: f64) -> f32 {
    kappa as f32
}

impl DirectionalCurvature for OwnedField {
    fn along(&self, triangle: usize, barycentrics: [f32; 3], direction: Vec3) -> Option<f32> {
        self.field.kappa_along(point(triangle, barycentrics), widen(direction).normalize()).map(narrow)
    }

    fn ask(&self, triangle: usize, barycentrics: [f32; 3], direction: Vec3) -> Option<RayCurvature> {
        self.filtered_by(&self.filter, point(triangle, barycentrics), direction)
    }

    fn at_point(&self, triangle: usize, barycentrics: [f32; 3], direction: Vec3) -> Option<RayCurvature> {
        self.filtered_by(&Filter::Point, point(triangle, barycentrics), direction)
    }

    fn filter(&self) -> FilterKind {
        self.filter.kind()
    }
}

#[cfg(test)]
mod tests {
    use super::*;
    use osculate_geom::curvature::{CurvatureOptions, estimate};
    use osculate_geom::shapes;

    /// What a build without filters has of every field.
    #[test]
    fn at_the_point_every_field_says_what_the_point_filter_does() {
        let torus = shapes::torus(1.0, 0.45, 40, 20);
        let surface = Surface::new(&torus, Weld::Exact);
        let curvature = estimate(&surface, &CurvatureOptions::default()).unwrap();
        let of = |filter| OwnedField::of_mesh(&torus, Weld::Exact, &curvature, filter, None);
        let point = of(FilterKind::Point);
        let mut looked_past = 0;
        for kind in FilterKind::ALL {
            let field = of(kind);
            for triangle in (0..torus.triangles().len()).step_by(17) {
                let (at, w) = ([0.2, 0.3, 0.5], Vec3::new(0.4, 0.7, -0.3));
                let expected = point.ask(triangle, at, w);
                assert!(expected.is_some_and(|answer| answer.across.is_some()));
                assert_eq!(field.at_point(triangle, at, w), expected, "{kind:?}");
                looked_past += usize::from(field.ask(triangle, at, w) != expected);
            }
        }
        assert!(looked_past > 50, "{looked_past}");
    }
}

//! [`ToldCurvature`]: what a material is told of the curvature under it, to show what each part of that is good for.

use std::sync::Arc;

use glam::Vec3;
use osculate_geom::Mesh;
use osculate_geom::curvature::VertexCurvature;
use osculate_geom::field::FilterKind;
use serde::{Deserialize, Serialize};

use super::{DirectionalCurvature, RayCurvature};

/// What a material is told of curvature. All but the default are wrong on purpose, for comparison.
#[derive(Debug, Clone, Copy, PartialEq, Eq, Default, Serialize, Deserialize)]
#[serde(rename_all = "snake_case")]
pub enum ToldCurvature {
    /// That along the ray, filtered as the scene says, in the material's own units.
    #[default]
    Along,
    /// The mean curvature at the point, whatever the ray's direction (Kuznetsov et al. 2022, Fig. 7 a, c).
    Mean,
    /// That along the ray in units of the world, as if a tile were one long (ibid., Fig. 6, middle).
    Unscaled,
}

impl ToldCurvature {
    /// A field that answers so. `tile_size` is the length of a tile in units of the mesh.
    pub(super) fn of(
        self,
        mesh: &Arc<Mesh>,
        curvature: Option<&Arc<[VertexCurvature]>>,
        field: Option<Arc<dyn DirectionalCurvature>>,
        tile_size: f32,
    ) -> Option<Arc<dyn DirectionalCurvature>> {
        let field = field?;
        match (self, curvature) {
            (Self::Along, _) | (Self::Mean, None) => Some(field),
            (Self::Mean, Some(curvature)) => {
                let (mesh, curvature) = (Arc::clone(mesh), Arc::clone(curvature));
                Some(Arc::new(Mean { mesh, curvature, field }))
            }
            (Self::Unscaled, _) => Some(Arc::new(Scaled { field, factor: 1.0 / tile_size })),
        }
    }
}

/// The mean of both principal curvatures for every ray.
#[derive(Debug)]
struct Mean {
    mesh: Arc<Mesh>,
    curvature: Arc<[VertexCurvature]>,
    field: Arc<dyn DirectionalCurvature>,
}

impl DirectionalCurvature for Mean {
    fn along(&self, triangle: usize, barycentrics: [f32; 3], direction: Vec3) -> Option<f32> {
        self.field.along(triangle, barycentrics, direction)
    }

    #[allow(clippy::cast_possible_truncation, reason = "rendering is f32")]
    fn ask(&self, triangle: usize, barycentrics: [f32; 3], _: Vec3) -> Option<RayCurvature> {
        let corners = self.mesh.triangles()[triangle];
        let (mut sum, mut total) = (0.0, 0.0);
        for (corner, weight) in corners.into_iter().zip(barycentrics) {
            if let Some(principal) = self.curvature[corner as usize].principal {
                sum += f64::from(weight) * principal.mean();
                total += f64::from(weight);
            }
        }
        (total > 0.0).then(|| RayCurvature { kappa: (sum / total) as f32, across: None, uv_rate: None })
    }

    fn filter(&self) -> FilterKind {
        FilterKind::Point
    }
}

/// A field's curvature times a factor.
#[derive(Debug)]
struct Scaled {
    field: Arc<dyn DirectionalCurvature>,
    factor: f32,
}

impl Scaled {
    fn scaled(&self, answer: RayCurvature) -> RayCurvature {
        let across = answer.across.map(|kappa| self.factor * kappa);
        RayCurvature { kappa: self.factor * answer.kappa, across, ..answer }
    }
}

impl DirectionalCurvature for Scaled {
    fn along(&self, triangle: usize, barycentrics: [f32; 3], direction: Vec3) -> Option<f32> {
        self.field.along(triangle, barycentrics, direction)
    }

    fn ask(&self, triangle: usize, barycentrics: [f32; 3], direction: Vec3) -> Option<RayCurvature> {
        Some(self.scaled(self.field.ask(triangle, barycentrics, direction)?))
    }

    fn at_point(&self, triangle: usize, barycentrics: [f32; 3], direction: Vec3) -> Option<RayCurvature> {
        Some(self.scaled(self.field.at_point(triangle, barycentrics, direction)?))
    }

    fn filter(&self) -> FilterKind {
        self.field.filter()
    }
}

#[cfg(test)]
mod tests {
    use super::*;
    use osculate_geom::curvature::{Principal, Status};

    /// As curved as the ray's direction along x is long.
    #[derive(Debug)]
    struct Along;

    impl DirectionalCurvature for Along {
        fn along(&self, _: usize, _: [f32; 3], direction: Vec3) -> Option<f32> {
            Some(direction.x)
        }

        fn ask(&self, _: usize, _: [f32; 3], direction: Vec3) -> Option<RayCurvature> {
            Some(RayCurvature { kappa: direction.x, across: Some(direction.y), uv_rate: Some([2.0, 3.0]) })
        }
    }

    fn told(told: ToldCurvature, weights: [f32; 3]) -> RayCurvature {
        type V = osculate_geom::Vec3;
        let mesh = Arc::new(Mesh::new(vec![V::zeros(), V::x(), V::y()], vec![[0, 1, 2]]).unwrap());
        let at = |kappa_max: f64, kappa_min: f64| VertexCurvature {
            principal: Some(Principal { kappa_max, kappa_min, d1: V::x(), d2: V::y() }),
            error: 0.0,
            status: Status::Ok,
        };
        let unknown = VertexCurvature { principal: None, ..at(0.0, 0.0) };
        let curvature = Arc::from(vec![at(3.0, 1.0), at(5.0, -1.0), unknown]);
        let field = told.of(&mesh, Some(&curvature), Some(Arc::new(Along)), 4.0).unwrap();
        assert_eq!(field.along(0, weights, Vec3::X), Some(1.0));
        field.ask(0, weights, 8.0 * Vec3::X).unwrap()
    }

    #[test]
    fn each_is_told_what_it_says() {
        let middle = [0.5, 0.5, 0.0];
        let exact = told(ToldCurvature::Along, middle);
        assert_eq!((exact.kappa, exact.uv_rate), (8.0, Some([2.0, 3.0])));
        let unscaled = told(ToldCurvature::Unscaled, middle);
        assert_eq!((unscaled.kappa, unscaled.uv_rate), (2.0, Some([2.0, 3.0])));
        // Means of 2 at both known corners; the third is left out, with its weight.
        for weights in [middle, [0.25, 0.25, 0.5]] {
            let mean = told(ToldCurvature::Mean, weights);
            assert_eq!((mean.kappa, mean.uv_rate), (2.0, None));
        }
    }
}

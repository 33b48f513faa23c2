//! Pictures of what is at each pixel instead of its colour: depth, normal, UV and curvature.

use glam::Vec3;
use osculate_geom::rays::Ray;
use rayon::prelude::*;
use serde::{Deserialize, Serialize};

use crate::counters::Counters;
use crate::curvature::ObjectPoint;
use crate::output::ExrLayer;
use crate::prepared::{Prepared, SceneError};
use crate::scene::Scene;
use crate::shading::ShadingPoint;

/// What a picture can show instead of colour.
#[derive(Debug, Clone, Copy, PartialEq, Eq, Serialize, Deserialize)]
#[serde(rename_all = "snake_case")]
pub enum Aov {
    /// Distance from the camera along the view direction; infinite where nothing is.
    Depth,
    /// World-space shading normal on the viewer's side; zero where nothing is.
    Normal,
    /// UV set 0.
    Uv,
    /// Smaller principal curvature, 1/length; NaN where there is none.
    KappaMin,
    /// Larger principal curvature, 1/length; NaN where there is none.
    KappaMax,
    /// Curvature along the view ray, 1/length; NaN where there is none.
    KappaAlongRay,
    /// Filtered curvature along the view ray, 1/length; NaN where there is none.
    KappaFiltered,
}

impl Aov {
    /// All of them, in the order of files.
    pub const ALL: [Self; 7] = [
        Self::Depth,
        Self::Normal,
        Self::Uv,
        Self::KappaMin,
        Self::KappaMax,
        Self::KappaAlongRay,
        Self::KappaFiltered,
    ];

    /// Name of the layer in EXR files.
    #[must_use]
    pub fn name(self) -> &'static str {
        match self {
            Self::Depth => "depth",
            Self::Normal => "normal",
            Self::Uv => "uv",
            Self::KappaMin => "kappa_min",
            Self::KappaMax => "kappa_max",
            Self::KappaAlongRay => "kappa_along_ray",
            Self::KappaFiltered => "kappa_filtered",
        }
    }

    /// The one with this name.
    #[must_use]
    pub fn from_name(name: &str) -> Option<Self> {
        Self::ALL.into_iter().find(|aov| aov.name() == name)
    }
}

/// What is at one pixel.
#[derive(Debug, Clone, Copy)]
struct Pixel {
    depth: f32,
    normal: Vec3,
    uv: [f32; 2],
    kappa: [f32; 4],
}

const NOTHING: Pixel =
    Pixel { depth: f32::INFINITY, normal: Vec3::ZERO, uv: [f32::NAN; 2], kappa: [f32::NAN; 4] };

/// Renders layers at pixel centres, one ray each; values are not blended across edges. Only what is asked for is evaluated.
///
/// # Errors
///
/// A scene that cannot be rendered.
pub fn aovs(scene: &Scene, wanted: &[Aov]) -> Result<(Vec<ExrLayer>, Counters), SceneError> {
    let prepared = Prepared::new(scene)?;
    let rows: Vec<(Vec<Pixel>, Counters)> =
        (0..scene.height).into_par_iter().map(|y| row(scene, &prepared, wanted, y)).collect();
    let mut counters = Counters::default();
    for (_, counted) in &rows {
        counters += *counted;
    }
    let pixels: Vec<Pixel> = rows.into_iter().flat_map(|(row, _)| row).collect();
    Ok((wanted.iter().map(|&aov| layer(aov, &pixels)).collect(), counters))
}

fn layer(aov: Aov, pixels: &[Pixel]) -> ExrLayer {
    let scalar = |value: fn(&Pixel) -> f32| ExrLayer::scalar(aov.name(), pixels.iter().map(value).collect());
    match aov {
        Aov::Depth => scalar(|p| p.depth),
        Aov::Normal => {
            let normals: Vec<Vec3> = pixels.iter().map(|p| p.normal).collect();
            ExrLayer::vector(aov.name(), ["X", "Y", "Z"], &normals)
        }
        Aov::Uv => {
            let channel = |name: &str, i: usize| (name.to_owned(), pixels.iter().map(|p| p.uv[i]).collect());
            ExrLayer { name: aov.name().into(), channels: vec![channel("U", 0), channel("V", 1)] }
        }
        Aov::KappaMin => scalar(|p| p.kappa[0]),
        Aov::KappaMax => scalar(|p| p.kappa[1]),
        Aov::KappaAlongRay => scalar(|p| p.kappa[2]),
        Aov::KappaFiltered => scalar(|p| p.kappa[3]),
    }
}

fn row(scene: &Scene, prepared: &Prepared, wanted: &[Aov], y: u32) -> (Vec<Pixel>, Counters) {
    let mut counters = Counters::default();
    let (width, height) = (scene.width as f32, scene.height as f32);
    let pixel = |x: u32| {
        let ray = scene.camera.pinhole_ray(x as f32 + 0.5, y as f32 + 0.5, width, height);
        counters.rays += 1;
        let Some(hit) = prepared.geometry.closest_hit(&Ray::new(ray.origin, ray.direction)) else {
            return NOTHING;
        };
        let depth = hit.t * ray.direction.dot(scene.camera.forward());
        let Some((object, triangle)) = prepared.object_of(hit.triangle) else {
            return Pixel { depth, ..NOTHING };
        };
        let point = ShadingPoint::new(prepared, &hit, -ray.direction);
        let at = ObjectPoint { object: &scene.objects[object], triangle, barycentrics: hit.barycentrics };
        let kappa = curvatures(&at, wanted, point.frame.n, -ray.direction, &mut counters);
        Pixel { depth, normal: point.frame.n, uv: point.uv, kappa }
    };
    ((0..scene.width).map(pixel).collect(), counters)
}

fn curvatures(at: &ObjectPoint<'_>, wanted: &[Aov], n: Vec3, wo: Vec3, counters: &mut Counters) -> [f32; 4] {
    let mut kappa = [f32::NAN; 4];
    if wanted.contains(&Aov::KappaMin) || wanted.contains(&Aov::KappaMax) {
        counters.curvature_evaluations += 1;
        if let Some(principal) = at.principal(n) {
            (kappa[0], kappa[1]) = (principal.kappa_min, principal.kappa_max);
        }
    }
    if wanted.contains(&Aov::KappaAlongRay) {
        counters.curvature_evaluations += 1;
        kappa[2] = at.along(wo).unwrap_or(f32::NAN);
    }
    if wanted.contains(&Aov::KappaFiltered) && at.object.field.is_some() {
        counters.filter_walks += 1;
        kappa[3] = at.filtered(wo).unwrap_or(f32::NAN);
    }
    kappa
}

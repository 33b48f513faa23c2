//! Pictures of numbers on surfaces, with a labelled colour bar.

mod axis;
mod colour_map;
mod legend;

use std::sync::Arc;

use glam::Vec3;
use osculate_geom::Mesh;
use osculate_geom::rays::Ray;
use rayon::prelude::*;
use serde::{Deserialize, Serialize};

pub use axis::{Axis, AxisScale};
pub use colour_map::ColourMap;

use crate::camera::Camera;
use crate::canvas::{Canvas, PAPER};
use crate::curvature::{ObjectPoint, vertex_curvatures};
use crate::prepared::{Prepared, SceneError};
use crate::scene::{MeshInstance, PreviewOptions, Role, Scene};
use crate::shading::ShadingPoint;
use crate::tone::Picture;
use legend::Legend;
use osculate_sbtf::colour::linear_from_srgb;

/// Which curvature a picture shows.
#[derive(Debug, Clone, Copy, PartialEq, Eq, Default, Serialize, Deserialize)]
#[serde(rename_all = "snake_case")]
pub enum Quantity {
    /// The larger principal curvature.
    KappaMax,
    /// The smaller principal curvature.
    KappaMin,
    /// Half their sum.
    #[default]
    Mean,
    /// Their product.
    Gaussian,
    /// Curvature along the view ray.
    AlongRay,
    /// Filtered curvature along the view ray.
    Filtered,
    /// Estimated error of the principal curvatures.
    Error,
}

impl Quantity {
    /// All of them.
    pub const ALL: [Self; 7] = [
        Self::KappaMax,
        Self::KappaMin,
        Self::Mean,
        Self::Gaussian,
        Self::AlongRay,
        Self::Filtered,
        Self::Error,
    ];

    fn title(self) -> &'static str {
        match self {
            Self::KappaMax => "max curvature",
            Self::KappaMin => "min curvature",
            Self::Mean => "mean curvature",
            Self::Gaussian => "Gauss curvature",
            Self::AlongRay => "along the ray",
            Self::Filtered => "filtered, ray",
            Self::Error => "est. error",
        }
    }

    fn unit(self) -> &'static str {
        if self == Self::Gaussian { "1/length^2" } else { "1/length" }
    }

    fn at(self, point: &ObjectPoint<'_>, normal: Vec3, wo: Vec3) -> Option<f32> {
        match self {
            Self::AlongRay => point.along(wo),
            Self::Filtered => point.filtered(wo),
            _ => point.principal(normal).map(|p| self.of(&p)),
        }
    }

    /// From principal curvatures. The two that depend on a ray are between these.
    fn of(self, p: &crate::curvature::PointCurvature) -> f32 {
        match self {
            Self::KappaMax => p.kappa_max,
            Self::KappaMin => p.kappa_min,
            Self::Mean => 0.5 * (p.kappa_min + p.kappa_max),
            Self::Gaussian => p.kappa_min * p.kappa_max,
            Self::AlongRay | Self::Filtered => {
                if p.kappa_max.abs() > p.kappa_min.abs() {
                    p.kappa_max
                } else {
                    p.kappa_min
                }
            }
            Self::Error => p.error,
        }
    }
}

/// How numbers are drawn.
#[derive(Debug, Clone, PartialEq)]
pub struct FalseColourOptions {
    /// Name of the quantity. ASCII.
    pub title: String,
    /// Its unit. ASCII.
    pub unit: String,
    /// Colours. Default: diverging.
    pub map: ColourMap,
    /// How values are placed on the automatic axis; logarithmic for the sequential map only. Default: linear.
    pub scale: AxisScale,
    /// Fixed axis; otherwise round numbers that cover 95 % of the values.
    pub axis: Option<Axis>,
    /// Width of the picture in pixels without the panel, and its height. Default: 800 x 800.
    pub size: [u32; 2],
}

impl Default for FalseColourOptions {
    fn default() -> Self {
        Self {
            title: "value".into(),
            unit: String::new(),
            map: ColourMap::default(),
            scale: AxisScale::default(),
            axis: None,
            size: [800, 800],
        }
    }
}

/// Share of values that an automatic axis covers. Curvature has heavy tails: creases would hide all else.
const COVERED: f64 = 0.95;

/// Rays per pixel and axis.
const SUPERSAMPLES: u8 = 4;

/// Draws the curvature of a scene's subjects. Lights, backdrops and materials are ignored; the form is shaded lightly.
///
/// The picture is as high as the scene's and wider by the panel with the colour bar.
///
/// # Errors
///
/// A scene that cannot be rendered.
pub fn curvature_picture(scene: &Scene, quantity: Quantity) -> Result<Picture, SceneError> {
    let scene = subjects(scene);
    let values = || scene.objects.iter().flat_map(vertex_curvatures).map(|p| quantity.of(&p));
    let (map, axis) = match quantity {
        Quantity::Error => (ColourMap::Sequential, Axis::from_zero(values(), COVERED)),
        _ => (ColourMap::Diverging, Axis::symmetric(values(), COVERED)),
    };
    let legend =
        Legend { title: quantity.title(), unit: quantity.unit(), map, axis, shows_undetermined: true };
    draw(&scene, &legend, |point, normal, wo| quantity.at(point, normal, wo))
}

/// Draws a value per mesh vertex, seen as in the preview. NaN is drawn as undetermined.
///
/// # Errors
///
/// A mesh that cannot be rendered.
///
/// # Panics
///
/// If there is not one value per vertex.
pub fn false_colour(
    mesh: &Arc<Mesh>,
    values: &[f32],
    options: &FalseColourOptions,
) -> Result<Picture, SceneError> {
    assert_eq!(values.len(), mesh.positions().len(), "one value per vertex");
    let preview = PreviewOptions { size: options.size, ..PreviewOptions::default() };
    let scene = subjects(&Scene::preview(vec![MeshInstance::new(Arc::clone(mesh))], &preview));
    let legend = options.legend(values);
    draw(&scene, &legend, |point, _, _| point.interpolate(values))
}

/// The scene without what the picture is not about.
fn subjects(scene: &Scene) -> Scene {
    let mut scene = scene.clone();
    scene.objects.retain(|o| o.role == Role::Subject);
    scene.lights.clear();
    scene.environment = crate::lights::Environment::Black;
    scene
}

fn draw(
    scene: &Scene,
    legend: &Legend<'_>,
    value: impl Fn(&ObjectPoint<'_>, Vec3, Vec3) -> Option<f32> + Sync,
) -> Result<Picture, SceneError> {
    let prepared = Prepared::new(scene)?;
    let painter = Painter { scene, prepared: &prepared, legend, value };
    let row = |y: u32| -> Vec<u8> {
        (0..scene.width).flat_map(|x| legend::encoded(painter.pixel(x, y).to_array())).collect()
    };
    let rows: Vec<Vec<u8>> = (0..scene.height).into_par_iter().map(row).collect();
    let drawn = Picture { width: scene.width, height: scene.height, rgb: rows.concat() };
    let panel = legend::panel(scene.height, legend);
    let mut canvas = Canvas::new(drawn.width + panel.width, drawn.height, 1);
    canvas.paste(&drawn, [0, 0]);
    canvas.paste(&panel, [drawn.width, 0]);
    Ok(canvas.into_picture())
}

/// Draws a plane of numbers, row by row from the top, a pixel each; and the panel for it, as high. NaN is drawn as undetermined. Of the
/// options the size is not used.
///
/// # Panics
///
/// If the values are no whole rows of `width`.
#[must_use]
pub fn plane(values: &[f32], width: u32, options: &FalseColourOptions) -> [Picture; 2] {
    assert!(width > 0 && values.len().is_multiple_of(width as usize), "whole rows of values");
    let legend = options.legend(values);
    let colour = |v: f32| {
        let known = (!v.is_nan()).then(|| legend.map.colour(legend.axis.position(v)));
        known.map_or(legend::UNDETERMINED, |colour| legend::encoded(colour.to_array()))
    };
    let height = u32::try_from(values.len() / width as usize).expect("a picture of less than 2^32 rows");
    let drawn = Picture { width, height, rgb: values.iter().flat_map(|v| colour(*v)).collect() };
    [drawn, legend::panel(height, &legend)]
}

impl FalseColourOptions {
    fn legend(&self, values: &[f32]) -> Legend<'_> {
        let finite = || values.iter().copied().filter(|v| v.is_finite());
        let axis = self.axis.unwrap_or_else(|| match (self.map, self.scale) {
            (ColourMap::Diverging, _) => Axis::symmetric(finite(), COVERED),
            (ColourMap::Sequential, AxisScale::Linear) => Axis::from_zero(finite(), COVERED),
            (ColourMap::Sequential, AxisScale::Logarithmic) => Axis::decades(finite(), COVERED),
        });
        let shows_undetermined = values.iter().any(|v| v.is_nan());
        Legend { title: &self.title, unit: &self.unit, map: self.map, axis, shows_undetermined }
    }
}

struct Painter<'a, F> {
    scene: &'a Scene,
    prepared: &'a Prepared,
    legend: &'a Legend<'a>,
    value: F,
}

impl<F: Fn(&ObjectPoint<'_>, Vec3, Vec3) -> Option<f32>> Painter<'_, F> {
    fn pixel(&self, x: u32, y: u32) -> Vec3 {
        let mut sum = Vec3::ZERO;
        for j in 0..SUPERSAMPLES {
            for i in 0..SUPERSAMPLES {
                let within = |k: u8| (f32::from(k) + 0.5) / f32::from(SUPERSAMPLES);
                sum += self.colour(x as f32 + within(i), y as f32 + within(j));
            }
        }
        sum / f32::from(SUPERSAMPLES).powi(2)
    }

    /// Linear RGB at a point of the image.
    fn colour(&self, x: f32, y: f32) -> Vec3 {
        let camera: &Camera = &self.scene.camera;
        let ray = camera.pinhole_ray(x, y, self.scene.width as f32, self.scene.height as f32);
        let hit = self.prepared.geometry.closest_hit(&Ray::new(ray.origin, ray.direction));
        let Some((hit, (object, triangle))) =
            hit.and_then(|h| Some((h, self.prepared.object_of(h.triangle)?)))
        else {
            return linear(PAPER);
        };
        let wo = -ray.direction;
        let point = ShadingPoint::new(self.prepared, &hit, wo);
        let at =
            ObjectPoint { object: &self.scene.objects[object], triangle, barycentrics: hit.barycentrics };
        let normal = point.frame.n;
        let found = (self.value)(&at, normal, wo).filter(|v| !v.is_nan());
        let colour = found
            .map_or(linear(legend::UNDETERMINED), |v| self.legend.map.colour(self.legend.axis.position(v)));
        colour * form_shading(normal, wo)
    }
}

/// Light from above the viewer, weak enough that colours can still be read against the bar.
fn form_shading(normal: Vec3, wo: Vec3) -> f32 {
    let light = (wo + 0.7 * Vec3::Y).normalize_or(wo);
    let wrapped = 0.5 + 0.5 * normal.dot(light);
    0.42 + 0.58 * wrapped.max(0.0)
}

fn linear(srgb: [u8; 3]) -> Vec3 {
    Vec3::from(srgb.map(|c| linear_from_srgb(f32::from(c) / 255.0)))
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn a_plane_has_the_colours_of_its_panel() {
        let axis = Axis { lower: -1.0, upper: 1.0, scale: AxisScale::Linear };
        let options = FalseColourOptions { axis: Some(axis), ..FalseColourOptions::default() };
        let values: Vec<f32> =
            (0_u8..200).flat_map(|y| [f32::from(y) / 100.0 - 1.0, f32::NAN, 9.0]).collect();
        let [drawn, panel] = plane(&values, 3, &options);
        assert_eq!((drawn.width, drawn.height, panel.height), (3, 200, 200));
        let at = |p: &Picture, x: u32, y: u32| -> [u8; 3] {
            let at = 3 * (y * p.width + x) as usize;
            p.rgb[at..at + 3].try_into().unwrap()
        };
        assert_eq!(at(&drawn, 1, 5), legend::UNDETERMINED);
        assert_eq!(at(&drawn, 2, 5), at(&drawn, 2, 190), "beyond the axis is its end");
        // White at 0, half-way up the bar too.
        assert_eq!(at(&drawn, 0, 100), [247, 246, 244]);
        // The bar's middle row is as near to 0 as rows of pixels allow.
        let off = |y: u32| at(&panel, 10, y).iter().zip(at(&drawn, 0, 100)).map(|(a, b)| a.abs_diff(b)).max();
        assert!((0..200).any(|y| off(y).unwrap() <= 3), "no white in the bar");
    }
}

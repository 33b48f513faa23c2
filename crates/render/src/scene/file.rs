//! Scene files: TOML, checked key by key.

use std::collections::BTreeMap;
use std::path::{Path, PathBuf};
use std::sync::Arc;

use glam::{EulerRot, Mat3, Vec3};
use osculate_geom::Mesh;
use osculate_geom::curvature::VertexCurvature;
use osculate_geom::field::{FilterKind, WalkLength};
use serde::{Deserialize, Serialize};
use thiserror::Error;

use super::{
    DirectionalCurvature, Material, MeshInstance, Placement, PreviewOptions, Role, Scene, SurfaceSource,
};
use crate::camera::Camera;
use crate::lights::{Environment, Light, RectangleLight};
use crate::output::read_environment;
use crate::texture::Texture;

/// A scene file as it is written. Paths are relative to the file. Angles are in degrees, lengths in world units, colours
/// linear RGB. Sections that are left out take what the preview has: its camera and, without lights and environment, its studio.
#[derive(Debug, Clone, PartialEq, Default, Serialize, Deserialize)]
#[serde(deny_unknown_fields, default)]
pub struct SceneFile {
    /// Size and exposure.
    pub image: ImageSection,
    /// The camera; framed automatically if it has no position.
    pub camera: CameraSection,
    /// How curvature along rays is filtered.
    pub curvature: CurvatureSection,
    /// The meshes.
    pub mesh: Vec<MeshSection>,
    /// Materials by name.
    pub material: BTreeMap<String, MaterialSection>,
    /// The lights.
    pub light: Vec<LightSection>,
    /// Light from infinitely far.
    pub environment: Option<EnvironmentSection>,
}

/// `[image]`.
#[derive(Debug, Clone, PartialEq, Serialize, Deserialize)]
#[serde(deny_unknown_fields, default)]
pub struct ImageSection {
    /// Pixels. Default: 960.
    pub width: u32,
    /// Pixels. Default: 720.
    pub height: u32,
    /// Stops. Default: 0.
    pub exposure: f32,
}

impl Default for ImageSection {
    fn default() -> Self {
        Self { width: 960, height: 720, exposure: 0.0 }
    }
}

/// `[camera]`.
#[derive(Debug, Clone, PartialEq, Serialize, Deserialize)]
#[serde(deny_unknown_fields, default)]
pub struct CameraSection {
    /// Where it stands; with `target`, or neither.
    pub position: Option<[f32; 3]>,
    /// What it looks at.
    pub target: Option<[f32; 3]>,
    /// Default: +Y.
    pub up: [f32; 3],
    /// Full vertical field of view in degrees. Default: 30.
    pub fov_y: f32,
    /// From the meshes towards the viewer, where the camera is framed automatically. Default: the preview's.
    pub towards_viewer: Option<[f32; 3]>,
    /// Radius of the lens. Default: 0, a pinhole.
    pub lens_radius: f32,
    /// Distance of the plane of focus. Default: the target's.
    pub focus_distance: Option<f32>,
}

impl Default for CameraSection {
    fn default() -> Self {
        Self {
            position: None,
            target: None,
            up: [0.0, 1.0, 0.0],
            fov_y: 30.0,
            towards_viewer: None,
            lens_radius: 0.0,
            focus_distance: None,
        }
    }
}

/// `[curvature]`.
#[derive(Debug, Clone, PartialEq, Default, Serialize, Deserialize)]
#[serde(deny_unknown_fields, default)]
pub struct CurvatureSection {
    /// `point`, `march`, `baked` or `chord`. Default: `march`.
    pub filter: FilterKind,
    /// Depth of the material in world units of the mesh file; the filter looks as far as a ray can be in it. Default: 2 % of the
    /// mesh's diagonal.
    pub depth: Option<f64>,
    /// How far to look past every point instead, in world units of the mesh file.
    pub length: Option<f64>,
}

impl CurvatureSection {
    /// How far the filter looks, if the file says it.
    #[must_use]
    pub fn walk(&self) -> Option<WalkLength> {
        let fixed = self.length.map(WalkLength::Fixed);
        fixed.or(self.depth.map(|depth| WalkLength::Shell { depth }))
    }
}

/// `[[mesh]]`.
#[derive(Debug, Clone, PartialEq, Serialize, Deserialize)]
#[serde(deny_unknown_fields)]
pub struct MeshSection {
    /// Mesh file.
    pub file: PathBuf,
    /// Name of a material of the scene; otherwise the mesh's own.
    pub material: Option<String>,
    /// Turns about x, then y, then z, in degrees. Default: none.
    #[serde(default)]
    pub rotate: [f32; 3],
    /// Uniform scale. Default: 1.
    #[serde(default = "one")]
    pub scale: f32,
    /// Translation, after rotation and scale. Default: none.
    #[serde(default)]
    pub translate: [f32; 3],
    /// Whether framing and curvature pictures leave it out. Default: false.
    #[serde(default)]
    pub backdrop: bool,
}

/// `[material.NAME]`.
#[derive(Debug, Clone, PartialEq, Serialize, Deserialize)]
#[serde(deny_unknown_fields, default)]
pub struct MaterialSection {
    /// Linear RGB. Default: 0.8 each.
    pub base_color: [f32; 3],
    /// PNG or JPEG, multiplied with `base_color`.
    pub base_color_texture: Option<PathBuf>,
    /// Default: 0.
    pub metallic: f32,
    /// Default: 0.6.
    pub roughness: f32,
    /// Default: 0.5.
    pub specular: f32,
    /// Default: 1.
    pub opacity: f32,
}

impl Default for MaterialSection {
    fn default() -> Self {
        let m = Material::default();
        Self {
            base_color: m.base_color.to_array(),
            base_color_texture: None,
            metallic: m.metallic,
            roughness: m.roughness,
            specular: m.specular,
            opacity: m.opacity,
        }
    }
}

/// `[[light]]`.
#[derive(Debug, Clone, PartialEq, Serialize, Deserialize)]
#[serde(tag = "type", rename_all = "snake_case", deny_unknown_fields)]
pub enum LightSection {
    /// A rectangle that shines towards `target`.
    Rectangle {
        /// Its centre.
        center: [f32; 3],
        /// A point that it faces.
        target: [f32; 3],
        /// Width.
        width: f32,
        /// Height.
        height: f32,
        /// Linear RGB radiance.
        radiance: [f32; 3],
    },
    /// Parallel light.
    Directional {
        /// The way it travels.
        direction: [f32; 3],
        /// Linear RGB irradiance on a surface that faces it.
        irradiance: [f32; 3],
    },
}

/// `[environment]`.
#[derive(Debug, Clone, PartialEq, Serialize, Deserialize)]
#[serde(deny_unknown_fields)]
pub struct EnvironmentSection {
    /// Latitude-longitude EXR file.
    pub file: Option<PathBuf>,
    /// Linear RGB radiance from everywhere, without a file.
    pub radiance: Option<[f32; 3]>,
    /// Multiplies the file's radiance. Default: 1.
    #[serde(default = "one")]
    pub intensity: f32,
    /// Turn about +Y in degrees. Default: 0.
    #[serde(default)]
    pub rotation: f32,
}

fn one() -> f32 {
    1.0
}

/// What the caller's loader makes of a mesh file.
#[derive(Debug, Clone)]
pub struct LoadedMesh {
    /// The mesh.
    pub mesh: Arc<Mesh>,
    /// Its baked curvature, if it has one.
    pub curvature: Option<Arc<[VertexCurvature]>>,
    /// Curvature along directions, if wanted.
    pub field: Option<Arc<dyn DirectionalCurvature>>,
}

/// Reads a mesh file.
pub type MeshLoader<'a> =
    dyn FnMut(&Path) -> Result<LoadedMesh, Box<dyn std::error::Error + Send + Sync>> + 'a;

/// What is wrong with a scene file. Every message begins with the file.
#[derive(Debug, Error)]
pub enum SceneFileError {
    /// Not TOML, or a key that does not exist, or a value of the wrong type.
    #[error("{file}: {message}")]
    Parse {
        /// The scene file.
        file: String,
        /// Line, column and cause.
        message: String,
    },
    /// A value that makes no sense.
    #[error("{file}: {key} = {value}: {problem}")]
    Value {
        /// The scene file.
        file: String,
        /// The key, with its section.
        key: String,
        /// Its value.
        value: String,
        /// What is wrong with it.
        problem: String,
    },
}

impl SceneFile {
    /// Parses a scene file; `file` is for messages.
    ///
    /// # Errors
    ///
    /// Text that is not TOML, unknown keys, values of the wrong type.
    pub fn parse(text: &str, file: &str) -> Result<Self, SceneFileError> {
        toml::from_str(text).map_err(|e| SceneFileError::Parse {
            file: file.into(),
            message: e.to_string().trim_end().into(),
        })
    }

    /// Loads what the file names and makes the scene. `load` reads a mesh file, whose path is already joined with the scene's.
    ///
    /// # Errors
    ///
    /// A value out of range, or a file that cannot be read; the message names scene file, key and value.
    pub fn build(&self, file: &Path, load: &mut MeshLoader<'_>) -> Result<Scene, SceneFileError> {
        let check =
            Checker { file: file.display().to_string(), folder: file.parent().unwrap_or(Path::new("")) };
        self.check_image(&check)?;
        self.check_curvature(&check)?;
        let materials = self.materials(&check)?;
        let objects = self
            .mesh
            .iter()
            .enumerate()
            .map(|(i, m)| object(&check, i, m, &materials, load))
            .collect::<Result<_, _>>()?;
        let towards_viewer = match self.camera.towards_viewer {
            Some(v) => check.direction("camera.towards_viewer", v)?,
            None => PreviewOptions::default().towards_viewer,
        };
        check.range("camera.fov_y", self.camera.fov_y, 0.1, 170.0)?;
        let preview = PreviewOptions {
            size: [self.image.width, self.image.height],
            towards_viewer,
            fov_y: self.camera.fov_y.to_radians(),
        };
        let mut scene = Scene::preview(objects, &preview);
        scene.filter = self.curvature.filter;
        scene.exposure = check.finite("image.exposure", self.image.exposure)?;
        if !self.light.is_empty() || self.environment.is_some() {
            scene.objects.pop();
            scene.lights =
                self.light.iter().enumerate().map(|(i, l)| light(&check, i, l)).collect::<Result<_, _>>()?;
            scene.environment = self.environment(&check)?;
        }
        self.place_camera(&check, &mut scene)?;
        Ok(scene)
    }

    fn check_image(&self, check: &Checker<'_>) -> Result<(), SceneFileError> {
        for (key, value) in [("image.width", self.image.width), ("image.height", self.image.height)] {
            if !(1..=32768).contains(&value) {
                return Err(check.error(key, value, "must be 1 to 32768 pixels"));
            }
        }
        Ok(())
    }

    fn check_curvature(&self, check: &Checker<'_>) -> Result<(), SceneFileError> {
        let section = &self.curvature;
        for (key, value) in [("curvature.depth", section.depth), ("curvature.length", section.length)] {
            if let Some(value) = value.filter(|x| !(x.is_finite() && *x > 0.0)) {
                return Err(check.error(key, value, "must be a positive length"));
            }
        }
        match (section.depth, section.length) {
            (Some(_), Some(length)) => {
                Err(check.error("curvature.length", length, "stands beside curvature.depth; leave one out"))
            }
            _ => Ok(()),
        }
    }

    fn materials(&self, check: &Checker<'_>) -> Result<BTreeMap<&str, Material>, SceneFileError> {
        let mut materials = BTreeMap::new();
        for (name, section) in &self.material {
            let key = |k: &str| format!("material.{name}.{k}");
            for (k, c) in ["r", "g", "b"].into_iter().zip(section.base_color) {
                check.range(&key(&format!("base_color ({k})")), c, 0.0, 1.0)?;
            }
            let base_color_texture = match &section.base_color_texture {
                None => None,
                Some(path) => {
                    let bytes = check.read(&key("base_color_texture"), path)?;
                    let texture = Texture::decode(&bytes)
                        .map_err(|e| check.error(&key("base_color_texture"), path.display(), e))?;
                    Some(Arc::new(texture))
                }
            };
            let material = Material {
                name: name.clone(),
                base_color: Vec3::from(section.base_color),
                base_color_texture,
                metallic: check.range(&key("metallic"), section.metallic, 0.0, 1.0)?,
                roughness: check.range(&key("roughness"), section.roughness, 0.0, 1.0)?,
                specular: check.range(&key("specular"), section.specular, 0.0, 1.0)?,
                opacity: check.range(&key("opacity"), section.opacity, 0.0, 1.0)?,
            };
            materials.insert(name.as_str(), material);
        }
        Ok(materials)
    }

    fn environment(&self, check: &Checker<'_>) -> Result<Environment, SceneFileError> {
        let Some(section) = &self.environment else { return Ok(Environment::Black) };
        let intensity = check.range("environment.intensity", section.intensity, 0.0, f32::MAX)?;
        let rotation = check.finite("environment.rotation", section.rotation)?.to_radians();
        match (&section.file, section.radiance) {
            (Some(path), None) => {
                let bytes = check.read("environment.file", path)?;
                let image = read_environment(&bytes)
                    .map_err(|e| check.error("environment.file", path.display(), e))?;
                Ok(Environment::Image { image: Arc::new(image), intensity, rotation })
            }
            (None, Some(radiance)) => {
                Ok(Environment::Constant(intensity * check.colour("environment.radiance", radiance)?))
            }
            _ => Err(check.error("environment", "{ .. }", "needs one of `file` and `radiance`")),
        }
    }

    fn place_camera(&self, check: &Checker<'_>, scene: &mut Scene) -> Result<(), SceneFileError> {
        let section = &self.camera;
        match (section.position, section.target) {
            (None, None) => {}
            (Some(position), Some(target)) => {
                let (position, target) =
                    (check.point("camera.position", position)?, check.point("camera.target", target)?);
                if position == target {
                    return Err(check.error("camera.target", target, "is the same as camera.position"));
                }
                let up = check.direction("camera.up", section.up)?;
                scene.camera = Camera::look_at(position, target, up, section.fov_y.to_radians());
            }
            _ => {
                return Err(check.error(
                    "camera",
                    "{ .. }",
                    "needs both or neither of `position` and `target`",
                ));
            }
        }
        let radius = check.range("camera.lens_radius", section.lens_radius, 0.0, f32::MAX)?;
        let focus = section.focus_distance.unwrap_or(scene.camera.focus_distance());
        if focus <= 0.0 || !focus.is_finite() {
            return Err(check.error("camera.focus_distance", focus, "must be a positive distance"));
        }
        scene.camera = scene.camera.with_lens(radius, focus);
        Ok(())
    }
}

/// Checks values, and says where they stand.
struct Checker<'a> {
    file: String,
    folder: &'a Path,
}

impl Checker<'_> {
    fn error(
        &self,
        key: &str,
        value: impl std::fmt::Display,
        problem: impl std::fmt::Display,
    ) -> SceneFileError {
        SceneFileError::Value {
            file: self.file.clone(),
            key: key.into(),
            value: value.to_string(),
            problem: problem.to_string(),
        }
    }

    fn finite(&self, key: &str, value: f32) -> Result<f32, SceneFileError> {
        if value.is_finite() { Ok(value) } else { Err(self.error(key, value, "must be finite")) }
    }

    fn range(&self, key: &str, value: f32, least: f32, most: f32) -> Result<f32, SceneFileError> {
        if (least..=most).contains(&value) {
            return Ok(value);
        }
        let problem = if most == f32::MAX {
            format!("must be at least {least}")
        } else {
            format!("must be {least} to {most}")
        };
        Err(self.error(key, value, problem))
    }

    fn point(&self, key: &str, value: [f32; 3]) -> Result<Vec3, SceneFileError> {
        let value = Vec3::from(value);
        if value.is_finite() { Ok(value) } else { Err(self.error(key, value, "must be finite")) }
    }

    fn direction(&self, key: &str, value: [f32; 3]) -> Result<Vec3, SceneFileError> {
        let found = Vec3::from(value).try_normalize();
        found.ok_or_else(|| self.error(key, Vec3::from(value), "must be finite and not zero"))
    }

    fn colour(&self, key: &str, value: [f32; 3]) -> Result<Vec3, SceneFileError> {
        let colour = self.point(key, value)?;
        if colour.min_element() >= 0.0 {
            Ok(colour)
        } else {
            Err(self.error(key, colour, "must not be negative"))
        }
    }

    fn read(&self, key: &str, path: &Path) -> Result<Vec<u8>, SceneFileError> {
        std::fs::read(self.folder.join(path)).map_err(|e| self.error(key, path.display(), e))
    }
}

fn object(
    check: &Checker<'_>,
    index: usize,
    section: &MeshSection,
    materials: &BTreeMap<&str, Material>,
    load: &mut MeshLoader<'_>,
) -> Result<MeshInstance, SceneFileError> {
    let key = |k: &str| format!("mesh[{index}].{k}");
    let surface = match &section.material {
        None => SurfaceSource::Mesh,
        Some(name) => match materials.get(name.as_str()) {
            Some(material) => SurfaceSource::Material(material.clone()),
            None => {
                let known = materials.keys().copied().collect::<Vec<_>>().join(", ");
                return Err(check.error(
                    &key("material"),
                    name,
                    format!("no such material; there are: {known}"),
                ));
            }
        },
    };
    let scale = section.scale;
    if !(scale.is_finite() && scale > 0.0) {
        return Err(check.error(&key("scale"), scale, "must be positive"));
    }
    let [x, y, z] = check.point(&key("rotate"), section.rotate)?.to_array().map(f32::to_radians);
    let placement = Placement {
        rotation: Mat3::from_euler(EulerRot::ZYX, z, y, x),
        scale,
        translation: check.point(&key("translate"), section.translate)?,
    };
    let loaded = load(&check.folder.join(&section.file))
        .map_err(|e| check.error(&key("file"), section.file.display(), e))?;
    let role = if section.backdrop { Role::Backdrop } else { Role::Subject };
    Ok(MeshInstance {
        mesh: loaded.mesh,
        curvature: loaded.curvature,
        field: loaded.field,
        surface,
        placement,
        role,
    })
}

fn light(check: &Checker<'_>, index: usize, section: &LightSection) -> Result<Light, SceneFileError> {
    let key = |k: &str| format!("light[{index}].{k}");
    match *section {
        LightSection::Directional { direction, irradiance } => Ok(Light::Directional {
            direction: check.direction(&key("direction"), direction)?,
            irradiance: check.colour(&key("irradiance"), irradiance)?,
        }),
        LightSection::Rectangle { center, target, width, height, radiance } => {
            let (center, target) =
                (check.point(&key("center"), center)?, check.point(&key("target"), target)?);
            if center == target {
                return Err(check.error(&key("target"), target, "is the same as the center"));
            }
            for (k, size) in [("width", width), ("height", height)] {
                if !(size.is_finite() && size > 0.0) {
                    return Err(check.error(&key(k), size, "must be positive"));
                }
            }
            let radiance = check.colour(&key("radiance"), radiance)?;
            Ok(Light::Rectangle(RectangleLight::facing(center, target, width, height, radiance)))
        }
    }
}

//! From a scene file to a scene.

use std::collections::BTreeMap;
use std::path::Path;
use std::sync::Arc;

use glam::Vec3;
use osculate_geom::field::FilterKind;
use osculate_geom::reference::Shape;

use super::checker::Checker;
use super::file::{
    LightSection, LoadRequest, LoadedMesh, MeshLoader, MeshSection, MeshSource, SceneFile, SceneFileError,
};
use super::instances::{spread, turned};
use super::silhouette_section::Choice;
use super::{Material, MeshInstance, Placement, PreviewOptions, QueryForm, Role, Scene, SurfaceSource};
use crate::camera::Camera;
use crate::lights::{Environment, Light, RectangleLight};
use crate::output::read_environment;
use crate::texture::Texture;

impl SceneFile {
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
        let mut objects = Vec::with_capacity(self.mesh.len());
        for (i, section) in self.mesh.iter().enumerate() {
            let object = self.object(&check, i, section, &materials, load)?;
            match &section.instances {
                None => objects.push(object),
                Some(instances) => {
                    let places = instances.placements(&check, &format!("mesh[{i}].instances"))?;
                    objects.extend(spread(&object, &places));
                }
            }
        }
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

    fn check_image(&self, check: &Checker<'_>) -> Result<(), SceneFileError> {
        for (key, value) in [("image.width", self.image.width), ("image.height", self.image.height)] {
            if !(1..=32768).contains(&value) {
                return Err(check.error(key, value, "must be 1 to 32768 pixels"));
            }
        }
        Ok(())
    }

    /// The filter, with its default: what materials with silhouettes want, if there are any.
    fn filter(&self, silhouettes: bool) -> FilterKind {
        self.curvature.filter.unwrap_or(match self.curvature.query {
            QueryForm::Chord if silhouettes => FilterKind::Chord,
            _ => FilterKind::March,
        })
    }

    fn materials(&self, check: &Checker<'_>) -> Result<BTreeMap<&str, SceneMaterial>, SceneFileError> {
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
                silhouette: None,
                micro: None,
            };
            let micro = section.micro(check, name)?;
            materials.insert(name.as_str(), SceneMaterial { material, micro });
        }
        Ok(materials)
    }

    fn object(
        &self,
        check: &Checker<'_>,
        index: usize,
        section: &MeshSection,
        materials: &BTreeMap<&str, SceneMaterial>,
        load: &mut MeshLoader<'_>,
    ) -> Result<MeshInstance, SceneFileError> {
        let key = |k: &str| format!("mesh[{index}].{k}");
        let chosen = section.material.as_deref().map(|name| {
            materials.get(name).ok_or_else(|| {
                let known = materials.keys().copied().collect::<Vec<_>>().join(", ");
                check.error(&key("material"), name, format!("no such material; there are: {known}"))
            })
        });
        let chosen = chosen.transpose()?;
        let scale = section.scale;
        if !(scale.is_finite() && scale > 0.0) {
            return Err(check.error(&key("scale"), scale, "must be positive"));
        }
        let placement = Placement {
            rotation: turned(check.point(&key("rotate"), section.rotate)?),
            scale,
            translation: check.point(&key("translate"), section.translate)?,
        };
        let shell = chosen.and_then(|m| m.micro.as_ref()).and_then(|choice| choice.shell(scale));
        let (filter, is_named) = (self.filter(shell.is_some()), self.curvature.filter.is_some());
        let mut loaded =
            load_mesh(check, index, section, load, |source| LoadRequest { source, shell, filter, is_named })?;
        let surface = match chosen {
            None => SurfaceSource::Mesh,
            Some(SceneMaterial { material, micro: None }) => SurfaceSource::Material(material.clone()),
            Some(SceneMaterial { material, micro: Some(choice) }) => {
                let made = choice.on_mesh(loaded.mesh.clone(), scale, self.curvature.query, material.clone());
                let (mesh, material) =
                    made.map_err(|problem| check.error(&key("material"), &material.name, problem))?;
                if !Arc::ptr_eq(&mesh, &loaded.mesh) {
                    // Curvature belongs to the mesh that was read.
                    loaded = LoadedMesh { mesh, curvature: None, field: None };
                }
                loaded = choice.told(loaded, scale);
                SurfaceSource::Material(material)
            }
        };
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

/// A material of a scene file, before it is known which mesh it goes on.
struct SceneMaterial {
    material: Material,
    micro: Option<Choice>,
}

fn load_mesh(
    check: &Checker<'_>,
    index: usize,
    section: &MeshSection,
    load: &mut MeshLoader<'_>,
    request: impl Fn(MeshSource<'_>) -> LoadRequest<'_>,
) -> Result<LoadedMesh, SceneFileError> {
    let key = |k: &str| format!("mesh[{index}].{k}");
    match (&section.file, &section.shape) {
        (Some(file), None) => load(&request(MeshSource::File(&check.folder.join(file))))
            .map_err(|e| check.error(&key("file"), file.display(), e)),
        (None, Some(words)) => {
            let shape = words.parse::<Shape>().map_err(|e| check.error(&key("shape"), words, e))?;
            load(&request(MeshSource::Shape(shape))).map_err(|e| check.error(&key("shape"), words, e))
        }
        _ => Err(check.error(&format!("mesh[{index}]"), "{ .. }", "needs one of `file` and `shape`")),
    }
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

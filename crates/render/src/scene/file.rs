//! Scene files: TOML, checked key by key.

use std::collections::BTreeMap;
use std::path::{Path, PathBuf};
use std::sync::Arc;

use osculate_geom::Mesh;
use osculate_geom::curvature::VertexCurvature;
use osculate_geom::field::{FilterKind, WalkLength};
use osculate_geom::mesh::uv_scale;
use osculate_geom::reference::Shape;
use serde::{Deserialize, Serialize};
use thiserror::Error;

use super::{
    DirectionalCurvature, InstancesSection, Laying, Material, MaterialForm, QueryForm, ToldCurvature,
};

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
    /// What materials with silhouettes are told of a ray's way: `paper` or `chord`. Default: `chord`.
    pub query: QueryForm,
    /// `point`, `march`, `baked`, `chord` or `baked_chord`. Default: `chord` for materials with silhouettes that are asked so, for which
    /// whoever loads the meshes may take `baked_chord`; else `march`.
    pub filter: Option<FilterKind>,
    /// Depth of the material in world units of the mesh file; the filter looks as far as a ray can be in it. Default: the
    /// depth of a mesh's material with silhouettes, else 2 % of the mesh's diagonal.
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
    /// Mesh file; or else `shape`.
    pub file: Option<PathBuf>,
    /// A surface made on the spot, with UV from 0 to 1: `torus:A,r`, radii of the circle and of the tube, around +Y.
    pub shape: Option<String>,
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
    /// Several places, each after the one above: a list of `{ rotate, scale, translate }`, or `{ grid, spacing }`. Default: one.
    #[serde(default)]
    pub instances: Option<InstancesSection>,
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
    /// What stands for a microstructure: `neural`, `oracle`, `displaced`, `march`, `neumip` or `flat`; see [`MaterialForm`]. Takes the
    /// place of all of the above. Default: `neural` with a `model`, `neumip` with a `baseline`, `oracle` with a `micro`.
    #[serde(rename = "as")]
    pub form: Option<MaterialForm>,
    /// A trained material (`.sbtf`).
    pub model: Option<PathBuf>,
    /// A trained material without curvature and silhouettes (`.sbtf`), for `neumip`.
    pub baseline: Option<PathBuf>,
    /// A microstructure, by name or `.toml`, for all forms that are not trained; `micro` is the same key. Default: what the model
    /// was trained on.
    #[serde(alias = "micro")]
    pub oracle: Option<String>,
    /// Paths per query of `oracle`. Default: 4.
    pub oracle_samples: u32,
    /// Depth of the microstructure in tiles; `micro_depth` is the same key. Default: its own, or that of the model.
    #[serde(alias = "micro_depth")]
    pub oracle_depth: Option<f32>,
    /// Steps of a ray of `march`. Default: 64.
    pub march_steps: u32,
    /// Largest error of the triangles of `displaced`, in depths. Default: 0.005.
    pub tolerance: f32,
    /// Tiles of the microstructure per UV unit, along u and v. Default: 1 and 1.
    pub tiles: [f32; 2],
    /// World length of a tile, which fixes how deep the material is. Default: what a tile measures on the mesh on average.
    pub tile_size: Option<f32>,
    /// What forms that ask for curvature are told: `along`, `mean` or `unscaled`; see [`ToldCurvature`]. Default: `along`.
    pub curvature: ToldCurvature,
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
            form: None,
            model: None,
            baseline: None,
            oracle: None,
            oracle_samples: 4,
            oracle_depth: None,
            march_steps: 64,
            tolerance: Laying::new([1.0; 2], 1.0).tolerance,
            tiles: [1.0; 2],
            tile_size: None,
            curvature: ToldCurvature::default(),
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

/// A mesh that a scene wants.
#[derive(Debug, Clone, Copy)]
pub struct LoadRequest<'a> {
    /// Where it comes from.
    pub source: MeshSource<'a>,
    /// The material that will lie under its surface and asks for curvature along rays.
    pub shell: Option<Shell>,
    /// The scene's choice of a filter, with its default resolved.
    pub filter: FilterKind,
    /// Whether the scene names it. If not, a table may stand in for it.
    pub is_named: bool,
}

/// Where a mesh comes from.
#[derive(Debug, Clone, Copy, PartialEq)]
pub enum MeshSource<'a> {
    /// A file; its path is joined with the scene's.
    File(&'a Path),
    /// A surface made on the spot.
    Shape(Shape),
}

/// A layer of material under a surface.
#[derive(Debug, Clone, Copy, PartialEq)]
pub struct Shell {
    /// In tiles.
    pub depth: f32,
    /// Tiles per UV unit of the mesh.
    pub tiles: [f32; 2],
    /// World length of a tile, if the scene fixes it.
    pub tile_size: Option<f32>,
    /// World length of a unit of the mesh.
    pub scale: f32,
}

impl Shell {
    /// World length of a tile on this mesh; `None` where it is not given and the mesh has no UV or no area.
    #[must_use]
    #[allow(clippy::cast_possible_truncation, reason = "rendering is f32")]
    pub fn tile_size_on(&self, mesh: &Mesh) -> Option<f32> {
        let measured = || {
            let unit = self.scale * uv_scale(mesh, 0)? as f32;
            Some(unit / (self.tiles[0] * self.tiles[1]).sqrt()).filter(|size| size.is_finite() && *size > 0.0)
        };
        self.tile_size.or_else(measured)
    }

    /// Depth in units of the mesh; `None` as for [`Self::tile_size_on`].
    #[must_use]
    pub fn depth_in_mesh(&self, mesh: &Mesh) -> Option<f64> {
        Some(f64::from(self.depth) * f64::from(self.tile_size_on(mesh)? / self.scale))
    }
}

/// Reads or makes a mesh.
pub type MeshLoader<'a> =
    dyn FnMut(&LoadRequest<'_>) -> Result<LoadedMesh, Box<dyn std::error::Error + Send + Sync>> + 'a;

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
}

//! The keys of `[material.NAME]` that make a material from a microstructure or a model of one.

use std::path::Path;
use std::sync::Arc;

use osculate_geom::Mesh;
use osculate_sbtf::SilhouetteBtf;
use osculate_sbtf::file::ModelFile;
use osculate_sbtf::infer::Material as Model;
use osculate_sbtf::march::HeightMarch;
use osculate_sbtf::micro::{Geometry, HeightField, Microstructure};
use osculate_sbtf::oracle::{Oracle, OracleOptions};
use osculate_sbtf::sampling::Sampler;

use super::checker::Checker;
use super::file::LoadedMesh;
use super::file::{MaterialSection, SceneFileError, Shell};
use super::{Laying, Material, MaterialForm, MicroSurface, QueryForm, SilhouetteMaterial, ToldCurvature};

/// What a scene file makes of a microstructure, before it is known which mesh it goes on.
pub(super) struct Choice {
    content: Content,
    depth: f32,
    tiles: [f32; 2],
    tile_size: Option<f32>,
    tolerance: f32,
    told: ToldCurvature,
}

enum Content {
    /// Answers to queries.
    Asked { btf: Arc<dyn SilhouetteBtf + Send + Sync>, sampler: Arc<Sampler>, curvature: Curvature },
    /// Triangles.
    Shown { field: Box<HeightField>, displaced: bool },
}

#[derive(Clone, Copy, PartialEq)]
enum Curvature {
    Asked,
    Ignored,
}

impl Choice {
    /// What the mesh's loader must know, if the material asks for curvature; `scale` is the world length of a unit of the mesh.
    pub(super) fn shell(&self, scale: f32) -> Option<Shell> {
        let asked = matches!(self.content, Content::Asked { curvature: Curvature::Asked, .. });
        asked.then(|| self.laid(scale))
    }

    /// A mesh with the curvature that the material is told, where it asks.
    pub(super) fn told(&self, loaded: LoadedMesh, scale: f32) -> LoadedMesh {
        let (Some(shell), Some(tile_size)) = (self.shell(scale), self.laid(scale).tile_size_on(&loaded.mesh))
        else {
            return loaded;
        };
        let field =
            self.told.of(&loaded.mesh, loaded.curvature.as_ref(), loaded.field, tile_size / shell.scale);
        LoadedMesh { field, ..loaded }
    }

    fn laid(&self, scale: f32) -> Shell {
        Shell { depth: self.depth, tiles: self.tiles, tile_size: self.tile_size, scale }
    }

    /// The mesh and its material; the reason where they do not fit.
    pub(super) fn on_mesh(
        &self,
        mesh: Arc<Mesh>,
        scale: f32,
        query: QueryForm,
        plain: Material,
    ) -> Result<(Arc<Mesh>, Material), String> {
        let no_uv = || "has tiles, and the mesh has no UV for them".to_owned();
        mesh.uv_sets().first().ok_or_else(no_uv)?;
        let tile_size = self.laid(scale).tile_size_on(&mesh).ok_or_else(no_uv)?;
        match &self.content {
            Content::Asked { btf, sampler, curvature } => {
                let query = if *curvature == Curvature::Asked { query } else { QueryForm::Paper };
                let (btf, sampler) = (Arc::clone(btf), Arc::clone(sampler));
                let silhouette = SilhouetteMaterial {
                    btf,
                    depth: self.depth,
                    tiles: self.tiles,
                    tile_size,
                    sampler,
                    query,
                };
                Ok((mesh, Material { silhouette: Some(silhouette), ..plain }))
            }
            Content::Shown { field, displaced } => {
                let laying =
                    Laying { tolerance: self.tolerance, ..Laying::new(self.tiles, tile_size / scale) };
                let (mesh, micro) = if *displaced {
                    let made = MicroSurface::displaced(&mesh, field, &laying).map_err(|e| e.to_string())?;
                    (Arc::new(made.0.mesh), made.1)
                } else {
                    let micro = MicroSurface::flat(&mesh, field, &laying);
                    (mesh, micro)
                };
                Ok((mesh, Material { micro: Some(micro), ..plain }))
            }
        }
    }
}

impl MaterialSection {
    /// What the section makes of a microstructure, where it names one in any way.
    #[must_use]
    pub fn micro_form(&self) -> Option<MaterialForm> {
        self.form.or_else(|| {
            let model = self.model.as_ref().map(|_| MaterialForm::Neural);
            let baseline = self.baseline.as_ref().map(|_| MaterialForm::Neumip);
            model.or(baseline).or_else(|| self.oracle.as_ref().map(|_| MaterialForm::Oracle))
        })
    }

    /// Reads the model or the microstructure that the section names, if any.
    pub(super) fn micro(&self, check: &Checker<'_>, name: &str) -> Result<Option<Choice>, SceneFileError> {
        let key = |k: &str| format!("material.{name}.{k}");
        for (axis, tiles) in ["u", "v"].into_iter().zip(self.tiles) {
            check.range(&key(&format!("tiles ({axis})")), tiles, 1e-6, 1e6)?;
        }
        if let Some(size) = self.tile_size {
            check.range(&key("tile_size"), size, f32::MIN_POSITIVE, f32::MAX)?;
        }
        check.range(&key("tolerance"), self.tolerance, 1e-5, 1.0)?;
        let Some(form) = self.micro_form() else { return Ok(None) };
        if let (None, Some(_), Some(oracle)) = (self.form, &self.model, &self.oracle) {
            let problem = "stands beside a model; say with `as` which of them is shown, or leave one out";
            return Err(check.error(&key("oracle"), oracle, problem));
        }
        let source = Source { section: self, check, key: &key, form };
        let (content, depth) = match form {
            MaterialForm::Neural => source.model(self.model.as_deref(), "model", Curvature::Asked)?,
            MaterialForm::Neumip => source.model(self.baseline.as_deref(), "baseline", Curvature::Ignored)?,
            MaterialForm::Oracle => source.oracle()?,
            MaterialForm::March => source.march()?,
            MaterialForm::Displaced | MaterialForm::Flat => source.shown()?,
        };
        let (tiles, tile_size, tolerance) = (self.tiles, self.tile_size, self.tolerance);
        Ok(Some(Choice { content, depth, tiles, tile_size, tolerance, told: self.curvature }))
    }
}

/// Where a section's material comes from.
struct Source<'a> {
    section: &'a MaterialSection,
    check: &'a Checker<'a>,
    key: &'a dyn Fn(&str) -> String,
    form: MaterialForm,
}

impl Source<'_> {
    fn error(
        &self,
        key: &str,
        value: impl std::fmt::Display,
        problem: impl std::fmt::Display,
    ) -> SceneFileError {
        self.check.error(&(self.key)(key), value, problem)
    }

    fn model(
        &self,
        path: Option<&Path>,
        key: &str,
        curvature: Curvature,
    ) -> Result<(Content, f32), SceneFileError> {
        let missing = || self.error("as", self.form.name(), format!("needs the key `{key}`, a .sbtf"));
        let file = self.read(path.ok_or_else(missing)?, key)?;
        let depth = file.model.architecture.depth;
        let sampler = Arc::new(file.sampler.clone().unwrap_or_else(Sampler::cosine));
        let btf = Arc::new(Model::new(&file.model));
        // One form of model is asked in one way, whichever key names it.
        let curvature = if btf.uses_curvature() { curvature } else { Curvature::Ignored };
        Ok((Content::Asked { btf, sampler, curvature }, depth))
    }

    fn read(&self, path: &Path, key: &str) -> Result<ModelFile, SceneFileError> {
        ModelFile::read(&self.check.folder.join(path)).map_err(|e| self.error(key, path.display(), e))
    }

    fn oracle(&self) -> Result<(Content, f32), SceneFileError> {
        let samples = self.section.oracle_samples;
        if !(1..=1 << 20).contains(&samples) {
            return Err(self.error("oracle_samples", samples, "must be 1 to 1048576"));
        }
        let micro = self.microstructure()?;
        let btf = Arc::new(Oracle::new(&micro, OracleOptions { samples, ..OracleOptions::default() }));
        Ok((asked(btf), micro.geometry.depth()))
    }

    fn march(&self) -> Result<(Content, f32), SceneFileError> {
        let steps = self.section.march_steps;
        if !(1..=1 << 16).contains(&steps) {
            return Err(self.error("march_steps", steps, "must be 1 to 65536"));
        }
        let field = self.field()?;
        Ok((asked(Arc::new(HeightMarch::new(&field, steps))), field.depth()))
    }

    fn shown(&self) -> Result<(Content, f32), SceneFileError> {
        let field = Box::new(self.field()?);
        let (depth, displaced) = (field.depth(), self.form == MaterialForm::Displaced);
        Ok((Content::Shown { field, displaced }, depth))
    }

    /// The microstructure, which must be a height field.
    fn field(&self) -> Result<HeightField, SceneFileError> {
        let micro = self.microstructure()?;
        match micro.geometry {
            Geometry::HeightField(field) => Ok(field),
            Geometry::TileMesh(_) => {
                let problem =
                    format!("{} is a see-through mesh; only height fields can be shown so", micro.name);
                Err(self.error("as", self.form.name(), problem))
            }
        }
    }

    /// What the section names, or else what its model was trained on; at the depth that the section asks for.
    fn microstructure(&self) -> Result<Microstructure, SceneFileError> {
        let micro = match &self.section.oracle {
            Some(name) => self.load("oracle", name)?,
            None => self.trained_on()?,
        };
        let Some(depth) = self.section.oracle_depth else { return Ok(micro) };
        self.check.range(&(self.key)("oracle_depth"), depth, 1e-4, 1.0)?;
        let own = || self.error("oracle_depth", depth, "a mesh has a depth of its own");
        micro.with_depth(depth).ok_or_else(own)
    }

    fn load(&self, key: &str, name: &str) -> Result<Microstructure, SceneFileError> {
        let path = self.check.folder.join(name);
        let place = if path.is_file() { path.to_string_lossy().into_owned() } else { name.to_owned() };
        Ok(Microstructure::load(&place).map_err(|e| self.error(key, name, e))?.micro)
    }

    /// What the section's model was trained on.
    fn trained_on(&self) -> Result<Microstructure, SceneFileError> {
        let section = self.section;
        let (key, path) = match (&section.model, &section.baseline) {
            (Some(path), _) => ("model", path),
            (None, Some(path)) => ("baseline", path),
            (None, None) => return Err(self.error("as", self.form.name(), "needs the key `micro`")),
        };
        let error = |problem: &str| self.error(key, path.display(), problem);
        let source = self.read(path, key)?.provenance.microstructure;
        let source =
            source.ok_or_else(|| error("does not say what it was trained on; name it with `micro`"))?;
        let micro = source.at_its_depth(self.load(key, &source.name)?);
        if source.sha256 != micro.hash() {
            let name = &source.name;
            return Err(error(&format!(
                "was trained on another {name} than the one of this version; name it with `micro`"
            )));
        }
        Ok(micro)
    }
}

/// A microstructure that is traced or marched.
fn asked(btf: Arc<dyn SilhouetteBtf + Send + Sync>) -> Content {
    Content::Asked { btf, sampler: Arc::new(Sampler::cosine()), curvature: Curvature::Asked }
}

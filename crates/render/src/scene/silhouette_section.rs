//! The keys of `[material.NAME]` that make a material with silhouettes.

use std::sync::Arc;

use osculate_geom::Mesh;
use osculate_sbtf::SilhouetteBtf;
use osculate_sbtf::file::ModelFile;
use osculate_sbtf::infer::Material as Model;
use osculate_sbtf::micro::Microstructure;
use osculate_sbtf::oracle::{Oracle, OracleOptions};
use osculate_sbtf::sampling::Sampler;

use super::checker::Checker;
use super::file::{MaterialSection, SceneFileError, Shell};
use super::{QueryForm, SilhouetteMaterial};

/// A silhouette BTF that a scene file names, before it is known which mesh it goes on.
pub(super) struct SilhouetteChoice {
    btf: Arc<dyn SilhouetteBtf + Send + Sync>,
    sampler: Arc<Sampler>,
    depth: f32,
    tiles: [f32; 2],
    tile_size: Option<f32>,
}

impl SilhouetteChoice {
    /// What the mesh's loader must know; `scale` is the world length of a unit of the mesh.
    pub(super) fn shell(&self, scale: f32) -> Shell {
        Shell { depth: self.depth, tiles: self.tiles, tile_size: self.tile_size, scale }
    }

    /// The material on a mesh; `None` if the mesh has no UV, or they have no area and no size is given.
    pub(super) fn on_mesh(&self, mesh: &Mesh, scale: f32, query: QueryForm) -> Option<SilhouetteMaterial> {
        mesh.uv_sets().first()?;
        let tile_size = self.shell(scale).tile_size_on(mesh)?;
        let (btf, sampler) = (Arc::clone(&self.btf), Arc::clone(&self.sampler));
        Some(SilhouetteMaterial { btf, depth: self.depth, tiles: self.tiles, tile_size, sampler, query })
    }
}

impl MaterialSection {
    /// Reads the model or the microstructure that the section names, if any.
    pub(super) fn silhouette(
        &self,
        check: &Checker<'_>,
        name: &str,
    ) -> Result<Option<SilhouetteChoice>, SceneFileError> {
        let key = |k: &str| format!("material.{name}.{k}");
        for (axis, tiles) in ["u", "v"].into_iter().zip(self.tiles) {
            check.range(&key(&format!("tiles ({axis})")), tiles, 1e-6, 1e6)?;
        }
        if let Some(size) = self.tile_size {
            check.range(&key("tile_size"), size, f32::MIN_POSITIVE, f32::MAX)?;
        }
        let mut sampler = None;
        let (btf, depth) = match (&self.model, &self.oracle) {
            (None, None) => return Ok(None),
            (Some(_), Some(oracle)) => {
                return Err(check.error(&key("oracle"), oracle, "stands beside a model; leave one out"));
            }
            (Some(path), None) => {
                let file = ModelFile::read(&check.folder.join(path))
                    .map_err(|e| check.error(&key("model"), path.display(), e))?;
                let depth = file.model.architecture.depth;
                sampler = file.sampler.clone();
                (Arc::new(Model::new(&file.model)) as Arc<dyn SilhouetteBtf + Send + Sync>, depth)
            }
            (None, Some(_)) => self.read_oracle(check, &key)?,
        };
        let sampler = Arc::new(sampler.unwrap_or_else(Sampler::cosine));
        Ok(Some(SilhouetteChoice { btf, sampler, depth, tiles: self.tiles, tile_size: self.tile_size }))
    }

    fn read_oracle(
        &self,
        check: &Checker<'_>,
        key: &dyn Fn(&str) -> String,
    ) -> Result<(Arc<dyn SilhouetteBtf + Send + Sync>, f32), SceneFileError> {
        let name = self.oracle.as_deref().unwrap_or_default();
        let samples = self.oracle_samples;
        if !(1..=1 << 20).contains(&samples) {
            return Err(check.error(&key("oracle_samples"), samples, "must be 1 to 1048576"));
        }
        let path = check.folder.join(name);
        let source = if path.is_file() { path.to_string_lossy().into_owned() } else { name.to_owned() };
        let mut micro =
            Microstructure::load(&source).map_err(|e| check.error(&key("oracle"), name, e))?.micro;
        if let Some(depth) = self.oracle_depth {
            check.range(&key("oracle_depth"), depth, 1e-4, 1.0)?;
            let own = || check.error(&key("oracle_depth"), depth, "a mesh has a depth of its own");
            micro = micro.with_depth(depth).ok_or_else(own)?;
        }
        let depth = micro.geometry.depth();
        Ok((Arc::new(Oracle::new(&micro, OracleOptions { samples, ..OracleOptions::default() })), depth))
    }
}

//! What a file says beside its numbers.

use std::collections::BTreeMap;

use serde::{Deserialize, Serialize};

use crate::infer::StoredModel;
use crate::micro::Microstructure;
use crate::model::Architecture;
use crate::sampling::Sampler;

/// A model with where it comes from.
#[derive(Debug, Clone, PartialEq)]
pub struct ModelFile {
    /// The model.
    pub model: StoredModel,
    /// What it was made of.
    pub provenance: Provenance,
    /// Directions to the light, if they were fitted.
    pub sampler: Option<Sampler>,
}

/// Everything that is needed to make a model again.
#[derive(Debug, Clone, PartialEq, Default, Serialize, Deserialize)]
#[serde(default)]
pub struct Provenance {
    /// Name and version of the program that wrote it.
    pub tool: String,
    /// Seed of the training.
    pub seed: u64,
    /// Options of the training, as the trainer has them; null for models that were not trained.
    pub training: serde_json::Value,
    /// What was measured on held-out queries; free in form.
    pub scores: serde_json::Value,
    /// What it was trained on.
    pub microstructure: Option<MicrostructureSource>,
}

/// Which microstructure a model stands for.
#[derive(Debug, Clone, PartialEq, Serialize, Deserialize)]
pub struct MicrostructureSource {
    /// Its name.
    pub name: String,
    /// SHA-256 of what it was made from, in hexadecimal digits.
    pub sha256: String,
    /// Its depth in UV units.
    pub depth: f32,
}

impl MicrostructureSource {
    /// A microstructure at the depth that was trained on; meshes keep their own. Its hash tells whether it is the same one.
    #[must_use]
    pub fn at_its_depth(&self, micro: Microstructure) -> Microstructure {
        if micro.geometry.depth() == self.depth {
            return micro;
        }
        micro.clone().with_depth(self.depth).unwrap_or(micro)
    }
}

/// The JSON under the key [`KEY`](super::layout::KEY) of a file.
#[derive(Debug, Serialize, Deserialize)]
pub(super) struct Header {
    pub format: String,
    pub version: u32,
    pub architecture: Architecture,
    pub provenance: Provenance,
    #[serde(default)]
    pub sampler: Option<Sampler>,
    /// Smallest and largest number of each tensor, for people; readers look at the tensors.
    #[serde(default)]
    pub ranges: BTreeMap<String, [f32; 2]>,
}

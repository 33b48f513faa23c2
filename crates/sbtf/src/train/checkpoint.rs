//! [`Checkpoint`]: a run on disk, from which it goes on as if it had not stopped.
//!
//! A safetensors file: `<module>.<texture|network>.<values|means|squares>`, each a list of f32, and under the key `checkpoint`
//! of its metadata everything else as JSON.

use std::collections::{BTreeMap, HashMap};
use std::io::Write as _;
use std::path::Path;

use safetensors::tensor::{Dtype, SafeTensors, TensorView};
use serde::{Deserialize, Serialize};

use super::learner::{LearnerState, Parameters};
use super::options::TrainOptions;
use super::report::{Stage, TrainReport};
use super::stage::{Position, Saved};
use super::trainer::TrainError;
use crate::model::Architecture;

/// Key of the metadata.
const KEY: &str = "checkpoint";
/// Raised when older files would be misread.
const VERSION: u32 = 1;

/// Everything that a run needs to go on.
#[derive(Debug, Clone, PartialEq)]
pub(super) struct Checkpoint {
    pub(super) header: Header,
    /// Modules that are done, and those that are being trained.
    pub(super) learners: Vec<(String, LearnerState)>,
}

/// What is no tensor.
#[derive(Debug, Clone, PartialEq, Serialize, Deserialize)]
pub(super) struct Header {
    version: u32,
    pub(super) architecture: Architecture,
    pub(super) options: TrainOptions,
    pub(super) stage: Stage,
    pub(super) position: Position,
    pub(super) report: TrainReport,
    /// Adam's steps, by module.
    steps: BTreeMap<String, u64>,
}

impl Checkpoint {
    pub(super) fn new(
        architecture: &Architecture,
        options: &TrainOptions,
        stage: Stage,
        done: &[(String, LearnerState)],
        saved: &Saved,
        report: &TrainReport,
    ) -> Self {
        let learners: Vec<_> = done.iter().chain(&saved.learners).cloned().collect();
        let header = Header {
            version: VERSION,
            architecture: architecture.clone(),
            options: options.clone(),
            stage,
            position: saved.position.clone(),
            report: report.clone(),
            steps: learners.iter().map(|(name, state)| (name.clone(), state.steps)).collect(),
        };
        Self { header, learners }
    }

    /// Writes the file at once or not at all.
    pub(super) fn write(&self, path: &Path) -> Result<(), TrainError> {
        let failed = |message: String| TrainError::Checkpoint { path: path.to_owned(), message };
        let mut bytes: BTreeMap<String, Vec<u8>> = BTreeMap::new();
        for (name, state) in &self.learners {
            for (part, parameters) in [("texture", &state.texture), ("network", &state.network)] {
                for (kind, numbers) in parameters.rows() {
                    let little = numbers.iter().flat_map(|x| x.to_le_bytes()).collect();
                    bytes.insert(format!("{name}.{part}.{kind}"), little);
                }
            }
        }
        let views: Vec<(&String, TensorView)> = (bytes.iter())
            .map(|(name, bytes)| Ok((name, TensorView::new(Dtype::F32, vec![bytes.len() / 4], bytes)?)))
            .collect::<Result<_, safetensors::SafeTensorError>>()
            .map_err(|error| failed(error.to_string()))?;
        let json = serde_json::to_string(&self.header).map_err(|error| failed(error.to_string()))?;
        let metadata = HashMap::from([(KEY.to_owned(), json)]);
        let file =
            safetensors::serialize(views, Some(metadata)).map_err(|error| failed(error.to_string()))?;
        osculate_geom::write_atomically(path, |out| out.write_all(&file))
            .map_err(|error| failed(error.to_string()))
    }

    /// Reads a file.
    pub(super) fn read(path: &Path) -> Result<Self, TrainError> {
        let failed = |message: String| TrainError::Checkpoint { path: path.to_owned(), message };
        let bytes = std::fs::read(path).map_err(|error| failed(error.to_string()))?;
        let (_, metadata) = SafeTensors::read_metadata(&bytes)
            .map_err(|error| failed(format!("no safetensors file: {error}")))?;
        let json = metadata.metadata().as_ref().and_then(|entries| entries.get(KEY));
        let json = json.ok_or_else(|| failed(format!("no checkpoint: its metadata has no `{KEY}`")))?;
        let header: Header =
            serde_json::from_str(json).map_err(|error| failed(format!("metadata `{KEY}`: {error}")))?;
        if header.version != VERSION {
            return Err(failed(format!("version {} of checkpoints, not {VERSION}", header.version)));
        }
        let tensors = SafeTensors::deserialize(&bytes).map_err(|error| failed(error.to_string()))?;
        let learners = (header.steps.iter())
            .map(|(name, &steps)| {
                let texture = parameters(&tensors, name, "texture").map_err(&failed)?;
                let network = parameters(&tensors, name, "network").map_err(&failed)?;
                Ok((name.clone(), LearnerState { texture, network, steps }))
            })
            .collect::<Result<_, TrainError>>()?;
        Ok(Self { header, learners })
    }

    /// The states of these modules, whose sizes must be those of `expected`.
    pub(super) fn take(&self, path: &Path, expected: &[(&str, &LearnerState)]) -> Result<Saved, TrainError> {
        let failed = |message: String| TrainError::Checkpoint { path: path.to_owned(), message };
        let learners = (expected.iter())
            .map(|(name, like)| {
                let found = self.learners.iter().find(|(other, _)| other == name);
                let (_, state) = found.ok_or_else(|| failed(format!("no module `{name}`")))?;
                let sizes = |state: &LearnerState| [state.texture.values.len(), state.network.values.len()];
                if sizes(state) != sizes(like) {
                    return Err(failed(format!(
                        "module `{name}` has {:?} numbers, its architecture {:?}",
                        sizes(state),
                        sizes(like)
                    )));
                }
                Ok(((*name).to_owned(), state.clone()))
            })
            .collect::<Result<_, _>>()?;
        Ok(Saved { position: self.header.position.clone(), learners })
    }
}

fn parameters(tensors: &SafeTensors, name: &str, part: &str) -> Result<Parameters, String> {
    let row = |kind: &str| {
        let full = format!("{name}.{part}.{kind}");
        let tensor = tensors.tensor(&full).map_err(|error| format!("`{full}`: {error}"))?;
        if tensor.dtype() != Dtype::F32 {
            return Err(format!("`{full}` is {:?}, not F32", tensor.dtype()));
        }
        let words = tensor.data().chunks_exact(4);
        Ok(words.map(|word| f32::from_le_bytes([word[0], word[1], word[2], word[3]])).collect::<Vec<f32>>())
    };
    let (values, means, squares) = (row("values")?, row("means")?, row("squares")?);
    if means.len() != values.len() || squares.len() != values.len() {
        return Err(format!("`{name}.{part}`: values and moments differ in length"));
    }
    Ok(Parameters { values, means, squares })
}

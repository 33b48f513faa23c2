//! Models to bytes.

use std::borrow::Cow;
use std::collections::{BTreeMap, HashMap};
use std::io::Write;
use std::path::Path;

use osculate_geom::write_atomically;
use safetensors::tensor::{Dtype, View, serialize};

use super::metadata::Header;
use super::{FileError, ModelFile, layout};
use crate::infer::{StoredTexture, Texels};

impl ModelFile {
    /// Writes the file, all of it or nothing.
    ///
    /// # Errors
    ///
    /// What the file system reports.
    pub fn write(&self, path: &Path) -> Result<(), FileError> {
        let write = |bytes: Vec<u8>| write_atomically(path, |file| file.write_all(&bytes));
        let bytes = self.to_bytes().map_err(std::io::Error::other);
        bytes.and_then(write).map_err(|error| FileError::Io { path: path.to_owned(), error })
    }

    /// The bytes of the file; the same for the same model.
    ///
    /// # Errors
    ///
    /// A header that cannot be put into JSON.
    pub fn to_bytes(&self) -> Result<Vec<u8>, safetensors::SafeTensorError> {
        let mut tensors: Vec<(String, Tensor)> = Vec::new();
        let mut ranges = BTreeMap::new();
        for (name, module) in self.model.modules() {
            push_texture(&mut tensors, &mut ranges, name, &module.texture);
            for (index, layer) in module.mlp.layers.iter().enumerate() {
                let shape = vec![layer.outputs, layer.inputs];
                push(&mut tensors, &mut ranges, layout::weights(name, index), shape, &layer.weights);
                push(
                    &mut tensors,
                    &mut ranges,
                    layout::biases(name, index),
                    vec![layer.outputs],
                    &layer.biases,
                );
            }
        }
        let header = Header {
            format: layout::FORMAT.to_owned(),
            version: layout::version(&self.model.architecture, self.sampler.as_ref()),
            architecture: self.model.architecture.clone(),
            provenance: self.provenance.clone(),
            sampler: self.sampler.clone(),
            ranges,
        };
        let header = serde_json::to_string(&header)?;
        // A single key, since the order of several is not defined.
        serialize(tensors, Some(HashMap::from([(layout::KEY.to_owned(), header)])))
    }
}

/// Bytes with a shape.
struct Tensor {
    dtype: Dtype,
    shape: Vec<usize>,
    bytes: Vec<u8>,
}

impl View for Tensor {
    fn dtype(&self) -> Dtype {
        self.dtype
    }

    fn shape(&self) -> &[usize] {
        &self.shape
    }

    fn data(&self) -> Cow<'_, [u8]> {
        Cow::Borrowed(&self.bytes)
    }

    fn data_len(&self) -> usize {
        self.bytes.len()
    }
}

type Ranges = BTreeMap<String, [f32; 2]>;

fn range(values: impl Iterator<Item = f32>) -> [f32; 2] {
    values.fold([f32::INFINITY, f32::NEG_INFINITY], |[low, high], x| [low.min(x), high.max(x)])
}

fn push(
    tensors: &mut Vec<(String, Tensor)>,
    ranges: &mut Ranges,
    name: String,
    shape: Vec<usize>,
    values: &[f32],
) {
    ranges.insert(name.clone(), range(values.iter().copied()));
    let bytes = values.iter().flat_map(|x| x.to_le_bytes()).collect();
    tensors.push((name, Tensor { dtype: Dtype::F32, shape, bytes }));
}

fn push_texture(
    tensors: &mut Vec<(String, Tensor)>,
    ranges: &mut Ranges,
    module: &str,
    texture: &StoredTexture,
) {
    let name = layout::texture(module);
    let shape = vec![texture.shape.height, texture.shape.width, texture.shape.channels];
    match &texture.texels {
        Texels::F32(texels) => push(tensors, ranges, name, shape, texels),
        Texels::F16(texels) => {
            ranges.insert(name.clone(), range(texels.iter().map(|x| x.to_f32())));
            let bytes = texels.iter().flat_map(|x| x.to_le_bytes()).collect();
            tensors.push((name, Tensor { dtype: Dtype::F16, shape, bytes }));
        }
        Texels::U8 { codes, scale, offset } => {
            ranges.insert(name.clone(), range(codes.iter().map(|&x| f32::from(x))));
            tensors.push((name, Tensor { dtype: Dtype::U8, shape, bytes: codes.clone() }));
            let channels = vec![texture.shape.channels];
            push(tensors, ranges, layout::scale(module), channels.clone(), scale);
            push(tensors, ranges, layout::offset(module), channels, offset);
        }
    }
}

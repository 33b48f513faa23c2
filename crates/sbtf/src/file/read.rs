//! Bytes to models. Nothing that a file claims is believed before it was compared with what is there.

use std::fs::File;
use std::io::Read;
use std::path::Path;

use half::f16;
use safetensors::SafeTensors;
use safetensors::tensor::{Dtype, TensorView};

use super::layout::{self, ModuleLayout};
use super::metadata::Header;
use super::{FORMAT_VERSION, FileError, InvalidModel, LARGEST_FILE, LONGEST_HEADER, ModelFile, check};
use crate::infer::{StoredModel, StoredModule, StoredTexture, Texels};
use crate::model::{Layer, Mlp};

impl ModelFile {
    /// Reads a file.
    ///
    /// # Errors
    ///
    /// What the file system reports, and all of [`InvalidModel`].
    pub fn read(path: &Path) -> Result<Self, FileError> {
        let io = |error| FileError::Io { path: path.to_owned(), error };
        let invalid = |error| FileError::Invalid { path: path.to_owned(), error };
        let file = File::open(path).map_err(io)?;
        let bytes = file.metadata().map_err(io)?.len();
        if bytes > LARGEST_FILE {
            return Err(invalid(InvalidModel::TooLarge { bytes, most: LARGEST_FILE }));
        }
        let mut data = Vec::new();
        file.take(LARGEST_FILE).read_to_end(&mut data).map_err(io)?;
        Self::from_bytes(&data).map_err(invalid)
    }

    /// Reads the bytes of a file.
    ///
    /// # Errors
    ///
    /// All of [`InvalidModel`].
    pub fn from_bytes(bytes: &[u8]) -> Result<Self, InvalidModel> {
        check_sizes(bytes)?;
        let container =
            SafeTensors::deserialize(bytes).map_err(|error| InvalidModel::Container(error.to_string()))?;
        let header = header(bytes)?;
        let tensors = Tensors(container);
        let mut modules = Vec::new();
        let mut known = 0;
        for module in layout::modules(&header.architecture) {
            let (module, tensors) = tensors.module(&module)?;
            modules.push(module);
            known += tensors;
        }
        tensors.check_known(&header, known)?;
        let (mut modules, missing) = (modules.into_iter().rev(), "every architecture has offset and colour");
        let (colour, offset) = (modules.next().expect(missing), modules.next().expect(missing));
        let opacity = modules.next();
        let model = StoredModel { architecture: header.architecture, opacity, offset, colour };
        Ok(Self { model, provenance: header.provenance, sampler: header.sampler })
    }
}

/// Compares the claimed sizes with the file's before anything is made of them.
fn check_sizes(bytes: &[u8]) -> Result<(), InvalidModel> {
    let truncated = InvalidModel::TruncatedHeader { bytes: bytes.len() };
    let Some((length, rest)) = bytes.split_first_chunk::<8>() else { return Err(truncated) };
    let claimed = u64::from_le_bytes(*length);
    if claimed > LONGEST_HEADER {
        return Err(InvalidModel::HeaderTooLong { claimed, most: LONGEST_HEADER });
    }
    let Some((header, data)) = usize::try_from(claimed).ok().and_then(|n| rest.split_at_checked(n)) else {
        return Err(truncated);
    };
    let json: serde_json::Value =
        serde_json::from_slice(header).map_err(|error| InvalidModel::Container(error.to_string()))?;
    let tensors = json.as_object().into_iter().flatten();
    let ends = tensors.filter_map(|(_, tensor)| tensor.get("data_offsets")?.get(1)?.as_u64());
    let (claimed, present) = (ends.max().unwrap_or(0), data.len() as u64);
    if claimed == present { Ok(()) } else { Err(InvalidModel::Claims { claimed, present }) }
}

/// The metadata, of a container that was checked.
fn header(bytes: &[u8]) -> Result<Header, InvalidModel> {
    let (_, container) =
        SafeTensors::read_metadata(bytes).map_err(|error| InvalidModel::Container(error.to_string()))?;
    let text = container.metadata().as_ref().and_then(|map| map.get(layout::KEY));
    let text = text.ok_or(InvalidModel::NoMetadata)?;
    // Format and version first: other versions may have other fields.
    let value: serde_json::Value = serde_json::from_str(text).map_err(InvalidModel::Metadata)?;
    let format = value.get("format").and_then(|format| format.as_str()).unwrap_or_default();
    if format != layout::FORMAT {
        return Err(InvalidModel::Format(format.to_owned()));
    }
    let found = value.get("version").and_then(serde_json::Value::as_u64).unwrap_or_default();
    if !(1..=u64::from(FORMAT_VERSION)).contains(&found) {
        return Err(InvalidModel::Version { found, known: FORMAT_VERSION });
    }
    let header: Header = serde_json::from_str(text).map_err(InvalidModel::Metadata)?;
    if found < u64::from(layout::version(&header.architecture, header.sampler.as_ref())) {
        let message = format!(
            "its taps lie along ways, or its sampler has lobes or edges, that version {found} does not know"
        );
        return Err(InvalidModel::Architecture(message));
    }
    check::architecture(&header.architecture).map_err(InvalidModel::Architecture)?;
    Ok(header)
}

struct Tensors<'a>(SafeTensors<'a>);

impl Tensors<'_> {
    fn tensor(&self, name: &str) -> Result<TensorView<'_>, InvalidModel> {
        self.0.tensor(name).map_err(|_| InvalidModel::Missing(name.to_owned()))
    }

    /// A tensor of f32 with this shape, all finite.
    fn floats(&self, name: &str, shape: &[usize]) -> Result<Vec<f32>, InvalidModel> {
        let tensor = self.tensor(name)?;
        check_type(name, &tensor, &[Dtype::F32])?;
        check_shape(name, &tensor, shape)?;
        let bytes = tensor.data().as_chunks::<4>().0;
        finite(name, bytes.iter().map(|b| f32::from_le_bytes(*b)))
    }

    /// A module, and the number of its tensors.
    fn module(&self, layout: &ModuleLayout) -> Result<(StoredModule, usize), InvalidModel> {
        let texture = self.texture(layout)?;
        let mut known = if matches!(texture.texels, Texels::U8 { .. }) { 3 } else { 1 };
        let mut layers = Vec::new();
        for (index, pair) in layout.layers.windows(2).enumerate() {
            let (inputs, outputs) = (pair[0], pair[1]);
            let weights = self.floats(&layout::weights(layout.name, index), &[outputs, inputs])?;
            let biases = self.floats(&layout::biases(layout.name, index), &[outputs])?;
            layers.push(Layer { inputs, outputs, weights, biases });
            known += 2;
        }
        Ok((StoredModule { texture, mlp: Mlp { layers } }, known))
    }

    fn texture(&self, layout: &ModuleLayout) -> Result<StoredTexture, InvalidModel> {
        let name = layout::texture(layout.name);
        let (tensor, shape) = (self.tensor(&name)?, layout.texture);
        check_type(&name, &tensor, &[Dtype::F32, Dtype::F16, Dtype::U8])?;
        check_shape(&name, &tensor, &[shape.height, shape.width, shape.channels])?;
        let texels = match tensor.dtype() {
            Dtype::F16 => {
                let texels = tensor.data().as_chunks::<2>().0.iter().map(|b| f16::from_le_bytes(*b));
                let texels: Vec<f16> = texels.collect();
                finite(&name, texels.iter().map(|x| x.to_f32()))?;
                Texels::F16(texels)
            }
            Dtype::U8 => Texels::U8 {
                codes: tensor.data().to_vec(),
                scale: self.floats(&layout::scale(layout.name), &[shape.channels])?,
                offset: self.floats(&layout::offset(layout.name), &[shape.channels])?,
            },
            _ => Texels::F32(finite(
                &name,
                tensor.data().as_chunks::<4>().0.iter().map(|b| f32::from_le_bytes(*b)),
            )?),
        };
        Ok(StoredTexture { shape, texels })
    }

    /// That there is no tensor beside the known ones, all of which were read.
    fn check_known(&self, header: &Header, known: usize) -> Result<(), InvalidModel> {
        if self.0.len() == known {
            return Ok(());
        }
        let modules = layout::modules(&header.architecture);
        let is_known = |name: &str| {
            modules.iter().any(|module| {
                let layers = 0..module.layers.len() - 1;
                let textures =
                    [layout::texture(module.name), layout::scale(module.name), layout::offset(module.name)];
                textures.iter().any(|known| known == name)
                    || layers.into_iter().any(|layer| {
                        name == layout::weights(module.name, layer)
                            || name == layout::biases(module.name, layer)
                    })
            })
        };
        let mut names = self.0.names();
        names.sort_unstable();
        let unknown = names.iter().find(|name| !is_known(name));
        // Scales of textures that are no codes are left.
        Err(InvalidModel::Unexpected(
            unknown.map_or_else(|| "texture.scale".to_owned(), |name| (*name).to_owned()),
        ))
    }
}

fn check_type(name: &str, tensor: &TensorView<'_>, wanted: &[Dtype]) -> Result<(), InvalidModel> {
    if wanted.contains(&tensor.dtype()) {
        return Ok(());
    }
    let wanted: Vec<_> = wanted.iter().map(|dtype| format!("{dtype:?}")).collect();
    let (tensor, found) = (name.to_owned(), format!("{:?}", tensor.dtype()));
    Err(InvalidModel::Type { tensor, found, wanted: wanted.join(" or ") })
}

fn check_shape(name: &str, tensor: &TensorView<'_>, wanted: &[usize]) -> Result<(), InvalidModel> {
    if tensor.shape() == wanted {
        return Ok(());
    }
    let (tensor, found) = (name.to_owned(), tensor.shape().to_vec());
    Err(InvalidModel::Shape { tensor, found, wanted: wanted.to_vec() })
}

fn finite(name: &str, values: impl Iterator<Item = f32>) -> Result<Vec<f32>, InvalidModel> {
    let check = |(index, value): (usize, f32)| {
        let not_finite = || InvalidModel::NotFinite { tensor: name.to_owned(), index, value };
        value.is_finite().then_some(value).ok_or_else(not_finite)
    };
    values.enumerate().map(check).collect()
}

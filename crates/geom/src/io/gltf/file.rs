//! [`GltfFile`]: the JSON of a glTF file with its buffers, every reference checked when it is followed.
//!
//! The `gltf` crate splits the GLB container and parses the JSON. Its own validation is not used: it panics on a
//! `POSITION` accessor out of range, refuses files over extensions that do not matter here, and does not say values.

use std::borrow::Cow;
use std::collections::HashMap;
use std::fmt;

use ::gltf::binary::{self, Glb};
use ::gltf::json::accessor::Accessor;
use ::gltf::json::buffer::{Buffer, View};
use ::gltf::json::validation::Checked;
use ::gltf::json::{Index, Root};
use base64::Engine;
use base64::engine::{DecodePaddingMode, GeneralPurpose, GeneralPurposeConfig};
use percent_encoding::percent_decode_str;

use super::GltfError;
use crate::io::files::Resolver;

/// The JSON, and the buffers that could be read.
#[derive(Debug)]
pub(crate) struct GltfFile<'a> {
    pub root: Root,
    /// One per distinct source.
    sources: Vec<Cow<'a, [u8]>>,
    /// Per buffer its source. A buffer that no mesh uses may be missing, so its error waits for the use.
    buffers: Vec<Result<usize, GltfError>>,
}

/// Extensions that a file may require and be read all the same, since they change only what is not read here.
const HARMLESS: [&str; 6] = [
    "KHR_mesh_quantization",
    "KHR_texture_transform",
    "KHR_lights_punctual",
    "KHR_texture_basisu",
    "EXT_texture_webp",
    "MSFT_texture_dds",
];

impl<'a> GltfFile<'a> {
    /// Reads the container (GLB if it starts like one), the JSON and the buffers.
    pub fn parse(bytes: &'a [u8], resolver: &Resolver<'_>) -> Result<Self, GltfError> {
        let (json, blob) =
            if bytes.starts_with(b"glTF") { split_glb(bytes)? } else { (Cow::Borrowed(bytes), None) };
        let json = json.strip_prefix(b"\xef\xbb\xbf").unwrap_or(&json);
        let root = Root::from_slice(json).map_err(|e| GltfError::Json { message: e.to_string() })?;
        if !root.asset.version.starts_with("2.") {
            return Err(GltfError::Version { version: root.asset.version });
        }
        let unknown = |e: &&String| !HARMLESS.contains(&e.as_str()) && !e.starts_with("KHR_materials_");
        if let Some(extension) = root.extensions_required.iter().find(unknown) {
            return Err(GltfError::Extension { extension: extension.clone() });
        }
        let mut file = Self { root, sources: Vec::new(), buffers: Vec::new() };
        file.read_buffers(blob, resolver);
        Ok(file)
    }

    fn read_buffers(&mut self, blob: Option<Cow<'a, [u8]>>, resolver: &Resolver<'_>) {
        let mut blob = blob;
        // Many buffers may name one large file.
        let mut known: HashMap<String, usize> = HashMap::new();
        for (number, buffer) in self.root.buffers.iter().enumerate() {
            let shared = buffer.uri.as_ref().and_then(|uri| known.get(uri)).copied();
            let source = match (shared, &buffer.uri) {
                (Some(source), _) => Ok(source),
                (None, Some(uri)) => read_uri(uri, resolver).map(|bytes| {
                    self.sources.push(Cow::Owned(bytes));
                    known.insert(uri.clone(), self.sources.len() - 1);
                    self.sources.len() - 1
                }),
                // Only the first buffer may be the GLB's own.
                (None, None) => match blob.take().filter(|_| number == 0) {
                    Some(bytes) => {
                        self.sources.push(bytes);
                        Ok(self.sources.len() - 1)
                    }
                    None => Err("there is no uri, and no binary chunk for it".to_owned()),
                },
            };
            let source_name = source_name(buffer);
            let checked = match source {
                Err(message) => Err(GltfError::Buffer { buffer: number, source_name, message }),
                Ok(source) => {
                    let (bytes, claimed) = (self.sources[source].len(), buffer.byte_length.0);
                    if (bytes as u64) < claimed {
                        Err(GltfError::ShortBuffer { buffer: number, source_name, bytes, claimed })
                    } else {
                        Ok(source)
                    }
                }
            };
            self.buffers.push(checked);
        }
    }

    /// The bytes of a buffer view and its stride, 0 for tightly packed.
    pub fn view(&self, view: Index<View>, place: &dyn fmt::Display) -> Result<(&[u8], usize), GltfError> {
        let number = view.value();
        let view = item(&self.root.buffer_views, view, "buffer view", place)?;
        let buffer = view.buffer.value();
        let here = format!("bufferViews[{number}]");
        item(&self.root.buffers, view.buffer, "buffer", &here)?;
        let source = self.buffers[buffer].clone()?;
        let claimed = usize::try_from(self.root.buffers[buffer].byte_length.0).unwrap_or(usize::MAX);
        let bytes = &self.sources[source];
        let bytes = &bytes[..claimed.min(bytes.len())];
        let (offset, length) = (view.byte_offset.unwrap_or_default().0, view.byte_length.0);
        let range = usize::try_from(offset).ok().zip(usize::try_from(length).ok());
        let slice = range.and_then(|(offset, length)| bytes.get(offset..)?.get(..length));
        let slice =
            slice.ok_or(GltfError::BadView { view: number, length, offset, buffer, bytes: bytes.len() })?;
        Ok((slice, view.byte_stride.map_or(0, |s| s.0)))
    }

    pub(super) fn accessor(
        &self,
        accessor: Index<Accessor>,
        place: &dyn fmt::Display,
    ) -> Result<&Accessor, GltfError> {
        item(&self.root.accessors, accessor, "accessor", place)
    }

    /// Size of all buffers together.
    pub(super) fn source_bytes(&self) -> usize {
        self.sources.iter().map(|s| s.len()).sum()
    }
}

/// The item that a reference at `place` names.
pub(super) fn item<'t, T>(
    items: &'t [T],
    index: Index<T>,
    what: &'static str,
    place: &dyn fmt::Display,
) -> Result<&'t T, GltfError> {
    items.get(index.value()).ok_or_else(|| GltfError::BadReference {
        place: place.to_string(),
        what,
        index: index.value(),
        count: items.len(),
    })
}

/// A value that the JSON parser has found valid.
pub(super) fn valid<T: Copy>(
    value: &Checked<T>,
    what: &'static str,
    place: &dyn fmt::Display,
) -> Result<T, GltfError> {
    match value {
        Checked::Valid(value) => Ok(*value),
        Checked::Invalid => Err(GltfError::BadValue { place: place.to_string(), what }),
    }
}

/// A number with a name, if there is one.
pub(super) fn label(kind: &str, number: usize, name: Option<&String>) -> String {
    match name {
        Some(name) if !name.is_empty() => format!("{kind} {number} {name:?}"),
        _ => format!("{kind} {number}"),
    }
}

/// The JSON chunk, and the binary chunk if there is one.
type Chunks<'a> = (Cow<'a, [u8]>, Option<Cow<'a, [u8]>>);

fn split_glb(bytes: &[u8]) -> Result<Chunks<'_>, GltfError> {
    // Checked before the crate does: it subtracts the header's size from the claimed length without looking.
    let word = |i: usize| bytes.get(i..i + 4).and_then(|w| w.try_into().ok()).map(u32::from_le_bytes);
    let (Some(version), Some(claimed)) = (word(4), word(8)) else {
        return Err(GltfError::NoHeader { bytes: bytes.len() });
    };
    if version != 2 {
        return Err(GltfError::Version { version: version.to_string() });
    }
    if claimed as usize > bytes.len() {
        return Err(GltfError::Truncated { claimed, bytes: bytes.len() });
    }
    if claimed < 12 {
        return Err(GltfError::Chunk {
            message: format!("the header claims {claimed} bytes, fewer than its own 12"),
        });
    }
    let glb = Glb::from_slice(&bytes[..claimed as usize]).map_err(|e| GltfError::Chunk {
        message: match e {
            ::gltf::Error::Binary(binary::Error::ChunkLength { ty, length, length_read }) => {
                format!("{ty:?} chunk claims {length} bytes, {length_read} follow; the file may be cut off")
            }
            ::gltf::Error::Binary(binary::Error::Io(_)) => {
                "its header is incomplete; the file may be cut off".into()
            }
            ::gltf::Error::Binary(binary::Error::UnknownChunkType(ty)) => {
                format!("type {:?} is neither JSON nor BIN", String::from_utf8_lossy(&ty))
            }
            other => other.to_string(),
        },
    })?;
    Ok((glb.json, glb.bin))
}

fn source_name(buffer: &Buffer) -> String {
    match &buffer.uri {
        None => "binary chunk".into(),
        Some(uri) if uri.starts_with("data:") => "data URI".into(),
        Some(uri) => format!("{uri:?}"),
    }
}

/// The bytes behind a URI: a data URI, or a file.
pub(super) fn read_uri(uri: &str, resolver: &Resolver<'_>) -> Result<Vec<u8>, String> {
    if let Some(data) = uri.strip_prefix("data:") {
        let (kind, data) = data.split_once(',').ok_or("the data URI has no comma")?;
        if !kind.ends_with(";base64") {
            return Ok(percent_decode_str(data).collect());
        }
        let engine = GeneralPurpose::new(
            &base64::alphabet::STANDARD,
            GeneralPurposeConfig::new().with_decode_padding_mode(DecodePaddingMode::Indifferent),
        );
        return engine.decode(data).map_err(|e| format!("the data URI is not base64: {e}"));
    }
    // Some writers do not encode, so that a name may hold a percent sign of its own.
    let decoded = percent_decode_str(uri).decode_utf8_lossy();
    resolver(&decoded)
        .or_else(|error| if decoded == uri { Err(error) } else { resolver(uri) })
        .map_err(|e| e.to_string())
}

#[cfg(test)]
mod tests {
    use super::*;
    use crate::io::no_files;

    #[test]
    fn data_uris_and_encoded_names() {
        let files = |name: &str| if name == "a b%.bin" { Ok(vec![1]) } else { no_files(name) };
        assert_eq!(read_uri("data:application/octet-stream;base64,AQID", &no_files).unwrap(), [1, 2, 3]);
        assert_eq!(read_uri("data:;base64,AQI=", &no_files).unwrap(), [1, 2]);
        assert_eq!(read_uri("data:,a%20", &no_files).unwrap(), b"a ");
        assert_eq!(read_uri("a%20b%25.bin", &files).unwrap(), [1]);
        assert_eq!(read_uri("a b%.bin", &files).unwrap(), [1]);
        assert!(read_uri("data:;base64,***", &no_files).unwrap_err().contains("not base64"));
    }

    #[test]
    fn containers_that_lie_are_refused() {
        let message = |bytes: &[u8]| GltfFile::parse(bytes, &no_files).unwrap_err().to_string();
        assert!(message(b"glTF\x02\0\0").contains("needs 12 bytes, the file has 7"));
        assert!(message(b"glTF\x01\0\0\0\x0c\0\0\0").contains("version 1"));
        assert!(message(b"glTF\x02\0\0\0\xff\0\0\0").contains("claims 255 bytes, the file has 12"));
        assert!(message(b"glTF\x02\0\0\0\x03\0\0\0").contains("claims 3 bytes, fewer"));
        assert!(message(b"glTF\x02\0\0\0\x14\0\0\0\x09\0\0\0JSON").contains("claims 9 bytes, 0 follow"));
        assert!(message(b"{\"asset\":{\"version\":\"1.0\"}}").contains("version 1.0"));
        assert!(message(b"{\"asset\":").starts_with("JSON: "));
        let meshopt = br#"{"asset":{"version":"2.0"},"extensionsRequired":["EXT_meshopt_compression"]}"#;
        assert!(message(meshopt).contains("EXT_meshopt_compression"));
    }
}

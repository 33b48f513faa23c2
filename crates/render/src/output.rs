//! Writing PNG and EXR, and reading environment maps.

use std::fs;
use std::io::{Cursor, Write};
use std::path::Path;

use exr::prelude::{
    AnyChannel, AnyChannels, Encoding, FlatSamples, Image, Layer, LayerAttributes, ReadChannels, ReadLayers,
    WritableImage,
};
use glam::Vec3;
use thiserror::Error;

use crate::lights::EnvironmentImage;
use crate::tone::Picture;

/// A picture that cannot be written or read. Callers add the file's name.
#[derive(Debug, Error)]
pub enum OutputError {
    /// The file system refuses.
    #[error(transparent)]
    Io(#[from] std::io::Error),
    /// The PNG encoder refuses.
    #[error(transparent)]
    Png(#[from] image::ImageError),
    /// The EXR library refuses.
    #[error(transparent)]
    Exr(#[from] exr::error::Error),
}

/// A named layer of floating-point channels, each `width * height` values, top row first.
#[derive(Debug, Clone, PartialEq)]
pub struct ExrLayer {
    /// Name of the layer; empty for the main one, whose channels viewers show.
    pub name: String,
    /// Channel names and values.
    pub channels: Vec<(String, Vec<f32>)>,
}

impl ExrLayer {
    /// A layer with channels R, G and B.
    #[must_use]
    pub fn rgb(name: &str, pixels: &[Vec3]) -> Self {
        Self::vector(name, ["R", "G", "B"], pixels)
    }

    /// A layer with three channels of these names.
    #[must_use]
    pub fn vector(name: &str, channels: [&str; 3], pixels: &[Vec3]) -> Self {
        let channel = |axis: usize| (channels[axis].to_owned(), pixels.iter().map(|p| p[axis]).collect());
        Self { name: name.into(), channels: (0..3).map(channel).collect() }
    }

    /// A layer with one channel V.
    #[must_use]
    pub fn scalar(name: &str, values: Vec<f32>) -> Self {
        Self { name: name.into(), channels: vec![("V".into(), values)] }
    }
}

/// Encodes a picture as PNG.
///
/// # Errors
///
/// What the encoder reports.
pub fn png_bytes(picture: &Picture) -> Result<Vec<u8>, OutputError> {
    let mut bytes = Cursor::new(Vec::new());
    let (width, height) = (picture.width, picture.height);
    image::write_buffer_with_format(
        &mut bytes,
        &picture.rgb,
        width,
        height,
        image::ExtendedColorType::Rgb8,
        image::ImageFormat::Png,
    )?;
    Ok(bytes.into_inner())
}

/// Writes a PNG. An interrupted write leaves no file, or the old one.
///
/// # Errors
///
/// What the encoder or the file system reports.
pub fn write_png(path: &Path, picture: &Picture) -> Result<(), OutputError> {
    write_atomically(path, &png_bytes(picture)?)
}

/// Encodes layers as a multi-part OpenEXR file of 32-bit floats, losslessly compressed.
///
/// # Errors
///
/// What the encoder reports, for instance for two channels of one name.
///
/// # Panics
///
/// If a channel has not `width * height` values.
pub fn exr_bytes(width: u32, height: u32, layers: &[ExrLayer]) -> Result<Vec<u8>, OutputError> {
    let size = (width as usize, height as usize);
    let layer = |layer: &ExrLayer| {
        let channel = |(name, values): &(String, Vec<f32>)| {
            assert_eq!(values.len(), size.0 * size.1, "channel {name} of layer {:?}", layer.name);
            AnyChannel::new(name.as_str(), FlatSamples::F32(values.clone()))
        };
        let channels = AnyChannels::sort(layer.channels.iter().map(channel).collect());
        Layer::new(size, LayerAttributes::named(layer.name.as_str()), Encoding::SMALL_LOSSLESS, channels)
    };
    let attributes = exr::meta::header::ImageAttributes::with_size(size);
    let image = Image::from_layers(attributes, layers.iter().map(layer).collect::<Vec<_>>());
    let mut bytes = Cursor::new(Vec::new());
    image.write().non_parallel().to_buffered(&mut bytes)?;
    Ok(bytes.into_inner())
}

/// Writes layers as [`exr_bytes`] encodes them. An interrupted write leaves no file, or the old one.
///
/// # Errors
///
/// What the encoder or the file system reports.
pub fn write_exr(path: &Path, width: u32, height: u32, layers: &[ExrLayer]) -> Result<(), OutputError> {
    write_atomically(path, &exr_bytes(width, height, layers)?)
}

/// Reads all layers of an EXR file as floats: width, height, layers.
///
/// # Errors
///
/// A file that is not EXR, or is damaged.
pub fn read_exr(bytes: &[u8]) -> Result<(u32, u32, Vec<ExrLayer>), OutputError> {
    let image = exr::prelude::read()
        .no_deep_data()
        .largest_resolution_level()
        .all_channels()
        .all_layers()
        .all_attributes()
        .from_buffered(Cursor::new(bytes))?;
    let size = image.layer_data.first().map_or((0, 0), |l| (l.size.width(), l.size.height()));
    let layer = |l: &Layer<AnyChannels<FlatSamples>>| ExrLayer {
        name: l.attributes.layer_name.as_ref().map(ToString::to_string).unwrap_or_default(),
        channels: l
            .channel_data
            .list
            .iter()
            .map(|c| (c.name.to_string(), c.sample_data.values_as_f32().collect()))
            .collect(),
    };
    let narrow = |x: usize| u32::try_from(x).unwrap_or(u32::MAX);
    Ok((narrow(size.0), narrow(size.1), image.layer_data.iter().map(layer).collect()))
}

/// Reads an environment map from an EXR file: channels R, G and B of the first layer that has them.
///
/// # Errors
///
/// A file that is not EXR, is damaged, or has no such layer.
pub fn read_environment(bytes: &[u8]) -> Result<EnvironmentImage, OutputError> {
    let (width, height, layers) = read_exr(bytes)?;
    let channel = |layer: &ExrLayer, name: &str| layer.channels.iter().position(|(n, _)| n == name);
    let found = layers.iter().find_map(|layer| {
        let [r, g, b] = ["R", "G", "B"].map(|name| channel(layer, name));
        let [r, g, b] = [r?, g?, b?].map(|i| &layer.channels[i].1);
        (r.len() == width as usize * height as usize && !r.is_empty())
            .then(|| (0..r.len()).map(|i| Vec3::new(r[i], g[i], b[i])).collect())
    });
    let pixels = found.ok_or(exr::error::Error::Invalid("no layer with channels R, G and B".into()))?;
    Ok(EnvironmentImage::new(width as usize, height as usize, pixels))
}

fn write_atomically(path: &Path, bytes: &[u8]) -> Result<(), OutputError> {
    let mut temporary = path.as_os_str().to_owned();
    temporary.push(".part");
    let written = fs::File::create(&temporary)
        .and_then(|mut file| file.write_all(bytes).and_then(|()| file.sync_all()));
    let renamed = written.and_then(|()| fs::rename(&temporary, path));
    if renamed.is_err() {
        // The error that is reported is the first one.
        let _ = fs::remove_file(&temporary);
    }
    Ok(renamed?)
}

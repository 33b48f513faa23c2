//! [`Raster`]: an image's channels as numbers.

use std::io::Cursor;

use image::{DynamicImage, ImageDecoder, ImageFormat, ImageReader};

use super::Problem;

/// Most texels along a side that are read.
pub const MAX_SIDE: usize = 16_384;
/// Most texels that are read in all.
pub const MAX_TEXELS: usize = 1 << 27;

/// An image, decoded.
#[derive(Debug, Clone, PartialEq)]
pub struct Raster {
    /// Texels along u.
    pub width: usize,
    /// Texels along v.
    pub height: usize,
    /// Grey, or red, green and blue: each row by row, the top row first. Codes are scaled to `[0, 1]`, floats are as they are.
    pub planes: Vec<Vec<f32>>,
    /// How the file stores them.
    pub format: TexelFormat,
}

/// How a file stores texels.
#[derive(Debug, Clone, Copy, PartialEq, Eq)]
pub enum TexelFormat {
    /// Codes of this many bits: 1, 2, 4, 8 or 16.
    Code(u8),
    /// Floating point of any width.
    Float,
}

impl Raster {
    /// Decodes PNG, JPEG or EXR, told apart by their first bytes. The size is checked before anything is decoded; alpha is ignored.
    ///
    /// # Errors
    ///
    /// Another format, a broken file, one that is too large, or an EXR with neither R, G, B nor a single channel or Y.
    pub fn decode(bytes: &[u8]) -> Result<Self, Problem> {
        match image::guess_format(bytes) {
            Ok(format @ (ImageFormat::Png | ImageFormat::Jpeg)) => decode_codes(bytes, format),
            Ok(ImageFormat::OpenExr) => decode_exr(bytes),
            _ => Err(Problem::UnknownFormat),
        }
    }

    /// The only plane of a grey image; a colour image whose channels are all equal counts as one.
    ///
    /// # Errors
    ///
    /// A colour image: which channel is meant is not known.
    pub fn into_grey(mut self) -> Result<Vec<f32>, Problem> {
        if let [red, green, blue] = self.planes.as_slice() {
            let differs = |i: usize| (red[i] - green[i]).abs().max((red[i] - blue[i]).abs()) > 2.5 / 255.0;
            if let Some(i) = (0..red.len()).find(|&i| differs(i)) {
                return Err(Problem::Channels(format!(
                    "is in colour: texel ({}, {}) is ({:.3}, {:.3}, {:.3}). A grey map is needed here",
                    i % self.width,
                    i / self.width,
                    red[i],
                    green[i],
                    blue[i]
                )));
            }
        }
        Ok(self.planes.swap_remove(0))
    }
}

pub(super) fn check_size(width: usize, height: usize) -> Result<(), Problem> {
    let fits = width.max(height) <= MAX_SIDE && width.checked_mul(height).is_some_and(|n| n <= MAX_TEXELS);
    if fits && width > 0 && height > 0 { Ok(()) } else { Err(Problem::TooLarge { width, height }) }
}

fn decode_codes(bytes: &[u8], format: ImageFormat) -> Result<Raster, Problem> {
    let damaged = |e: image::ImageError| Problem::Damaged(e.to_string());
    let decoder = ImageReader::with_format(Cursor::new(bytes), format).into_decoder().map_err(damaged)?;
    let (width, height) = decoder.dimensions();
    let (width, height) = (width as usize, height as usize);
    check_size(width, height)?;
    // The decoder widens codes below 8 bits and does not say so; a PNG's first chunk does, which the decoder has checked.
    let bits = if format == ImageFormat::Png { bytes.get(24).copied().unwrap_or(8) } else { 8 };
    let image = DynamicImage::from_decoder(decoder).map_err(damaged)?;
    let planes = if image.color().has_color() {
        let texels = image.into_rgb16().into_raw();
        (0..3).map(|channel| texels.iter().skip(channel).step_by(3).map(|&x| share(x)).collect()).collect()
    } else {
        vec![image.into_luma16().into_raw().iter().map(|&x| share(x)).collect()]
    };
    Ok(Raster { width, height, planes, format: TexelFormat::Code(bits) })
}

fn share(code: u16) -> f32 {
    f32::from(code) / 65_535.0
}

fn decode_exr(bytes: &[u8]) -> Result<Raster, Problem> {
    use exr::prelude::{ReadChannels as _, ReadLayers as _};
    let damaged = |e: exr::error::Error| Problem::Damaged(e.to_string());
    let meta = exr::meta::MetaData::read_from_buffered(Cursor::new(bytes), false).map_err(damaged)?;
    for header in &meta.headers {
        check_size(header.layer_size.x(), header.layer_size.y())?;
    }
    let reader = exr::prelude::read().no_deep_data().largest_resolution_level().all_channels();
    // In parallel, results would be the same; but a small file would start all threads.
    let image = reader.first_valid_layer().all_attributes().non_parallel();
    let layer = image.from_buffered(Cursor::new(bytes)).map_err(damaged)?.layer_data;
    let channels = &layer.channel_data.list;
    let find = |name: &str| channels.iter().find(|c| c.name.to_string().eq_ignore_ascii_case(name));
    let chosen = if let (Some(r), Some(g), Some(b)) = (find("R"), find("G"), find("B")) {
        vec![r, g, b]
    } else if let Some(grey) = find("Y").or_else(|| channels.first().filter(|_| channels.len() == 1)) {
        vec![grey]
    } else {
        let names = channels.iter().map(|c| c.name.to_string()).collect::<Vec<_>>().join(", ");
        return Err(Problem::Channels(format!(
            "has the channels {names}; R, G and B, or Y, or a single one are needed"
        )));
    };
    let (width, height) = (layer.size.x(), layer.size.y());
    let planes: Vec<Vec<f32>> = chosen.iter().map(|c| c.sample_data.values_as_f32().collect()).collect();
    if planes.iter().any(|plane| plane.len() != width * height) {
        return Err(Problem::Channels("has subsampled channels, which are not read".into()));
    }
    Ok(Raster { width, height, planes, format: TexelFormat::Float })
}

#[cfg(test)]
mod tests {
    use super::*;

    fn png(width: u32, height: u32, colour: image::ExtendedColorType, bytes: &[u8]) -> Vec<u8> {
        let mut out = Vec::new();
        let encoder = image::codecs::png::PngEncoder::new(&mut out);
        image::ImageEncoder::write_image(encoder, bytes, width, height, colour).unwrap();
        out
    }

    #[test]
    fn codes_become_shares() {
        let eight = Raster::decode(&png(3, 1, image::ExtendedColorType::L8, &[0, 51, 255])).unwrap();
        assert_eq!((eight.format, &eight.planes), (TexelFormat::Code(8), &vec![vec![0.0, 0.2, 1.0]]));
        let texels: Vec<u8> = [13_107_u16, 65_535].iter().flat_map(|x| x.to_ne_bytes()).collect();
        let sixteen = Raster::decode(&png(1, 2, image::ExtendedColorType::L16, &texels)).unwrap();
        assert_eq!((sixteen.format, &sixteen.planes), (TexelFormat::Code(16), &vec![vec![0.2, 1.0]]));
        let colour = Raster::decode(&png(1, 1, image::ExtendedColorType::Rgb8, &[255, 0, 0])).unwrap();
        assert_eq!(colour.planes, [[1.0], [0.0], [0.0]]);
        assert!(colour.into_grey().unwrap_err().to_string().contains("in colour: texel (0, 0)"));
    }

    #[test]
    fn floats_are_as_they_are() {
        let mut bytes = Cursor::new(Vec::new());
        use exr::prelude::WritableImage as _;
        let pixels = |p: exr::math::Vec2<usize>| (p.x() as f32, f32::NAN, -7.5_f32);
        exr::image::Image::from_channels((2, 1), exr::image::SpecificChannels::rgb(pixels))
            .write()
            .to_buffered(&mut bytes)
            .unwrap();
        let raster = Raster::decode(bytes.get_ref()).unwrap();
        assert_eq!((raster.planes[0].as_slice(), raster.planes[2][1]), ([0.0, 1.0].as_slice(), -7.5));
        assert!(raster.planes[1][0].is_nan() && raster.format == TexelFormat::Float);
    }

    #[test]
    fn sizes_are_refused_before_decoding() {
        // Only the header of a PNG of 30,000 texels a side, with its checksum.
        let mut header = b"\x89PNG\r\n\x1a\n\0\0\0\rIHDR\0\0\x75\x30\0\0\x75\x30\x08\0\0\0\0".to_vec();
        header.extend(crc32(&header[12..29]).to_be_bytes());
        header.extend(b"\0\0\0\0IDAT");
        header.extend(crc32(b"IDAT").to_be_bytes());
        let message = Raster::decode(&header).unwrap_err().to_string();
        assert!(message.contains("30000 x 30000") && message.contains("Scale it down"), "{message}");
        assert!(matches!(Raster::decode(b"GIF89a"), Err(Problem::UnknownFormat)));
        assert!(matches!(Raster::decode(b"\x89PNG\r\n\x1a\nrest"), Err(Problem::Damaged(_))));
    }

    fn crc32(bytes: &[u8]) -> u32 {
        !bytes.iter().fold(!0, |crc, &byte| {
            (0..8).fold(crc ^ u32::from(byte), |c, _| if c & 1 == 1 { c >> 1 ^ 0xEDB8_8320 } else { c >> 1 })
        })
    }
}

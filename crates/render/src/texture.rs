//! [`Texture`]: an sRGB colour image, looked up bilinearly with wrapping.

use std::io::Cursor;

use glam::Vec3;
use osculate_sbtf::colour::linear_from_srgb;
use thiserror::Error;

/// A colour image. UV (0, 0) is the lower left corner, v goes up; texels lie at half-integer positions.
#[derive(Clone)]
pub struct Texture {
    width: u32,
    height: u32,
    /// sRGB, top row first.
    texels: Vec<[u8; 3]>,
    linear_from_srgb: [f32; 256],
}

/// Bytes that are not an image.
#[derive(Debug, Error)]
#[error("cannot decode the texture: {0}")]
pub struct TextureError(#[from] image::ImageError);

impl std::fmt::Debug for Texture {
    fn fmt(&self, f: &mut std::fmt::Formatter<'_>) -> std::fmt::Result {
        write!(f, "Texture({} x {})", self.width, self.height)
    }
}

impl Texture {
    /// Decodes a PNG or JPEG.
    ///
    /// # Errors
    ///
    /// Another format, or damaged data.
    pub fn decode(bytes: &[u8]) -> Result<Self, TextureError> {
        let reader = image::ImageReader::new(Cursor::new(bytes))
            .with_guessed_format()
            .map_err(image::ImageError::from)?;
        let picture = reader.decode()?.into_rgb8();
        let (width, height) = picture.dimensions();
        Ok(Self::from_srgb(width, height, picture.pixels().map(|p| p.0).collect()))
    }

    /// Takes sRGB texels, top row first.
    ///
    /// # Panics
    ///
    /// If there are not `width * height` texels, or none.
    #[must_use]
    pub fn from_srgb(width: u32, height: u32, texels: Vec<[u8; 3]>) -> Self {
        assert!(!texels.is_empty() && texels.len() == width as usize * height as usize);
        let linear_from_srgb = std::array::from_fn(|i| linear_from_srgb(i as f32 / 255.0));
        Self { width, height, texels, linear_from_srgb }
    }

    /// The linear colour at a UV position, bilinear between texels, repeated outside the unit square.
    #[must_use]
    #[allow(
        clippy::cast_possible_truncation,
        clippy::cast_sign_loss,
        reason = "coordinates are wrapped into the image first"
    )]
    // So that scenes without textures do not pay for its registers.
    #[inline(never)]
    pub fn lookup(&self, uv: [f32; 2]) -> Vec3 {
        // A UV that is not finite looks up the corner: NaN as an index is 0.
        let wrap = |x: f32, size: u32| (x - x.floor()) * size as f32 - 0.5;
        let (x, y) = (wrap(uv[0], self.width), wrap(1.0 - uv[1], self.height));
        let (x0, y0) = (x.floor(), y.floor());
        let (fx, fy) = (x - x0, y - y0);
        let column = |x: f32| if x < 0.0 { self.width - 1 } else { (x as u32) % self.width };
        let row = |y: f32| if y < 0.0 { self.height - 1 } else { (y as u32) % self.height };
        let (xs, ys) = ([column(x0), column(x0 + 1.0)], [row(y0), row(y0 + 1.0)]);
        let texel = |i: usize, j: usize| {
            let rgb = self.texels[ys[j] as usize * self.width as usize + xs[i] as usize];
            Vec3::from(rgb.map(|c| self.linear_from_srgb[usize::from(c)]))
        };
        texel(0, 0).lerp(texel(1, 0), fx).lerp(texel(0, 1).lerp(texel(1, 1), fx), fy)
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn texel_centres_wrapping_and_orientation() {
        let texture = Texture::from_srgb(2, 2, vec![[255, 0, 0], [0, 255, 0], [0, 0, 255], [255, 255, 255]]);
        for offset in [0.0, 1.0, -3.0] {
            // v is up: the first row of the file is at the top.
            assert_eq!(texture.lookup([0.25 + offset, 0.75]), Vec3::X);
            assert_eq!(texture.lookup([0.75, 0.25 + offset]), Vec3::ONE);
        }
        let corner = texture.lookup([0.0, 0.0]);
        assert!((corner - Vec3::splat(0.5)).length() < 1e-6, "{corner}");
    }
}

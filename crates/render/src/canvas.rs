//! Text and rectangles on pictures.

use embedded_graphics::mono_font::{MonoFont, MonoTextStyle, ascii};
use embedded_graphics::pixelcolor::Rgb888;
use embedded_graphics::prelude::{DrawTarget, Drawable, OriginDimensions, Pixel, Point, RgbColor, Size};
use embedded_graphics::text::{Alignment, Baseline, Text, TextStyleBuilder};

use crate::tone::Picture;

/// White.
pub(crate) const PAPER: [u8; 3] = [255, 255, 255];

const INK: Rgb888 = Rgb888::new(40, 40, 40);

/// An image that text is drawn on, magnified without smoothing.
pub(crate) struct Canvas {
    picture: Picture,
    zoom: u32,
}

impl OriginDimensions for Canvas {
    fn size(&self) -> Size {
        Size::new(self.picture.width / self.zoom, self.picture.height / self.zoom)
    }
}

impl DrawTarget for Canvas {
    type Color = Rgb888;
    type Error = std::convert::Infallible;

    fn draw_iter<I: IntoIterator<Item = Pixel<Rgb888>>>(&mut self, pixels: I) -> Result<(), Self::Error> {
        for Pixel(Point { x, y }, colour) in pixels {
            let (Ok(x), Ok(y)) = (u32::try_from(x), u32::try_from(y)) else { continue };
            let colour = [colour.r(), colour.g(), colour.b()];
            self.fill(x * self.zoom, y * self.zoom, self.zoom, self.zoom, colour);
        }
        Ok(())
    }
}

impl Canvas {
    /// Blank paper.
    pub(crate) fn new(width: u32, height: u32, zoom: u32) -> Self {
        let rgb = PAPER.repeat(width as usize * height as usize);
        Self { picture: Picture { width, height, rgb }, zoom }
    }

    pub(crate) fn into_picture(self) -> Picture {
        self.picture
    }

    /// Fills a rectangle in unmagnified pixels, clipped to the image.
    pub(crate) fn fill(&mut self, x: u32, y: u32, width: u32, height: u32, colour: [u8; 3]) {
        let Picture { width: columns, height: rows, rgb } = &mut self.picture;
        for row in y..(y + height).min(*rows) {
            for column in x..(x + width).min(*columns) {
                let at = 3 * (row as usize * *columns as usize + column as usize);
                rgb[at..at + 3].copy_from_slice(&colour);
            }
        }
    }

    /// Puts a picture at a corner, inside the image.
    pub(crate) fn paste(&mut self, source: &Picture, [x, y]: [u32; 2]) {
        let bytes = 3 * source.width as usize;
        if bytes == 0 {
            return;
        }
        for (row, line) in (y..).zip(source.rgb.chunks_exact(bytes)) {
            let at = 3 * (row as usize * self.picture.width as usize + x as usize);
            self.picture.rgb[at..at + bytes].copy_from_slice(line);
        }
    }

    /// Writes a line whose left edge's middle is at `(x, y)`, in unmagnified pixels.
    pub(crate) fn write(&mut self, text: &str, x: u32, y: u32, font: &MonoFont<'_>) {
        let style = TextStyleBuilder::new().alignment(Alignment::Left).baseline(Baseline::Middle).build();
        let at = Point::new((x / self.zoom).cast_signed(), (y / self.zoom).cast_signed());
        let Ok(_) = Text::with_text_style(text, at, MonoTextStyle::new(font, INK), style).draw(self);
    }
}

/// A bitmap font, and how much it is magnified, for an image of this height.
pub(crate) fn font(height: u32) -> (&'static MonoFont<'static>, u32) {
    // Text as high as a 32nd of the image reads well at any size.
    match height / 32 {
        0..=11 => (&ascii::FONT_6X10, 1),
        12..=14 => (&ascii::FONT_7X13, 1),
        15..=17 => (&ascii::FONT_9X15, 1),
        18..=29 => (&ascii::FONT_10X20, 1),
        large => (&ascii::FONT_10X20, large.div_ceil(20).min(8)),
    }
}

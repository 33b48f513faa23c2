//! The panel beside a false-colour picture: title, colour bar, ticks.

use embedded_graphics::mono_font::{MonoFont, MonoTextStyle, ascii};
use embedded_graphics::pixelcolor::Rgb888;
use embedded_graphics::prelude::{DrawTarget, Drawable, OriginDimensions, Pixel, Point, RgbColor, Size};
use embedded_graphics::text::{Alignment, Baseline, Text, TextStyleBuilder};

use super::axis::Axis;
use super::colour_map::ColourMap;
use osculate_sbtf::colour::srgb_from_linear;

/// Paper.
pub(super) const BACKGROUND: [u8; 3] = [255, 255, 255];

/// Where there is no value. Grey with a green tint, which neither map contains.
pub(super) const UNDETERMINED: [u8; 3] = [139, 150, 132];

const INK: Rgb888 = Rgb888::new(40, 40, 40);

/// What the panel says.
#[derive(Debug, Clone, PartialEq)]
pub(super) struct Legend<'a> {
    pub title: &'a str,
    pub unit: &'a str,
    pub map: ColourMap,
    pub axis: Axis,
    pub shows_undetermined: bool,
}

/// An image that text is drawn on, magnified without smoothing.
struct Canvas<'a> {
    rgb: &'a mut [u8],
    width: u32,
    height: u32,
    zoom: u32,
}

impl OriginDimensions for Canvas<'_> {
    fn size(&self) -> Size {
        Size::new(self.width / self.zoom, self.height / self.zoom)
    }
}

impl DrawTarget for Canvas<'_> {
    type Color = Rgb888;
    type Error = std::convert::Infallible;

    fn draw_iter<I: IntoIterator<Item = Pixel<Rgb888>>>(&mut self, pixels: I) -> Result<(), Self::Error> {
        for Pixel(Point { x, y }, colour) in pixels {
            let (Ok(x), Ok(y)) = (u32::try_from(x), u32::try_from(y)) else { continue };
            self.fill(
                x * self.zoom,
                y * self.zoom,
                self.zoom,
                self.zoom,
                [colour.r(), colour.g(), colour.b()],
            );
        }
        Ok(())
    }
}

impl Canvas<'_> {
    /// Fills a rectangle in unmagnified pixels, clipped to the image.
    fn fill(&mut self, x: u32, y: u32, width: u32, height: u32, colour: [u8; 3]) {
        for row in y..(y + height).min(self.height) {
            for column in x..(x + width).min(self.width) {
                let at = 3 * (row as usize * self.width as usize + column as usize);
                self.rgb[at..at + 3].copy_from_slice(&colour);
            }
        }
    }

    /// Writes a line whose left edge's middle is at `(x, y)`, in unmagnified pixels.
    fn write(&mut self, text: &str, x: u32, y: u32, font: &MonoFont<'_>) {
        let style = TextStyleBuilder::new().alignment(Alignment::Left).baseline(Baseline::Middle).build();
        let at = Point::new((x / self.zoom).cast_signed(), (y / self.zoom).cast_signed());
        let Ok(_) = Text::with_text_style(text, at, MonoTextStyle::new(font, INK), style).draw(self);
    }
}

/// A bitmap font, and how much it is magnified, for an image of this height.
fn font(height: u32) -> (&'static MonoFont<'static>, u32) {
    // Text as high as a 32nd of the image reads well at any size.
    match height / 32 {
        0..=11 => (&ascii::FONT_6X10, 1),
        12..=14 => (&ascii::FONT_7X13, 1),
        15..=17 => (&ascii::FONT_9X15, 1),
        18..=29 => (&ascii::FONT_10X20, 1),
        large => (&ascii::FONT_10X20, large.div_ceil(20).min(8)),
    }
}

/// Width of the panel for an image of this height.
pub(super) fn panel_width(height: u32, legend: &Legend<'_>) -> u32 {
    let (font, zoom) = font(height);
    let letters = legend.axis.ticks().iter().map(|t| t.label.len() + 4).max().unwrap_or(0);
    let letters = letters.max(legend.title.len()).max(legend.unit.len());
    let letters = if legend.shows_undetermined { letters.max(16) } else { letters };
    let letter = font.character_size.width + font.character_spacing;
    (u32::try_from(letters).unwrap_or(40) + 2) * letter * zoom
}

/// Draws the panel into the columns from `left` on.
pub(super) fn draw(rgb: &mut [u8], width: u32, height: u32, left: u32, legend: &Legend<'_>) {
    let (font, zoom) = font(height);
    let line = font.character_size.height * zoom;
    let letter = font.character_size.width * zoom;
    let mut canvas = Canvas { rgb, width, height, zoom };
    canvas.fill(left, 0, width - left, height, BACKGROUND);
    let x = left + letter;
    canvas.write(legend.title, x, 3 * line / 2, font);
    canvas.write(legend.unit, x, 11 * line / 4, font);
    let (top, bottom) = (9 * line / 2, height.saturating_sub(7 * line / 2).max(9 * line / 2 + 2));
    let (bar, edge) = (2 * letter, zoom.max(1));
    canvas.fill(x, top - edge, bar + 2 * edge, bottom - top + 2 * edge, [40, 40, 40]);
    for y in top..bottom {
        let position = 1.0 - (y as f32 + 0.5 - top as f32) / (bottom - top) as f32;
        canvas.fill(x + edge, y, bar, 1, encoded(legend.map.colour(position).to_array()));
    }
    for tick in legend.axis.ticks() {
        #[allow(clippy::cast_possible_truncation, clippy::cast_sign_loss, reason = "between top and bottom")]
        let y = (bottom as f32 - tick.position * (bottom - top) as f32).round() as u32;
        canvas.fill(x + bar + 2 * edge, y - y.min(edge / 2), letter / 2, edge, [40, 40, 40]);
        canvas.write(&tick.label, x + bar + letter + 2 * edge, y, font);
    }
    if legend.shows_undetermined {
        let y = height - 3 * line / 2;
        canvas.fill(x, y - line / 2, bar, line, UNDETERMINED);
        canvas.write("undetermined", x + bar + letter, y, font);
    }
}

#[allow(clippy::cast_possible_truncation, clippy::cast_sign_loss, reason = "in the range of u8")]
pub(super) fn encoded(linear: [f32; 3]) -> [u8; 3] {
    linear.map(|c| (255.0 * srgb_from_linear(c.clamp(0.0, 1.0))).round() as u8)
}

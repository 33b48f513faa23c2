//! The panel beside a false-colour picture: title, colour bar, ticks.

use super::axis::Axis;
use super::colour_map::ColourMap;
use crate::canvas::{Canvas, font};
use crate::tone::Picture;
use osculate_sbtf::colour::srgb_from_linear;

/// Where there is no value. Grey with a green tint, which neither map contains.
pub(super) const UNDETERMINED: [u8; 3] = [139, 150, 132];

/// What the panel says.
#[derive(Debug, Clone, PartialEq)]
pub(super) struct Legend<'a> {
    pub title: &'a str,
    pub unit: &'a str,
    pub map: ColourMap,
    pub axis: Axis,
    pub shows_undetermined: bool,
}

/// Width of the panel for an image of this height.
fn panel_width(height: u32, legend: &Legend<'_>) -> u32 {
    let (font, zoom) = font(height);
    let letters = legend.axis.ticks().iter().map(|t| t.label.len() + 4).max().unwrap_or(0);
    let letters = letters.max(legend.title.len()).max(legend.unit.len());
    let letters = if legend.shows_undetermined { letters.max(16) } else { letters };
    let letter = font.character_size.width + font.character_spacing;
    (u32::try_from(letters).unwrap_or(40) + 2) * letter * zoom
}

/// The panel for an image of this height.
pub(super) fn panel(height: u32, legend: &Legend<'_>) -> Picture {
    let (font, zoom) = font(height);
    let line = font.character_size.height * zoom;
    let letter = font.character_size.width * zoom;
    let mut canvas = Canvas::new(panel_width(height, legend), height, zoom);
    let x = letter;
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
    canvas.into_picture()
}

#[allow(clippy::cast_possible_truncation, clippy::cast_sign_loss, reason = "in the range of u8")]
pub(super) fn encoded(linear: [f32; 3]) -> [u8; 3] {
    linear.map(|c| (255.0 * srgb_from_linear(c.clamp(0.0, 1.0))).round() as u8)
}

//! Sheets: pictures in rows and columns with words beside them, and the parts of pictures that go on them.

use crate::canvas::{Canvas, font};
use crate::tone::Picture;

/// Pixels between the cells of a sheet.
const GAP: u32 = 6;

/// A rectangle of pixels.
#[derive(Debug, Clone, Copy, PartialEq, Eq)]
pub struct Window {
    /// Column and row of its upper left pixel.
    pub corner: [u32; 2],
    /// Columns and rows, at least one.
    pub size: [u32; 2],
}

/// A row of a sheet.
#[derive(Debug, Clone, PartialEq, Eq)]
pub struct SheetRow {
    /// Written to the left of it, may be empty. ASCII.
    pub name: String,
    /// From left to right; `None` stays empty.
    pub cells: Vec<Option<Picture>>,
}

/// Puts pictures together on white paper, headings (ASCII) above the columns and names beside the rows. A column is as wide as its
/// widest picture, a row as high as its highest; smaller ones stand in the middle.
///
/// # Panics
///
/// If a row has more cells than there are headings.
#[must_use]
pub fn sheet(headings: &[&str], rows: &[SheetRow]) -> Picture {
    assert!(rows.iter().all(|row| row.cells.len() <= headings.len()), "a heading for every column");
    let column = |i: usize| rows.iter().filter_map(move |row| row.cells.get(i)?.as_ref());
    let widths: Vec<u32> =
        (0..headings.len()).map(|i| column(i).map(|p| p.width).max().unwrap_or(0)).collect();
    let heights: Vec<u32> =
        rows.iter().map(|row| row.cells.iter().flatten().map(|p| p.height).max().unwrap_or(0)).collect();
    let (letters, zoom) = font(heights.iter().copied().max().unwrap_or(0));
    let [letter, line] = [letters.character_size.width * zoom, letters.character_size.height * zoom];
    let longest = rows.iter().map(|row| row.name.len()).max().unwrap_or(0);
    let left = if longest == 0 { 0 } else { (u32::try_from(longest).unwrap_or(40) + 1) * letter };
    let top = if headings.iter().all(|h| h.is_empty()) { 0 } else { 3 * line / 2 };
    let width = left + total(&widths);
    let height = top + total(&heights);
    let mut canvas = Canvas::new(width, height, zoom);
    let mut x = left;
    for (heading, width) in headings.iter().zip(&widths) {
        let length = u32::try_from(heading.len()).unwrap_or(40) * letter;
        canvas.write(heading, x + width.saturating_sub(length) / 2, top / 2, letters);
        x += width + GAP;
    }
    let mut y = top;
    for (row, height) in rows.iter().zip(&heights) {
        canvas.write(&row.name, letter / 2, y + height / 2, letters);
        let mut x = left;
        for (cell, width) in row.cells.iter().zip(&widths) {
            if let Some(cell) = cell {
                canvas.paste(cell, [x + (width - cell.width) / 2, y + (height - cell.height) / 2]);
            }
            x += width + GAP;
        }
        y += height + GAP;
    }
    canvas.into_picture()
}

/// With gaps between.
fn total(lengths: &[u32]) -> u32 {
    lengths.iter().map(|length| length + GAP).sum::<u32>().saturating_sub(GAP)
}

impl Picture {
    /// A part of it, every pixel `zoom` by `zoom`, without smoothing.
    ///
    /// # Panics
    ///
    /// If the window reaches beyond the picture.
    #[must_use]
    pub fn magnified(&self, window: Window, zoom: u32) -> Self {
        let Window { corner, size } = window;
        assert!(
            corner[0] + size[0] <= self.width && corner[1] + size[1] <= self.height,
            "{window:?} in a picture of {} x {}",
            self.width,
            self.height
        );
        let [width, height] = size.map(|n| n * zoom);
        let pixel = |x: u32, y: u32| self.pixel(corner[0] + x / zoom, corner[1] + y / zoom);
        let rgb = (0..height).flat_map(|y| (0..width).flat_map(move |x| pixel(x, y))).collect();
        Self { width, height, rgb }
    }

    /// With a line of one pixel just around a window, where there is room.
    #[must_use]
    pub fn framed(mut self, window: Window, colour: [u8; 3]) -> Self {
        let [left, top] = window.corner.map(|c| i64::from(c) - 1);
        let [right, bottom] = [0, 1].map(|i| i64::from(window.corner[i] + window.size[i]));
        let sides = (left..=right).flat_map(|x| [(x, top), (x, bottom)]);
        let ends = (top..=bottom).flat_map(|y| [(left, y), (right, y)]);
        for (x, y) in sides.chain(ends) {
            let (Ok(x), Ok(y)) = (u32::try_from(x), u32::try_from(y)) else { continue };
            if x < self.width && y < self.height {
                let at = self.offset(x, y);
                self.rgb[at..at + 3].copy_from_slice(&colour);
            }
        }
        self
    }

    fn offset(&self, x: u32, y: u32) -> usize {
        3 * (y as usize * self.width as usize + x as usize)
    }

    fn pixel(&self, x: u32, y: u32) -> [u8; 3] {
        let at = self.offset(x, y);
        [self.rgb[at], self.rgb[at + 1], self.rgb[at + 2]]
    }
}

#[cfg(test)]
mod tests {
    use super::*;
    use crate::canvas::PAPER;

    /// Every pixel says where it is.
    fn numbered(width: u8, height: u8) -> Picture {
        let rgb = (0..height).flat_map(|y| (0..width).flat_map(move |x| [x, y, 7])).collect();
        Picture { width: width.into(), height: height.into(), rgb }
    }

    #[test]
    fn windows_are_magnified_and_framed() {
        let picture = numbered(9, 7);
        let window = Window { corner: [2, 3], size: [4, 2] };
        let large = picture.magnified(window, 3);
        assert_eq!((large.width, large.height), (12, 6));
        assert_eq!(
            [large.pixel(0, 0), large.pixel(2, 2), large.pixel(3, 2)],
            [[2, 3, 7], [2, 3, 7], [3, 3, 7]]
        );
        assert_eq!(large.pixel(11, 5), [5, 4, 7]);
        let red = [255, 0, 0];
        let framed = picture.clone().framed(window, red);
        let is_red = |x, y| framed.pixel(x, y) == red;
        let count = (0..7).flat_map(|y| (0..9).map(move |x| (x, y))).filter(|(x, y)| is_red(*x, *y)).count();
        // Around 4 by 2 pixels there are 6 by 4 less those.
        assert_eq!(count, 16);
        assert!(is_red(1, 2) && is_red(6, 5) && !is_red(2, 3) && !is_red(5, 4));
        // At the corner, only what is inside.
        let cut = picture.framed(Window { corner: [0, 0], size: [2, 2] }, red);
        assert_eq!(cut.rgb.chunks(3).filter(|p| *p == red).count(), 5);
    }

    #[test]
    fn cells_stand_in_rows_and_columns() {
        let row = |name: &str, cells| SheetRow { name: name.into(), cells };
        let bare = sheet(
            &["", ""],
            &[
                row("", vec![Some(numbered(9, 7)), None]),
                row("", vec![Some(numbered(3, 5)), Some(numbered(4, 1))]),
            ],
        );
        assert_eq!((bare.width, bare.height), (9 + GAP + 4, 7 + GAP + 5));
        assert_eq!(bare.pixel(8, 6), [8, 6, 7]);
        assert_eq!(bare.pixel(9 + GAP, 0), PAPER);
        // In the middle of their cells.
        assert_eq!(bare.pixel(3, 7 + GAP), [0, 0, 7]);
        assert_eq!(bare.pixel(9 + GAP + 3, 7 + GAP + 2), [3, 0, 7]);
        let named = sheet(&["a", "b"], &[row("one", vec![Some(numbered(9, 7)), Some(numbered(9, 7))])]);
        assert!(named.width > 24 && named.height > 7);
        let ink = |x: std::ops::Range<u32>, y: std::ops::Range<u32>| {
            y.flat_map(|y| x.clone().map(move |x| (x, y))).any(|(x, y)| named.pixel(x, y)[0] < 100)
        };
        let (left, top) = (named.width - 24, named.height - 7);
        assert!(
            ink(0..left, top..top + 7) && ink(left..left + 9, 0..top) && ink(left + 15..left + 24, 0..top)
        );
    }
}

//! Pictures of forms beside each other: with insets at the silhouette, and with their differences to the truth.

use glam::Vec3;
use osculate_render::false_colour::{Axis, AxisScale, FalseColourOptions, plane};
use osculate_render::sheet::{SheetRow, Window, sheet};
use osculate_render::{Mask, Picture, picture};
use osculate_sbtf::brdf::luminance;

use super::pictures::Shown;
use super::silhouettes::MaskSet;
use super::subject::Subject;

/// How much insets are magnified; they show as large a share of the picture's side as makes them as large as the picture.
const ZOOM: u32 = 4;

/// Ends of the scale of differences of luminance: a sunlit wall of these scenes has 0.4 or so.
const LARGEST_DIFFERENCE: f32 = 0.3;

/// Around insets: a yellow that no material has.
const FRAME: [u8; 3] = [255, 210, 0];

/// The camera of the overview: the one at 35 degrees.
const OVERVIEW_CAMERA: usize = 1;

/// A picture with words below it.
pub type Captioned = (String, Picture);

/// A material's pictures from the camera of the overview.
pub struct Exhibit {
    /// Of the row.
    pub name: String,
    cells: Vec<(&'static str, Picture, Window)>,
}

/// Forms in the order of the overview, as reports and as pictures name them.
const OVERVIEW: [(&str, &str); 3] = [("neumip", "NeuMIP"), ("neural", "neural"), ("displaced", "displaced")];

fn title(form: &str) -> &str {
    OVERVIEW.iter().find(|(name, _)| *name == form).map_or(form, |(_, title)| title)
}

/// A sheet for every camera: pictures with a frame, what is inside it four times as large, and differences to the truth.
pub fn sheets(subject: &Subject, shown: &[Shown], masks: &MaskSet, side: u32) -> Vec<Captioned> {
    let Some((truth, _)) = shown.split_first() else { return Vec::new() };
    let of_camera = |camera: usize| {
        let window = masks.busiest_window(camera, side);
        let pictures: Vec<Picture> =
            shown.iter().map(|s| picture(side, side, &s.radiance[camera], 0.0)).collect();
        let headings: Vec<&str> = shown.iter().map(|s| title(s.form)).collect();
        let framed = pictures.iter().map(|p| Some(p.clone().framed(window, FRAME))).collect();
        let inset = pictures.iter().map(|p| Some(p.magnified(window, ZOOM))).collect();
        let differences = differences(truth, shown, camera, side);
        let row = |name: &str, cells| SheetRow { name: name.to_owned(), cells };
        let rows = [row("", framed), row("4x", inset), row("difference", differences)];
        let caption = format!(
            "Elevation {} degrees. Below the pictures: the frame four times as large, where most of the mesh's rim is missing in truth; and luminance less the truth's.",
            subject.cameras[camera].0
        );
        (caption, sheet(&headings, &rows))
    };
    (0..subject.cameras.len()).map(of_camera).collect()
}

/// Luminance less the truth's in colours, behind the scale in the truth's own place.
fn differences(truth: &Shown, shown: &[Shown], camera: usize, side: u32) -> Vec<Option<Picture>> {
    let axis = Axis { lower: -LARGEST_DIFFERENCE, upper: LARGEST_DIFFERENCE, scale: AxisScale::Linear };
    let options = FalseColourOptions {
        title: "luminance".to_owned(),
        unit: "minus truth".to_owned(),
        axis: Some(axis),
        ..FalseColourOptions::default()
    };
    let of = |s: &Shown| {
        let pairs = s.radiance[camera].iter().zip(&truth.radiance[camera]);
        let values: Vec<f32> = pairs.map(|(a, b)| luminance(*a) - luminance(*b)).collect();
        plane(&values, side, &options)
    };
    let mut cells: Vec<Option<Picture>> = Vec::with_capacity(shown.len());
    for other in &shown[1..] {
        let [drawn, panel] = of(other);
        if cells.is_empty() {
            cells.push(Some(panel));
        }
        cells.push(Some(drawn));
    }
    cells
}

/// What the overview shows of a material.
pub fn exhibit(name: String, shown: &[Shown], masks: &MaskSet, side: u32) -> Exhibit {
    let window = masks.busiest_window(OVERVIEW_CAMERA, side);
    let cell = |s: &Shown| (s.form, picture(side, side, &s.radiance[OVERVIEW_CAMERA], 0.0), window);
    Exhibit { name, cells: shown.iter().map(cell).collect() }
}

/// A row for each material: the forms at 35 degrees, each before its inset. `None` without any.
pub fn overview(exhibits: &[Exhibit]) -> Option<Captioned> {
    let has = |form: &str| exhibits.iter().any(|e| e.cells.iter().any(|(f, ..)| *f == form));
    let forms: Vec<(&str, &str)> = OVERVIEW.into_iter().filter(|(form, _)| has(form)).collect();
    if forms.is_empty() {
        return None;
    }
    let inset = format!("{ZOOM}x");
    let headings: Vec<&str> = forms.iter().flat_map(|(_, title)| [*title, &inset]).collect();
    let row = |exhibit: &Exhibit| {
        let cells = forms.iter().flat_map(|(form, _)| {
            let found = exhibit.cells.iter().find(|(f, ..)| f == form);
            found.map_or([None, None], |(_, picture, window)| {
                [Some(picture.clone().framed(*window, FRAME)), Some(picture.magnified(*window, ZOOM))]
            })
        });
        SheetRow { name: exhibit.name.clone(), cells: cells.collect() }
    };
    let rows: Vec<SheetRow> = exhibits.iter().map(row).collect();
    let caption = "Elevation 35 degrees, each picture before the inset of its frame: materials by row, forms by column.";
    Some((caption.to_owned(), sheet(&headings, &rows)))
}

impl MaskSet {
    /// The window of a picture that has the most of the rim in it, of the mesh that truth does not cover; its side is a quarter of
    /// the picture's.
    fn busiest_window(&self, camera: usize, side: u32) -> Window {
        let rim = &self.rim[camera];
        let samples = self.truth[camera].size()[0];
        let size = side / ZOOM;
        let corner = busiest(rim, samples as usize).map(|share| {
            #[allow(
                clippy::cast_possible_truncation,
                clippy::cast_sign_loss,
                reason = "a share of a picture's side"
            )]
            let corner = (share * f64::from(side)) as u32;
            corner.min(side - size)
        });
        Window { corner, size: [size; 2] }
    }
}

/// Upper left corner, as shares of the side, of the square of a quarter of the side with the most that is true in it.
fn busiest(rim: &[bool], side: usize) -> [f64; 2] {
    // Sums over all that is above and to the left.
    let mut sums = vec![0_u32; (side + 1) * (side + 1)];
    for y in 0..side {
        let mut line = 0;
        for x in 0..side {
            line += u32::from(rim[y * side + x]);
            sums[(y + 1) * (side + 1) + x + 1] = sums[y * (side + 1) + x + 1] + line;
        }
    }
    let size = side / ZOOM as usize;
    let at = |x: usize, y: usize| i64::from(sums[y * (side + 1) + x]);
    let inside = |x: usize, y: usize| at(x + size, y + size) - at(x, y + size) - at(x + size, y) + at(x, y);
    let step = (size / 8).max(1);
    let corners =
        (0..=side - size).step_by(step).flat_map(|y| (0..=side - size).step_by(step).map(move |x| [x, y]));
    // The first of equals.
    let best = corners.max_by_key(|&[x, y]| (inside(x, y), std::cmp::Reverse((y, x)))).unwrap_or([0, 0]);
    best.map(|corner| corner as f64 / side as f64)
}

/// Masks of all cameras beside each other: what is covered in both grey, too much red, missing blue.
pub fn mask_strip(masks: &MaskSet) -> Option<Captioned> {
    let side = masks.truth.first()?.size()[0];
    let cells = masks.truth.iter().zip(&masks.model).map(|(t, m)| Some(compared(t, m, side))).collect();
    let headings = vec![""; masks.truth.len()];
    let caption = "Silhouettes of the model, asked by the chord: red is too much, blue is missing.";
    Some((caption.to_owned(), sheet(&headings, &[SheetRow { name: String::new(), cells }])))
}

fn compared(truth: &Mask, test: &Mask, side: u32) -> Picture {
    let colour = |(&a, &b): (&bool, &bool)| match (a, b) {
        (true, true) => Vec3::splat(0.25),
        (false, false) => Vec3::ZERO,
        (false, true) => Vec3::new(0.8, 0.05, 0.02),
        (true, false) => Vec3::new(0.05, 0.2, 0.8),
    };
    let pixels: Vec<Vec3> = truth.covered().iter().zip(test.covered()).map(colour).collect();
    picture(side, side, &pixels, 0.0)
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn the_window_lies_where_the_rim_is() {
        let side = 64;
        let mut rim = vec![false; side * side];
        // A long thin line has less in a window than a small blot.
        for x in 0..side {
            rim[5 * side + x] = true;
        }
        for y in 40..46 {
            for x in 30..36 {
                rim[y * side + x] = true;
            }
        }
        let [x, y] = busiest(&rim, side).map(|share| share * side as f64);
        assert!(x <= 30.0 && x + 16.0 >= 36.0 && y <= 40.0 && y + 16.0 >= 46.0, "{x} {y}");
        assert_eq!(busiest(&[false; 16], 4), [0.0, 0.0]);
    }
}

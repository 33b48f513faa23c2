//! Pictures beside each other: exact, then each model's.

use glam::Vec3;
use osculate_render::{Picture, picture};
use osculate_sbtf::evaluate::Pair;

/// Pixels between pictures.
const GAP: usize = 4;

/// One row for each viewer and light, the exact picture first, then one column per model. All models have the same rows.
pub fn sheet(models: &[Vec<&Pair>], size: usize) -> Picture {
    let rows = models.first().map_or(0, Vec::len);
    let columns = models.len() + 1;
    let (width, height) = (columns * (size + GAP), rows * (size + GAP));
    let mut pixels = vec![Vec3::splat(0.2); width * height];
    let mut put = |row: usize, column: usize, source: &[Vec3]| {
        for (y, line) in source.chunks(size).enumerate() {
            let start = (row * (size + GAP) + y) * width + column * (size + GAP);
            pixels[start..start + size].copy_from_slice(line);
        }
    };
    for (model, pairs) in models.iter().enumerate() {
        for (row, pair) in pairs.iter().enumerate() {
            if model == 0 {
                put(row, 0, &pair.truth);
            }
            put(row, model + 1, &pair.test);
        }
    }
    let side = |n: usize| u32::try_from(n).expect("a few thousand pixels");
    picture(side(width), side(height), &pixels, 0.0)
}

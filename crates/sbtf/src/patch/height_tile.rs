//! A height field's triangles for displaced meshes.

use glam::Vec3;
use osculate_geom::displacement::{HeightTile, TileError};

use super::triangulate::triangulate;
use crate::micro::HeightField;

/// Triangulates a height field to a tolerance in depths, or to about so many triangles if that comes first, as patches are; see
/// [`TileSurface::error`](super::TileSurface::error) for what the tolerance means between the points that it is measured at.
///
/// # Errors
///
/// A field so fine, over 2^22 texels along a side, that neighbouring points are the same to [`HeightTile`].
pub fn height_tile(
    field: &HeightField,
    tolerance: f32,
    most_triangles: usize,
) -> Result<HeightTile, TileError> {
    let made = triangulate(field, tolerance, most_triangles);
    let halves = [field.heights().width(), field.heights().height()].map(|n| 2.0 * n as f64);
    // All points are whole numbers of half texels, which single precision has rounded.
    let point = |p: &Vec3| [0, 1].map(|axis| (f64::from(p[axis]) * halves[axis]).round() / halves[axis]);
    let points: Vec<[f64; 2]> = made.vertices.iter().map(point).collect();
    let heights: Vec<f64> = made.vertices.iter().map(|p| f64::from(p.z.min(0.0))).collect();
    HeightTile::new(&points, &heights, &made.triangles)
}

#[cfg(test)]
mod tests {
    use super::*;
    use crate::patch::test_fields::{bumps, sinusoid};
    use osculate_geom::displacement::{DisplaceOptions, displace};
    use osculate_geom::shapes;

    /// Also where the texels are no power of two apart.
    #[test]
    fn a_displaced_square_has_the_heights_of_the_field() {
        for (field, off) in
            [(sinusoid(64, 0.1), 0.0075), (sinusoid(50, 0.2), 0.0075), (bumps(128, 0.1), 0.03)]
        {
            let tile = height_tile(&field, 0.005, usize::MAX).unwrap();
            let options = DisplaceOptions { tiles: [3.0, 2.0], tile_size: 0.5, ..Default::default() };
            let made = displace(&shapes::plane(5, 7), &tile, &options).unwrap();
            for triangle in 0..made.mesh.triangles().len() {
                let centre = made.mesh.corners(triangle).iter().sum::<osculate_geom::Vec3>() / 3.0;
                let uv = glam::DVec2::new(3.0 * centre.x, 2.0 * centre.y).as_vec2();
                let z = 0.5 * f64::from(field.z(uv));
                let bound = 0.5 * off * f64::from(field.depth());
                // See the triangulation's test for the bound between the points where the error is held.
                assert!((centre.z - z).abs() <= bound + 1e-6, "{} for {z} at {uv}", centre.z);
            }
        }
    }
}

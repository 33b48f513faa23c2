//! What feature textures begin with: the material's own maps.
//!
//! A network that finds albedo, normals and heights in its texture need only learn what light does with them. From
//! random features it would have to find them first, texel by texel, in noisy samples.

use glam::{Vec2, Vec3};

use super::mesh_tracer::Top;
use crate::micro::{Grid, HeightField};
use crate::model::TextureShape;
use crate::random::Random;
use crate::samples::Features;

/// Channels beyond the maps, and maps without any contrast, are noise of this size: enough to tell texels apart.
const NOISE: f32 = 0.05;
/// Standard deviation of a map as features.
const SPREAD: f32 = 0.3;
/// Standard deviations beyond which a map is cut: one white texel is not to drown the others.
const CUT: f32 = 3.0;

/// Features of a texture of this shape, texel by texel; `normals` may be of any length and resolution.
pub(super) fn first_features(
    field: &HeightField,
    normals: &Grid<Vec3>,
    which: Features,
    shape: TextureShape,
    random: &mut Random,
) -> Vec<f32> {
    let maps = match which {
        Features::Rays => heights(field, shape),
        Features::Colour => looks(field, normals, shape),
    };
    standardised(&maps, shape, random)
}

/// Maps as features of one mean and spread; what is left of the channels is noise.
pub(super) fn standardised(maps: &[Vec<f32>], shape: TextureShape, random: &mut Random) -> Vec<f32> {
    let mut texels: Vec<f32> = (0..shape.len()).map(|_| NOISE * random.signed()).collect();
    for (channel, map) in maps.iter().take(shape.channels).enumerate() {
        let (mean, deviation) = moments(map);
        if deviation <= 1e-6 {
            continue;
        }
        for (texel, value) in texels.chunks_exact_mut(shape.channels).zip(map) {
            texel[channel] = SPREAD * ((value - mean) / deviation).clamp(-CUT, CUT);
        }
    }
    texels
}

/// For rays: the height, the highest around in growing squares, and the slopes.
fn heights(field: &HeightField, shape: TextureShape) -> Vec<Vec<f32>> {
    let height = |uv: Vec2| field.heights().lookup(uv);
    let mean = over_texels(shape, height);
    let highest = (0..mean.len()).map(|i| footprint(shape, i).map(height).fold(0.0, f32::max)).collect();
    let mut maps = vec![mean, highest];
    for radius in [shape.width / 64, shape.width / 24] {
        maps.push(highest_around(&maps[1], shape, radius.max(1)));
    }
    let step = Vec2::new(0.5 / shape.width as f32, 0.5 / shape.height as f32);
    maps.push(over_texels(shape, |uv| height(uv + step * Vec2::X) - height(uv - step * Vec2::X)));
    maps.push(over_texels(shape, |uv| height(uv + step * Vec2::Y) - height(uv - step * Vec2::Y)));
    maps
}

/// For light: albedo, normal, height, roughness and metalness.
fn looks(field: &HeightField, normals: &Grid<Vec3>, shape: TextureShape) -> Vec<Vec<f32>> {
    let reflectance = |uv| field.maps().reflectance(uv);
    let normal = |uv| normals.lookup(uv).normalize_or_zero();
    vec![
        over_texels(shape, |uv| reflectance(uv).albedo.x),
        over_texels(shape, |uv| reflectance(uv).albedo.y),
        over_texels(shape, |uv| reflectance(uv).albedo.z),
        over_texels(shape, |uv| normal(uv).x),
        over_texels(shape, |uv| normal(uv).y),
        over_texels(shape, |uv| field.heights().lookup(uv)),
        over_texels(shape, |uv| reflectance(uv).roughness),
        over_texels(shape, |uv| reflectance(uv).metalness),
    ]
}

/// What stands at a point of a tile mesh, seen from straight above.
type TopOf<'a> = dyn Fn(Vec2) -> Option<Top> + 'a;

/// For rays that may pass through a mesh: the share of the texel that is covered, the height,
/// and the most and least of both around.
pub(super) fn cover(top: &TopOf<'_>, depth: f32, shape: TextureShape) -> Vec<Vec<f32>> {
    let cover = over_texels(shape, |uv| f32::from(u8::from(top(uv).is_some())));
    let height = over_texels(shape, |uv| top(uv).map_or(0.0, |top| 1.0 + top.z / depth));
    let mut maps = vec![cover, height];
    let radius = (shape.width / 48).max(1);
    maps.push(highest_around(&maps[0], shape, radius));
    maps.push(lowest_around(&maps[0], shape, radius));
    maps.push(highest_around(&maps[1], shape, radius));
    maps.push(lowest_around(&maps[1], shape, radius));
    maps
}

/// For light that meets a mesh: albedo, normal, height, roughness and metalness of what is seen from above; nothing where nothing is.
pub(super) fn tops(top: &TopOf<'_>, depth: f32, shape: TextureShape) -> Vec<Vec<f32>> {
    let map = |value: &dyn Fn(&Top) -> f32| over_texels(shape, |uv| top(uv).map_or(0.0, |top| value(&top)));
    vec![
        map(&|top| top.point.reflectance.albedo.x),
        map(&|top| top.point.reflectance.albedo.y),
        map(&|top| top.point.reflectance.albedo.z),
        map(&|top| top.point.normal.normalize_or_zero().x),
        map(&|top| top.point.normal.normalize_or_zero().y),
        map(&|top| 1.0 + top.z / depth),
        map(&|top| top.point.reflectance.roughness),
        map(&|top| top.point.reflectance.metalness),
    ]
}

/// Points of a texel, a third of it apart.
fn footprint(shape: TextureShape, texel: usize) -> impl Iterator<Item = Vec2> {
    let (column, row) = (texel % shape.width, texel / shape.width);
    (0..9_u8).map(move |k| {
        let within = (Vec2::new(f32::from(k % 3), f32::from(k / 3)) + 0.5) / 3.0;
        (Vec2::new(column as f32, row as f32) + within) / Vec2::new(shape.width as f32, shape.height as f32)
    })
}

fn over_texels(shape: TextureShape, value: impl Fn(Vec2) -> f32) -> Vec<f32> {
    let texels = shape.width * shape.height;
    (0..texels).map(|texel| footprint(shape, texel).map(&value).sum::<f32>() / 9.0).collect()
}

/// The maximum over a square of so many texels on either side, around the tile's borders.
fn highest_around(map: &[f32], shape: TextureShape, radius: usize) -> Vec<f32> {
    let (width, height) = (shape.width, shape.height);
    let over = |count: usize, i: usize, at: &dyn Fn(usize) -> f32| {
        let reach = (2 * radius + 1).min(count);
        (0..reach).map(|k| at((i + count + k - reach / 2) % count)).fold(f32::MIN, f32::max)
    };
    let row = |i: usize| over(width, i % width, &|x| map[i / width * width + x]);
    let rows: Vec<f32> = (0..map.len()).map(row).collect();
    (0..map.len()).map(|i| over(height, i / width, &|y| rows[y * width + i % width])).collect()
}

/// The minimum over a square, as [`highest_around`].
fn lowest_around(map: &[f32], shape: TextureShape, radius: usize) -> Vec<f32> {
    let mirrored: Vec<f32> = map.iter().map(|x| -x).collect();
    highest_around(&mirrored, shape, radius).into_iter().map(|x| -x).collect()
}

fn moments(map: &[f32]) -> (f32, f32) {
    let count = map.len() as f64;
    let mean = map.iter().map(|&x| f64::from(x)).sum::<f64>() / count;
    let square = map.iter().map(|&x| (f64::from(x) - mean).powi(2)).sum::<f64>() / count;
    #[allow(clippy::cast_possible_truncation, reason = "to the precision of the map")]
    (mean as f32, square.sqrt() as f32)
}

#[cfg(test)]
mod tests {
    use super::*;
    use crate::patch::test_fields::{level, sinusoid};

    const SHAPE: TextureShape = TextureShape { width: 32, height: 16, channels: 8 };

    fn features(field: &HeightField, which: Features) -> Vec<f32> {
        let up = Grid::from_fn(1, 1, |_| Vec3::Z);
        first_features(field, &up, which, SHAPE, &mut Random::new(1, 2, 3))
    }

    #[test]
    fn heights_are_standardised_in_place() {
        let field = sinusoid(64, 0.1);
        let texels = features(&field, Features::Rays);
        let channel = |c: usize| texels.iter().skip(c).step_by(8).copied().collect::<Vec<f32>>();
        let (mean, deviation) = moments(&channel(0));
        assert!(mean.abs() < 1e-5 && (deviation - SPREAD).abs() < 1e-3, "{mean} {deviation}");
        // The highest texel of the features is where the field is highest.
        let argmax = |values: &[f32]| (0..values.len()).max_by(|&a, &b| values[a].total_cmp(&values[b]));
        let truth: Vec<f32> = (0..32 * 16).map(|i| footprint(SHAPE, i).map(|uv| field.z(uv)).sum()).collect();
        let (found, wanted) = (argmax(&channel(0)).unwrap(), argmax(&truth).unwrap());
        assert!((truth[found] - truth[wanted]).abs() < 1e-6);
        assert!(channel(7).iter().all(|x| x.abs() <= NOISE), "beyond the maps");
    }

    #[test]
    fn a_level_material_begins_with_noise() {
        let texels = features(&level(0.5, 0.1), Features::Rays);
        assert!(texels.iter().all(|x| x.abs() <= NOISE) && texels.iter().any(|x| *x != 0.0));
    }

    #[test]
    fn squares_reach_around_the_border() {
        let mut map = vec![0.0; 32 * 16];
        map[0] = 1.0;
        let wide = highest_around(&map, SHAPE, 2);
        let expected = |i: usize| {
            let near = |x: usize, count: usize| x.min(count - x) <= 2;
            f32::from(u8::from(near(i % 32, 32) && near(i / 32, 16)))
        };
        assert!((0..32 * 16).all(|i| wide[i] == expected(i)));
    }
}

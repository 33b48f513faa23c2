//! Height fields with simple shapes, for tests.

use glam::{Vec2, Vec3};

use crate::micro::{Grid, HeightField, Maps, Reflectance, TileMesh, TileTriangle};

pub(crate) fn grey(albedo: f32) -> Maps {
    Maps::uniform(Reflectance { albedo: Vec3::splat(albedo), roughness: 0.6, metalness: 0.0 })
}

/// One height everywhere.
pub(crate) fn level(height: f32, depth: f32) -> HeightField {
    HeightField::new(Grid::new(4, 4, vec![height; 16]), depth, grey(0.5))
}

/// An egg box.
pub(crate) fn sinusoid(size: usize, depth: f32) -> HeightField {
    let wave = |x: f32| (std::f32::consts::TAU * x).sin();
    let height = |p: Vec2| 0.5 + 0.25 * wave(2.0 * p.x) + 0.25 * wave(p.y + 0.1);
    HeightField::new(Grid::from_fn(size, size, height), depth, grey(0.7))
}

/// Two V-shaped grooves along v in a tile: height 1 at u = 0 and 1/2, height 0 half-way.
pub(crate) fn grooves(size: usize, depth: f32) -> HeightField {
    // Texel centres lie on the edges and valleys, so that the bilinear surface has them exactly.
    let height = |p: Vec2| {
        let x = (2.0 * (p.x - 0.5 / size as f32)).fract();
        (2.0 * x - 1.0).abs()
    };
    HeightField::new(Grid::from_fn(size, size, height), depth, grey(0.6))
}

/// Half spheres of several sizes on a plain.
pub(crate) fn bumps(size: usize, depth: f32) -> HeightField {
    let spheres = [(0.3, 0.3, 0.2), (0.75, 0.6, 0.15), (0.2, 0.8, 0.1), (0.7, 0.15, 0.12)];
    let height = |p: Vec2| {
        let over = |&(x, y, radius): &(f32, f32, f32)| {
            let d = (p - Vec2::new(x, y)).length_squared() / (radius * radius);
            (radius / 0.2) * (1.0 - d).max(0.0).sqrt()
        };
        spheres.iter().map(over).fold(0.1, f32::max)
    };
    HeightField::new(Grid::from_fn(size, size, height), depth, grey(0.7))
}

/// A level strap over half of the tile, and nothing beside it.
pub(crate) fn strip(depth: f32) -> TileMesh {
    let z = -0.5 * depth;
    let positions = [(0.0, 0.25), (1.0, 0.25), (1.0, 0.75), (0.0, 0.75)].map(|(u, v)| Vec3::new(u, v, z));
    let triangles = [[0, 1, 2], [0, 2, 3]].map(|vertices| TileTriangle { vertices, material: 0 });
    let material = Reflectance { albedo: Vec3::splat(0.5), roughness: 0.5, metalness: 0.0 };
    TileMesh::new(positions.to_vec(), vec![Vec3::Z; 4], triangles.to_vec(), vec![material], depth)
}

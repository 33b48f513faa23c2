//! Materials to measure with.

use glam::{Vec2, Vec3};
use osculate_sbtf::micro::{
    Geometry, Grid, HeightField, Maps, Microstructure, Reflectance, TileMesh, TileTriangle,
};
use osculate_sbtf::random::Random;

/// A material by its name: `stones`, `waves`, `plain` or `weave`.
pub fn material(name: &str, depth: f32) -> Option<Microstructure> {
    let geometry = match name {
        "stones" => Geometry::HeightField(stones(512, depth)),
        "waves" => Geometry::HeightField(waves(512, depth)),
        "plain" => Geometry::HeightField(HeightField::new(Grid::new(8, 8, vec![0.0; 64]), depth, maps(8))),
        "weave" => Geometry::TileMesh(weave(depth)),
        _ => return None,
    };
    Some(Microstructure { name: name.to_owned(), geometry })
}

/// Rounded cells with rough tops and deep joints.
fn stones(size: usize, depth: f32) -> HeightField {
    let point = |cell: [i32; 2]| {
        let number =
            u64::try_from(cell[1].rem_euclid(CELLS) * CELLS + cell[0].rem_euclid(CELLS)).unwrap_or(0);
        let mut random = Random::new(1, 0, number);
        Vec2::new(cell[0] as f32 + random.unit(), cell[1] as f32 + random.unit())
    };
    #[allow(clippy::cast_possible_truncation, reason = "cells of one tile")]
    let height = |uv: Vec2| {
        let p = uv * CELLS as f32;
        let mut nearest = [f32::INFINITY; 2];
        for dy in -2..=2 {
            for dx in -2..=2 {
                let d = (point([p.x.floor() as i32 + dx, p.y.floor() as i32 + dy]) - p).length();
                nearest = if d < nearest[0] { [d, nearest[0]] } else { [nearest[0], nearest[1].min(d)] };
            }
        }
        let stone = ((nearest[1] - nearest[0]) * 2.0).min(1.0).sqrt();
        (0.9 * stone + 0.1 * roughness(uv)).clamp(0.0, 1.0)
    };
    HeightField::new(Grid::from_fn(size, size, height), depth, maps(size))
}

const CELLS: i32 = 5;

/// Waves of five octaves in `[0, 1]`.
fn roughness(uv: Vec2) -> f32 {
    let octave = |i: i32| {
        let f = std::f32::consts::TAU * 4.0 * 2.0_f32.powi(i);
        0.5_f32.powi(i) * ((f * uv.x + 1.3 * i as f32).sin() * (f * uv.y + 0.7 * i as f32).cos())
    };
    0.5 + 0.25 * (0..5).map(octave).sum::<f32>()
}

fn waves(size: usize, depth: f32) -> HeightField {
    let height = |uv: Vec2| {
        let phase = std::f32::consts::TAU * (3.0 * uv.x + 0.1 * (std::f32::consts::TAU * 2.0 * uv.y).sin());
        0.5 + 0.5 * phase.sin()
    };
    HeightField::new(Grid::from_fn(size, size, height), depth, maps(size))
}

fn maps(size: usize) -> Maps {
    let base = Maps::uniform(Reflectance { albedo: Vec3::splat(0.6), roughness: 0.5, metalness: 0.0 });
    let albedo = |uv: Vec2| Vec3::new(0.65, 0.55, 0.45) * (0.6 + 0.4 * roughness(uv));
    Maps { albedo: Grid::from_fn(size, size, albedo), ..base }
}

/// Straps over and under each other, with holes between them.
fn weave(depth: f32) -> TileMesh {
    const STEPS: u32 = 96;
    const STRAPS: u32 = 4;
    let (mut positions, mut normals, mut triangles) = (Vec::new(), Vec::new(), Vec::new());
    for strap in 0..2 * STRAPS {
        let (along_u, number) = (strap < STRAPS, strap % STRAPS);
        let first = u32::try_from(positions.len()).unwrap_or(0);
        for step in 0..=STEPS {
            for side in [-0.3_f32, 0.3] {
                let along = step as f32 / STEPS as f32;
                let across = (number as f32 + 0.5 + side) / STRAPS as f32;
                let phase = std::f32::consts::PI * (along * STRAPS as f32 + number as f32);
                let up = if along_u { phase.sin() } else { -phase.sin() };
                let slope = 0.4 * depth * std::f32::consts::PI * STRAPS as f32 * phase.cos();
                let slope = if along_u { slope } else { -slope };
                let z = depth * (-0.5 + 0.4 * up);
                let flat =
                    |a: f32, b: f32, z: f32| if along_u { Vec3::new(a, b, z) } else { Vec3::new(b, a, z) };
                positions.push(flat(along, across, z));
                normals.push(flat(-slope, 0.0, 1.0).normalize());
            }
            if step > 0 {
                let i = first + 2 * step;
                let material = u32::from(along_u);
                triangles.push(TileTriangle { vertices: [i - 2, i - 1, i], material });
                triangles.push(TileTriangle { vertices: [i - 1, i + 1, i], material });
            }
        }
    }
    let strap = |albedo: Vec3| Reflectance { albedo, roughness: 0.4, metalness: 0.0 };
    let materials = vec![strap(Vec3::new(0.55, 0.15, 0.1)), strap(Vec3::splat(0.45))];
    TileMesh::new(positions, normals, triangles, materials, depth)
}

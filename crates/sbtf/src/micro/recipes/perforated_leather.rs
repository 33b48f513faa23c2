//! Perforated leather: a grained sheet with staggered round holes through it.

use glam::{Vec2, Vec3};

use super::leather::pebbles;
use super::swept::MeshBuilder;
use crate::micro::pattern::{ball, fbm, noise, srgb};
use crate::micro::{Reflectance, TileMesh};

/// Holes along each axis, an even number: every other row is shifted by half a hole.
const HOLES: u32 = 4;
const RADIUS: f32 = 0.072;
const DEPTH: f32 = 0.08;
/// Depth of the grain, and radius of the rounded edge of a hole.
const GRAIN: f32 = 0.006;
const EDGE: f32 = 0.022;
/// Vertices along each side of a hole's square; even, so that shifted rows meet vertex to vertex.
const SIDE: u32 = 44;
const TOP_RINGS: u32 = 20;
const WALL_RINGS: u32 = 4;
const BOTTOM_RINGS: u32 = 3;

/// Materials.
const HIDE: u32 = 0;
const FIBRE: u32 = 1;

/// The mesh.
pub(super) fn build() -> TileMesh {
    let mut mesh = MeshBuilder::default();
    for row in 0..HOLES {
        for column in 0..HOLES {
            let shift = 0.5 * (row % 2) as f32;
            let centre = Vec2::new(column as f32 + 0.5 + shift, row as f32 + 0.5) / HOLES as f32;
            add_hole(&mut mesh, centre);
        }
    }
    let leather = |code, roughness| Reflectance { albedo: srgb(code), roughness, metalness: 0.0 };
    mesh.finish(vec![leather(0xa46230, 0.45), leather(0xc8a880, 0.95)], DEPTH)
}

/// The square of sheet round one hole: its top from the outline inward, the wall of the hole, and the underside outward.
fn add_hole(mesh: &mut MeshBuilder, centre: Vec2) {
    let outline: Vec<Vec2> = (0..=4 * SIDE).map(|i| outline(i % (4 * SIDE))).collect();
    // 1 on the outline, 0 on the edge of the hole.
    let at = |direction: Vec2, s: f32| centre + direction.normalize() * RADIUS * (1.0 - s) + direction * s;
    let mut rows: Vec<(Vec<u32>, u32)> = Vec::new();
    for ring in 0..=TOP_RINGS {
        // Denser towards the hole, where the sheet bends.
        let s = 1.0 - ring as f32 / TOP_RINGS as f32;
        let row = outline.iter().map(|&o| top_vertex(mesh, at(o, s.powf(1.6)), centre)).collect();
        rows.push((row, HIDE));
    }
    for ring in 0..=WALL_RINGS {
        let s = ring as f32 / WALL_RINGS as f32;
        let wall = |&o: &Vec2| {
            let p = at(o, 0.0);
            let z = top(p, centre) * (1.0 - s) - DEPTH * s;
            mesh.vertex(p.extend(z), -o.normalize().extend(0.0), tint(p, 1.0 - 0.35 * s))
        };
        rows.push((outline.iter().map(wall).collect(), FIBRE));
    }
    for ring in 0..=BOTTOM_RINGS {
        let s = ring as f32 / BOTTOM_RINGS as f32;
        let under = |&o: &Vec2| {
            let p = at(o, s);
            mesh.vertex(p.extend(-DEPTH), Vec3::NEG_Z, tint(p, 0.8))
        };
        rows.push((outline.iter().map(under).collect(), FIBRE));
    }
    for pair in rows.windows(2) {
        let ((near, _), (far, material)) = (&pair[0], &pair[1]);
        mesh.join(near, far, *material);
    }
}

/// Vertex `i` of the square's outline, counter-clockwise, relative to its middle.
fn outline(i: u32) -> Vec2 {
    let t = (i % SIDE) as f32 / SIDE as f32 - 0.5;
    let p = match i / SIDE {
        0 => Vec2::new(0.5, t),
        1 => Vec2::new(-t, 0.5),
        2 => Vec2::new(-0.5, -t),
        _ => Vec2::new(t, -0.5),
    };
    p / HOLES as f32
}

fn top_vertex(mesh: &mut MeshBuilder, p: Vec2, centre: Vec2) -> u32 {
    const STEP: f32 = 1e-3;
    let z = top(p, centre);
    let slope = |d: Vec2| (top(p + d, centre) - top(p - d, centre)) / (2.0 * STEP);
    let normal = Vec3::new(-slope(Vec2::new(STEP, 0.0)), -slope(Vec2::new(0.0, STEP)), 1.0);
    let crease = (1.0 + z / GRAIN).clamp(0.0, 1.0);
    mesh.vertex(p.extend(z), normal, tint(p, 0.5 + 0.5 * crease))
}

/// z of the sheet's upper side: grain that fades where the sheet bends into the hole.
fn top(p: Vec2, centre: Vec2) -> f32 {
    let from_edge = (p.distance(centre) - RADIUS).max(0.0);
    let bend = (1.0 - from_edge / EDGE).max(0.0);
    let grain = (1.0 - pebbles(p, [26, 26], 60)) + 0.25 * fbm(p, [5, 5], 2, 61).max(0.0);
    -GRAIN * grain.clamp(0.0, 1.0) * (1.0 - 0.6 * bend) - EDGE * (1.0 - ball(bend))
}

fn tint(p: Vec2, shade: f32) -> Vec3 {
    let patina = 0.9 + 0.1 * fbm(p, [4, 4], 3, 62) + 0.06 * noise(p, [50, 50], 63);
    Vec3::splat((shade * patina).clamp(0.0, 1.0))
}

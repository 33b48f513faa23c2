//! Collects the triangles of a tile mesh; strands are tubes swept along a path.

use glam::{Vec2, Vec3};

use crate::micro::{Reflectance, TileMesh, TileTriangle};

/// Vertices and triangles so far.
#[derive(Debug, Default)]
pub(super) struct MeshBuilder {
    positions: Vec<Vec3>,
    normals: Vec<Vec3>,
    tints: Vec<Vec3>,
    triangles: Vec<TileTriangle>,
}

/// A strand that crosses the tile once and goes on in the next one.
#[derive(Debug, Clone, Copy)]
pub(super) struct Strand {
    pub run: Run,
    /// Half width along the surface and half thickness across it, in UV units: the axes of the elliptic cross-section.
    pub half: Vec2,
    /// Points along the tile, and round the strand.
    pub segments: u32,
    pub sides: u32,
    pub material: u32,
}

/// The axis along which a strand runs.
#[derive(Debug, Clone, Copy, PartialEq, Eq)]
pub(super) enum Run {
    AlongU,
    AlongV,
}

impl MeshBuilder {
    /// Adds a vertex and returns its index.
    pub(super) fn vertex(&mut self, position: Vec3, normal: Vec3, tint: Vec3) -> u32 {
        let index = u32::try_from(self.positions.len()).expect("recipes make few vertices");
        self.positions.push(position);
        self.normals.push(normal.normalize_or(Vec3::Z));
        self.tints.push(tint);
        index
    }

    /// Joins two rows of vertices of equal length by triangles, `near` to `far`. Seen from outside, `far` lies to the left of
    /// `near` when one goes along the rows.
    pub(super) fn join(&mut self, near: &[u32], far: &[u32], material: u32) {
        for (n, f) in near.windows(2).zip(far.windows(2)) {
            self.triangles.push(TileTriangle { vertices: [n[0], n[1], f[1]], material });
            self.triangles.push(TileTriangle { vertices: [n[0], f[1], f[0]], material });
        }
    }

    /// Sweeps an ellipse along a path. `path`: sideways position and z over the way along the tile in `[0, 1]`, with period 1;
    /// `tint` over the way along and the way round, both in `[0, 1]`.
    pub(super) fn strand(
        &mut self,
        strand: &Strand,
        path: impl Fn(f32) -> Vec2,
        tint: impl Fn(Vec2) -> Vec3,
    ) {
        let mut previous: Vec<u32> = Vec::new();
        for i in 0..=strand.segments {
            let along = i as f32 / strand.segments as f32;
            let row: Vec<u32> = (0..=strand.sides)
                .map(|j| {
                    let round = j as f32 / strand.sides as f32;
                    let (position, normal) = strand.point(along, round, &path);
                    self.vertex(position, normal, tint(Vec2::new(along, round)))
                })
                .collect();
            if !previous.is_empty() {
                self.join(&previous, &row, strand.material);
            }
            previous = row;
        }
    }

    /// The mesh.
    pub(super) fn finish(self, materials: Vec<Reflectance>, depth: f32) -> TileMesh {
        // Rounding may lift a vertex that touches the bounding surface by an ulp.
        let positions = self.positions.into_iter().map(|p| p.with_z(p.z.clamp(-depth, 0.0))).collect();
        TileMesh::new(positions, self.normals, self.triangles, materials, depth).with_tints(self.tints)
    }
}

impl Strand {
    /// A point of the tube and its outward normal.
    fn point(&self, along: f32, round: f32, path: &impl Fn(f32) -> Vec2) -> (Vec3, Vec3) {
        const STEP: f32 = 1e-3;
        let axis = path(along);
        let slope = (path(along + STEP) - path(along - STEP)) / (2.0 * STEP);
        // In the frame (along, aside, up), right-handed.
        let tangent = Vec3::new(1.0, slope.x, slope.y).normalize();
        let aside = Vec3::Z.cross(tangent).normalize();
        let up = tangent.cross(aside);
        let (sin, cos) = (std::f32::consts::TAU * round).sin_cos();
        let position = Vec3::new(along, axis.x, axis.y) + aside * self.half.x * cos + up * self.half.y * sin;
        let normal = aside * cos / self.half.x + up * sin / self.half.y;
        let turn = |p: Vec3| match self.run {
            Run::AlongU => p,
            // A quarter turn about z.
            Run::AlongV => Vec3::new(-p.y, p.x, p.z),
        };
        (turn(position), turn(normal))
    }
}

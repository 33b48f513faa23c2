//! [`TileMesh`]: triangles over the tile that need not be a height field.

use glam::{Vec2, Vec3};

use super::Reflectance;

/// Triangles that repeat over the plane with period 1 in u and v.
///
/// Vertices may lie outside the unit square (a thread that crosses its border need not be cut), but each triangle is given
/// once: its copies in the neighbouring tiles are implied. Both sides of a triangle reflect.
#[derive(Debug, Clone, PartialEq)]
pub struct TileMesh {
    /// `(u, v, z)` in UV units, `z` in `[-depth, 0]`.
    positions: Vec<Vec3>,
    /// Unit shading normals, one per vertex.
    normals: Vec<Vec3>,
    triangles: Vec<TileTriangle>,
    /// What the triangles' `material` counts.
    materials: Vec<Reflectance>,
    depth: f32,
}

/// One triangle of a tile mesh.
#[derive(Debug, Clone, Copy, PartialEq, Eq)]
pub struct TileTriangle {
    /// Its vertices.
    pub vertices: [u32; 3],
    /// Index of its reflectance.
    pub material: u32,
}

impl TileMesh {
    /// Takes vertices with shading normals, triangles and their reflectances.
    ///
    /// # Panics
    ///
    /// If an index is out of range, a coordinate is not finite, a vertex lies outside `[-depth, 0]`, or there is not one
    /// normal per vertex.
    #[must_use]
    pub fn new(
        positions: Vec<Vec3>,
        normals: Vec<Vec3>,
        triangles: Vec<TileTriangle>,
        materials: Vec<Reflectance>,
        depth: f32,
    ) -> Self {
        assert!(depth > 0.0 && depth.is_finite(), "a positive depth, not {depth}");
        assert_eq!(positions.len(), normals.len(), "one normal per vertex");
        assert!(positions.iter().all(|p| p.is_finite() && (-depth..=0.0).contains(&p.z)), "z in [-depth, 0]");
        let in_range = |t: &TileTriangle| {
            t.vertices.iter().all(|&v| (v as usize) < positions.len())
                && (t.material as usize) < materials.len()
        };
        assert!(triangles.iter().all(in_range), "indices in range");
        Self { positions, normals, triangles, materials, depth }
    }

    /// `(u, v, z)` of the vertices.
    #[must_use]
    pub fn positions(&self) -> &[Vec3] {
        &self.positions
    }

    /// Shading normals of the vertices.
    #[must_use]
    pub fn normals(&self) -> &[Vec3] {
        &self.normals
    }

    /// The triangles.
    #[must_use]
    pub fn triangles(&self) -> &[TileTriangle] {
        &self.triangles
    }

    /// The reflectances that triangles name.
    #[must_use]
    pub fn materials(&self) -> &[Reflectance] {
        &self.materials
    }

    /// Depth of the space that the triangles lie in, in UV units.
    #[must_use]
    pub fn depth(&self) -> f32 {
        self.depth
    }

    /// The smallest and largest texture coordinates of the vertices.
    #[must_use]
    pub fn uv_range(&self) -> (Vec2, Vec2) {
        let uv = || self.positions.iter().map(|p| p.truncate());
        (uv().fold(Vec2::MAX, Vec2::min), uv().fold(Vec2::MIN, Vec2::max))
    }
}

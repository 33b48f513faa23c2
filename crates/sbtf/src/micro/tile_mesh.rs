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
    /// What the albedo is multiplied by at each vertex, in `[0, 1]`; `None` is 1.
    tints: Option<Vec<Vec3>>,
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
        Self { positions, normals, triangles, materials, tints: None, depth }
    }

    /// The same mesh with albedos that vary inside triangles: each is multiplied by the interpolated tint.
    ///
    /// # Panics
    ///
    /// If there is not one tint in `[0, 1]` per vertex.
    #[must_use]
    pub fn with_tints(mut self, tints: Vec<Vec3>) -> Self {
        assert_eq!(tints.len(), self.positions.len(), "one tint per vertex");
        let in_range = |t: &Vec3| t.cmpge(Vec3::ZERO).all() && t.cmple(Vec3::ONE).all();
        assert!(tints.iter().all(in_range), "tints in [0, 1]");
        self.tints = Some(tints);
        self
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

    /// Factors of the albedo, one per vertex, if it varies inside triangles.
    #[must_use]
    pub fn tints(&self) -> Option<&[Vec3]> {
        self.tints.as_deref()
    }

    /// Reflectance at a point of a triangle.
    ///
    /// # Panics
    ///
    /// If the triangle is out of range.
    #[must_use]
    pub fn reflectance(&self, triangle: usize, barycentrics: [f32; 3]) -> Reflectance {
        let TileTriangle { vertices, material } = self.triangles[triangle];
        let base = self.materials[material as usize];
        let Some(tints) = &self.tints else { return base };
        let tint: Vec3 = vertices.iter().zip(barycentrics).map(|(&v, w)| tints[v as usize] * w).sum();
        Reflectance { albedo: base.albedo * tint, ..base }
    }

    /// Unit shading normal at a point of a triangle; the triangle's own where the interpolated one vanishes.
    ///
    /// # Panics
    ///
    /// If the triangle is out of range.
    #[must_use]
    pub fn normal(&self, triangle: usize, barycentrics: [f32; 3]) -> Vec3 {
        let vertices = self.triangles[triangle].vertices.map(|v| v as usize);
        let sum: Vec3 = vertices.iter().zip(barycentrics).map(|(&v, w)| self.normals[v] * w).sum();
        let [a, b, c] = vertices.map(|v| self.positions[v]);
        sum.normalize_or((b - a).cross(c - a).normalize_or(Vec3::Z))
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

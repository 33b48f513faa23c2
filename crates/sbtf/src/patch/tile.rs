//! [`TileSurface`]: the triangles of one tile, before bending, and how their points are shaded.

use std::borrow::Cow;

use glam::{Vec2, Vec3};

use super::subdivide::subdivide_long_edges;
use super::triangulate::triangulate;
use crate::micro::{Geometry, Grid, HeightField, Microstructure, Reflectance, TileMesh};

/// How a tile becomes triangles.
#[derive(Debug, Clone, Copy, PartialEq)]
pub struct TileOptions {
    /// Largest vertical distance between the triangles and a height field, in depths. Default 0.005.
    pub tolerance: f32,
    /// Largest `|kappa|` for which bent triangles keep to the tolerance, 1/UV units. Default 2.5.
    pub largest_curvature: f32,
    /// Most triangles in a tile; where they do not reach the tolerance, [`TileSurface::error`] says how close they come.
    /// Default 400,000, about 100 MB in a patch.
    pub most_triangles: usize,
    /// Where shading normals come from.
    pub shading: Shading,
}

impl Default for TileOptions {
    fn default() -> Self {
        Self { tolerance: 0.005, largest_curvature: 2.5, most_triangles: 400_000, shading: Shading::Smooth }
    }
}

/// Where shading normals come from.
#[derive(Debug, Clone, Copy, PartialEq, Eq, Default)]
pub enum Shading {
    /// Height fields: central differences at the texels, bilinear between, with the normal map; tile meshes: their normals.
    #[default]
    Smooth,
    /// The triangles' own, as energy tests want them.
    Faceted,
}

/// The triangles of one tile, which repeat with period 1 and join without gaps.
#[derive(Debug)]
pub struct TileSurface {
    /// `(u, v, z)`, UV units. May lie outside the unit square.
    pub(super) vertices: Vec<Vec3>,
    pub(super) triangles: Vec<[u32; 3]>,
    /// Longest edge on the tile, UV units.
    pub(super) longest_edge: f32,
    /// Lowest and highest `z` of the vertices.
    pub(super) z_range: [f32; 2],
    shading: ShadingSource,
    depth: f32,
    error: f32,
}

/// A height field with the normals that it is shaded with.
#[derive(Debug)]
pub struct FieldShading {
    field: HeightField,
    /// `None` where triangles have their own.
    normals: Option<Grid<Vec3>>,
}

#[derive(Debug)]
enum ShadingSource {
    Field(FieldShading),
    Mesh { mesh: TileMesh, normals: Option<Vec<Vec3>>, tints: Option<Vec<Vec3>>, sources: Vec<u32> },
}

/// How a point of the surface is shaded.
#[derive(Debug, Clone, Copy)]
pub struct TilePoint {
    /// What it reflects with.
    pub reflectance: Reflectance,
    /// Normal in `(u, v, z)`, of any length; zero for the triangle's own.
    pub normal: Vec3,
}

impl TileSurface {
    /// Triangulates a microstructure.
    #[must_use]
    pub fn new(micro: &Microstructure, options: &TileOptions) -> Self {
        match &micro.geometry {
            Geometry::HeightField(field) => Self::from_field(field, options),
            Geometry::TileMesh(mesh) => Self::from_mesh(mesh, options),
        }
    }

    /// Triangulates a height field.
    #[must_use]
    pub fn from_field(field: &HeightField, options: &TileOptions) -> Self {
        let mut made = triangulate(field, options.tolerance, options.most_triangles);
        let longest = longest_edge(options, field.depth());
        let (triangles, _) = subdivide_long_edges(&mut made.vertices, &made.triangles, longest);
        let shading = ShadingSource::Field(FieldShading::new(field, options.shading));
        Self::with(made.vertices, triangles, longest, shading, field.depth(), made.error)
    }

    /// Takes the triangles of a tile mesh, with long edges split.
    #[must_use]
    pub fn from_mesh(mesh: &TileMesh, options: &TileOptions) -> Self {
        let mut vertices = mesh.positions().to_vec();
        let triangles: Vec<[u32; 3]> = mesh.triangles().iter().map(|t| t.vertices).collect();
        let longest = longest_edge(options, mesh.depth());
        let mut normals = mesh.normals().to_vec();
        let mut tints = mesh.tints().map(<[Vec3]>::to_vec);
        let first_new = vertices.len();
        let (triangles, split) = subdivide_long_edges(&mut vertices, &triangles, longest);
        for [a, b] in split.parents {
            let sum = normals[a as usize] + normals[b as usize];
            normals.push(sum.try_normalize().unwrap_or(normals[a as usize]));
            if let Some(tints) = &mut tints {
                tints.push(0.5 * (tints[a as usize] + tints[b as usize]));
            }
        }
        debug_assert_eq!(normals.len(), vertices.len(), "{first_new} vertices before");
        let normals = (options.shading == Shading::Smooth).then_some(normals);
        let shading = ShadingSource::Mesh { mesh: mesh.clone(), normals, tints, sources: split.sources };
        Self::with(vertices, triangles, longest, shading, mesh.depth(), 0.0)
    }

    fn with(
        vertices: Vec<Vec3>,
        triangles: Vec<[u32; 3]>,
        longest_edge: f32,
        shading: ShadingSource,
        depth: f32,
        error: f32,
    ) -> Self {
        let z = || vertices.iter().map(|p| p.z);
        let z_range = [z().fold(0.0, f32::min), z().fold(-depth, f32::max)];
        Self { vertices, triangles, longest_edge, z_range, shading, depth, error }
    }

    /// Number of triangles.
    #[must_use]
    pub fn triangle_count(&self) -> usize {
        self.triangles.len()
    }

    /// Largest vertical distance between the triangles and the surface they stand for, in depths, before bending: measured at all
    /// texels and half-way between them. Between those points it may be half as much again, at cliffs one
    /// texel wide five times as much.
    #[must_use]
    pub fn error(&self) -> f32 {
        self.error
    }

    /// Distance between the bounding surface and the deepest point that the material may have, UV units.
    #[must_use]
    pub fn depth(&self) -> f32 {
        self.depth
    }

    /// Whether no ray can pass through to what is below.
    #[must_use]
    pub fn is_closed(&self) -> bool {
        matches!(self.shading, ShadingSource::Field(_))
    }

    /// Shading of a point on a triangle.
    pub(super) fn point(&self, triangle: usize, weights: [f32; 3], uv: Vec2) -> TilePoint {
        match &self.shading {
            ShadingSource::Field(shading) => shading.point(uv),
            ShadingSource::Mesh { mesh, normals, tints, sources } => {
                let corners = self.triangles[triangle];
                let interpolated =
                    |all: &Vec<Vec3>| (0..3).map(|i| weights[i] * all[corners[i] as usize]).sum();
                let normal = normals.as_ref().map_or(Vec3::ZERO, interpolated);
                let tint = tints.as_ref().map_or(Vec3::ONE, interpolated);
                let source = mesh.triangles()[sources[triangle] as usize];
                let base = mesh.materials()[source.material as usize];
                let reflectance = Reflectance { albedo: base.albedo * tint, ..base };
                TilePoint { reflectance, normal }
            }
        }
    }

    /// How far the surface that the triangles stand for is above a point of theirs, UV units.
    pub(super) fn lift(&self, uv: Vec2, z: f32) -> f32 {
        match &self.shading {
            ShadingSource::Field(shading) if shading.normals.is_some() => (shading.field.z(uv) - z).max(0.0),
            ShadingSource::Field(_) | ShadingSource::Mesh { .. } => 0.0,
        }
    }
}

/// The edge whose bow, at the largest curvature, is half of the tolerance: an arc of length `e` stands `k e^2 / 8` over its chord.
fn longest_edge(options: &TileOptions, depth: f32) -> f32 {
    /// Longer ones would make triangles reach far into neighbouring tiles, which costs tracing time.
    const LONGEST: f32 = 0.125;
    /// Shorter ones than this would make a million triangles of a plane.
    const SHORTEST: f32 = 1.0 / 512.0;
    let bow = 0.5 * options.tolerance * depth;
    (8.0 * bow / options.largest_curvature.abs().max(1e-6)).sqrt().clamp(SHORTEST, LONGEST)
}

impl FieldShading {
    /// Works out the normals, if they are to be smooth.
    #[must_use]
    pub fn new(field: &HeightField, shading: Shading) -> Self {
        let normals = (shading == Shading::Smooth).then(|| field_normals(field));
        Self { field: field.clone(), normals }
    }

    /// The heights.
    #[must_use]
    pub fn field(&self) -> &HeightField {
        &self.field
    }

    /// Normals of the smooth surface, of any length.
    pub fn normals(&self) -> Cow<'_, Grid<Vec3>> {
        self.normals.as_ref().map_or_else(|| Cow::Owned(field_normals(&self.field)), Cow::Borrowed)
    }

    /// Shading of the surface's point at these texture coordinates.
    #[must_use]
    pub fn point(&self, uv: Vec2) -> TilePoint {
        TilePoint {
            reflectance: self.field.maps().reflectance(uv),
            normal: self.normals.as_ref().map_or(Vec3::ZERO, |grid| grid.lookup(uv)),
        }
    }

    /// Normal of the bilinear surface itself, of any length.
    #[must_use]
    pub fn facet(&self, uv: Vec2) -> Vec3 {
        let heights = self.field.heights();
        let size = Vec2::new(heights.width() as f32, heights.height() as f32);
        // From the centre of the first texel.
        let at = (uv - uv.floor()) * size - 0.5;
        let (corner, within) = (at.floor(), at - at.floor());
        #[allow(clippy::cast_possible_truncation, clippy::cast_sign_loss, reason = "inside the grid")]
        let texel = |dx: f32, dy: f32| {
            let wrapped = (corner + Vec2::new(dx, dy)).rem_euclid(size);
            heights.texel(wrapped.x as usize, wrapped.y as usize)
        };
        let [a, b, c, d] = [texel(0.0, 0.0), texel(1.0, 0.0), texel(0.0, 1.0), texel(1.0, 1.0)];
        let du = b - a + within.y * (d - c - b + a);
        let dv = c - a + within.x * (d - b - c + a);
        let slope = self.field.depth() * size * Vec2::new(du, dv);
        Vec3::new(-slope.x, -slope.y, 1.0)
    }
}

/// Normals of the smooth surface, not of unit length: central differences of the heights, turned by the normal map if there is one.
fn field_normals(field: &HeightField) -> Grid<Vec3> {
    let heights = field.heights();
    let map = field.maps().normal.as_ref();
    let width = map.map_or(1, Grid::width).max(heights.width());
    let height = map.map_or(1, Grid::height).max(heights.height());
    let step = Vec2::new(1.0 / heights.width() as f32, 1.0 / heights.height() as f32);
    let slope = |uv: Vec2, by: Vec2| field.z(uv + by) - field.z(uv - by);
    Grid::from_fn(width, height, |uv| {
        let du = slope(uv, Vec2::new(step.x, 0.0)) / (2.0 * step.x);
        let dv = slope(uv, Vec2::new(0.0, step.y)) / (2.0 * step.y);
        let smooth = Vec3::new(-du, -dv, 1.0);
        let Some(map) = map else { return smooth };
        let n = smooth.normalize();
        let t = Vec3::new(1.0, 0.0, du).normalize();
        let m = map.lookup(uv);
        (t * m.x + n.cross(t) * m.y + n * m.z).try_normalize().unwrap_or(n)
    })
}

#[cfg(test)]
mod tests {
    use super::*;
    use crate::patch::test_fields::bumps;

    /// The slopes of the bilinear surface, against differences of its heights within a cell.
    #[test]
    fn facets_are_the_gradient_of_the_heights() {
        let field = bumps(20, 0.3);
        let shading = FieldShading::new(&field, Shading::Smooth);
        // A hundredth of a texel; none of the points below is as near to the border of a cell.
        let step = 0.01 / 20.0;
        for i in 0..200_u16 {
            let uv = Vec2::new((f32::from(i) * 0.618).fract() + 2.0, (f32::from(i) * 0.414).fract() - 1.0);
            let within = (20.0 * uv - 0.5).fract_gl();
            if within.min_element() < 0.02 || within.max_element() > 0.98 {
                continue;
            }
            let slope = |by: Vec2| (field.z(uv + by) - field.z(uv - by)) / (2.0 * step);
            let expected = Vec3::new(-slope(Vec2::new(step, 0.0)), -slope(Vec2::new(0.0, step)), 1.0);
            // Heights of 0.3 are rounded to 3e-8, coordinates of 3 to 2e-7 of a step of 5e-4.
            let found = shading.facet(uv);
            assert!(
                (found - expected).length() < 2e-3 * (1.0 + expected.length()),
                "{uv}: {found} {expected}"
            );
        }
    }
}

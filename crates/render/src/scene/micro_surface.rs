//! [`MicroSurface`]: triangles that show a microstructure by themselves, displaced or not.
//!
//! Colours and normals are looked up where the ray meets the surface, not at the vertices: displaced triangles are large where
//! the heights are flat, and the normals are those of the heights at every texel, as the exact tracer has them.

use std::fmt;
use std::sync::Arc;

use glam::{Vec2, Vec3};
use osculate_geom::Mesh;
use osculate_geom::displacement::{DisplaceError, DisplaceOptions, Displaced, displace};
use osculate_geom::mesh::{Weld, smooth_normals};
use osculate_geom::rays::to_f32;
use osculate_sbtf::micro::{HeightField, Reflectance};
use osculate_sbtf::patch::{FieldShading, Shading, height_tile};
use thiserror::Error;

use super::Placement;

/// How a microstructure lies on a mesh.
#[derive(Debug, Clone, Copy, PartialEq)]
pub struct Laying {
    /// Tiles per UV unit of the mesh, along u and v; positive.
    pub tiles: [f32; 2],
    /// Length of a tile in units of the mesh, positive: it fixes how deep the material is.
    pub tile_size: f32,
    /// Largest error of displaced heights, in depths. Default: 0.005.
    pub tolerance: f32,
    /// Most displaced triangles. Default: 16 million.
    pub most_triangles: usize,
}

impl Laying {
    /// With the defaults.
    #[must_use]
    pub fn new(tiles: [f32; 2], tile_size: f32) -> Self {
        let most_triangles = DisplaceOptions::default().most_triangles;
        Self { tiles, tile_size, tolerance: 0.005, most_triangles }
    }
}

/// Why a height field cannot be laid over a mesh.
#[derive(Debug, Clone, PartialEq, Error)]
pub enum LayError {
    /// The field's triangles.
    #[error("the heights cannot be triangulated: {0}")]
    Tile(#[from] osculate_geom::displacement::TileError),
    /// The mesh.
    #[error(transparent)]
    Mesh(#[from] DisplaceError),
}

/// The maps of a microstructure on triangles.
#[derive(Clone)]
pub struct MicroSurface {
    field: Arc<FieldShading>,
    base: Arc<Base>,
    /// Triangle of the base for each triangle; `None` where they are the same, and nothing is displaced.
    sources: Option<Arc<[u32]>>,
    tiles: Vec2,
    /// Units of the mesh.
    tile_size: f32,
}

/// The mesh before anything was displaced.
struct Base {
    mesh: Arc<Mesh>,
    normals: Vec<Vec3>,
}

/// How a point is shaded.
#[derive(Debug, Clone, Copy)]
pub(crate) struct MicroPoint {
    pub reflectance: Reflectance,
    /// Unit normal in the world, on the outward side.
    pub normal: Vec3,
    /// Unit normal of the surface itself, on the outward side: of the heights that displaced triangles stand for; `None` where it is the
    /// triangle's.
    pub facet: Option<Vec3>,
    /// Where the surface is that the triangles stand for, if that is above them.
    pub position: Vec3,
}

impl fmt::Debug for MicroSurface {
    fn fmt(&self, f: &mut fmt::Formatter<'_>) -> fmt::Result {
        f.debug_struct("MicroSurface")
            .field("displaced", &self.sources.is_some())
            .field("tiles", &self.tiles)
            .field("tile_size", &self.tile_size)
            .finish_non_exhaustive()
    }
}

impl MicroSurface {
    /// The mesh as it is, with the normals and colours of the field.
    #[must_use]
    pub fn flat(mesh: &Arc<Mesh>, field: &HeightField, laying: &Laying) -> Self {
        let own = || mesh.normals().map(<[_]>::to_vec);
        let normals = own().unwrap_or_else(|| smooth_normals(mesh, Weld::Exact));
        let normals = normals.iter().map(|n| to_f32(n).normalize_or_zero()).collect();
        Self {
            field: Arc::new(FieldShading::new(field, Shading::Smooth)),
            base: Arc::new(Base { mesh: Arc::clone(mesh), normals }),
            sources: None,
            tiles: laying.tiles.into(),
            tile_size: laying.tile_size,
        }
    }

    /// The mesh displaced by the field, and how to shade it.
    ///
    /// # Errors
    ///
    /// A mesh without UV, or more triangles than are allowed; see [`LayError`].
    pub fn displaced(
        mesh: &Arc<Mesh>,
        field: &HeightField,
        laying: &Laying,
    ) -> Result<(Displaced, Self), LayError> {
        let tile = height_tile(field, laying.tolerance, laying.most_triangles)?;
        let options = DisplaceOptions {
            tiles: laying.tiles.map(f64::from),
            tile_size: laying.tile_size.into(),
            most_triangles: laying.most_triangles,
        };
        let made = displace(mesh, &tile, &options)?;
        let sources = Some(Arc::from(made.sources.as_slice()));
        Ok((made, Self { sources, ..Self::flat(mesh, field, laying) }))
    }

    /// Shading at a point of a triangle, by its UV and place in the world; `None` where the base has no area, in the world or in UV.
    pub(crate) fn at(
        &self,
        placement: &Placement,
        triangle: usize,
        uv: [f32; 2],
        position: Vec3,
    ) -> Option<MicroPoint> {
        let source = self.sources.as_ref().map_or(triangle, |sources| sources[triangle] as usize);
        let mesh = &self.base.mesh;
        let corners = mesh.triangles()[source].map(|v| v as usize);
        let p = corners.map(|v| placement.world_from_object(to_f32(&mesh.positions()[v])));
        let n = corners.map(|v| placement.rotation * self.base.normals[v]);
        #[allow(clippy::cast_possible_truncation, reason = "rendering is f32")]
        let uvs =
            corners.map(|v| mesh.uv_sets()[0][v].map(|x| x as f32)).map(|uv| Vec2::from(uv) * self.tiles);
        let uv = Vec2::from(uv) * self.tiles;
        let (d1, d2, d) = (uvs[1] - uvs[0], uvs[2] - uvs[0], uv - uvs[0]);
        let area = d1.perp_dot(d2);
        let (v, w) = (d.perp_dot(d2) / area, d1.perp_dot(d) / area);
        let foot = p[0] + v * (p[1] - p[0]) + w * (p[2] - p[0]);
        let up = (n[0] + v * (n[1] - n[0]) + w * (n[2] - n[0])).try_normalize()?;
        let unit = self.tile_size * placement.scale;
        let height = if self.sources.is_some() { (position - foot).dot(up) } else { 0.0 };
        // Edges of the base's triangle at this height, and the gradients of the tile's u and v along it.
        let (e1, e2) = (p[1] - p[0] + height * (n[1] - n[0]), p[2] - p[0] + height * (n[2] - n[0]));
        let m = e1.cross(e2);
        let gradient = |a: f32, b: f32| (a * e2.cross(m) + b * m.cross(e1)) / m.length_squared();
        let point = self.field.point(uv);
        let laid = |n: Vec3| {
            let slopes = n.x * gradient(d1.x, d2.x) + n.y * gradient(d1.y, d2.y);
            (n.z * up + unit * slopes).try_normalize()
        };
        let normal = laid(point.normal)?;
        let facet = if self.sources.is_some() { laid(self.field.facet(uv)) } else { None };
        let lift = if self.sources.is_some() { unit * self.field.field().z(uv) - height } else { 0.0 };
        let position = position + lift.max(0.0) * up;
        position.is_finite().then_some(MicroPoint { reflectance: point.reflectance, normal, facet, position })
    }
}

//! [`MicroReport`]: what a microstructure is like, in numbers.

use glam::Vec3;
use osculate_geom::rays::{Bvh, Ray};
use serde::Serialize;

use super::{Geometry, HeightField, Microstructure, SeamReport, TileMesh};

/// A microstructure in numbers.
#[derive(Debug, Clone, PartialEq, Serialize)]
pub struct MicroReport {
    /// Its name.
    pub name: String,
    /// SHA-256 of geometry and maps.
    pub hash: String,
    /// Depth in UV units.
    pub depth: f32,
    /// Lowest and highest `z`, in UV units.
    pub z: [f32; 2],
    /// What only height fields have.
    #[serde(skip_serializing_if = "Option::is_none")]
    pub field: Option<FieldReport>,
    /// What only tile meshes have.
    #[serde(skip_serializing_if = "Option::is_none")]
    pub mesh: Option<MeshReport>,
}

/// A height field in numbers.
#[derive(Debug, Clone, PartialEq, Serialize)]
pub struct FieldReport {
    /// Texels along u and v.
    pub size: [usize; 2],
    /// Mean height in `[0, 1]`.
    pub mean_height: f32,
    /// Angles of the surface to the plane, in degrees.
    pub slope_degrees: SlopeReport,
    /// Jumps across the borders.
    pub seam: SeamReport,
}

/// Angles to the plane, in degrees.
#[derive(Debug, Clone, Copy, PartialEq, Serialize)]
pub struct SlopeReport {
    /// Half of the surface, as seen from above, is flatter.
    pub median: f32,
    /// 95 % are flatter.
    pub p95: f32,
    /// The steepest.
    pub max: f32,
}

/// A tile mesh in numbers.
#[derive(Debug, Clone, Copy, PartialEq, Serialize)]
pub struct MeshReport {
    /// Vertices, as given.
    pub vertices: usize,
    /// Triangles of one tile.
    pub triangles: usize,
    /// Share of the tile that one sees through from straight above.
    pub see_through: f32,
}

impl MicroReport {
    /// Measures.
    #[must_use]
    pub fn new(micro: &Microstructure) -> Self {
        let base = |z| Self {
            name: micro.name.clone(),
            hash: micro.hash(),
            depth: micro.geometry.depth(),
            z,
            field: None,
            mesh: None,
        };
        match &micro.geometry {
            Geometry::HeightField(field) => {
                let (low, high) = range(field.heights().texels().iter().copied());
                let z = [low, high].map(|h| field.depth() * (h - 1.0));
                Self { field: Some(field_report(field)), ..base(z) }
            }
            Geometry::TileMesh(mesh) => {
                let (low, high) = range(mesh.positions().iter().map(|p| p.z));
                Self { mesh: Some(mesh_report(mesh)), ..base([low, high]) }
            }
        }
    }
}

fn range(values: impl Iterator<Item = f32>) -> (f32, f32) {
    values.fold((f32::MAX, f32::MIN), |(low, high), x| (low.min(x), high.max(x)))
}

fn field_report(field: &HeightField) -> FieldReport {
    let heights = field.heights();
    let (w, h) = (heights.width(), heights.height());
    let mut slopes: Vec<f32> = (0..w * h)
        .map(|i| {
            let (x, y) = (i % w, i / w);
            let here = heights.texel(x, y);
            let du = (heights.texel((x + 1) % w, y) - here) * w as f32;
            let dv = (heights.texel(x, (y + 1) % h) - here) * h as f32;
            (field.depth() * du.hypot(dv)).atan().to_degrees()
        })
        .collect();
    slopes.sort_by(f32::total_cmp);
    let at = |percent: usize| slopes[(slopes.len() - 1) * percent / 100];
    let mean = heights.texels().iter().map(|&x| f64::from(x)).sum::<f64>() / slopes.len() as f64;
    #[allow(clippy::cast_possible_truncation, reason = "a report")]
    FieldReport {
        size: [w, h],
        mean_height: mean as f32,
        slope_degrees: SlopeReport { median: at(50), p95: at(95), max: at(100) },
        seam: SeamReport::new(heights),
    }
}

/// Rays straight down along each side of the tile, to find what is see-through.
const RAYS: u16 = 192;

fn mesh_report(mesh: &TileMesh) -> MeshReport {
    let corners = |t: &super::TileTriangle| t.vertices.map(|v| mesh.positions()[v as usize]);
    let bvh = Bvh::new(mesh.triangles().iter().map(corners).collect());
    let (low, high) = mesh.uv_range();
    let shifts = |low: f32, high: f32| {
        std::iter::successors(Some(low.floor()), |x| Some(x + 1.0)).take_while(move |&x| x <= high)
    };
    let blocked = |u: f32, v: f32| {
        shifts(low.x, high.x).any(|x| {
            shifts(low.y, high.y).any(|y| bvh.any_hit(&Ray::new(Vec3::new(u + x, v + y, 1.0), Vec3::NEG_Z)))
        })
    };
    let place = |i: u16| (f32::from(i) + 0.5) / f32::from(RAYS);
    let rays = || (0..RAYS).flat_map(|y| (0..RAYS).map(move |x| (x, y)));
    let open = rays().filter(|&(x, y)| !blocked(place(x), place(y))).count();
    let see_through = open as f32 / f32::from(RAYS).powi(2);
    MeshReport { vertices: mesh.positions().len(), triangles: mesh.triangles().len(), see_through }
}

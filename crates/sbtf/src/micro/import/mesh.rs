//! Tile meshes from mesh files.

use std::path::Path;

use glam::Vec3;
use osculate_geom::io::read_mesh;
use osculate_geom::mesh::{Weld, smooth_normals};
use osculate_geom::rays::to_f32;

use super::spec::{MapOrValue, Spec, Up};
use super::{ImportError, Imported, Problem};
use crate::micro::{Geometry, Microstructure, Reflectance, TileMesh, TileTriangle};

/// Farthest from the tile that a vertex may lie, in tiles: whoever traces the mesh holds as many copies.
const REACH: f32 = 4.0;

pub(super) fn build(spec: &Spec, name: &str, spec_path: &Path) -> Result<Imported, ImportError> {
    let path = spec_path.parent().unwrap_or_else(|| Path::new("")).join(name);
    let read = read_mesh(&path).map_err(|e| ImportError::new(&path, Problem::Mesh(e.problem.to_string())))?;
    let mesh = read.mesh;
    let [period_u, period_v] = spec.period.unwrap_or([1.0, 1.0]);
    let scale = Vec3::new(1.0 / period_u, 1.0 / period_v, 1.0 / period_u);
    let turn = |p: Vec3| if spec.up == Some(Up::Y) { Vec3::new(p.x, -p.z, p.y) } else { p };
    let mut positions: Vec<Vec3> = mesh.positions().iter().map(|p| turn(to_f32(p)) * scale).collect();
    let highest = positions.iter().map(|p| p.z).fold(f32::MIN, f32::max);
    for p in &mut positions {
        p.z -= highest;
    }
    let lowest = positions.iter().map(|p| p.z).fold(0.0, f32::min);
    let depth = check(&positions, -lowest, spec.depth).map_err(|problem| ImportError::new(&path, problem))?;
    let smooth = || smooth_normals(&mesh, Weld::Exact);
    let normals = mesh.normals().map_or_else(smooth, <[_]>::to_vec);
    // Normals go with the inverse of the scale.
    let normals = normals.iter().map(|n| (turn(to_f32(n)) / scale).normalize_or(Vec3::Z)).collect();
    let tile = TileMesh::new(positions, normals, triangles(&mesh), materials(&mesh, spec), depth);
    let micro = Microstructure { name: String::new(), geometry: Geometry::TileMesh(tile) };
    let warnings = read.warnings.iter().map(|w| format!("{}: {w}", path.display())).collect();
    Ok(Imported { micro, warnings, seam: None })
}

/// The depth, if the vertices suit a tile.
fn check(positions: &[Vec3], height: f32, depth: Option<f32>) -> Result<f32, Problem> {
    if let Some((i, p)) = positions.iter().enumerate().find(|(_, p)| !p.is_finite()) {
        return Err(Problem::Mesh(format!(
            "vertex {i} is at {p} tiles; set `period` to the length of a tile"
        )));
    }
    let far = |p: &Vec3| (p.truncate() - 0.5).abs().max_element() > REACH;
    if let Some((i, p)) = positions.iter().enumerate().find(|(_, p)| far(p)) {
        let message =
            format!("vertex {i} is at ({}, {}) tiles, more than {REACH} away; set `period`", p.x, p.y);
        return Err(Problem::Mesh(message));
    }
    match depth {
        Some(depth) if height > depth => Err(Problem::Mesh(format!(
            "reaches {height} tiles below its highest point; `depth` is only {depth}"
        ))),
        Some(depth) => Ok(depth),
        None if height < 1e-6 => {
            Err(Problem::Mesh(format!("is {height} tiles high; give `depth`, or a mesh that is not flat")))
        }
        None => Ok(height),
    }
}

fn triangles(mesh: &osculate_geom::Mesh) -> Vec<TileTriangle> {
    let mut triangles: Vec<TileTriangle> =
        mesh.triangles().iter().map(|&vertices| TileTriangle { vertices, material: 0 }).collect();
    for part in mesh.parts() {
        // 0 is for triangles without a material.
        let material = part.material.and_then(|m| u32::try_from(m + 1).ok()).unwrap_or(0);
        for triangle in &mut triangles[part.triangles.clone()] {
            triangle.material = material;
        }
    }
    triangles
}

/// The file's materials after the one for triangles that have none; what the specification gives goes for all.
fn materials(mesh: &osculate_geom::Mesh, spec: &Spec) -> Vec<Reflectance> {
    let value = |given: &Option<MapOrValue<f32>>, own: f32| match given {
        Some(MapOrValue::Value(x)) => *x,
        _ => own,
    };
    let none = osculate_geom::mesh::Material::default();
    std::iter::once(&none)
        .chain(mesh.materials())
        .map(|m| Reflectance {
            albedo: match &spec.albedo {
                Some(MapOrValue::Value(colour)) => Vec3::from(*colour),
                _ => Vec3::from(m.base_color).clamp(Vec3::ZERO, Vec3::ONE),
            },
            roughness: value(&spec.roughness, m.roughness),
            metalness: value(&spec.metalness, m.metallic),
        })
        .collect()
}

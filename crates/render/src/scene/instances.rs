//! `instances` of `[[mesh]]`: the same mesh in several places.

use glam::{EulerRot, Mat3, Vec3};
use serde::{Deserialize, Serialize};

use super::checker::Checker;
use super::{MeshInstance, Placement, SceneFileError, SurfaceSource};

/// Most instances of a mesh: their triangles are numbered through in 32 bits, and a picture shows no more.
const MOST: usize = 1_000_000;

/// Places of a mesh, after the mesh's own. Scaling one scales its material with it: depth and tiles.
#[derive(Debug, Clone, PartialEq, Serialize, Deserialize)]
#[serde(untagged)]
pub enum InstancesSection {
    /// One after the other.
    List(Vec<InstanceSection>),
    /// On a horizontal grid around the mesh's own place.
    Grid(GridSection),
}

/// A place of `instances`.
#[derive(Debug, Clone, PartialEq, Serialize, Deserialize)]
#[serde(deny_unknown_fields, default)]
pub struct InstanceSection {
    /// Turns about x, then y, then z, in degrees. Default: none.
    pub rotate: [f32; 3],
    /// Uniform scale. Default: 1.
    pub scale: ScaleSection,
    /// Translation, after rotation and scale. Default: none.
    pub translate: [f32; 3],
}

impl Default for InstanceSection {
    fn default() -> Self {
        Self { rotate: [0.0; 3], scale: ScaleSection::Uniform(1.0), translate: [0.0; 3] }
    }
}

/// A scale; a number for each axis only if they are the same.
#[derive(Debug, Clone, Copy, PartialEq, Serialize, Deserialize)]
#[serde(untagged)]
pub enum ScaleSection {
    /// Along all axes.
    Uniform(f32),
    /// Along x, y and z.
    Axes([f32; 3]),
}

/// A grid of `instances`.
#[derive(Debug, Clone, PartialEq, Serialize, Deserialize)]
#[serde(deny_unknown_fields)]
pub struct GridSection {
    /// How many along x and along z.
    pub grid: [u32; 2],
    /// Between neighbours, along x and along z.
    pub spacing: [f32; 2],
}

impl InstancesSection {
    /// All places.
    pub(super) fn placements(
        &self,
        check: &Checker<'_>,
        key: &str,
    ) -> Result<Vec<Placement>, SceneFileError> {
        let placements: Vec<Placement> = match self {
            Self::List(list) => {
                let place = |(k, section): (usize, &InstanceSection)| {
                    section.placement(check, &format!("{key}[{k}]"))
                };
                list.iter().enumerate().map(place).collect::<Result<_, _>>()?
            }
            Self::Grid(grid) => grid.placements(check, key)?,
        };
        if placements.is_empty() || placements.len() > MOST {
            return Err(check.error(key, placements.len(), format!("there must be 1 to {MOST} instances")));
        }
        Ok(placements)
    }
}

impl InstanceSection {
    fn placement(&self, check: &Checker<'_>, key: &str) -> Result<Placement, SceneFileError> {
        let scale = match self.scale {
            ScaleSection::Uniform(scale) => scale,
            ScaleSection::Axes([x, y, z]) if x == y && y == z => x,
            ScaleSection::Axes(axes) => {
                let problem = "must be the same along all axes: curvature is known for uniform scales only";
                return Err(check.error(&format!("{key}.scale"), format!("{axes:?}"), problem));
            }
        };
        if !(scale.is_finite() && scale > 0.0) {
            return Err(check.error(&format!("{key}.scale"), scale, "must be positive"));
        }
        let rotate = check.point(&format!("{key}.rotate"), self.rotate)?;
        let translation = check.point(&format!("{key}.translate"), self.translate)?;
        Ok(Placement { rotation: turned(rotate), scale, translation })
    }
}

impl GridSection {
    fn placements(&self, check: &Checker<'_>, key: &str) -> Result<Vec<Placement>, SceneFileError> {
        let [columns, rows] = self.grid;
        let count = u64::from(columns) * u64::from(rows);
        if !(1..=MOST as u64).contains(&count) {
            let problem = format!("must be 1 to {MOST} places");
            return Err(check.error(&format!("{key}.grid"), format!("{:?}", self.grid), problem));
        }
        for spacing in self.spacing {
            check.finite(&format!("{key}.spacing"), spacing)?;
        }
        let along = |k: u32, n: u32, spacing: f32| (k as f32 - 0.5 * (n - 1) as f32) * spacing;
        let place = |(column, row): (u32, u32)| {
            let [x, z] = self.spacing;
            let translation = Vec3::new(along(column, columns, x), 0.0, along(row, rows, z));
            Placement { translation, ..Placement::default() }
        };
        Ok((0..rows).flat_map(|row| (0..columns).map(move |column| (column, row))).map(place).collect())
    }
}

/// A turn about x, then y, then z, in degrees.
pub(super) fn turned(degrees: Vec3) -> Mat3 {
    let [x, y, z] = degrees.to_array().map(f32::to_radians);
    Mat3::from_euler(EulerRot::ZYX, z, y, x)
}

/// The object in these places. A material with silhouettes grows with it: its tiles keep their place on the mesh, and its depth is
/// the same part of the mesh.
pub(super) fn spread(object: &MeshInstance, placements: &[Placement]) -> Vec<MeshInstance> {
    let spread = |place: &Placement| {
        let mut object = object.clone();
        object.placement = place.after(&object.placement);
        if let SurfaceSource::Material(material) = &mut object.surface
            && let Some(silhouette) = &mut material.silhouette
        {
            silhouette.tile_size *= place.scale;
        }
        object
    };
    placements.iter().map(spread).collect()
}

//! The vertex rows of a bake in a file's float type, common to all formats.

use super::BakedMesh;
use super::error::WriteError;
use super::float::{FileFloat, error_row, narrow_all, unit_row};
use crate::Vec3;
use crate::curvature::{Principal, Status, VertexCurvature};
use crate::mesh::smooth_normals;

/// What a file holds of one vertex's curvature.
#[derive(Debug, Clone, Copy, PartialEq)]
pub(super) struct CurvatureRow<F> {
    /// `kappa_max`, `kappa_min`; zero where undetermined.
    pub kappa: [F; 2],
    /// Unit; where undetermined any direction across the normal.
    pub d1: [F; 3],
    /// Unit; not every format stores it.
    pub d2: [F; 3],
    /// [`FileFloat::UNDETERMINED`] where there is no estimate.
    pub error: F,
    /// [`Status`] as a number.
    pub status: u8,
}

/// Everything that a file holds per vertex, but for UVs, whose direction differs between formats.
#[derive(Debug)]
pub(super) struct Rows<F> {
    pub positions: Vec<[F; 3]>,
    pub normals: Vec<[F; 3]>,
    pub curvature: Vec<CurvatureRow<F>>,
}

impl<F: FileFloat> Rows<F> {
    /// Converts a bake, or names the first vertex that does not fit.
    pub fn new(baked: &BakedMesh) -> Result<Self, WriteError> {
        let mesh = baked.mesh();
        let positions = narrow_rows("position", mesh.positions().iter().map(|&p| p.into()))?;
        let normals = unit_normals(baked);
        let curvature = baked
            .curvature()
            .iter()
            .enumerate()
            .map(|(vertex, c)| curvature_row(vertex, c, &normals[vertex]))
            .collect::<Result<_, _>>()?;
        Ok(Self { positions, normals, curvature })
    }
}

/// Rows of `N` components in `F`.
pub(super) fn narrow_rows<F: FileFloat, const N: usize>(
    attribute: &'static str,
    rows: impl Iterator<Item = [f64; N]>,
) -> Result<Vec<[F; N]>, WriteError> {
    rows.enumerate()
        .map(|(vertex, row)| {
            narrow_all(row).map_err(|value| WriteError::DoesNotFit { attribute, vertex, value })
        })
        .collect()
}

/// The file's normals made unit; computed ones where the file has none; +Z for a vertex without any triangle.
fn unit_normals<F: FileFloat>(baked: &BakedMesh) -> Vec<[F; 3]> {
    let mesh = baked.mesh();
    let from_file = mesh.normals().map(|normals| normals.iter().map(|&n| unit_row(n)).collect::<Vec<_>>());
    let complete = from_file.as_ref().is_some_and(|rows| rows.iter().all(Option::is_some));
    let computed = if complete { Vec::new() } else { smooth_normals(mesh, baked.provenance.weld) };
    (0..mesh.positions().len())
        .map(|v| {
            from_file
                .as_ref()
                .and_then(|rows| rows[v])
                .or_else(|| unit_row(*computed.get(v)?))
                .or_else(|| unit_row(Vec3::z()))
                .expect("+Z is unit in every float type")
        })
        .collect()
}

fn curvature_row<F: FileFloat>(
    vertex: usize,
    curvature: &VertexCurvature,
    normal: &[F; 3],
) -> Result<CurvatureRow<F>, WriteError> {
    let status = curvature.status as u8;
    let Some(principal) = &curvature.principal else {
        let d1 = any_tangent(widen(*normal));
        let unit = |v: Vec3| unit_row(v).expect("a tangent of a unit vector is unit");
        return Ok(CurvatureRow {
            kappa: narrow_all([0.0; 2]).expect("zero fits"),
            d1: unit(d1),
            d2: unit(widen(*normal).cross(&d1)),
            error: F::UNDETERMINED,
            status,
        });
    };
    let direction = |v: Vec3| {
        unit_row(v).ok_or(WriteError::DoesNotFit { attribute: "direction", vertex, value: v.amax() })
    };
    let kappa = narrow_all([principal.kappa_max, principal.kappa_min])
        .map_err(|value| WriteError::DoesNotFit { attribute: "curvature", vertex, value })?;
    Ok(CurvatureRow {
        kappa,
        d1: direction(principal.d1)?,
        d2: direction(principal.d2)?,
        error: error_row(curvature.error),
        status,
    })
}

/// Why a row read from a file is not a curvature.
#[derive(Debug, Clone, PartialEq, thiserror::Error)]
pub(super) enum BadRow {
    #[error("the curvatures {0:?} are not finite with the larger one first")]
    Kappa([f64; 2]),
    #[error("the direction {0:?} is not a unit vector")]
    Direction([f64; 3]),
    #[error("the error {0:?} is negative or not a number")]
    Error(f64),
    #[error("status {0} is not among 0 to 5")]
    Status(u8),
}

/// The curvature that a row stands for. `d2` comes from the row where `stored_d2`, and from `normal x d1` otherwise.
pub(super) fn curvature_from_row<F: FileFloat>(
    row: &CurvatureRow<F>,
    d2: SecondDirection,
) -> Result<VertexCurvature, BadRow> {
    let status = Status::from_number(row.status).ok_or(BadRow::Status(row.status))?;
    let kappa = row.kappa.map(F::widen);
    let error = row.error.widen();
    if !(kappa[0].is_finite() && kappa[1].is_finite() && kappa[1] <= kappa[0]) {
        return Err(BadRow::Kappa(kappa));
    }
    if error.is_nan() || error < 0.0 {
        return Err(BadRow::Error(error));
    }
    if row.error == F::UNDETERMINED {
        return Ok(VertexCurvature::undetermined(status));
    }
    let d1 = checked_direction(row.d1)?;
    let d2 = match d2 {
        SecondDirection::Stored => checked_direction(row.d2)?,
        SecondDirection::AcrossNormal(normal) => {
            let across = normal.cross(&d1);
            // A direction along the normal has no perpendicular in the tangent plane; the file is odd but readable.
            if across.norm() > f64::from(f32::EPSILON) { across.normalize() } else { any_tangent(d1) }
        }
    };
    let principal = Principal { kappa_max: kappa[0], kappa_min: kappa[1], d1, d2 };
    Ok(VertexCurvature { principal: Some(principal), error: super::float::error_from_row(row.error), status })
}

/// Where the direction of `kappa_min` comes from.
#[derive(Debug, Clone, Copy)]
pub(super) enum SecondDirection {
    /// The row.
    Stored,
    /// `n x d1` with this unit normal.
    AcrossNormal(Vec3),
}

fn checked_direction<F: FileFloat>(row: [F; 3]) -> Result<Vec3, BadRow> {
    let d = widen(row);
    // Other programs may round directions on the way (half floats have 1e-3); what is farther off is no direction.
    if (d.norm() - 1.0).abs() <= 2e-3 { Ok(d) } else { Err(BadRow::Direction(d.into())) }
}

/// The same vector in `f64`.
pub(super) fn widen<F: FileFloat>(row: [F; 3]) -> Vec3 {
    Vec3::from(row.map(F::widen))
}

/// A unit vector across the unit vector `n`: the axis that `n` has least of, projected.
fn any_tangent(n: Vec3) -> Vec3 {
    let axis = Vec3::ith(n.iamin(), 1.0);
    (axis - n * n.dot(&axis)).normalize()
}

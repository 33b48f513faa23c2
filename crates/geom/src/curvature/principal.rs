//! What estimation returns for a vertex.

use serde::{Deserialize, Serialize};

use crate::{Mat3, Vec3};

/// Principal curvatures and directions at a point. All finite; `kappa_min <= kappa_max`; `d1`, `d2` unit and orthogonal.
#[derive(Debug, Clone, Copy, PartialEq)]
pub struct Principal {
    /// Larger signed curvature, 1/length.
    pub kappa_max: f64,
    /// Smaller signed curvature, 1/length.
    pub kappa_min: f64,
    /// Unit direction of `kappa_max`. Its sign carries no meaning.
    pub d1: Vec3,
    /// Unit direction of `kappa_min`; `d1 x d2` is the outward normal of the fitted surface.
    pub d2: Vec3,
}

impl Principal {
    /// The curvature tensor `kappa_max d1 d1^T + kappa_min d2 d2^T`, zero along the normal.
    #[must_use]
    pub fn tensor(&self) -> Mat3 {
        self.kappa_max * self.d1 * self.d1.transpose() + self.kappa_min * self.d2 * self.d2.transpose()
    }

    /// Outward unit normal of the fitted surface.
    #[must_use]
    pub fn normal(&self) -> Vec3 {
        self.d1.cross(&self.d2)
    }

    /// Mean curvature, `(kappa_max + kappa_min) / 2`.
    #[must_use]
    pub fn mean(&self) -> f64 {
        0.5 * self.kappa_max + 0.5 * self.kappa_min
    }
}

/// How much an estimate can be trusted, and if there is none, why. The numbers are `_CURVATURE_STATUS` in files.
///
/// Where several apply, [`Status::worse`] says which is reported.
#[derive(Debug, Clone, Copy, PartialEq, Eq, PartialOrd, Ord, Hash, Serialize, Deserialize)]
#[serde(rename_all = "snake_case")]
#[repr(u8)]
pub enum Status {
    /// Interior vertex, enough neighbours on all sides.
    Ok = 0,
    /// On the boundary: the fit sees one side only.
    Boundary = 1,
    /// Fewer neighbours than coefficients, also after growing to the whole component.
    FewNeighbours = 2,
    /// Neighbours in a degenerate position (collinear, on two lines): the fit does not determine a quadric.
    RankDeficient = 3,
    /// On an edge with three or more triangles, on one with inconsistent orientation, or where several fans meet.
    NonManifold = 4,
    /// No triangle of non-zero area uses the vertex.
    Isolated = 5,
    /// The estimated error is over the tolerance: the surface is under-sampled there, or noisier than the largest
    /// neighbourhood can average out. Only where nothing else is to be said.
    OverTolerance = 6,
    /// On a sharp crease, where curvature is not defined: this is that of the larger side.
    Crease = 7,
}

impl Status {
    /// All statuses in the order of their numbers.
    pub const ALL: [Self; 8] = [
        Self::Ok,
        Self::Boundary,
        Self::FewNeighbours,
        Self::RankDeficient,
        Self::NonManifold,
        Self::Isolated,
        Self::OverTolerance,
        Self::Crease,
    ];

    /// Words for tables and messages.
    #[must_use]
    pub fn label(self) -> &'static str {
        match self {
            Self::Ok => "ok",
            Self::Boundary => "boundary",
            Self::FewNeighbours => "few neighbours",
            Self::RankDeficient => "rank deficient",
            Self::NonManifold => "non-manifold",
            Self::Isolated => "isolated",
            Self::OverTolerance => "over tolerance",
            Self::Crease => "crease",
        }
    }

    /// The one of two that is reported: whatever says why there is no estimate, then what is wrong with the mesh, then what
    /// is wrong with the estimate.
    #[must_use]
    pub fn worse(self, other: Self) -> Self {
        let rank = |status: Self| match status {
            Self::Ok => 0,
            Self::OverTolerance => 1,
            Self::Crease => 2,
            other => 2 + other as u8,
        };
        if rank(other) > rank(self) { other } else { self }
    }

    /// The status with this number in a file.
    #[must_use]
    pub fn from_number(number: u8) -> Option<Self> {
        Self::ALL.get(usize::from(number)).copied()
    }
}

/// The estimate at one vertex.
#[derive(Debug, Clone, Copy, PartialEq)]
pub struct VertexCurvature {
    /// The curvature, or `None` where the data does not determine one; `status` then says why.
    pub principal: Option<Principal>,
    /// Estimated absolute error of the worse of the two curvatures, 1/length; `f64::INFINITY` where there is no estimate.
    pub error: f64,
    /// How the estimate came about.
    pub status: Status,
}

impl VertexCurvature {
    /// No estimate, for this reason.
    #[must_use]
    pub fn undetermined(status: Status) -> Self {
        Self { principal: None, error: f64::INFINITY, status }
    }

    /// Whether the surface is umbilic here as far as the estimate can tell: `kappa_max - kappa_min <= error`.
    ///
    /// The directions are then unit and orthogonal, but nothing else is known about them: another tangent is as good
    /// within the error. The tensor is sound all the same. `false` without an estimate.
    ///
    /// The flag is as good as the error is, which is an estimate and no bound.
    #[must_use]
    pub fn is_umbilic(&self) -> bool {
        self.principal.is_some_and(|p| p.kappa_max - p.kappa_min <= self.error)
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn umbilic_is_a_matter_of_the_error() {
        let at = |kappa_min: f64, error: f64| {
            let principal = Principal { kappa_max: 2.0, kappa_min, d1: Vec3::x(), d2: Vec3::y() };
            VertexCurvature { principal: Some(principal), error, status: Status::Ok }.is_umbilic()
        };
        assert!(at(2.0, 0.0) && at(1.5, 0.5) && at(-2.0, f64::INFINITY));
        assert!(!at(1.5, 0.25));
        assert!(!VertexCurvature::undetermined(Status::Isolated).is_umbilic());
    }
}

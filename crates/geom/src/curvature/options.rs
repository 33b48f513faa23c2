//! What to estimate, and how.

use serde::{Deserialize, Serialize};
use thiserror::Error;

/// Which estimator runs.
#[derive(Debug, Clone, Copy, PartialEq, Eq, Default, Serialize, Deserialize)]
#[serde(rename_all = "snake_case")]
pub enum Method {
    /// What `igl::principal_curvature` computes, its deviations from the textbook included.
    Libigl,
    /// A weighted, distance-scaled quadric fit with the exact shape operator.
    Quadric,
    /// A polynomial fit of degree 2 to 4 of heights bent by the curvature itself.
    Jet,
    /// An algebraic sphere fitted to positions and normals, and the differential of its gradient: for noise.
    Algebraic,
    /// The change of vertex normals over one ring: fast, for clean meshes. Takes no neighbourhood but one ring.
    Normals,
    /// Jets whose neighbourhood and degree are chosen vertex by vertex for the tolerance.
    #[default]
    Auto,
}

impl Method {
    /// All estimators, for tests and studies that must hold for every one.
    pub const ALL: [Self; 6] =
        [Self::Libigl, Self::Quadric, Self::Jet, Self::Algebraic, Self::Normals, Self::Auto];
}

/// What to do at sharp creases.
#[derive(Debug, Clone, Copy, PartialEq, Eq, Default, Serialize, Deserialize)]
#[serde(rename_all = "snake_case")]
pub enum Features {
    /// Detect them, and let no fit reach across. [`Method::Libigl`] does not, since libigl does not.
    #[default]
    Keep,
    /// Fit across them.
    Ignore,
}

/// Which vertices a fit sees.
#[derive(Debug, Clone, Copy, PartialEq, Serialize, Deserialize)]
#[serde(rename_all = "snake_case")]
pub enum Neighbourhood {
    /// All vertices at most this many edges away.
    Rings(u32),
    /// All vertices within this distance, in world units, that a walk over edges reaches without leaving it.
    Radius(f64),
    /// As `Radius`, in multiples of the mesh's mean edge length: libigl's "sphere" mode.
    MeanEdges(f64),
    /// This many vertices, the nearest ones by distance that a walk over edges reaches.
    Nearest(u32),
}

impl Neighbourhood {
    /// A larger one of the same kind, for fits that this one does not determine; itself at step 0.
    pub(super) fn enlarged(self, step: u32) -> Self {
        let growth = 1.5_f64.powi(i32::try_from(step).expect("few steps"));
        match self {
            Self::Rings(rings) => Self::Rings(rings.saturating_add(step)),
            Self::Radius(radius) => Self::Radius(radius * growth),
            Self::MeanEdges(edges) => Self::MeanEdges(edges * growth),
            Self::Nearest(count) => Self::Nearest(count.saturating_mul(step + 1)),
        }
    }
}

/// What to estimate.
#[derive(Debug, Clone, Copy, PartialEq, Serialize, Deserialize)]
pub struct CurvatureOptions {
    /// Which estimator runs. Default: [`Method::Auto`].
    pub method: Method,
    /// Which vertices a fit sees. `None`, the default, takes the method's own: 5 rings for `libigl` (as libigl does), 2
    /// for `quadric`, 3 for `jet`, 8 for `algebraic`, 1 for `normals`, at most 16 for `auto`.
    pub neighbourhood: Option<Neighbourhood>,
    /// Degree of [`Method::Jet`], 2 to 4. Default: 4.
    #[serde(default = "default_degree")]
    pub degree: u8,
    /// What [`Method::Auto`] aims for: error over curvature, at each vertex. Default: 0.005.
    #[serde(default = "default_tolerance")]
    pub tolerance: f64,
    /// What to do at sharp creases. Default: [`Features::Keep`].
    #[serde(default)]
    pub features: Features,
}

fn default_degree() -> u8 {
    4
}

fn default_tolerance() -> f64 {
    0.005
}

impl Default for CurvatureOptions {
    fn default() -> Self {
        Self {
            method: Method::default(),
            neighbourhood: None,
            degree: default_degree(),
            tolerance: default_tolerance(),
            features: Features::default(),
        }
    }
}

/// Options that make no sense.
#[derive(Debug, Clone, Copy, PartialEq, Error)]
pub enum OptionsError {
    /// A radius of zero, below zero or not finite.
    #[error("a neighbourhood radius of {0} is not a positive finite length")]
    Radius(f64),
    /// Zero rings.
    #[error("a neighbourhood of 0 rings holds no neighbour; take 1 or more")]
    NoRings,
    /// Fewer nearest neighbours than a fit has coefficients.
    #[error("{0} nearest neighbours do not determine a fit; take 6 or more")]
    TooFewNearest(u32),
    /// A degree that jets do not have.
    #[error("a degree of {0} is not among 2, 3 and 4")]
    Degree(u8),
    /// A tolerance of zero, below zero or not finite.
    #[error("a tolerance of {0} is not a positive finite number")]
    Tolerance(f64),
    /// `auto` with a neighbourhood that is no bound on its rings.
    #[error("auto chooses the neighbourhood itself: only a number of rings can bound it")]
    AutoTakesRings,
    /// `normals` with another neighbourhood than one ring.
    #[error("normals sees one ring; take another method for a larger neighbourhood")]
    NormalsTakesOneRing,
}

impl CurvatureOptions {
    /// The neighbourhood in force.
    #[must_use]
    pub fn neighbourhood(&self) -> Neighbourhood {
        self.neighbourhood.unwrap_or(match self.method {
            Method::Libigl => Neighbourhood::Rings(5),
            Method::Quadric => Neighbourhood::Rings(2),
            Method::Jet => Neighbourhood::Rings(3),
            Method::Algebraic => Neighbourhood::Rings(8),
            Method::Normals => Neighbourhood::Rings(1),
            Method::Auto => Neighbourhood::Rings(16),
        })
    }

    /// Checks the ranges.
    ///
    /// # Errors
    ///
    /// Zero rings, a radius that is not positive and finite, or what else [`OptionsError`] lists.
    pub fn validate(&self) -> Result<(), OptionsError> {
        if !(2..=4).contains(&self.degree) {
            return Err(OptionsError::Degree(self.degree));
        }
        if !(self.tolerance.is_finite() && self.tolerance > 0.0) {
            return Err(OptionsError::Tolerance(self.tolerance));
        }
        match self.neighbourhood() {
            hood if self.method == Method::Normals && hood != Neighbourhood::Rings(1) => {
                Err(OptionsError::NormalsTakesOneRing)
            }
            Neighbourhood::Rings(0) => Err(OptionsError::NoRings),
            Neighbourhood::Rings(_) => Ok(()),
            _ if self.method == Method::Auto => Err(OptionsError::AutoTakesRings),
            Neighbourhood::Radius(r) | Neighbourhood::MeanEdges(r) if !(r.is_finite() && r > 0.0) => {
                Err(OptionsError::Radius(r))
            }
            Neighbourhood::Nearest(count) if count < 6 => Err(OptionsError::TooFewNearest(count)),
            _ => Ok(()),
        }
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn all_methods_are_listed() {
        // A new variant does not compile here: count it, and add it to `ALL`.
        let number = |method: Method| match method {
            Method::Libigl => 0,
            Method::Quadric => 1,
            Method::Jet => 2,
            Method::Algebraic => 3,
            Method::Normals => 4,
            Method::Auto => 5,
        };
        assert_eq!(Method::ALL.map(number), [0, 1, 2, 3, 4, 5]);
    }
}

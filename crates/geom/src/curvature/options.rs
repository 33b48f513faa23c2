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
    #[default]
    Quadric,
}

impl Method {
    /// All estimators, for tests and studies that must hold for every one.
    pub const ALL: [Self; 2] = [Self::Libigl, Self::Quadric];
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
}

/// What to estimate.
#[derive(Debug, Clone, Copy, PartialEq, Default, Serialize, Deserialize)]
pub struct CurvatureOptions {
    /// Which estimator runs. Default: [`Method::Quadric`].
    pub method: Method,
    /// Which vertices a fit sees. `None`, the default, takes the method's own: 5 rings for `libigl` (as libigl does) and
    /// 2 for `quadric`.
    pub neighbourhood: Option<Neighbourhood>,
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
}

impl CurvatureOptions {
    /// The neighbourhood in force.
    #[must_use]
    pub fn neighbourhood(&self) -> Neighbourhood {
        self.neighbourhood.unwrap_or(match self.method {
            Method::Libigl => Neighbourhood::Rings(5),
            Method::Quadric => Neighbourhood::Rings(2),
        })
    }

    /// Checks the ranges.
    ///
    /// # Errors
    ///
    /// Zero rings, or a radius that is not positive and finite.
    pub fn validate(&self) -> Result<(), OptionsError> {
        match self.neighbourhood() {
            Neighbourhood::Rings(0) => Err(OptionsError::NoRings),
            Neighbourhood::Radius(r) | Neighbourhood::MeanEdges(r) if !(r.is_finite() && r > 0.0) => {
                Err(OptionsError::Radius(r))
            }
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
        };
        assert_eq!(Method::ALL.map(number), [0, 1]);
    }
}

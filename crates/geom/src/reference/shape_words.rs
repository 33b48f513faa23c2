//! Shapes as words: `torus:1,0.45,z`.

use std::fmt;
use std::str::FromStr;

use thiserror::Error;

use super::{Axis, SaddleForm, Shape};
use crate::Vec3;

/// Words that name no shape.
#[derive(Debug, Clone, PartialEq, Eq, Error)]
#[error(
    "{0:?} is no shape; write sphere:R, torus:A,r, cylinder:R, ellipsoid:a,b,c, plane or saddle (z = x y or z = (x^2 - y^2) / 2), with positive numbers, r < A, and optionally an axis as in torus:1,0.45,z or plane:z"
)]
pub struct ParseShapeError(String);

impl FromStr for Shape {
    type Err = ParseShapeError;

    fn from_str(text: &str) -> Result<Self, ParseShapeError> {
        let fail = || ParseShapeError(text.to_owned());
        let (name, rest) = text.split_once(':').unwrap_or((text, ""));
        let mut words: Vec<&str> = rest.split(',').map(str::trim).filter(|w| !w.is_empty()).collect();
        let axis = match words.last().copied() {
            Some("x") => Axis::X,
            Some("y") => Axis::Y,
            Some("z") => Axis::Z,
            _ => Axis::Fitted,
        };
        if axis != Axis::Fitted {
            words.pop();
        }
        let length = |word: &str| word.parse().ok().filter(|x: &f64| x.is_finite() && *x > 0.0);
        let lengths: Vec<f64> = words.iter().map(|w| length(w)).collect::<Option<_>>().ok_or_else(fail)?;
        match (name, &lengths[..], axis) {
            ("sphere", &[radius], Axis::Fitted) => Ok(Self::Sphere { radius }),
            ("torus", &[major, minor], axis) if minor < major => Ok(Self::Torus { major, minor, axis }),
            ("cylinder", &[radius], axis) => Ok(Self::Cylinder { radius, axis }),
            ("ellipsoid", &[a, b, c], Axis::Fitted) => Ok(Self::Ellipsoid { axes: Vec3::new(a, b, c) }),
            ("plane", [], axis) => Ok(Self::Plane { axis }),
            ("saddle", [], Axis::Fitted) => Ok(Self::Saddle { form: SaddleForm::Fitted }),
            _ => Err(fail()),
        }
    }
}

impl fmt::Display for Shape {
    fn fmt(&self, f: &mut fmt::Formatter<'_>) -> fmt::Result {
        let suffix = |axis: Axis| match axis {
            Axis::Fitted => "",
            Axis::X => ",x",
            Axis::Y => ",y",
            Axis::Z => ",z",
        };
        match *self {
            Self::Sphere { radius } => write!(f, "sphere:{radius}"),
            Self::Torus { major, minor, axis } => write!(f, "torus:{major},{minor}{}", suffix(axis)),
            Self::Cylinder { radius, axis } => write!(f, "cylinder:{radius}{}", suffix(axis)),
            Self::Ellipsoid { axes } => write!(f, "ellipsoid:{},{},{}", axes.x, axes.y, axes.z),
            Self::Plane { axis } => write!(f, "plane{}", suffix(axis).replace(',', ":")),
            Self::Saddle { .. } => write!(f, "saddle"),
        }
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn words_are_shapes_or_errors() {
        for text in
            ["sphere:2", "torus:1,0.45,z", "cylinder:0.5", "ellipsoid:1,2,3", "plane", "plane:z", "saddle"]
        {
            assert_eq!(text.parse::<Shape>().unwrap().to_string(), text);
        }
        for text in
            ["", "sphere", "sphere:-1", "sphere:NaN", "torus:1,2", "torus:1", "ellipsoid:1,2", "cube:1"]
        {
            assert!(text.parse::<Shape>().is_err(), "{text:?}");
        }
    }
}

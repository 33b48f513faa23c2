//! The one table of estimators and knobs that are measured. A new estimator or knob is added here and nowhere else.

use osculate_geom::curvature::{CurvatureOptions, Method, Neighbourhood};

use crate::estimate::name;

/// An estimator with its knobs.
#[derive(Debug, Clone)]
pub struct Setting {
    /// The estimator, as in `--method`.
    pub method: String,
    /// Its knobs in words.
    pub knobs: String,
    /// What `osculate bake` takes for it.
    pub arguments: String,
    /// What the library takes for it.
    pub options: CurvatureOptions,
    /// Whether it is measured on large meshes too.
    pub scaling: bool,
}

/// All that are measured; `quick` takes a few of each method.
pub fn settings(quick: bool) -> Vec<Setting> {
    let rings: &[u32] = if quick { &[2, 5] } else { &[2, 3, 4, 5, 6, 8] };
    let jet_rings: &[u32] = if quick { &[3] } else { &[2, 3, 4, 6, 8, 11] };
    let algebraic_rings: &[u32] = if quick { &[8] } else { &[4, 5, 6, 8, 10] };
    let tolerances: &[f64] = if quick { &[0.005] } else { &[0.1, 0.02, 0.005, 0.001, 0.0001] };
    Method::ALL
        .into_iter()
        .flat_map(|method| match method {
            Method::Auto => tolerances.iter().map(|&tolerance| with_tolerance(tolerance)).collect(),
            Method::Jet => (2..=4)
                .flat_map(|degree| jet_rings.iter().map(move |&rings| with_degree(degree, rings)))
                .collect(),
            Method::Algebraic => algebraic_rings.iter().map(|&rings| with_rings(method, rings)).collect(),
            Method::Normals => vec![with_rings(method, 1)],
            _ => rings.iter().map(|&rings| with_rings(method, rings)).collect::<Vec<_>>(),
        })
        .collect()
}

fn with_rings(method: Method, rings: u32) -> Setting {
    let options = CurvatureOptions { method, ..CurvatureOptions::default() };
    setting(fixed(options, rings), format!("{rings} rings"), &format!("--rings {rings}"))
}

fn with_degree(degree: u8, rings: u32) -> Setting {
    let options = CurvatureOptions { method: Method::Jet, degree, ..CurvatureOptions::default() };
    let knobs = format!("degree {degree} on {rings} rings");
    setting(fixed(options, rings), knobs, &format!("--degree {degree} --rings {rings}"))
}

fn with_tolerance(tolerance: f64) -> Setting {
    let options = CurvatureOptions { method: Method::Auto, tolerance, ..CurvatureOptions::default() };
    setting(options, format!("tolerance {tolerance}"), &format!("--tolerance {tolerance}"))
}

fn fixed(mut options: CurvatureOptions, rings: u32) -> CurvatureOptions {
    options.neighbourhood = Some(Neighbourhood::Rings(rings));
    options
}

fn setting(options: CurvatureOptions, knobs: String, knob_arguments: &str) -> Setting {
    let method = name(options.method);
    // The defaults of a method are what is measured at scale.
    let default = CurvatureOptions { method: options.method, ..CurvatureOptions::default() };
    let scaling = options.degree == default.degree
        && options.tolerance.to_bits() == default.tolerance.to_bits()
        && options.neighbourhood() == default.neighbourhood();
    Setting {
        arguments: format!("--method {method} {knob_arguments}"),
        knobs,
        method: method.to_owned(),
        options,
        scaling,
    }
}

#[cfg(test)]
mod tests {
    use std::collections::HashSet;

    use super::*;

    #[test]
    fn every_method_is_measured_once_per_knob_and_once_at_scale() {
        for quick in [true, false] {
            let all = settings(quick);
            let names: HashSet<_> = all.iter().map(|s| (&s.method, &s.knobs)).collect();
            assert_eq!(names.len(), all.len());
            let at_scale: HashSet<_> = all.iter().filter(|s| s.scaling).map(|s| &s.method).collect();
            assert_eq!(at_scale.len(), Method::ALL.len(), "{at_scale:?}");
            assert!(all.iter().all(|s| s.options.validate().is_ok()));
        }
    }
}

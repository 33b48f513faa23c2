//! The one table of estimators and knobs that are measured. A new estimator or knob is added here and nowhere else.

use osculate_geom::curvature::{CurvatureOptions, Method, Neighbourhood};

use crate::estimate::describe;

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

/// All that are measured; `quick` takes two a method.
pub fn settings(quick: bool) -> Vec<Setting> {
    let rings: &[u32] = if quick { &[2, 5] } else { &[2, 3, 4, 5, 6, 8] };
    Method::ALL.iter().flat_map(|&method| rings.iter().map(move |&rings| with_rings(method, rings))).collect()
}

fn with_rings(method: Method, rings: u32) -> Setting {
    let own = CurvatureOptions { method, ..CurvatureOptions::default() };
    let options = with_neighbourhood(own, Neighbourhood::Rings(rings));
    let scaling = own.neighbourhood() == Neighbourhood::Rings(rings);
    setting(options, &format!("--rings {rings}"), scaling)
}

fn with_neighbourhood(mut options: CurvatureOptions, neighbourhood: Neighbourhood) -> CurvatureOptions {
    options.neighbourhood = Some(neighbourhood);
    options
}

fn setting(options: CurvatureOptions, knob_arguments: &str, scaling: bool) -> Setting {
    let words = describe(&options);
    let (method, knobs) = words.split_once(", ").unwrap_or((&words, ""));
    Setting {
        arguments: format!("--method {method} {knob_arguments}").trim_end().to_owned(),
        method: method.to_owned(),
        knobs: knobs.to_owned(),
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

//! The arguments that choose an estimator.

use clap::{Args, ValueEnum};
use osculate_geom::bake::{BakeOptions, Facing};
use osculate_geom::curvature::{CurvatureOptions, Method, Neighbourhood};
use osculate_geom::mesh::Weld;

/// How curvature is estimated.
#[derive(Debug, Clone, Default, Args)]
#[command(next_help_heading = "Estimator")]
pub struct EstimateArgs {
    /// Estimator: `quadric`, the accurate one, or `libigl`, which repeats `igl::principal_curvature` number by number
    /// [default: quadric; for `verify --reference` libigl]
    #[arg(long, value_enum, hide_possible_values = true)]
    method: Option<MethodArg>,
    /// Fit all vertices at most N edges away [default: 2 for quadric, 5 for libigl]
    #[arg(long, value_name = "N", group = "neighbourhood", value_parser = clap::value_parser!(u32).range(1..=1000))]
    rings: Option<u32>,
    /// Fit all vertices within the distance R, in the mesh's units
    #[arg(long, value_name = "R", group = "neighbourhood", value_parser = positive)]
    radius: Option<f64>,
    /// Fit all vertices within X mean edge lengths: libigl's sphere mode
    #[arg(long, value_name = "X", group = "neighbourhood", value_parser = positive)]
    mean_edges: Option<f64>,
    /// Which vertices to merge first: those of equal position, or none [default: exact]
    #[arg(long, value_enum)]
    weld: Option<WeldArg>,
    /// Turn the surface over first: curvature changes its sign
    #[arg(long)]
    flip: bool,
}

#[derive(Debug, Clone, Copy, PartialEq, Eq, ValueEnum)]
enum MethodArg {
    Quadric,
    Libigl,
}

#[derive(Debug, Clone, Copy, PartialEq, Eq, ValueEnum)]
enum WeldArg {
    Exact,
    Off,
}

impl EstimateArgs {
    /// The options, with these in place of what the user leaves open.
    pub fn options(&self, defaults: &BakeOptions) -> BakeOptions {
        let method = self.method.map_or(defaults.curvature.method, |method| match method {
            MethodArg::Quadric => Method::Quadric,
            MethodArg::Libigl => Method::Libigl,
        });
        let rings = self.rings.map(Neighbourhood::Rings);
        let radius = self.radius.map(Neighbourhood::Radius);
        let mean_edges = self.mean_edges.map(Neighbourhood::MeanEdges);
        let neighbourhood = rings.or(radius).or(mean_edges).or(defaults.curvature.neighbourhood);
        BakeOptions {
            curvature: CurvatureOptions { method, neighbourhood },
            weld: self.weld.map_or(defaults.weld, |weld| match weld {
                WeldArg::Exact => Weld::Exact,
                WeldArg::Off => Weld::Off,
            }),
            facing: if self.flip { Facing::Flipped } else { defaults.facing },
            filter: defaults.filter,
        }
    }

    /// Whether the user chose anything; a baked file leaves nothing to choose.
    pub fn is_given(&self) -> bool {
        let Self { method, rings, radius, mean_edges, weld, flip } = self;
        method.is_some()
            || rings.is_some()
            || radius.is_some()
            || mean_edges.is_some()
            || weld.is_some()
            || *flip
    }
}

/// A positive finite number.
pub fn positive(text: &str) -> Result<f64, String> {
    match text.parse::<f64>() {
        Ok(x) if x > 0.0 && x.is_finite() => Ok(x),
        _ => Err("must be a positive number".to_owned()),
    }
}

/// The estimator in words: `quadric, 2 rings`.
pub fn describe(options: &CurvatureOptions) -> String {
    let method = match options.method {
        Method::Quadric => "quadric",
        Method::Libigl => "libigl",
    };
    match options.neighbourhood() {
        Neighbourhood::Rings(1) => format!("{method}, 1 ring"),
        Neighbourhood::Rings(rings) => format!("{method}, {rings} rings"),
        Neighbourhood::Radius(radius) => format!("{method}, radius {radius}"),
        Neighbourhood::MeanEdges(x) => format!("{method}, {x} mean edge lengths"),
    }
}

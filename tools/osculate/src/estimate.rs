//! The arguments that choose an estimator.

use anyhow::{Result, ensure};
use clap::{Args, ValueEnum};
use osculate_geom::bake::{BakeOptions, Facing};
use osculate_geom::curvature::{CurvatureOptions, Features, Method, Neighbourhood};
use osculate_geom::mesh::Weld;

/// How curvature is estimated.
#[derive(Debug, Clone, Default, Args)]
#[command(next_help_heading = "Estimator")]
pub struct EstimateArgs {
    /// Estimator: `auto` finds neighbourhood and degree for the tolerance, vertex by vertex; `jet` fits a polynomial of
    /// `--degree`; `quadric` is the cheapest fit; `algebraic` fits spheres to positions and normals, for noise;
    /// `normals` reads one ring of vertex normals, fast, for clean meshes; `libigl` repeats `igl::principal_curvature` number by number
    /// [default: auto, or jet where a degree or a neighbourhood is given; for `verify --reference` libigl]
    #[arg(long, value_enum, hide_possible_values = true)]
    method: Option<MethodArg>,
    /// For auto: error to aim for, relative to the curvature at each vertex [default: 0.01]
    #[arg(long, value_name = "E", value_parser = positive)]
    tolerance: Option<f64>,
    /// For jet: degree of the polynomial, 2 to 4 [default: 4]
    #[arg(long, value_name = "D", value_parser = clap::value_parser!(u8).range(2..=4))]
    degree: Option<u8>,
    /// Fit all vertices at most N edges away; for auto, go no further [default: 16 for auto, 3 for jet, 2 for quadric,
    /// 8 for algebraic, 5 for libigl; normals has 1]
    #[arg(long, value_name = "N", group = "neighbourhood", value_parser = clap::value_parser!(u32).range(1..=1000))]
    rings: Option<u32>,
    /// Fit all vertices within the distance R, in the mesh's units
    #[arg(long, value_name = "R", group = "neighbourhood", value_parser = positive)]
    radius: Option<f64>,
    /// Fit all vertices within X mean edge lengths: libigl's sphere mode
    #[arg(long, value_name = "X", group = "neighbourhood", value_parser = positive)]
    mean_edges: Option<f64>,
    /// Fit the N nearest vertices that a walk over edges reaches
    #[arg(long, value_name = "N", group = "neighbourhood", value_parser = clap::value_parser!(u32).range(6..=100_000))]
    nearest: Option<u32>,
    /// At sharp creases: let no fit reach across, or fit as if they were smooth [default: keep; libigl ignores them]
    #[arg(long, value_enum)]
    features: Option<FeaturesArg>,
    /// Which vertices to merge first: those of equal position, or none [default: exact]
    #[arg(long, value_enum)]
    weld: Option<WeldArg>,
    /// Turn the surface over first: curvature changes its sign
    #[arg(long)]
    flip: bool,
}

#[derive(Debug, Clone, Copy, PartialEq, Eq, ValueEnum)]
enum MethodArg {
    Auto,
    Jet,
    Quadric,
    Algebraic,
    Normals,
    Libigl,
}

#[derive(Debug, Clone, Copy, PartialEq, Eq, ValueEnum)]
enum FeaturesArg {
    Keep,
    Ignore,
}

impl From<MethodArg> for Method {
    fn from(method: MethodArg) -> Self {
        match method {
            MethodArg::Auto => Self::Auto,
            MethodArg::Jet => Self::Jet,
            MethodArg::Quadric => Self::Quadric,
            MethodArg::Algebraic => Self::Algebraic,
            MethodArg::Normals => Self::Normals,
            MethodArg::Libigl => Self::Libigl,
        }
    }
}

#[derive(Debug, Clone, Copy, PartialEq, Eq, ValueEnum)]
enum WeldArg {
    Exact,
    Off,
}

impl EstimateArgs {
    /// The options, with these in place of what the user leaves open.
    ///
    /// # Errors
    ///
    /// Options that do not go together, with what to do instead.
    pub fn options(&self, defaults: &BakeOptions) -> Result<BakeOptions> {
        let rings = self.rings.map(Neighbourhood::Rings);
        let radius = self.radius.map(Neighbourhood::Radius);
        let mean_edges = self.mean_edges.map(Neighbourhood::MeanEdges);
        let nearest = self.nearest.map(Neighbourhood::Nearest);
        let given = rings.or(radius).or(mean_edges).or(nearest);
        // A tolerance, a degree or a neighbourhood says what is meant where the default would choose these itself.
        let fixed = self.degree.is_some() || given.is_some() && defaults.curvature.method == Method::Auto;
        let implied = match self.tolerance {
            Some(_) => Some(Method::Auto),
            None if fixed => Some(Method::Jet),
            None => None,
        };
        let method = self.method.map(Method::from).or(implied).unwrap_or(defaults.curvature.method);
        ensure!(
            self.tolerance.is_none() || method == Method::Auto,
            "--tolerance is for --method auto; the others take a neighbourhood"
        );
        ensure!(self.degree.is_none() || method == Method::Jet, "--degree is for --method jet");
        let curvature = CurvatureOptions {
            method,
            neighbourhood: given.or(defaults.curvature.neighbourhood),
            degree: self.degree.unwrap_or(defaults.curvature.degree),
            tolerance: self.tolerance.unwrap_or(defaults.curvature.tolerance),
            features: self.features.map_or(defaults.curvature.features, |features| match features {
                FeaturesArg::Keep => Features::Keep,
                FeaturesArg::Ignore => Features::Ignore,
            }),
        };
        curvature.validate()?;
        Ok(BakeOptions {
            curvature,
            weld: self.weld.map_or(defaults.weld, |weld| match weld {
                WeldArg::Exact => Weld::Exact,
                WeldArg::Off => Weld::Off,
            }),
            facing: if self.flip { Facing::Flipped } else { defaults.facing },
            filter: defaults.filter,
        })
    }

    /// Whether the user chose anything; a baked file leaves nothing to choose.
    pub fn is_given(&self) -> bool {
        let Self { method, tolerance, degree, rings, radius, mean_edges, nearest, features, weld, flip } =
            self;
        let estimator = method.is_some() || tolerance.is_some() || degree.is_some();
        let neighbourhood = rings.is_some() || radius.is_some() || mean_edges.is_some() || nearest.is_some();
        estimator || neighbourhood || features.is_some() || weld.is_some() || *flip
    }
}

/// A positive finite number.
pub fn positive(text: &str) -> Result<f64, String> {
    match text.parse::<f64>() {
        Ok(x) if x > 0.0 && x.is_finite() => Ok(x),
        _ => Err("must be a positive number".to_owned()),
    }
}

/// The estimator as in `--method`.
pub fn name(method: Method) -> &'static str {
    match method {
        Method::Auto => "auto",
        Method::Jet => "jet",
        Method::Quadric => "quadric",
        Method::Algebraic => "algebraic",
        Method::Normals => "normals",
        Method::Libigl => "libigl",
    }
}

/// The estimator in words: `quadric, 2 rings`.
pub fn describe(options: &CurvatureOptions) -> String {
    let neighbourhood = match options.neighbourhood() {
        Neighbourhood::Rings(1) => "1 ring".to_owned(),
        Neighbourhood::Rings(rings) => format!("{rings} rings"),
        Neighbourhood::Radius(radius) => format!("radius {radius}"),
        Neighbourhood::MeanEdges(x) => format!("{x} mean edge lengths"),
        Neighbourhood::Nearest(count) => format!("{count} nearest vertices"),
    };
    let name = name(options.method);
    match options.method {
        Method::Auto => format!("{name}, tolerance {}, at most {neighbourhood}", options.tolerance),
        Method::Jet => format!("{name} of degree {}, {neighbourhood}", options.degree),
        Method::Quadric | Method::Algebraic | Method::Normals | Method::Libigl => {
            format!("{name}, {neighbourhood}")
        }
    }
}

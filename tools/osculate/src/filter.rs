//! The arguments that choose how far and by what curvature is filtered.

use clap::{Args, ValueEnum};
use osculate_geom::field::{FilterKind, WalkLength};

use crate::console::number;
use crate::estimate::positive;

/// How far a filter looks past a point.
#[derive(Debug, Clone, Default, Args)]
pub struct LengthArgs {
    /// Depth of the material below the surface, in world units: the filter looks as far as a ray can be in it
    /// [default: 2 % of the mesh's diagonal]
    #[arg(long, value_name = "D", group = "walk", value_parser = positive)]
    filter_depth: Option<f64>,
    /// Look this far past every point instead, in world units along the surface
    #[arg(long, value_name = "L", group = "walk", value_parser = positive)]
    filter_length: Option<f64>,
}

impl LengthArgs {
    /// What the user chose, if anything.
    pub fn walk(&self) -> Option<WalkLength> {
        let fixed = self.filter_length.map(WalkLength::Fixed);
        fixed.or(self.filter_depth.map(|depth| WalkLength::Shell { depth }))
    }
}

/// Names of the filters on the command line.
#[derive(Debug, Clone, Copy, PartialEq, Eq, ValueEnum)]
pub enum FilterArg {
    /// Curvature along the ray at the point, unfiltered
    Point,
    /// Least curvature past the point, by an exact walk
    March,
    /// The same from a table: the file's, if it was baked for this length, or one of 16 directions that is made first
    Baked,
    /// The circle with the ray's entry angle and exit distance
    Chord,
    /// The same from a table that is made first: for long renderings
    #[value(name = "baked_chord")]
    BakedChord,
}

impl From<FilterArg> for FilterKind {
    fn from(arg: FilterArg) -> Self {
        match arg {
            FilterArg::Point => Self::Point,
            FilterArg::March => Self::March,
            FilterArg::Baked => Self::Baked,
            FilterArg::Chord => Self::Chord,
            FilterArg::BakedChord => Self::BakedChord,
        }
    }
}

/// A walk's length in words.
pub fn describe_walk(walk: &WalkLength) -> String {
    match *walk {
        WalkLength::Fixed(length) => format!("{} far", number(length)),
        WalkLength::Shell { depth } => format!("as far as a ray is in a material {} deep", number(depth)),
        WalkLength::ShellAt { depth, cosine } => {
            format!("as far as a ray of cosine {} is in a material {} deep", number(cosine), number(depth))
        }
    }
}

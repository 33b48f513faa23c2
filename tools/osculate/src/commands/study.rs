//! `osculate study`

use anyhow::Result;
use clap::{Args, Subcommand};

use super::study_filter::{self, FilterArgs};
use crate::cli::Outcome;
use crate::console::Console;
use crate::report::Reporter;

/// Measure error against time: CSV, SVG, and one self-contained HTML page.
#[derive(Debug, Args)]
pub struct StudyArgs {
    #[command(subcommand)]
    study: Study,
}

#[derive(Debug, Subcommand)]
enum Study {
    Filter(FilterArgs),
}

/// Runs the command.
pub fn run(args: &StudyArgs, console: &Console, reporter: &Reporter) -> Result<Outcome> {
    match &args.study {
        Study::Filter(args) => study_filter::run(args, console, reporter),
    }
}

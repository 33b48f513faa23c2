//! The arguments that all commands share.

use std::path::PathBuf;

use anyhow::{Context, Result};
use clap::{Args, Parser, Subcommand};

use crate::commands::{bake, demo, eval, inspect, micro, render, study, train, verify};
use crate::console::Console;
use crate::report::Reporter;

/// Principal curvature on triangle meshes: estimate it, bake it into the mesh, prove it right, render with it.
#[derive(Debug, Parser)]
#[command(name = "osculate", version, propagate_version = true, max_term_width = 110, after_help = EXAMPLES)]
pub struct Cli {
    #[command(flatten)]
    common: Common,
    #[command(subcommand)]
    command: Command,
}

const EXAMPLES: &str = "\
Examples:
  osculate demo                                     the main job on a shipped mesh, with pictures
  osculate bake cow.obj -o cow.glb                  estimate curvature, write it as vertex attributes
  osculate inspect cow.glb                          what is inside
  osculate verify cow.glb --analytic sphere:1       compare with a closed form
  osculate render cow.glb -o cow.png                a picture
  osculate micro wool-1 -o wool.png                 a material: numbers and a picture
  osculate train stone-1 -o stone.sbtf              a neural material from a microstructure
  osculate eval stone.sbtf                          compare it with exact answers
  osculate study curvature -o study --quick         error against time of every estimator

Exit codes: 0 done; 1 a check did not hold; 2 bad input or usage, nothing was written.";

/// Options of every command.
#[derive(Debug, Args)]
pub struct Common {
    /// Write a machine-readable report to FILE, or to standard output for `-` (and nothing else there)
    #[arg(long, global = true, value_name = "FILE")]
    json: Option<PathBuf>,
    /// Number of threads [default: all]; results do not depend on it
    #[arg(long, global = true, value_name = "N", value_parser = clap::value_parser!(u16).range(1..=1024))]
    threads: Option<u16>,
    /// Print errors only
    #[arg(short, long, global = true, conflicts_with = "verbose")]
    quiet: bool,
    /// Print what is done
    #[arg(short, long, global = true)]
    verbose: bool,
}

#[derive(Debug, Subcommand)]
enum Command {
    Bake(bake::BakeArgs),
    Inspect(inspect::InspectArgs),
    Verify(verify::VerifyArgs),
    Render(render::RenderArgs),
    Micro(micro::MicroArgs),
    Train(train::TrainArgs),
    Eval(eval::EvalArgs),
    Study(study::StudyArgs),
    Demo(demo::DemoArgs),
}

/// How a command ended when nothing went wrong.
#[derive(Debug, Clone, Copy, PartialEq, Eq)]
pub enum Outcome {
    /// Everything was done, and every check held.
    Done,
    /// Everything was done, and a check did not hold.
    CheckFailed,
}

impl Cli {
    /// Runs the command.
    pub fn run(self) -> Result<Outcome> {
        let Common { json, threads, quiet, verbose } = self.common;
        if let Some(threads) = threads {
            rayon::ThreadPoolBuilder::new()
                .num_threads(threads.into())
                .build_global()
                .with_context(|| format!("--threads {threads}: the threads cannot be started"))?;
        }
        let reporter = Reporter::new(json)?;
        let console = Console::new(quiet, verbose, reporter.owns_stdout());
        match self.command {
            Command::Bake(args) => bake::run(&args, &console, &reporter),
            Command::Inspect(args) => inspect::run(&args, &console, &reporter),
            Command::Verify(args) => verify::run(&args, &console, &reporter),
            Command::Render(args) => render::run(&args, &console, &reporter),
            Command::Micro(args) => micro::run(&args, &console, &reporter),
            Command::Train(args) => train::run(&args, &console, &reporter),
            Command::Eval(args) => eval::run(&args, &console, &reporter),
            Command::Study(args) => study::run(&args, &console, &reporter),
            Command::Demo(args) => demo::run(&args, &console, &reporter),
        }
    }
}

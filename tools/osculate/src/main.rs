//! Command line of Osculate: arguments become library options, results become words, files and exit codes.
//!
//! | file | what it holds |
//! |---|---|
//! | `cli` | the arguments that all commands share, and the list of commands |
//! | `commands/` | one file per command: its arguments, what it runs, what it reports |
//! | `estimate` | the arguments that choose an estimator |
//! | `filter` | the arguments that choose how curvature is filtered |
//! | `field` | what the renderer asks about curvature along a ray |
//! | `input`, `output` | files in, files out, and the checks before any work |
//! | `neural/` | what the commands about neural materials share |
//! | `protocol/` | the paper's table: materials on curved meshes against displaced truth |
//! | `console` | what a person sees: lines, warnings, progress |
//! | `report` | what a program sees: `--json` |
//! | `study` | error against time: what `study` measures, plots and writes |

mod cli;
mod commands;
mod console;
mod estimate;
mod field;
mod filter;
mod input;
mod model_report;
mod neural;
mod output;
mod protocol;
mod report;
mod study;

use std::alloc::System;
use std::process::ExitCode;

use clap::Parser;
use peakmem_alloc::{INSTRUMENTED_SYSTEM, PeakMemAlloc};

/// Counts, so that a study can say what an estimate allocates; two atomic operations an allocation.
#[global_allocator]
static ALLOCATOR: &PeakMemAlloc<System> = &INSTRUMENTED_SYSTEM;

fn main() -> ExitCode {
    // Prints help and usage errors by itself, with exit codes 0 and 2.
    let cli = cli::Cli::parse();
    match cli.run() {
        Ok(cli::Outcome::Done) => ExitCode::SUCCESS,
        Ok(cli::Outcome::CheckFailed) => ExitCode::from(1),
        Err(error) => {
            console::error(&error);
            ExitCode::from(2)
        }
    }
}

//! What a program sees: one JSON document per run.

use std::io::{self, Write};
use std::path::{Path, PathBuf};
use std::time::Instant;

use anyhow::{Context, Result};
use osculate_geom::write_atomically;
use serde::Serialize;

use crate::output;

/// Writes the report that `--json` asks for, and measures what the run costs.
#[derive(Debug)]
pub struct Reporter {
    target: Option<PathBuf>,
    start: Instant,
}

/// What a run cost.
#[derive(Debug, Clone, Copy, Serialize)]
pub struct Cost {
    /// Wall time of the whole command.
    pub seconds: f64,
    /// Largest resident memory of the process, where the system tells.
    pub peak_memory_bytes: Option<u64>,
    /// Threads that the command could use.
    pub threads: usize,
}

#[derive(Serialize)]
struct Document<'a, T> {
    schema: String,
    tool: &'static str,
    #[serde(flatten)]
    body: &'a T,
    cost: Cost,
}

impl Reporter {
    /// Starts the clock, and checks that the report can be written before any work is done.
    pub fn new(target: Option<PathBuf>) -> Result<Self> {
        if let Some(path) = target.as_deref().filter(|path| !is_stdout(path)) {
            output::check(path)?;
        }
        Ok(Self { target, start: Instant::now() })
    }

    /// Whether standard output belongs to the report.
    pub fn owns_stdout(&self) -> bool {
        self.target.as_deref().is_some_and(is_stdout)
    }

    /// Cost up to now.
    pub fn cost(&self) -> Cost {
        Cost {
            seconds: self.start.elapsed().as_secs_f64(),
            peak_memory_bytes: peak_memory_bytes(),
            threads: rayon::current_num_threads(),
        }
    }

    /// Writes the report of `command`, if one is wanted. `version` grows when a field changes its meaning or goes.
    pub fn write(&self, command: &str, version: u32, body: &impl Serialize) -> Result<()> {
        let Some(target) = &self.target else { return Ok(()) };
        let document = Document {
            schema: format!("osculate.{command}/{version}"),
            tool: concat!("osculate ", env!("CARGO_PKG_VERSION")),
            body,
            cost: self.cost(),
        };
        let mut json = serde_json::to_vec_pretty(&document).context("the report is no JSON")?;
        json.push(b'\n');
        if is_stdout(target) {
            io::stdout().write_all(&json).context("standard output")
        } else {
            write_atomically(target, |w| w.write_all(&json)).with_context(|| target.display().to_string())
        }
    }
}

fn is_stdout(path: &Path) -> bool {
    path.as_os_str() == "-"
}

#[cfg(target_os = "linux")]
fn peak_memory_bytes() -> Option<u64> {
    let status = std::fs::read_to_string("/proc/self/status").ok()?;
    let line = status.lines().find_map(|line| line.strip_prefix("VmHWM:"))?;
    line.trim().strip_suffix(" kB")?.trim().parse::<u64>().ok().map(|kilobytes| kilobytes * 1024)
}

#[cfg(not(target_os = "linux"))]
fn peak_memory_bytes() -> Option<u64> {
    None
}

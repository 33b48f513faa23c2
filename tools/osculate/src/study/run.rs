//! What every study does at its end, and says about the run that made it.

use std::io::Write;
use std::path::Path;

use anyhow::{Context, Result};
use osculate_geom::write_atomically;

/// Writes named texts into a folder; their names.
pub fn write_files(folder: &Path, files: Vec<(String, String)>) -> Result<Vec<String>> {
    for (name, text) in &files {
        let path = folder.join(name);
        write_atomically(&path, |w| w.write_all(text.as_bytes()))
            .with_context(|| path.display().to_string())?;
    }
    Ok(files.into_iter().map(|(name, _)| name).collect())
}

/// What was typed, with the program's bare name.
pub fn command_line() -> String {
    let arguments = std::env::args_os().skip(1).map(|a| a.to_string_lossy().into_owned());
    std::iter::once("osculate".to_owned()).chain(arguments).collect::<Vec<_>>().join(" ")
}

/// The processor's name where the system tells it, or its kind.
pub fn processor() -> String {
    let info = std::fs::read_to_string("/proc/cpuinfo").unwrap_or_default();
    let model = info.lines().find_map(|line| line.strip_prefix("model name")?.split_once(':'));
    model.map_or_else(|| std::env::consts::ARCH.to_owned(), |(_, name)| name.trim().to_owned())
}

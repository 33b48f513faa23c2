//! Files out: the checks before any work is done.

use std::path::Path;

use anyhow::{Result, bail};

/// Refuses a file that could not be written, so that a long run does not end in an error.
pub fn check(path: &Path) -> Result<()> {
    let shown = path.display();
    if path.is_dir() {
        bail!("{shown}: is a directory; name a file in it");
    }
    if path.exists() && !path.is_file() {
        bail!("{shown}: is not a regular file; name another one");
    }
    match path.parent() {
        Some(parent) if !parent.as_os_str().is_empty() && !parent.is_dir() => {
            bail!("{shown}: the directory {} does not exist; make it first", parent.display())
        }
        _ => Ok(()),
    }
}

/// Refuses to replace an input by an output.
pub fn check_distinct(input: &Path, output: &Path) -> Result<()> {
    if let (Ok(a), Ok(b)) = (input.canonicalize(), output.canonicalize())
        && a == b
    {
        bail!("{}: is the input too; write to another file", output.display());
    }
    Ok(())
}

/// The extension in lower case, without the dot.
pub fn extension(path: &Path) -> String {
    path.extension().unwrap_or_default().to_string_lossy().to_lowercase()
}

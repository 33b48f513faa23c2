//! Other programs: the meshes go out as files, `tools/reference/peers.py` measures them, rows come back.

use std::fs::File;
use std::io::{BufRead, BufReader, BufWriter, Write};
use std::path::{Path, PathBuf};
use std::process::{Command, Stdio};

use anyhow::{Context, Result, bail};

use super::rows::Row;
pub use super::rows::read_peers;
use super::subjects::Subject;

/// How to run the peers.
#[derive(Debug, Clone)]
pub struct PeersRun {
    /// A Python that can import numpy, and libigl or pymeshlab for these to be measured.
    pub python: PathBuf,
    /// `tools/reference/peers.py`.
    pub script: PathBuf,
    /// What else the script takes.
    pub arguments: Vec<String>,
}

/// Largest mesh that is written for other programs: some take half a millisecond a vertex.
pub const LARGEST: usize = 100_000;

/// The meshes on disk.
#[derive(Debug)]
pub struct Export {
    folder: PathBuf,
    manifest: String,
}

impl Export {
    /// Makes the folder.
    pub fn new(folder: PathBuf) -> Result<Self> {
        std::fs::create_dir_all(&folder).with_context(|| folder.display().to_string())?;
        Ok(Self { folder, manifest: String::from("mesh,shape,vertices,noise,radius,use\n") })
    }

    /// Writes one mesh as OBJ with all digits, and its exact curvature.
    pub fn add(&mut self, subject: &Subject) -> Result<()> {
        let vertices = subject.mesh.positions().len();
        if vertices > LARGEST {
            return Ok(());
        }
        let write = |extension: &str, write: &dyn Fn(&mut dyn Write) -> std::io::Result<()>| {
            let path = self.folder.join(format!("{}.{extension}", subject.name));
            let file = File::create(&path).with_context(|| path.display().to_string())?;
            let mut out = BufWriter::new(file);
            write(&mut out).and_then(|()| out.flush()).with_context(|| path.display().to_string())
        };
        write("obj", &|out| {
            for p in subject.mesh.positions() {
                writeln!(out, "v {:?} {:?} {:?}", p.x, p.y, p.z)?;
            }
            for [a, b, c] in subject.mesh.triangles() {
                writeln!(out, "f {} {} {}", a + 1, b + 1, c + 1)?;
            }
            Ok(())
        })?;
        write("exact", &|out| {
            for exact in &subject.exact {
                let numbers =
                    exact.map_or([f64::NAN; 5], |e| [e.kappa_max, e.kappa_min, e.d1.x, e.d1.y, e.d1.z]);
                for x in numbers {
                    out.write_all(&x.to_le_bytes())?;
                }
            }
            Ok(())
        })?;
        let Subject { name, shape, noise, radius, purpose, .. } = subject;
        self.manifest += &format!("{name},{shape},{vertices},{noise},{radius},{}\n", purpose.name());
        Ok(())
    }

    /// Writes the list of meshes, last, so that it never names what is not there.
    pub fn finish(self) -> Result<PathBuf> {
        let path = self.folder.join("meshes.csv");
        std::fs::write(&path, self.manifest).with_context(|| path.display().to_string())?;
        Ok(self.folder)
    }
}

impl PeersRun {
    /// Refuses what cannot run, before any work is done.
    pub fn check(&self) -> Result<()> {
        if !self.script.is_file() {
            bail!(
                "{}: does not exist; run in a checkout of osculate or name the script with --peers-script",
                self.script.display()
            );
        }
        let tried = Command::new(&self.python).args(["-c", "import numpy"]).output();
        let output = tried.with_context(|| format!("{}: cannot be run", self.python.display()))?;
        if !output.status.success() {
            bail!("{}: cannot import numpy; install tools/reference/requirements.txt", self.python.display());
        }
        Ok(())
    }

    /// Measures the exported meshes. `progress` gets the share that is done.
    pub fn run(&self, meshes: &Path, progress: impl Fn(f64)) -> Result<Vec<Row>> {
        let output = meshes.join("peers.csv");
        let mut child = Command::new(&self.python)
            .arg(&self.script)
            .arg(meshes)
            .arg("-o")
            .arg(&output)
            .args(&self.arguments)
            .stderr(Stdio::piped())
            .spawn()
            .with_context(|| format!("{}: cannot be run", self.python.display()))?;
        let mut last = String::new();
        for line in child.stderr.take().into_iter().flat_map(|e| BufReader::new(e).lines()) {
            last = line.unwrap_or_default();
            // `peers DONE TOTAL ...`
            let mut words = last.split_ascii_whitespace().skip(1).map_while(|w| w.parse::<f64>().ok());
            if let (Some(done), Some(total)) = (words.next(), words.next()) {
                progress(done / total);
            }
        }
        let status = child.wait().context("the peers")?;
        if !status.success() {
            bail!("{}: {last}", self.script.display());
        }
        let text = std::fs::read_to_string(&output).with_context(|| output.display().to_string())?;
        read_peers(&text).with_context(|| output.display().to_string())
    }
}

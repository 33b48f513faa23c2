//! Runs the real binary in a fresh directory.
#![allow(clippy::unwrap_used, reason = "a test that cannot set up its files must stop")]
#![allow(dead_code, reason = "every test binary uses its own part of this")]

use std::fmt::Write as _;
use std::path::{Path, PathBuf};
use std::process::{Command, Output};

use osculate_geom::Mesh;
use tempfile::TempDir;

/// A directory of its own, and the binary to run in it.
pub struct Workspace {
    directory: TempDir,
}

/// What a run left behind.
#[derive(Debug)]
pub struct Run {
    pub code: i32,
    pub stdout: String,
    pub stderr: String,
}

impl Workspace {
    pub fn new() -> Self {
        Self { directory: tempfile::tempdir().unwrap() }
    }

    pub fn path(&self, name: &str) -> PathBuf {
        self.directory.path().join(name)
    }

    pub fn command(&self) -> Command {
        let mut command = Command::new(env!("CARGO_BIN_EXE_osculate"));
        command.current_dir(self.directory.path());
        command
    }

    /// Runs the binary in the directory; `args` are split at blanks.
    pub fn run(&self, args: &str) -> Run {
        Run::from(self.command().args(args.split_ascii_whitespace()).output().unwrap())
    }

    /// Runs it and expects exit code 0.
    pub fn ok(&self, args: &str) -> Run {
        let run = self.run(args);
        assert_eq!(run.code, 0, "osculate {args}: {run:?}");
        run
    }

    /// Runs it and expects exit code 2, one line of message that has `parts` in it, and no new file.
    pub fn refuses(&self, args: &str, parts: &[&str]) -> String {
        let before = self.files();
        let run = self.run(args);
        assert_eq!(run.code, 2, "osculate {args}: {run:?}");
        assert_eq!(run.stderr.lines().count(), 1, "osculate {args}: one line: {run:?}");
        assert!(run.stderr.starts_with("osculate: "), "{run:?}");
        for part in parts {
            assert!(run.stderr.contains(part), "osculate {args}: {part:?} is not in {:?}", run.stderr);
        }
        assert_eq!(run.stdout, "");
        assert_eq!(self.files(), before, "osculate {args}: nothing is written");
        run.stderr
    }

    /// Names of all files.
    pub fn files(&self) -> Vec<String> {
        let entries = std::fs::read_dir(self.directory.path()).unwrap();
        let mut names: Vec<_> =
            entries.map(|entry| entry.unwrap().file_name().to_string_lossy().into_owned()).collect();
        names.sort();
        names
    }

    pub fn write(&self, name: &str, text: &str) {
        std::fs::write(self.path(name), text).unwrap();
    }

    pub fn read(&self, name: &str) -> Vec<u8> {
        std::fs::read(self.path(name)).unwrap()
    }

    pub fn json(&self, name: &str) -> serde_json::Value {
        serde_json::from_slice(&self.read(name)).unwrap()
    }

    /// Writes a mesh as OBJ with all digits.
    pub fn write_obj(&self, name: &str, mesh: &Mesh) {
        let mut text = String::new();
        for p in mesh.positions() {
            let _ = writeln!(text, "v {:?} {:?} {:?}", p.x, p.y, p.z);
        }
        for [a, b, c] in mesh.triangles() {
            let _ = writeln!(text, "f {} {} {}", a + 1, b + 1, c + 1);
        }
        self.write(name, &text);
    }
}

impl From<Output> for Run {
    fn from(output: Output) -> Self {
        let text = |bytes: Vec<u8>| String::from_utf8(bytes).unwrap();
        let code = output.status.code().unwrap_or(-1);
        Self { code, stdout: text(output.stdout), stderr: text(output.stderr) }
    }
}

/// A file of the repository.
pub fn repository(path: &str) -> PathBuf {
    Path::new(env!("CARGO_MANIFEST_DIR")).join("../..").join(path)
}

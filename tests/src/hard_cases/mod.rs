//! The hard cases: each a mesh that breaks tools, what every estimator must return for it, and the check of that.
//!
//! One table, four uses: a test a case and method (`tests/tests/hard_cases.rs`), the document
//! (`docs/hard-cases.md`, see [`document`]), the meshes that other tools are run on (`tests/examples/export_hard_cases.rs`), and
//! their verdicts (`tests/data/hard_case_peers.csv`, by `tools/reference/hard_case_peers.py`).

mod broken;
pub mod document;
mod exemptions;
mod files;
mod laws;
pub mod meshes;
mod noise;
mod outcome;
mod rays;
mod sharp;
mod smooth;
mod topology;
mod truth;

use osculate_geom::Mesh;
use osculate_geom::curvature::Method;

pub use outcome::{Outcome, invariants};
pub use truth::{Truth, verdict};

/// A mesh that breaks tools, and what must come of it.
#[derive(Debug, Clone, Copy)]
pub struct HardCase {
    /// Unique, in snake case: the name of the test and of the exported mesh.
    pub name: &'static str,
    /// What is hard about it.
    pub what: &'static str,
    /// What every estimator must return, in words. Completes "every estimator returns".
    pub expect: &'static str,
    /// Makes the mesh; always the same one.
    pub mesh: fn() -> Mesh,
    /// What is known about each of its vertices.
    pub truth: fn(&Mesh) -> Vec<Truth>,
    /// Share of the vertices with a truth that must meet it: 1 but where data is random.
    pub share: f64,
    /// What must hold besides the truths and the [`invariants`].
    pub check: fn(&Outcome<'_>) -> Result<(), String>,
    /// Estimators of which only the invariants are asked, and why, besides those in `exemptions`.
    pub exempt: &'static [(Method, &'static str)],
}

impl HardCase {
    /// A case without truths, further checks or exemptions.
    const fn new(name: &'static str, what: &'static str, expect: &'static str, mesh: fn() -> Mesh) -> Self {
        Self {
            name,
            what,
            expect,
            mesh,
            truth: |mesh| vec![Truth::Free; mesh.positions().len()],
            share: 1.0,
            check: |_| Ok(()),
            exempt: &[],
        }
    }

    /// Estimators of which only the invariants are asked, and why.
    fn exempted(&self) -> impl Iterator<Item = (Method, &'static str)> {
        self.exempt.iter().copied().chain(exemptions::exemptions(self.name))
    }

    /// Runs one estimator on the case.
    ///
    /// # Errors
    ///
    /// The first thing that does not hold, with the vertex and the numbers.
    pub fn run(&self, method: Method) -> Result<(), String> {
        let mesh = (self.mesh)();
        let outcome = Outcome::new(&mesh, method);
        invariants(&outcome)?;
        if self.exempted().any(|(exempt, _)| exempt == method) {
            return Ok(());
        }
        truth::meets(&outcome, &(self.truth)(&mesh), self.share)?;
        (self.check)(&outcome)
    }
}

/// A hard case of something else than estimation on one mesh: rays, and ways through files.
#[derive(Debug, Clone, Copy)]
pub struct OtherCase {
    /// Unique, in snake case: the name of the test.
    pub name: &'static str,
    /// What is hard about it.
    pub what: &'static str,
    /// What must come of it.
    pub expect: &'static str,
    /// Whether it does.
    pub check: fn() -> Result<(), String>,
}

/// All cases of estimation, by theme.
#[must_use]
pub fn hard_cases() -> Vec<HardCase> {
    [smooth::cases(), sharp::cases(), topology::cases(), broken::cases(), noise::cases(), laws::cases()]
        .concat()
}

/// All cases of rays and files.
#[must_use]
pub fn other_cases() -> Vec<OtherCase> {
    [rays::cases(), files::cases()].concat()
}

/// Why the estimator that follows libigl is not asked to know its error.
const NO_ERROR_ESTIMATE: &[(Method, &str)] = &[(Method::Libigl, "no error estimate to admit it with")];

/// Fails with a message unless a condition holds.
fn ensure(holds: bool, message: impl FnOnce() -> String) -> Result<(), String> {
    if holds { Ok(()) } else { Err(message()) }
}

//! `osculate study curvature`: error against time for every estimator, knob and noise level.
//!
//! | file | what it holds |
//! |---|---|
//! | `settings` | the one table of estimators and knobs that are measured |
//! | `subjects` | the meshes, with their exact curvature |
//! | `measure` | error, time, memory and honesty of one setting on one mesh |
//! | `rows` | what was measured, as CSV |
//! | `peers` | other programs: meshes out, rows in |
//! | `summary` | rows put together over shapes: means, fronts, recommendations |
//! | `exponents` | power laws of time, memory and error |
//! | `figures`, `growth` | the plots |
//! | `tables` | the tables |
//! | `report` | the page |

mod exponents;
mod figures;
mod growth;
mod measure;
pub mod peers;
mod report;
mod rows;
mod settings;
mod subjects;
mod summary;
mod tables;

pub use exponents::{Exponents, csv as exponents_csv, exponents};
pub use measure::{Effort, measure};
pub use report::{Context as ReportContext, PeersOrigin, page};
pub use rows::{Row, csv};
pub use settings::{Setting, settings};
pub use subjects::{Part, Plan, Subject};

/// Files of plots: name and SVG.
pub fn plots(rows: &[Row]) -> Vec<(String, String)> {
    figures::all(rows).into_iter().map(|figure| (format!("{}.svg", figure.name), figure.plot.svg())).collect()
}

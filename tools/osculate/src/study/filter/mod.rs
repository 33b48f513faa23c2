//! `study filter`: error and time of every curvature filter.
//!
//! | file | what it holds |
//! |---|---|
//! | `measure` | the meshes, what is measured on each, and how |
//! | `report` | the CSV file, the plots and the page |

pub mod measure;
pub mod report;

//! `study render`: what error, time and memory each way to show a material has, and what its knobs do.

pub mod measure;
pub mod report;
pub mod settings;

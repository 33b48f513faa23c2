//! `study material`: what width, textures, taps, bits and training time buy.
//!
//! | file | what it holds |
//! |---|---|
//! | `settings` | which models are trained |
//! | `measure` | training and judging one of them |
//! | `report` | CSV, plots and the page |

pub mod measure;
pub mod report;
pub mod settings;

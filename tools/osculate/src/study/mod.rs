//! Studies of error against time: what `osculate study` measures, and how it shows it.
//!
//! | file | what it holds |
//! |---|---|
//! | `curvature` | `study curvature` |
//! | `filter` | `study filter` |
//! | `material` | `study material` |
//! | `render` | `study render` |
//! | `plot` | a plot with linear or logarithmic axes as SVG |
//! | `axis` | its axes and their ticks |
//! | `page` | text, tables and plots as one self-contained HTML page |
//! | `run` | files, command line and processor of a run |

pub mod axis;
pub mod curvature;
pub mod filter;
pub mod material;
pub mod page;
pub mod plot;
pub mod render;
pub mod run;

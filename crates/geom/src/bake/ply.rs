//! PLY with curvature as plain vertex properties.
//!
//! MeshLab (vcglib, as of 2025) writes no principal curvature of its own, but reads any scalar vertex property as a custom
//! attribute, and `s`, `t` as texture coordinates; so curvature is in scalars under MeshLab's names `k1` and `k2`.

mod read;
mod write;

pub use read::read_baked_ply;
pub use write::{Precision, write_ply};

/// Names of the vertex properties after the UVs, in file order; the status comes last and is a `uchar`.
const CURVATURE: [&str; 9] = ["k1", "k2", "d1x", "d1y", "d1z", "d2x", "d2y", "d2z", "curvature_error"];
const STATUS: &str = "curvature_status";
/// First word of the comment lines that hold the provenance.
const COMMENT: &str = "osculate";

/// Name of the filter's bound; it stands after the filter's values, before the status.
const FILTER_BOUND: &str = "filter_bound";

/// Property name of the filter's value for an azimuth.
fn filter_name(azimuth: usize) -> String {
    format!("filter_{azimuth}")
}

/// Property names of a UV set: `s`, `t`, then `s1`, `t1` and so on.
fn uv_names(set: usize) -> [String; 2] {
    if set == 0 { ["s".to_owned(), "t".to_owned()] } else { [format!("s{set}"), format!("t{set}")] }
}

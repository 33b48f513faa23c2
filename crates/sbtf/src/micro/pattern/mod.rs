//! Building blocks of procedural materials: everything here repeats with period 1 in u and v, and depends on nothing but its
//! arguments.
//!
//! Points are UV coordinates, any finite value. Sizes are given as `counts`: how many lattice cells there are along u and v,
//! at least one each, which is what makes a pattern repeat.

mod cells;
mod hash;
mod noise;
mod shape;

pub use cells::{Cell, Point, cells, scatter};
pub use hash::{hash, pick, unit};
pub use noise::{fbm, lattice, noise, ridges, warp};
pub use shape::{ball, bump, dome, fall, mix, ramp, rise, smooth_max, smooth_min, srgb, wave};

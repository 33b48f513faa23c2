//! Displaced meshes: a periodic height tile laid over a mesh through its UV, as real triangles.
//!
//! The base mesh is the top: the tile's heights are at most 0 there and measured along the outward normal. Every base triangle
//! is cut, in UV space, exactly by the copies of the tile's triangles that lie over it ([`HeightTile`] is a triangulation, so
//! that there are triangles only where the heights bend). No height is sampled anew: the surface has the tile's own
//! error, and that of a normal interpolated over a base triangle, [`Displaced::bow`].
//!
//! Which cuts there are is decided on a lattice of 2^-24 tiles in integers, with the tile moved by an infinitesimal step where
//! something coincides (Edelsbrunner and Mücke, "Simulation of Simplicity", ACM Transactions on Graphics, 1990), and points
//! on an edge are computed from the edge alone. So the result is watertight wherever the base is and its UV go on, or jump by whole tiles.
//!
//! Points come from interpolated positions and normals: where a layer is deeper than the base's radius of curvature
//! on its hollow side, the result intersects itself.

mod build;
mod candidates;
mod clip;
mod lattice;
mod strip;
mod tile;

#[cfg(test)]
mod tests;

pub use build::{DisplaceError, DisplaceOptions, Displaced, displace};
pub use tile::{HeightTile, TileError};

//! Principal curvature on triangle meshes: estimation, interpolation, filtering and baking.
//!
//! # Conventions
//!
//! - Geometry is `f64`; lengths are world units, angles radians, curvature 1/length.
//! - Normals point out of the material. The shape operator is `S = dN`, so the unit sphere with outward normals has
//!   `kappa_min = kappa_max = +1`. `kappa_min <= kappa_max` as signed values.
//! - The curvature tensor `kappa_max d1 d1^T + kappa_min d2 d2^T` is a symmetric 3x3 matrix in world space. Tensors are
//!   interpolated, directions never: they have a sign ambiguity and no limit at umbilics.
//!
//! # Module map
//!
//! | module | what it holds |
//! |---|---|
//! | [`io`] | reading OBJ, PLY, STL, glTF and GLB |
//! | [`mesh`] | [`Mesh`], welding, adjacency, topology, normals, UV scale |
//! | [`curvature`] | the estimators behind one options struct |

pub mod curvature;
pub mod io;
pub mod mesh;

pub use mesh::{Material, Mesh, MeshError, Part};

/// A point or vector of three `f64` world-space components.
pub type Vec3 = nalgebra::Vector3<f64>;

/// A 3x3 `f64` matrix, such as a curvature tensor.
pub type Mat3 = nalgebra::Matrix3<f64>;

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
//! | [`field`] | curvature between the vertices, along rays, and its minimum past a point |
//! | [`bake`] | meshes with curvature as `.glb` and `.ply` |
//! | [`inspect`] | what a mesh and its curvature are, in numbers |
//! | [`mod@reference`] | recorded libigl output and closed forms, and the comparison with them |
//! | [`shapes`] | parametric surfaces for tests, studies and scenes; irregular ones of known curvature |
//! | [`displacement`] | height fields laid over a mesh as real triangles |
//! | [`rays`] | watertight ray tracing against triangles, in `f32` |

mod atomic;
pub mod bake;
pub mod curvature;
pub mod displacement;
pub mod field;
pub mod inspect;
pub mod io;
pub mod mesh;
pub mod rays;
pub mod reference;
pub mod shapes;

pub use atomic::write_atomically;
pub use mesh::{Material, Mesh, MeshError, Part};

/// A point or vector of three `f64` world-space components.
pub type Vec3 = nalgebra::Vector3<f64>;

/// A 3x3 `f64` matrix, such as a curvature tensor.
pub type Mat3 = nalgebra::Matrix3<f64>;

/// The README's example, compiled with the documentation's tests.
#[cfg(doctest)]
#[doc = include_str!("../../../README.md")]
struct Readme;

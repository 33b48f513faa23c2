//! Neural Silhouette BTF: microstructures, transport inside bent patches, training and inference.
//!
//! A *silhouette BTF* answers one [`Query`]: what does a material that lies under a curved bounding surface show to a ray
//! that enters that surface here? The [`Answer`] is a reflectance and an opacity; where the opacity is 0 the ray went
//! through above the material and goes on (Kuznetsov et al., "Rendering Neural Materials on Curved Surfaces",
//! SIGGRAPH 2022, section 4.1).
//!
//! # Conventions
//!
//! - The unit of length is one UV unit; one tile of a microstructure covers the unit square. Depths and curvatures are in
//!   that unit: `kappa_hat = kappa * uv_scale`.
//! - Directions are unit vectors in the frame of the entry point: +x along dP/du, +y along dP/dv, +z the outward normal of
//!   the bounding surface. `wo` points to the viewer, `wi` to the light; `cos_o = wo.z`.
//! - Heights `z` lie in `[-depth, 0]`, measured along the normal of the bounding surface, which is at `z = 0`.
//! - Convex bounding surfaces have positive curvature.
//! - Colours are linear RGB.
//!
//! # Map
//!
//! | module | concept |
//! |---|---|
//! | [`micro`] | microstructures: height fields and tile meshes with their reflectance |
//! | [`query`] | one query, its answer, and what can answer it |
//! | [`samples`] | batches of training samples, and where they come from |
//! | [`silhouette`] | where grazing rays begin to hit, and its closed forms |
//! | [`brdf`] | the reflection model of microstructures and of the renderer |
//! | [`colour`] | the sRGB transfer function, and codes of pictures |
//! | [`random`] | numbers that depend on seed and place only |
//! | [`patch`] | microstructures on cylinders, transport in them, and the samples that training wants |
//! | [`oracle`] | exact answers to queries, by tracing |
//! | [`photographs`] | pictures under known lights, as a measurement takes them |
//! | [`march`] | height fields without a network: a fixed number of steps |
//! | [`model`] | architectures and parameters of the networks; what a model answers |
//! | [`train`] | from samples to a model |
//! | [`infer`] | models compiled for speed: single queries, batches, several lights at one hit |
//! | [`file`](mod@file) | `.sbtf` files |
//! | [`sampling`] | where light comes from that matters: directions and their densities, fitted to a material |
//! | [`chi_square`](mod@chi_square) | whether samples have the density that they should |
//! | [`evaluate`] | how good a model is: silhouettes and appearance against exact answers |

pub mod brdf;
pub mod chi_square;
pub mod colour;
pub mod evaluate;
pub mod file;
pub mod infer;
pub mod march;
pub mod micro;
pub mod model;
pub mod oracle;
pub mod patch;
pub mod photographs;
pub mod query;
pub mod random;
pub mod samples;
pub mod sampling;
pub mod silhouette;
pub mod train;

pub use query::{Answer, Entry, Incidence, Query, SeeThrough, SilhouetteBtf};

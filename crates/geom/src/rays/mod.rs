//! Rays against triangles: watertight intersection and a bounding volume hierarchy, in `f32`.
//!
//! Guarantees:
//! - **Watertight**: a ray that passes through a shared edge or vertex of a closed mesh hits at least one of the triangles
//!   that meet there (Woop, Benthin, Wald, "Watertight Ray/Triangle Intersection", JCGT 2013), and no bounding box on the
//!   way is missed.
//! - **No lower bound on t**: hits at any `t > 0` are found. To leave a surface, start at [`SurfacePoint::origin_towards`],
//!   which clears the rounding error of the hit point, instead of skipping a distance that suits one scale only.
//! - **Deterministic**: of several hits at the same `t` the lowest triangle index wins, and the SIMD kernels give the same
//!   bits as the portable ones.
//!
//! Not guaranteed: hits on triangles of zero area, or of an area that is zero after rounding as seen from the ray.

mod build;
mod bundle;
mod bvh;
mod instances;
mod kernels;
mod ray;
mod surface_point;
mod traverse;
mod triangle;

pub use bvh::{Bvh, to_f32};
pub use instances::{Instances, Similarity};
pub use ray::{Hit, Ray};
pub use surface_point::SurfacePoint;

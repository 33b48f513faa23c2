//! Triangle meshes as files hold them, and the surface under their seams.

mod adjacency;
mod closed_fan;
mod fans;
mod lookahead;
mod normals;
mod renumbered;
mod rings;
mod survey;
mod topology;
mod triangle_mesh;
mod uv;
mod weld;

pub use adjacency::Adjacency;
pub(crate) use fans::Fan;
pub(crate) use lookahead::Lookahead;
pub use normals::{angle_weighted_normals, area_weighted_normals, smooth_normals, triangle_normal};
pub(crate) use renumbered::{Renumbered, inverse};
pub(crate) use rings::{Rings, SLOT};
pub(crate) use survey::{Oriented, Survey, SurveyMemory};
pub use topology::{Orientation, Topology};
pub use triangle_mesh::{Material, Mesh, MeshError, Part, TextureImage};
pub use uv::{UvJacobian, uv_jacobian, uv_scale};
pub(crate) use weld::index_u32;
pub use weld::{Surface, Weld};

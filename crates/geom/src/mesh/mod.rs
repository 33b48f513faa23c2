//! Triangle meshes as files hold them, and the surface under their seams.

mod adjacency;
mod normals;
mod topology;
mod triangle_mesh;
mod uv;
mod weld;

pub use adjacency::Adjacency;
pub use normals::{angle_weighted_normals, area_weighted_normals, triangle_normal};
pub(crate) use topology::{Link, vertex_link};
pub use topology::{Orientation, Topology};
pub use triangle_mesh::{Material, Mesh, MeshError, Part, TextureImage};
pub use uv::{UvJacobian, uv_jacobian, uv_scale};
pub(crate) use weld::index_u32;
pub use weld::{Surface, Weld};

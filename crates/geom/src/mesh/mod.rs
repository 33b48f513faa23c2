//! Triangle meshes as files hold them, and the surface under their seams.

mod triangle_mesh;
mod weld;

pub use triangle_mesh::{Material, Mesh, MeshError, Part, TextureImage};
pub use weld::{Surface, Weld};

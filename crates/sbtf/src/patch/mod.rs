//! Microstructures on cylinders of signed curvature, and light in them (paper, section 4.4).

mod bend;
mod bent_mesh;
mod dataset;
mod dataset_options;
mod distribution;
mod export;
mod field_tracer;
mod first_features;
mod grazing;
mod height_tile;
mod march;
mod mesh_tracer;
mod pool;
mod shell;
mod subdivide;
mod surface;
mod sweep;
#[cfg(test)]
pub(crate) mod test_fields;
mod tile;
mod transport;
mod triangulate;

pub use bend::{Bend, LEAST_CORE};
pub use dataset::PatchDataset;
pub use dataset_options::{DatasetError, DatasetOptions, Silhouettes, Tracing};
pub use export::{ExportError, export_dataset};
pub(crate) use field_tracer::FieldTracer;
pub use grazing::{GrazingOptions, OpacityStudy};
pub use height_tile::height_tile;
pub(crate) use mesh_tracer::MeshTracer;
pub use surface::Patch;
pub use sweep::Sweep;
pub use tile::{FieldShading, Shading, TileOptions, TilePoint, TileSurface};
pub(crate) use transport::Space;
pub use transport::{PatchSample, Transport, TransportOptions};

//! Microstructures on cylinders of signed curvature, and light in them (paper, section 4.4).

mod bend;
mod dataset;
mod dataset_options;
mod distribution;
mod export;
mod field_tracer;
mod first_features;
mod grazing;
mod march;
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
pub(crate) use pool::PatchPool;
pub use surface::Patch;
pub use sweep::Sweep;
pub use tile::{Shading, TileOptions, TileSurface};
pub use transport::{PatchSample, Transport, TransportOptions};

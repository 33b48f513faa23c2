//! A CPU path tracer for curvature-baked meshes.

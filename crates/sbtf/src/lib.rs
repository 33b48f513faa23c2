//! Neural Silhouette BTF.

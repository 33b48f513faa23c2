//! What a mesh and its curvature are, in numbers.

use serde::Serialize;

use crate::Mesh;
use crate::curvature::{Status, VertexCurvature};
use crate::mesh::{Orientation, Surface, Topology, Weld, uv_scale};

/// Counts, ranges and defects of a mesh. Topology is that of the surface with equal positions merged.
#[derive(Debug, Clone, PartialEq, Serialize)]
pub struct MeshReport {
    /// Vertices as stored, copies along seams included.
    pub vertices: usize,
    /// Distinct positions.
    pub positions: usize,
    /// Triangles.
    pub triangles: usize,
    /// Lower and upper corner of the bounding box; `None` without vertices.
    pub bounds: Option<[[f64; 3]; 2]>,
    /// Length of the box's diagonal.
    pub bbox_diagonal: f64,
    /// Whether the file has normals.
    pub has_normals: bool,
    /// UV sets.
    pub uv_sets: Vec<UvReport>,
    /// Parts, in order.
    pub parts: Vec<PartReport>,
    /// Names of the materials.
    pub materials: Vec<String>,
    /// Connected components; unused vertices belong to none.
    pub components: usize,
    /// Vertices that no triangle uses.
    pub unused_vertices: usize,
    /// Edges with one triangle.
    pub boundary_edges: usize,
    /// Edges with three or more triangles.
    pub non_manifold_edges: usize,
    /// Edges whose two triangles face different ways.
    pub inconsistent_edges: usize,
    /// Triangles that name a position twice.
    pub degenerate_triangles: usize,
    /// Whether the mesh has no boundary, no non-manifold edge and one orientation.
    pub closed: bool,
}

/// One UV set.
#[derive(Debug, Clone, PartialEq, Serialize)]
pub struct UvReport {
    /// Smallest u and v.
    pub min: [f64; 2],
    /// Largest u and v.
    pub max: [f64; 2],
    /// World length of a UV unit, see [`uv_scale`]; `None` without area.
    pub uv_scale: Option<f64>,
}

/// One part.
#[derive(Debug, Clone, PartialEq, Serialize)]
pub struct PartReport {
    /// Name, or empty.
    pub name: String,
    /// Triangles in it.
    pub triangles: usize,
    /// Index of its material.
    pub material: Option<usize>,
}

impl MeshReport {
    /// Looks at a mesh.
    #[must_use]
    pub fn new(mesh: &Mesh) -> Self {
        let surface = Surface::new(mesh, Weld::Exact);
        let topology = Topology::new(surface.triangles());
        let mut used = vec![false; mesh.positions().len()];
        mesh.triangles().iter().flatten().for_each(|&v| used[v as usize] = true);
        let consistent = topology.orientation() == Orientation::Consistent;
        let parts = mesh.parts().iter();
        Self {
            vertices: mesh.positions().len(),
            positions: surface.positions().len(),
            triangles: mesh.triangles().len(),
            bounds: mesh.bounds().map(|(lo, hi)| [lo.into(), hi.into()]),
            bbox_diagonal: mesh.bbox_diagonal(),
            has_normals: mesh.normals().is_some(),
            uv_sets: (0..mesh.uv_sets().len()).map(|set| uv_report(mesh, set)).collect(),
            parts: parts
                .map(|part| PartReport {
                    name: part.name.clone(),
                    triangles: part.triangles.len(),
                    material: part.material,
                })
                .collect(),
            materials: mesh.materials().iter().map(|m| m.name.clone()).collect(),
            components: Topology::components(surface.triangles(), surface.positions().len()),
            unused_vertices: used.iter().filter(|&&used| !used).count(),
            boundary_edges: topology.boundary_edges,
            non_manifold_edges: topology.non_manifold_edges,
            inconsistent_edges: topology.inconsistent_edges,
            degenerate_triangles: topology.degenerate_triangles,
            closed: consistent
                && topology.boundary_edges == 0
                && topology.non_manifold_edges == 0
                && topology.edges > 0,
        }
    }
}

fn uv_report(mesh: &Mesh, set: usize) -> UvReport {
    let mut min = [f64::INFINITY; 2];
    let mut max = [f64::NEG_INFINITY; 2];
    for uv in &mesh.uv_sets()[set] {
        for k in 0..2 {
            min[k] = min[k].min(uv[k]);
            max[k] = max[k].max(uv[k]);
        }
    }
    UvReport { min, max, uv_scale: uv_scale(mesh, set) }
}

/// Ranges of the curvature at the vertices.
#[derive(Debug, Clone, PartialEq, Serialize)]
pub struct CurvatureReport {
    /// Vertices with an estimate.
    pub determined: usize,
    /// Vertices without.
    pub undetermined: usize,
    /// Determined vertices whose directions carry no information, see [`VertexCurvature::is_umbilic`].
    pub umbilic: usize,
    /// Of `kappa_max` over the determined vertices; `None` when there are none.
    pub kappa_max: Option<Range>,
    /// Of `kappa_min`.
    pub kappa_min: Option<Range>,
    /// Of the finite error estimates.
    pub error: Option<Range>,
    /// Vertices of each status that occurs, in the order of [`Status::ALL`].
    pub statuses: Vec<StatusCount>,
}

/// How many vertices have a status.
#[derive(Debug, Clone, Copy, PartialEq, Eq, Serialize)]
pub struct StatusCount {
    /// The status.
    pub status: Status,
    /// Vertices.
    pub vertices: usize,
}

/// Where values lie.
#[derive(Debug, Clone, Copy, PartialEq, Serialize)]
pub struct Range {
    /// Smallest.
    pub min: f64,
    /// Half of the values are at most this (nearest rank).
    pub median: f64,
    /// Largest.
    pub max: f64,
}

impl Range {
    /// The range of some finite values, or `None` without any.
    #[must_use]
    pub fn new(mut values: Vec<f64>) -> Option<Self> {
        values.sort_unstable_by(f64::total_cmp);
        let (&min, &max) = (values.first()?, values.last()?);
        Some(Self { min, median: values[(values.len() - 1) / 2], max })
    }
}

impl CurvatureReport {
    /// Looks at the curvature of all vertices.
    #[must_use]
    pub fn new(curvature: &[VertexCurvature]) -> Self {
        let principals: Vec<_> = curvature.iter().filter_map(|c| c.principal).collect();
        let errors = curvature.iter().map(|c| c.error).filter(|e| e.is_finite());
        let count = |status: Status| curvature.iter().filter(|c| c.status == status).count();
        Self {
            determined: principals.len(),
            undetermined: curvature.len() - principals.len(),
            umbilic: curvature.iter().filter(|c| c.is_umbilic()).count(),
            kappa_max: Range::new(principals.iter().map(|p| p.kappa_max).collect()),
            kappa_min: Range::new(principals.iter().map(|p| p.kappa_min).collect()),
            error: Range::new(errors.collect()),
            statuses: Status::ALL
                .into_iter()
                .map(|status| StatusCount { status, vertices: count(status) })
                .filter(|entry| entry.vertices > 0)
                .collect(),
        }
    }
}

#[cfg(test)]
mod tests {
    use super::*;
    use crate::curvature::{CurvatureOptions, estimate};
    use crate::shapes;

    #[test]
    fn a_torus_with_a_seam_is_closed_and_an_open_cylinder_is_not() {
        let report = MeshReport::new(&shapes::torus_with_uv(1.0, 0.4, 24, 12));
        assert_eq!((report.vertices, report.positions, report.triangles), (25 * 13, 24 * 12, 2 * 24 * 12));
        assert!(report.closed && report.components == 1 && report.unused_vertices == 0);
        assert_eq!((report.uv_sets[0].min, report.uv_sets[0].max), ([0.0; 2], [1.0; 2]));
        let report = MeshReport::new(&shapes::cylinder(1.0, 1.0, 10, 4));
        assert!(!report.closed && report.boundary_edges == 20);
    }

    #[test]
    fn all_of_a_plane_is_umbilic_and_nothing_of_a_cylinder() {
        let umbilic = |mesh: &Mesh| {
            let surface = Surface::new(mesh, Weld::Exact);
            CurvatureReport::new(&estimate(&surface, &CurvatureOptions::default()).unwrap()).umbilic
        };
        assert_eq!(umbilic(&shapes::plane(6, 6)), 49);
        assert_eq!(umbilic(&shapes::cylinder(1.0, 1.0, 48, 12)), 0);
    }

    #[test]
    fn curvature_is_counted_by_status() {
        let mesh = shapes::cylinder(0.5, 1.0, 32, 8);
        let curvature = estimate(&Surface::new(&mesh, Weld::Exact), &CurvatureOptions::default()).unwrap();
        let report = CurvatureReport::new(&curvature);
        assert_eq!(report.determined + report.undetermined, curvature.len());
        assert_eq!(report.statuses.iter().map(|s| s.vertices).sum::<usize>(), curvature.len());
        let range = report.kappa_max.unwrap();
        assert!(range.min <= range.median && range.median <= range.max && range.max < 3.0);
    }
}

//! Any simple polygon, by a constrained Delaunay triangulation of its projection.

use std::collections::HashSet;

use spade::handles::{FixedVertexHandle, VertexHandle};
use spade::{ConstrainedDelaunayTriangulation, Point2, Triangulation};

use super::CutKind;
use crate::Vec3;

type Cdt = ConstrainedDelaunayTriangulation<Point2<f64>>;

/// The triangles inside the outline `plane`, as indices of its corners; which kind of fan to fall back on where it
/// encloses none or meets itself.
pub(super) fn cut(corners: &[Vec3], plane: &[Point2<f64>]) -> Result<Vec<[usize; 3]>, CutKind> {
    let mut cdt = Cdt::new();
    let mut corner_from_vertex: Vec<usize> = Vec::with_capacity(plane.len());
    let mut outline = Vec::with_capacity(plane.len());
    for (corner, point) in plane.iter().enumerate() {
        let vertex = cdt.insert(*point).map_err(|_| CutKind::DegenerateFan)?;
        match corner_from_vertex.get(vertex.index()) {
            None => corner_from_vertex.push(corner),
            Some(&first) if corners[first] == corners[corner] => {}
            Some(_) => return Err(CutKind::DegenerateFan),
        }
        outline.push(vertex);
    }
    outline.dedup();
    if outline.len() > 1 && outline.first() == outline.last() {
        outline.pop();
    }
    let edges: Vec<_> = outline.iter().copied().zip(outline.iter().copied().cycle().skip(1)).collect();
    for &(from, to) in &edges {
        if !cdt.can_add_constraint(from, to) {
            return Err(CutKind::CrossingFan);
        }
        cdt.add_constraint(from, to);
    }
    let triangles = inner_triangles(&cdt, &edges)?;
    let used: HashSet<usize> = triangles.iter().flatten().map(FixedVertexHandle::index).collect();
    if used.len() != corner_from_vertex.len() {
        return Err(CutKind::CrossingFan);
    }
    Ok(triangles.into_iter().map(|t| t.map(|v| corner_from_vertex[v.index()])).collect())
}

/// The faces that the outline winds around once. Those it does not wind around are outside; any other number means that
/// it overlaps itself.
fn inner_triangles(
    cdt: &Cdt,
    outline: &[(FixedVertexHandle, FixedVertexHandle)],
) -> Result<Vec<[FixedVertexHandle; 3]>, CutKind> {
    // For each undirected edge, how often the outline runs along it, counted in the direction spade stores it in. A
    // double edge to a hole counts 1 - 1 = 0 and so separates nothing.
    let mut passes = vec![0_i64; cdt.num_undirected_edges()];
    for &(from, to) in outline {
        // An edge that runs through another corner has been split: the outline touches itself.
        let edge = cdt.get_edge_from_neighbors(from, to).ok_or(CutKind::CrossingFan)?;
        let stored = edge.as_undirected().as_directed().fix() == edge.fix();
        passes[edge.as_undirected().fix().index()] += if stored { 1 } else { -1 };
    }
    let mut winding: Vec<Option<i64>> = vec![None; cdt.num_all_faces()];
    let outer = cdt.outer_face().fix();
    winding[outer.index()] = Some(0);
    let mut stack: Vec<_> = cdt.convex_hull().map(|e| e.fix()).collect();
    while let Some(edge) = stack.pop() {
        let edge = cdt.directed_edge(edge);
        let next = edge.rev().face();
        if winding[next.fix().index()].is_some() {
            continue;
        }
        let here = winding[edge.face().fix().index()].unwrap_or(0);
        let stored = edge.as_undirected().as_directed().fix() == edge.fix();
        let passed = passes[edge.as_undirected().fix().index()];
        // The face left of an edge is wound around once more than the one on its right.
        winding[next.fix().index()] = Some(here - if stored { passed } else { -passed });
        if let Some(inner) = next.as_inner() {
            stack.extend(inner.adjacent_edges().map(|e| e.fix()));
        }
    }
    let mut triangles = Vec::with_capacity(outline.len());
    for face in cdt.inner_faces() {
        match winding[face.fix().index()] {
            Some(1) => triangles.push(face.vertices().map(|v: VertexHandle<_, _, _, _>| v.fix())),
            Some(0) | None => {}
            Some(_) => return Err(CutKind::CrossingFan),
        }
    }
    Ok(triangles)
}

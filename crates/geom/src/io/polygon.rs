//! Polygons cut into triangles in their best-fit plane.

mod cdt;

use spade::Point2;

use super::corners::CornerVertices;
use super::warnings::Warnings;
use crate::Vec3;

/// The triangles of one polygon, as indices of its corners.
#[derive(Debug, Clone, PartialEq)]
pub(crate) struct Cut {
    /// In the polygon's orientation.
    pub triangles: Vec<[usize; 3]>,
    /// How they were found.
    pub kind: CutKind,
}

/// Whether a cut covers exactly the polygon.
#[derive(Debug, Clone, Copy, PartialEq, Eq)]
pub(crate) enum CutKind {
    /// Covers the polygon once, uses every distinct corner, so neighbours along its edges stay connected.
    Exact,
    /// A fan from corner 0, because the polygon has no area (or corners that coincide in its plane).
    DegenerateFan,
    /// A fan from corner 0, because the polygon crosses, touches or overlaps itself.
    CrossingFan,
}

/// Cuts a polygon of at least three corners into triangles.
///
/// Polygons may be concave, have collinear or repeated corners, and reach a hole over a double edge. Corners at one
/// position are represented by the first of them.
///
/// A convex quad is cut along its shorter diagonal, or along corners 0-2 when the two are equal within rounding: on
/// grids the choice is then the same everywhere. Everything else is a constrained Delaunay triangulation of the
/// polygon projected along its Newell normal (area-weighted, so defined for polygons that are not quite planar).
///
/// # Panics
///
/// With fewer than three corners: readers report those.
pub(crate) fn cut_polygon(corners: &[Vec3]) -> Cut {
    assert!(corners.len() >= 3, "a polygon has at least three corners, not {}", corners.len());
    if corners.len() == 3 {
        return Cut { triangles: vec![[0, 1, 2]], kind: CutKind::Exact };
    }
    let normalised = normalise(corners);
    let Some(plane) = project(&normalised) else {
        return fan(corners.len(), CutKind::DegenerateFan);
    };
    if let Some(triangles) = cut_convex_quad(&normalised, &plane) {
        return Cut { triangles, kind: CutKind::Exact };
    }
    match cdt::cut(&normalised, &plane) {
        Ok(triangles) => Cut { triangles, kind: CutKind::Exact },
        Err(kind) => fan(corners.len(), kind),
    }
}

/// Appends the triangles of a polygon over mesh vertices, with a warning if it is no simple polygon. `face` is its number
/// as the file counts.
pub(crate) fn push_polygon(
    polygon: &[u32],
    vertices: &CornerVertices,
    face: usize,
    triangles: &mut Vec<[u32; 3]>,
    warnings: &mut Warnings,
) {
    if let &[a, b, c] = polygon {
        triangles.push([a, b, c]);
        return;
    }
    let corners: Vec<Vec3> = polygon.iter().map(|&v| vertices.position(v)).collect();
    let cut = cut_polygon(&corners);
    triangles.extend(cut.triangles.iter().map(|t| t.map(|i| polygon[i])));
    let how = match cut.kind {
        CutKind::Exact => return,
        CutKind::DegenerateFan => "has no area",
        CutKind::CrossingFan => "crosses or touches itself",
    };
    warnings.add(how, || format!("face {face} with {} corners {how}; it is cut as a fan", polygon.len()));
}

/// Other readers pass over faces of one or two corners too, and exporters do write them.
pub(crate) fn warn_of_few_corners(face: usize, corners: usize, warnings: &mut Warnings) {
    warnings.add("few corners", || format!("face {face} has {corners} corners and is left out"));
}

fn fan(corners: usize, kind: CutKind) -> Cut {
    Cut { triangles: (1..corners - 1).map(|i| [0, i, i + 1]).collect(), kind }
}

/// The corners moved and scaled into [-1, 1]: spade's exact predicates refuse coordinates beyond 2^201 or below 2^-142.
fn normalise(corners: &[Vec3]) -> Vec<Vec3> {
    let (lo, hi) = corners.iter().fold((corners[0], corners[0]), |(lo, hi), p| (lo.inf(p), hi.sup(p)));
    // Halved first, so that the widest finite box does not overflow.
    let centre = 0.5 * lo + 0.5 * hi;
    let half_extent = (0.5 * hi - 0.5 * lo).amax();
    if half_extent == 0.0 {
        return vec![Vec3::zeros(); corners.len()];
    }
    // Divided, not multiplied by the reciprocal: that overflows for subnormal extents.
    corners.iter().map(|p| (p - centre) / half_extent).collect()
}

/// The normalised corners in an orthonormal basis of the plane across their Newell normal, counter-clockwise; `None`
/// if that normal is lost in rounding.
fn project(corners: &[Vec3]) -> Option<Vec<Point2<f64>>> {
    let origin = corners[0];
    let mut twice_area = Vec3::zeros();
    for (a, b) in corners.iter().zip(corners.iter().cycle().skip(1)) {
        twice_area += (a - origin).cross(&(b - origin));
    }
    // Coordinates are at most 1, so each term is off by at most a few epsilon.
    let rounding = 4.0 * f64::EPSILON * corners.len() as f64;
    let length = twice_area.norm();
    if length <= rounding {
        return None;
    }
    let normal = twice_area / length;
    // The axis most across the normal; for an axis-aligned polygon the basis is then the axes and nothing is rounded.
    let mut axis = Vec3::zeros();
    axis[normal.iamin()] = 1.0;
    let u = (axis - normal * normal.dot(&axis)).normalize();
    let v = normal.cross(&u);
    // A coordinate below spade's smallest is below the rounding of its neighbours, which reach 1.
    let flush = |x: f64| if x.abs() < 1e-40 { 0.0 } else { x };
    Some(corners.iter().map(|p| Point2::new(flush(p.dot(&u)), flush(p.dot(&v)))).collect())
}

fn cut_convex_quad(corners: &[Vec3], plane: &[Point2<f64>]) -> Option<Vec<[usize; 3]>> {
    let (&[a, b, c, d], [p0, p1, p2, p3]) = (corners, plane) else { return None };
    // Turns below this (in units of the squared extent) are left to the exact predicates of the general path.
    const CLEARLY_CONVEX: f64 = 1e-9;
    let turn = |p: &Point2<f64>, q: &Point2<f64>, r: &Point2<f64>| {
        (q.x - p.x) * (r.y - q.y) - (q.y - p.y) * (r.x - q.x)
    };
    let turns = [turn(p3, p0, p1), turn(p0, p1, p2), turn(p1, p2, p3), turn(p2, p3, p0)];
    if turns.iter().any(|&t| t <= CLEARLY_CONVEX) {
        return None;
    }
    // Far above rounding (1e-16), far below a difference that anyone can see.
    const EQUAL_DIAGONALS: f64 = 1e-9;
    let second_is_shorter = (b - d).norm() < (a - c).norm() * (1.0 - EQUAL_DIAGONALS);
    Some(if second_is_shorter { vec![[0, 1, 3], [1, 2, 3]] } else { vec![[0, 1, 2], [0, 2, 3]] })
}

#[cfg(test)]
mod tests {
    use std::collections::HashSet;

    use proptest::prelude::*;

    use super::*;

    fn vector_area(polygon: &[Vec3]) -> Vec3 {
        let o = polygon[0];
        (1..polygon.len() - 1).map(|i| 0.5 * (polygon[i] - o).cross(&(polygon[i + 1] - o))).sum()
    }

    fn areas(polygon: &[Vec3], cut: &Cut) -> Vec<Vec3> {
        cut.triangles.iter().map(|t| vector_area(&t.map(|i| polygon[i]))).collect()
    }

    /// Same area, all triangles oriented like the polygon, every distinct corner used.
    fn assert_exact(polygon: &[Vec3]) {
        let cut = cut_polygon(polygon);
        assert_eq!(cut.kind, CutKind::Exact, "{polygon:?}");
        let whole = vector_area(polygon);
        let parts = areas(polygon, &cut);
        let normal = whole.normalize();
        let sum: f64 = parts.iter().map(Vec3::norm).sum();
        // Each triangle's area is rounded relative to the squared size of the polygon as its coordinates hold it.
        let lever = polygon.iter().map(|p| (p - polygon[0]).norm()).fold(0.0, f64::max).powi(2);
        let tolerance = 1e-12 * lever * polygon.len() as f64;
        assert!(
            (sum - whole.norm()).abs() <= tolerance,
            "area {sum} instead of {}: {polygon:?}",
            whole.norm()
        );
        for a in &parts {
            assert!(a.dot(&normal) >= -tolerance, "a triangle of area {a:?} is turned over: {polygon:?}");
        }
        let mut distinct: Vec<[u64; 3]> = polygon.iter().map(|p| (*p).map(f64::to_bits).into()).collect();
        distinct.sort_unstable();
        distinct.dedup();
        let used: HashSet<usize> = cut.triangles.iter().flatten().copied().collect();
        assert_eq!(used.len(), distinct.len(), "{:?} of {polygon:?}", cut.triangles);
    }

    fn flat(points: &[[f64; 2]]) -> Vec<Vec3> {
        points.iter().map(|p| Vec3::new(p[0], p[1], 0.0)).collect()
    }

    #[test]
    fn concave_pentagon_keeps_its_area() {
        let polygon = flat(&[[0.0, 0.0], [4.0, 0.0], [4.0, 4.0], [2.0, 1.0], [0.0, 4.0]]);
        assert!((vector_area(&polygon).z - 10.0).abs() < 1e-14);
        assert_exact(&polygon);
    }

    #[test]
    fn quads_take_the_shorter_diagonal_and_squares_the_first() {
        let square = flat(&[[0.0, 0.0], [1.0, 0.0], [1.0, 1.0], [0.0, 1.0]]);
        assert_eq!(cut_polygon(&square).triangles, [[0, 1, 2], [0, 2, 3]]);
        let tilted: Vec<Vec3> = square
            .iter()
            .map(|p| nalgebra::Rotation3::from_euler_angles(0.3, 0.7, 1.1) * p * 1e-9 + Vec3::repeat(0.1))
            .collect();
        assert_eq!(cut_polygon(&tilted).triangles.len(), 2);
        let kite = flat(&[[0.0, 0.0], [5.0, -1.0], [9.0, 0.0], [5.0, 1.0]]);
        assert_eq!(cut_polygon(&kite).triangles, [[0, 1, 3], [1, 2, 3]]);
        let arrow = flat(&[[0.0, 0.0], [4.0, 2.0], [0.0, 4.0], [1.0, 2.0]]);
        assert_exact(&arrow);
        let flat_corner = flat(&[[0.0, 0.0], [1.0, 0.0], [2.0, 0.0], [1.0, 1.0]]);
        assert_eq!(cut_polygon(&flat_corner).triangles.len(), 2);
        assert_exact(&flat_corner);
    }

    #[test]
    fn collinear_corners_stay_connected() {
        let polygon =
            flat(&[[0.0, 0.0], [1.0, 0.0], [2.0, 0.0], [3.0, 0.0], [3.0, 3.0], [1.5, 3.0], [0.0, 3.0]]);
        assert_exact(&polygon);
    }

    #[test]
    fn double_edge_to_a_hole_is_exact() {
        let keyhole = flat(&[
            [0.0, 0.0],
            [4.0, 0.0],
            [4.0, 4.0],
            [0.0, 4.0],
            [0.0, 0.0],
            [1.0, 1.0],
            [1.0, 3.0],
            [3.0, 3.0],
            [3.0, 1.0],
            [1.0, 1.0],
        ]);
        assert!((vector_area(&keyhole).z - 12.0).abs() < 1e-14);
        assert_exact(&keyhole);
    }

    #[test]
    fn repeated_corners_are_dropped() {
        let polygon =
            flat(&[[0.0, 0.0], [0.0, 0.0], [1.0, 0.0], [1.0, 1.0], [1.0, 1.0], [0.0, 1.0], [0.0, 0.0]]);
        assert_exact(&polygon);
    }

    #[test]
    fn crossing_and_flat_polygons_become_fans() {
        let bow_tie = flat(&[[0.0, 0.0], [2.0, 2.0], [2.0, 0.0], [0.0, 1.0]]);
        assert_eq!(cut_polygon(&bow_tie).kind, CutKind::CrossingFan);
        let twice = flat(&[[0.0, 0.0], [1.0, 0.0], [0.0, 1.0], [0.0, 0.0], [1.0, 0.0], [0.0, 1.0]]);
        assert_eq!(cut_polygon(&twice).kind, CutKind::CrossingFan);
        let line = flat(&[[0.0, 0.0], [1.0, 0.0], [2.0, 0.0], [3.0, 0.0]]);
        assert_eq!(
            cut_polygon(&line),
            Cut { triangles: vec![[0, 1, 2], [0, 2, 3]], kind: CutKind::DegenerateFan }
        );
        let point = flat(&[[7.0, 7.0]; 5]);
        assert_eq!(cut_polygon(&point).kind, CutKind::DegenerateFan);
        let spike = flat(&[[0.0, 0.0], [2.0, 0.0], [2.0, 2.0], [2.0, 3.0], [2.0, 2.0], [0.0, 2.0]]);
        assert_eq!(cut_polygon(&spike).kind, CutKind::CrossingFan);
    }

    #[test]
    fn any_finite_scale_works() {
        let shape = flat(&[[0.0, 0.0], [4.0, 0.0], [4.0, 4.0], [2.0, 1.0], [0.0, 4.0]]);
        for scale in [1e-320, 1e-300, 1e-50, 1e-9, 1e9, 1e50, 1e150, 1e307] {
            let scaled: Vec<Vec3> = shape.iter().map(|p| p * scale).collect();
            let cut = cut_polygon(&scaled);
            assert_eq!((cut.kind, cut.triangles.len()), (CutKind::Exact, 3), "{scale}");
        }
    }

    /// Star-shaped outlines, some of whose edges carry extra collinear corners, anywhere in space at any scale.
    fn star() -> impl Strategy<Value = Vec<Vec3>> {
        let spokes = prop::collection::vec((0.05_f64..1.0, 0_usize..4), 4..24);
        (spokes, -9_i32..9, prop::array::uniform3(-3.0_f64..3.0), -5.0_f64..5.0).prop_map(
            |(spokes, exponent, angles, offset)| {
                let count = spokes.len();
                let tips: Vec<Vec3> = spokes
                    .iter()
                    .enumerate()
                    .map(|(i, (radius, _))| {
                        let angle = std::f64::consts::TAU * i as f64 / count as f64;
                        Vec3::new(radius * angle.cos(), radius * angle.sin(), 0.0)
                    })
                    .collect();
                let rotation = nalgebra::Rotation3::from_euler_angles(angles[0], angles[1], angles[2]);
                let mut outline = Vec::new();
                for (i, &(_, extra)) in spokes.iter().enumerate() {
                    let (a, b) = (tips[i], tips[(i + 1) % count]);
                    outline.extend((0..=extra).map(|k| a.lerp(&b, k as f64 / (extra + 1) as f64)));
                }
                outline
                    .iter()
                    .map(|p| (rotation * p + Vec3::repeat(offset)) * 10_f64.powi(exponent))
                    .collect()
            },
        )
    }

    proptest! {
        #[test]
        fn star_polygons_are_cut_exactly(polygon in star()) {
            assert_exact(&polygon);
        }

        #[test]
        fn far_offsets_do_not_panic_or_lose_corners(polygon in star(), offset in -1e9_f64..1e9) {
            let moved: Vec<Vec3> = polygon.iter().map(|p| p + Vec3::repeat(offset)).collect();
            let cut = cut_polygon(&moved);
            prop_assert!(cut.triangles.iter().flatten().all(|&i| i < moved.len()));
            prop_assert!(!cut.triangles.is_empty());
        }

        #[test]
        fn arbitrary_corners_never_panic(points in prop::collection::vec(prop::array::uniform3(-3_i8..3), 3..12)) {
            let polygon: Vec<Vec3> = points.iter().map(|p| Vec3::from(p.map(f64::from))).collect();
            let cut = cut_polygon(&polygon);
            prop_assert!(!cut.triangles.is_empty());
            if cut.kind == CutKind::Exact && polygon.iter().all(|p| p.z == polygon[0].z) {
                let sum: f64 = areas(&polygon, &cut).iter().map(Vec3::norm).sum();
                prop_assert!((sum - vector_area(&polygon).norm()).abs() < 1e-9);
            }
        }
    }
}

//! What is not asked of estimators that trade accuracy for speed or for calm under noise; the invariants hold for them, too.

use osculate_geom::curvature::Method;

/// Why one ring of normals falls short.
const ONE_RING: &str = "one ring, whose normals are off beside a defect or a boundary";
/// Why algebraic spheres fall short.
const SPHERES: &str = "a sphere is no fit for what bends one way, or for points on one side";
/// Why both return something for a line of points.
const FLAT: &str = "normals alone make it a plane";

/// Case, estimator and reason.
const EXEMPTIONS: [(&str, Method, &str); 16] = [
    ("boundary_and_corners", Method::Algebraic, SPHERES),
    ("boundary_and_corners", Method::Normals, ONE_RING),
    ("bow_tie", Method::Normals, ONE_RING),
    ("capped_cylinder", Method::Algebraic, SPHERES),
    ("collinear_ring", Method::Algebraic, FLAT),
    ("collinear_ring", Method::Normals, FLAT),
    ("duplicated_triangles", Method::Normals, ONE_RING),
    ("graded_edges", Method::Algebraic, SPHERES),
    ("graded_edges", Method::Normals, ONE_RING),
    ("holes", Method::Normals, ONE_RING),
    ("near_flat", Method::Algebraic, SPHERES),
    ("reversed_triangles", Method::Normals, ONE_RING),
    ("umbilics_of_an_ellipsoid", Method::Algebraic, SPHERES),
    ("valence_500", Method::Algebraic, SPHERES),
    ("zero_area_triangles", Method::Algebraic, SPHERES),
    ("zero_area_triangles", Method::Normals, ONE_RING),
];

/// Estimators of which only the invariants are asked in a case, and why.
pub(super) fn exemptions(case: &str) -> impl Iterator<Item = (Method, &'static str)> {
    EXEMPTIONS.into_iter().filter(move |(name, ..)| *name == case).map(|(_, method, why)| (method, why))
}

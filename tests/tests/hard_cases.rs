//! Every hard case with every estimator, and the document that is made from them.

use std::path::Path;

use osculate_geom::curvature::Method;
use osculate_tests::hard_cases::{document, hard_cases, other_cases};

/// Runs a case of this name with every estimator.
fn check(name: &str) {
    let cases = hard_cases();
    let case = cases.iter().find(|case| case.name == name).expect("the table has the case");
    let failures: Vec<String> = Method::ALL
        .into_iter()
        .filter_map(|method| case.run(method).err().map(|error| format!("{name}, {method:?}: {error}")))
        .collect();
    assert!(failures.is_empty(), "{}", failures.join("\n"));
}

fn check_other(name: &str) {
    let cases = other_cases();
    let case = cases.iter().find(|case| case.name == name).expect("the table has the case");
    if let Err(error) = (case.check)() {
        panic!("{name}: {error}");
    }
}

/// A test a case, so that each can be run and fails by its own name.
macro_rules! tests {
    ($check:ident, $names:ident: $($name:ident,)*) => {
        $(#[test]
        fn $name() {
            $check(stringify!($name));
        })*

        const $names: &[&str] = &[$(stringify!($name)),*];
    };
}

tests! { check, MESHES:
    umbilic_sphere,
    umbilic_plane,
    umbilics_of_an_ellipsoid,
    parabolic_lines,
    monkey_saddle,
    near_flat,
    valence_3,
    valence_500,
    graded_edges,
    needle_triangles,
    needle_cylinder,
    zero_area_triangles,
    cone_tip,
    capped_cylinder,
    cube,
    stair_steps,
    boundary_and_corners,
    holes,
    self_intersection,
    thin_sheet,
    duplicated_triangles,
    reversed_triangles,
    bow_tie,
    non_manifold_edge,
    mixed_orientation,
    moebius_band,
    unmerged_triangles,
    uv_seam,
    normal_seam,
    no_vertices,
    points_only,
    isolated_vertices,
    one_triangle,
    two_triangles,
    tetrahedron_beside_a_sphere,
    octahedron,
    collinear_ring,
    all_on_a_line,
    all_in_one_point,
    largest_numbers,
    smallest_numbers,
    all_magnitudes,
    far_apart_in_size,
    noise_1e_6,
    noise_1e_3,
    noise_1e_2,
    noise_1e_1,
    noise_3e_1,
    scale_1e_minus_150,
    scale_1e_minus_100,
    scale_1e_minus_9,
    scale_1e9,
    scale_1e100,
    scale_1e150,
    offset_1e7,
    offset_1e7_rounded,
    offset_1e3_in_f32,
    offset_1e7_in_f32,
    random_rotation,
    permutation,
    inside_out,
    spike,
    vertex_at_1e100,
}

tests! { check_other, OTHERS:
    ray_at_exactly_normal_incidence,
    ray_at_grazing_1e_8,
    rays_through_vertices_and_edges,
    rays_along_edges,
    rays_in_the_plane_of_triangles,
    scales_through_files,
    single_precision_input,
    too_large_for_a_file,
}

#[test]
fn every_case_has_a_test() {
    let names: Vec<&str> = hard_cases().iter().map(|case| case.name).collect();
    assert_eq!(names, MESHES);
    let names: Vec<&str> = other_cases().iter().map(|case| case.name).collect();
    assert_eq!(names, OTHERS);
}

#[test]
fn the_document_is_up_to_date() {
    let path = Path::new(env!("CARGO_MANIFEST_DIR")).join("../docs/hard-cases.md");
    let expected = document::hard_cases_document();
    if std::env::var_os("UPDATE_DOCS").is_some() {
        std::fs::write(&path, &expected).unwrap();
    }
    let found = std::fs::read_to_string(&path).unwrap_or_default();
    assert!(found == expected, "docs/hard-cases.md is out of date; run this test with UPDATE_DOCS=1");
}

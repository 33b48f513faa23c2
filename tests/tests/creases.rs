//! What creases must and must not be found, through the estimates.

use osculate_geom::Vec3;
use osculate_geom::curvature::{CurvatureOptions, Status};
use osculate_geom::shapes::study::{StudyShape, add_noise};
use osculate_geom::shapes::{self, Ends};
use osculate_tests::samples::run;

#[test]
fn a_crease_ends_at_the_boundary_as_a_boundary() {
    // The surface goes on at neither end of the fold, which matters more than the fold.
    let folded = shapes::grid(12, 12, [Ends::Open; 2], |u, v| {
        let x = u - 0.5;
        if x > 0.0 { Vec3::new(0.4 * x, v, -0.9 * x) } else { Vec3::new(x, v, 0.0) }
    });
    let estimates = run(&folded, &CurvatureOptions::default());
    for (p, e) in std::iter::zip(folded.positions(), estimates) {
        let at_end = p.y < 1e-9 || p.y > 1.0 - 1e-9;
        let on_fold = p.x.abs() < 1e-9;
        match (on_fold, at_end) {
            (true, true) => assert_eq!(e.status, Status::Boundary, "{p}"),
            (true, false) => assert_eq!(e.status, Status::Crease, "{p}"),
            (false, _) => assert_ne!(e.status, Status::Crease, "{p}"),
        }
    }
}

#[test]
fn noise_makes_few_creases() {
    // With noise of 0.4 of an edge every second edge turns by 40 degrees. Creases that may go on in either sense, or turn back, are two
    // to four times as many.
    for (shape, most) in [(StudyShape::Sphere, 70), (StudyShape::Bump, 140)] {
        let noisy = add_noise(&shape.mesh(10_000, 61), 0.4, 62);
        let estimates = run(&noisy, &CurvatureOptions { tolerance: 1e3, ..CurvatureOptions::default() });
        let creases = estimates.iter().filter(|e| e.status == Status::Crease).count();
        assert!(creases < most, "{}: {creases} of {}", shape.name(), estimates.len());
    }
}

//! `auto` with no options beside the best that any other program reaches at any setting, chosen in hindsight.
//!
//! The other programs' figures are those of docs/study-curvature.html (10,000 vertices, made with other random numbers): median and 95th
//! percentile of the error of the worse curvature, times the shape's radius.

use osculate_geom::curvature::CurvatureOptions;
use osculate_geom::shapes::study::StudyShape::{
    self, Bump, Catenoid, Cylinder, Ellipsoid, MonkeySaddle, Sphere, Torus,
};
use osculate_tests::samples::{geometric_mean, quantile, samples};

/// Shape, noise in mean edges, median and 95th percentile of the best others.
const BEST: [(StudyShape, f64, [f64; 2]); 35] = [
    (Sphere, 0.0, [4.1e-6, 1.5e-5]), // CGAL jets, degree 4 on 2 rings; the same below
    (Ellipsoid, 0.0, [6.2e-5, 4.0e-4]),
    (Torus, 0.0, [2.4e-4, 1.3e-3]),
    (Catenoid, 0.0, [2.3e-5, 8.7e-5]),
    (Bump, 0.0, [1.15e-5, 5.6e-5]),
    (MonkeySaddle, 0.0, [1.2e-5, 6.7e-5]),
    (Cylinder, 0.0, [1.0e-6, 2.1e-6]),
    (Sphere, 0.001, [0.0017, 0.0033]),       // Ponca APSS, 12 edges
    (Ellipsoid, 0.001, [0.0020, 0.0074]),    // CGAL jets, degree 4 on 6 rings and 5
    (Torus, 0.001, [0.0037, 0.0087]),        // CGAL jets, degree 4 on 4 rings
    (Catenoid, 0.001, [0.0019, 0.0065]),     // CGAL jets, degree 4 on 6 rings
    (Bump, 0.001, [0.0015, 0.0056]),         // CGAL jets, degree 4 on 6 rings
    (MonkeySaddle, 0.001, [0.0030, 0.0083]), // CGAL jets, degree 3 on 5 rings and 6
    (Cylinder, 0.001, [0.0012, 0.0077]),     // Ponca ASO, 12 edges; CGAL jets, degree 2 on 4 rings
    (Sphere, 0.01, [0.0030, 0.0059]),        // Ponca APSS, 12 edges
    (Ellipsoid, 0.01, [0.011, 0.034]),       // CGAL jets, degree 4 on 6 rings
    (Torus, 0.01, [0.0079, 0.024]),          // Ponca ASO, 12 edges
    (Catenoid, 0.01, [0.0061, 0.027]),       // Ponca ASO, 12 edges; CGAL jets, degree 3 on 6 rings
    (Bump, 0.01, [0.0056, 0.030]),           // Ponca ASO, 12 edges; CGAL jets, degree 2 on 5 rings
    (MonkeySaddle, 0.01, [0.0071, 0.054]),   // Ponca ASO, 12 edges; CGAL jets, degree 3 on 6 rings
    (Cylinder, 0.01, [0.0035, 0.021]),       // Ponca APSS, 12 edges; CGAL jets, degree 2 on 6 rings
    (Sphere, 0.05, [0.013, 0.025]),          // Ponca APSS, 12 edges
    (Ellipsoid, 0.05, [0.022, 0.081]),       // Ponca ASO, 12 edges and 8
    (Torus, 0.05, [0.011, 0.028]),           // Ponca ASO, 12 edges
    (Catenoid, 0.05, [0.014, 0.092]),        // Ponca ASO, 12 edges; CGAL jets, degree 2 on 6 rings
    (Bump, 0.05, [0.012, 0.054]),            // Ponca ASO, 12 edges
    (MonkeySaddle, 0.05, [0.023, 0.13]),     // Ponca ASO, 12 edges; CGAL jets, degree 2 on 6 rings
    (Cylinder, 0.05, [0.0071, 0.076]),       // Ponca APSS, 12 edges; CGAL jets, degree 2 on 6 rings
    (Sphere, 0.2, [0.068, 0.13]),            // Ponca ASO, 12 edges; APSS, 12 edges
    (Ellipsoid, 0.2, [0.046, 0.14]),         // Ponca ASO, 12 edges
    (Torus, 0.2, [0.027, 0.063]),            // Ponca ASO, 12 edges
    (Catenoid, 0.2, [0.041, 0.24]),          // Ponca ASO, 12 edges; CGAL jets, degree 2 on 6 rings
    (Bump, 0.2, [0.031, 0.090]),             // Ponca ASO, 12 edges
    (MonkeySaddle, 0.2, [0.069, 0.38]),      // Ponca ASO, 12 edges
    (Cylinder, 0.2, [0.025, 0.30]),          // Ponca APSS, 12 edges; CGAL jets, degree 2 on 6 rings
];

#[test]
fn auto_is_near_the_best_that_others_reach_in_hindsight() {
    let mut ratios = [vec![], vec![]];
    for (shape, noise, best) in BEST {
        let samples = samples(shape, 10_000, [11, 12], noise, &CurvatureOptions::default());
        let found = [50, 95].map(|percent| quantile(samples.iter().map(|s| s.error), percent));
        let [median, high] = [0, 1].map(|k| found[k] / best[k]);
        println!("{:14} {noise:5} {:.4} {median:.2} {:.4} {high:.2}", shape.name(), found[0], found[1]);
        ratios[0].push(median);
        ratios[1].push(high);
        assert!(median < 1.2 && high < 1.2, "{}, noise {noise}: {median} and {high} times", shape.name());
    }
    let means = ratios.map(|ratios| geometric_mean(&ratios));
    println!("geometric means {means:.2?}");
    assert!(means[0] < 0.5 && means[1] < 0.55, "{means:?}");
}

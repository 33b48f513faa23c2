//! Noise, from what hardly shows to what drowns the shape.

use osculate_geom::{Mesh, Vec3};

use super::meshes::{Random, moved, torus, torus_curvature};
use super::{HardCase, NO_ERROR_ESTIMATE, Truth};

/// Mean edge length of the torus, which noise is measured by.
const EDGE: f64 = 0.12;

/// Every coordinate off by up to this share of an edge, uniformly.
fn noisy(share: f64) -> Mesh {
    let mut random = Random(11);
    moved(&torus(), |p| p + share * EDGE * random.vector())
}

/// Right within 12 % of `kappa_max`, or within twice the stated error. Points off the torus are judged by the nearest one.
fn honest(mesh: &Mesh) -> Vec<Truth> {
    let on_torus = |p: &Vec3| {
        let around = Vec3::new(p.x, 0.0, p.z).normalize();
        around + 0.4 * (p - around).normalize()
    };
    let truth = |p: &Vec3| Truth::Honest { kappa: torus_curvature(&on_torus(p)), tolerance: 0.12 * 2.5 };
    mesh.positions().iter().map(truth).collect()
}

pub(super) fn cases() -> Vec<HardCase> {
    let case = |name, what, mesh: fn() -> Mesh, share| HardCase {
        truth: honest,
        share,
        exempt: NO_ERROR_ESTIMATE,
        ..HardCase::new(
            name,
            what,
            "the closed form within 12 % of kappa_max, or an error estimate that covers the difference twice over, at 90 % of the vertices (all of them up to 1e-3)",
            mesh,
        )
    };
    vec![
        case("noise_1e_6", "noise of a millionth of an edge", || noisy(1e-6), 1.0),
        case("noise_1e_3", "noise of a thousandth of an edge", || noisy(1e-3), 1.0),
        case("noise_1e_2", "noise of a hundredth of an edge", || noisy(1e-2), 0.9),
        case("noise_1e_1", "noise of a tenth of an edge", || noisy(0.1), 0.9),
        case("noise_3e_1", "noise of 0.3 of an edge", || noisy(0.3), 0.9),
    ]
}

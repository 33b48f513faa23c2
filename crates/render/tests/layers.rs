//! Layers of a cylinder against its closed form.

mod support;

use std::sync::Arc;

use glam::{DVec3, Vec3};
use osculate_geom::curvature::{Principal, Status, VertexCurvature};
use osculate_geom::{Vec3 as Vec3d, shapes};
use osculate_render::MeshInstance;
use osculate_render::aov::{Aov, aovs};

const RADIUS: f64 = 0.5;
const SIZE: u32 = 65;
const DISTANCE: f32 = 4.0;
const FOV_DEGREES: f32 = 30.0;

/// Where the ray through a pixel meets the cylinder around y, and its direction; `None` where it passes.
fn analytic_hit(x: u32, y: u32) -> Option<(DVec3, DVec3)> {
    let tan = f64::from(FOV_DEGREES / 2.0).to_radians().tan();
    let ndc = |pixel: u32| 2.0 * (f64::from(pixel) + 0.5) / f64::from(SIZE) - 1.0;
    let direction = DVec3::new(ndc(x) * tan, -ndc(y) * tan, -1.0).normalize();
    let origin = DVec3::new(0.0, 0.0, f64::from(DISTANCE));
    let (a, b) = (direction.x.powi(2) + direction.z.powi(2), origin.z * direction.z);
    let discriminant = b * b - a * (origin.z * origin.z - RADIUS * RADIUS);
    (discriminant > 0.0).then(|| (origin + direction * ((-b - discriminant.sqrt()) / a), direction))
}

#[test]
fn curvature_and_depth_of_a_cylinder() {
    let mesh = shapes::cylinder(RADIUS, 8.0, 512, 4);
    let exact = |p: &Vec3d| {
        let n = Vec3d::new(p.x, 0.0, p.z) / RADIUS;
        let principal = Principal {
            kappa_max: 1.0 / RADIUS,
            kappa_min: 0.0,
            d1: Vec3d::new(n.z, 0.0, -n.x),
            d2: Vec3d::y(),
        };
        VertexCurvature { principal: Some(principal), error: 0.0, status: Status::Ok }
    };
    let curvature: Arc<[VertexCurvature]> = mesh.positions().iter().map(exact).collect();
    let object = MeshInstance { curvature: Some(curvature), ..MeshInstance::new(Arc::new(mesh)) };
    let position = Vec3::new(0.0, 0.0, DISTANCE);
    let scene = support::scene(vec![object], SIZE, position, Vec3::ZERO, FOV_DEGREES);
    let wanted = [Aov::Depth, Aov::KappaMin, Aov::KappaMax, Aov::KappaAlongRay];
    let (layers, _) = aovs(&scene, &wanted).expect("a valid scene");
    let value =
        |layer: usize, x: u32, y: u32| f64::from(layers[layer].channels[0].1[(y * SIZE + x) as usize]);
    let mut compared = 0;
    for (x, y) in (0..SIZE).flat_map(|y| (0..SIZE).map(move |x| (x, y))) {
        let Some((hit, direction)) = analytic_hit(x, y) else {
            assert!(value(0, x, y).is_infinite() && value(3, x, y).is_nan(), "{x} {y} shows something");
            continue;
        };
        let normal = DVec3::new(hit.x, 0.0, hit.z) / RADIUS;
        let sine = (1.0 - direction.dot(normal).powi(2)).sqrt();
        // At the limb a facet of 0.7 degrees moves the hit far; near the normal the direction is blended out.
        if direction.dot(normal).abs() < 0.2 || sine < 0.03 {
            continue;
        }
        compared += 1;
        let along = direction.dot(DVec3::new(normal.z, 0.0, -normal.x)).powi(2) / (sine * sine) / RADIUS;
        // Facets lie up to 1e-5 inside the circle. Along the ray, the curvature is taken at two vertices a facet's angle apart
        // and interpolated; the mean of two tensors that far apart has lost angle^2 / 4 of its maximum. Near the normal, a turn by that angle turns the azimuth by angle / sine.
        let facet = std::f64::consts::TAU / 512.0;
        let tolerance = [1e-3, facet * facet, facet * facet, 1e-3 + (facet / sine).powi(2)];
        let expected = [f64::from(DISTANCE) - hit.z, 0.0, 1.0 / RADIUS, along];
        for (layer, expected) in expected.into_iter().enumerate() {
            let found = value(layer, x, y);
            assert!(
                (found - expected).abs() < tolerance[layer],
                "{:?} at {x}, {y}: {found}, not {expected}",
                wanted[layer]
            );
        }
    }
    assert!(compared > 1000, "{compared}");
}

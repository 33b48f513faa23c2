//! Scenes and statistics that the tests share.
#![allow(dead_code, reason = "each test file uses its part")]

use std::ops::ControlFlow;
use std::sync::Arc;

use glam::Vec3;
use osculate_geom::{Mesh, Vec3 as Vec3d};
use osculate_render::scene::{Role, SurfaceSource};
use osculate_render::{
    Camera, Environment, Material, MeshInstance, RenderOptions, Rendering, SamplerKind, Scene, StopRule,
    Strategy, render,
};

pub fn run(scene: &Scene, options: &RenderOptions) -> Rendering {
    render(scene, options, &mut |_| ControlFlow::Continue(())).expect("a valid scene")
}

/// Independent samples, so that the variance image is unbiased.
pub fn independent(samples: u32, max_depth: u32, strategy: Strategy, seed: u64) -> RenderOptions {
    RenderOptions {
        stop: StopRule::Samples(samples),
        max_depth,
        strategy,
        seed,
        sampler: SamplerKind::Independent,
        ..RenderOptions::default()
    }
}

pub fn object(mesh: Mesh, material: Material) -> MeshInstance {
    MeshInstance {
        surface: SurfaceSource::Material(material),
        role: Role::Subject,
        ..MeshInstance::new(Arc::new(mesh))
    }
}

/// The unit sphere with exact normals.
pub fn sphere(rings: u32) -> Mesh {
    let mut points = Vec::new();
    for i in 0..=rings {
        for j in 0..=2 * rings {
            let theta = std::f64::consts::PI * f64::from(i) / f64::from(rings);
            let phi = std::f64::consts::PI * f64::from(j) / f64::from(rings);
            points.push(Vec3d::new(theta.sin() * phi.sin(), theta.cos(), theta.sin() * phi.cos()));
        }
    }
    let stride = 2 * rings + 1;
    let mut triangles = Vec::new();
    for a in (0..rings).flat_map(|i| (0..2 * rings).map(move |j| i * stride + j)) {
        triangles.extend([[a, a + stride, a + stride + 1], [a, a + stride + 1, a + 1]]);
    }
    Mesh::new(points.clone(), triangles).and_then(|m| m.with_normals(points)).expect("a sphere")
}

/// A horizontal square of half side `half`, facing up.
pub fn plane(half: f64, height: f64) -> Mesh {
    let corner = |x: f64, z: f64| Vec3d::new(x * half, height, z * half);
    let corners = vec![corner(-1.0, -1.0), corner(-1.0, 1.0), corner(1.0, 1.0), corner(1.0, -1.0)];
    Mesh::new(corners, vec![[0, 1, 2], [0, 2, 3]]).expect("a plane")
}

pub fn scene(objects: Vec<MeshInstance>, size: u32, position: Vec3, target: Vec3, fov_degrees: f32) -> Scene {
    Scene {
        camera: Camera::look_at(position, target, Vec3::Y, fov_degrees.to_radians()),
        width: size,
        height: size,
        objects,
        lights: Vec::new(),
        environment: Environment::Black,
        exposure: 0.0,
    }
}

/// Mean of the red channel over the picture, and its standard error from the variance image.
pub fn mean_and_error(rendering: &Rendering) -> (f64, f64) {
    let pixels = rendering.film.radiance();
    let n = pixels.len() as f64;
    let mean = pixels.iter().map(|p| f64::from(p.x)).sum::<f64>() / n;
    let variance = rendering.film.variance().iter().map(|v| f64::from(*v)).sum::<f64>();
    (mean, variance.sqrt() / n)
}

/// Asserts that two independent estimates agree within 4.5 standard errors (one false alarm in 150,000).
pub fn assert_agree(a: (f64, f64), b: (f64, f64), case: &str) {
    let error = a.1.hypot(b.1).max(1e-7 * a.0.abs());
    let z = (a.0 - b.0) / error;
    assert!(z.abs() < 4.5, "{case}: {} +- {} and {} +- {}: z = {z:.2}", a.0, a.1, b.0, b.1);
    // An error bar as wide as the value would agree with anything.
    assert!(error < 0.05 * a.0.abs().max(b.0.abs()), "{case}: too noisy to tell: {a:?} {b:?}");
}

//! Meshes of surfaces whose curvature is known, other than those of the studies.

use std::f64::consts::TAU;

use osculate_geom::shapes::{self, Ends};
use osculate_geom::{Mesh, Vec3};

/// Exact `[kappa_max, kappa_min]` at a point of a surface.
pub type Exact = fn(&Vec3) -> [f64; 2];

/// A grid whose parameters are moved by up to `amount` cells, so that no symmetry cancels errors.
#[must_use]
pub fn irregular(n: [usize; 2], ends: [Ends; 2], amount: f64, point: impl Fn(f64, f64) -> Vec3) -> Mesh {
    let step = |k: f64| (k * 0.754_877_666).fract() - 0.5;
    let moved = move |u: f64, v: f64| {
        let (i, j) = (u * n[0] as f64, v * n[1] as f64);
        let inside = |t: f64, end: Ends| end == Ends::Closed || (t > 1e-9 && t < 1.0 - 1e-9);
        let shift = |seed: f64| 2.0 * amount * step(seed);
        let du = if inside(u, ends[0]) { shift(i * 12.9898 + j * 78.233) / n[0] as f64 } else { 0.0 };
        let dv = if inside(v, ends[1]) { shift(i * 39.346 + j * 11.135 + 5.0) / n[1] as f64 } else { 0.0 };
        (u + du, v + dv)
    };
    shapes::grid(n[0], n[1], ends, move |u, v| {
        let (u, v) = moved(u, v);
        point(u, v)
    })
}

/// Radii 1 and 0.4 around the y axis, `n` cells around the tube.
#[must_use]
pub fn torus(n: usize, amount: f64) -> Mesh {
    irregular([5 * n / 2, n], [Ends::Closed; 2], amount, |u, v| {
        let (a, b) = (u * TAU, v * TAU);
        let radius = 1.0 + 0.4 * b.cos();
        Vec3::new(radius * a.sin(), 0.4 * b.sin(), radius * a.cos())
    })
}

/// Of [`torus`].
#[must_use]
pub fn torus_exact(p: &Vec3) -> [f64; 2] {
    let radius = p.x.hypot(p.z);
    [2.5, (radius - 1.0) / 0.4 / radius]
}

/// Radius 1 and height 2 around the y axis, `n` cells high.
#[must_use]
pub fn cylinder(n: usize, amount: f64) -> Mesh {
    irregular([3 * n, n], [Ends::Closed, Ends::Open], amount, |u, v| {
        let a = u * TAU;
        Vec3::new(a.sin(), 2.0 * (v - 0.5), a.cos())
    })
}

/// `z = xy` over `[-1, 1]^2`, with the normal towards `+z`.
#[must_use]
pub fn saddle(n: usize, amount: f64) -> Mesh {
    irregular([n, n], [Ends::Open; 2], amount, |u, v| {
        let (x, y) = (2.0 * u - 1.0, 2.0 * v - 1.0);
        Vec3::new(x, y, x * y)
    })
}

/// Of [`saddle`], from its fundamental forms.
#[must_use]
pub fn saddle_exact(p: &Vec3) -> [f64; 2] {
    let w2 = 1.0 + p.x * p.x + p.y * p.y;
    let mean = p.x * p.y / w2.powf(1.5);
    let root = (mean * mean + 1.0 / (w2 * w2)).sqrt();
    [mean + root, mean - root]
}

/// Of the ellipsoid with the half-axes 1, 1.5 and 0.7.
#[must_use]
pub fn ellipsoid_exact(p: &Vec3) -> [f64; 2] {
    let (a, b, c) = (1.0, 1.5, 0.7);
    let g2 = p.x * p.x / (a * a * a * a) + p.y * p.y / (b * b * b * b) + p.z * p.z / (c * c * c * c);
    let gauss = 1.0 / (a * b * c * g2).powi(2);
    let mean = (a * a + b * b + c * c - p.norm_squared()) / (2.0 * (a * b * c).powi(2) * g2.powf(1.5));
    let root = (mean * mean - gauss).max(0.0).sqrt();
    [mean + root, mean - root]
}

/// Name, mesh and exact curvature of six surfaces; `n` cells a side, or `levels` subdivisions.
#[must_use]
pub fn surfaces(n: usize, levels: u32) -> Vec<(&'static str, Mesh, Exact)> {
    vec![
        ("torus", torus(n, 0.0), torus_exact),
        ("irregular torus", torus(n, 0.3), torus_exact),
        ("irregular cylinder", cylinder(n, 0.3), |_| [1.0, 0.0]),
        ("irregular saddle", saddle(n, 0.3), saddle_exact),
        ("sphere", shapes::icosphere(1.0, levels), |_| [1.0, 1.0]),
        ("ellipsoid", shapes::ellipsoid(Vec3::new(1.0, 1.5, 0.7), levels), ellipsoid_exact),
    ]
}

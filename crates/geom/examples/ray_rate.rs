//! Million rays a second on a mesh, on one thread, with the rays of `tools/reference/embree_rays.cpp`.
//!
//! ```text
//! cargo run --release -p osculate-geom --example ray_rate -- MESH [RUNS=5]
//! ```
//!
//! The head of that file describes the rays. Printed is JSON with medians, and what was found, to compare with Embree's: of rays one by one, and of
//! the primary ones in one call.

use std::time::Instant;

use glam::{DVec3, Vec3};
use osculate_geom::io::read_mesh;
use osculate_geom::rays::{Bvh, Hit, Ray};

const SIZE: u32 = 1024;

fn main() -> Result<(), Box<dyn std::error::Error>> {
    let mut arguments = std::env::args().skip(1);
    let path = arguments.next().ok_or("usage: ray_rate MESH [RUNS]")?;
    let runs: usize = arguments.next().map_or(Ok(5), |text| text.parse())?;
    let mesh = read_mesh(path.as_ref())?.mesh;
    let bvh = Bvh::from_mesh(&mesh);
    let corners = || bvh.triangles().iter().flatten();
    let lower = corners().fold(Vec3::INFINITY, |lower, p| lower.min(*p)).as_dvec3();
    let upper = corners().fold(Vec3::NEG_INFINITY, |upper, p| upper.max(*p)).as_dvec3();
    let diagonal = (upper - lower).length();
    let primary = primary_rays(0.5 * (lower + upper), diagonal);
    let random = random_rays(&bvh, &primary, diagonal);
    let one_by_one = |rays: &[Ray]| sum(rays.iter().filter_map(|ray| bvh.closest_hit(ray)));
    let together = |rays: &[Ray]| {
        /// Few enough that their hits stay near.
        const AT_A_TIME: usize = 1024;
        let mut hits = [None; AT_A_TIME];
        let sums = rays.chunks(AT_A_TIME).map(|rays| {
            let hits = &mut hits[..rays.len()];
            bvh.closest_hits(rays, hits);
            sum(hits.iter().flatten().copied())
        });
        sums.fold((0, 0.0), |(count, total), (hits, distance)| (count + hits, total + distance))
    };
    let rates = [
        ("primary", rate(&primary, runs, one_by_one)),
        ("random", rate(&random, runs, one_by_one)),
        ("primary, together", rate(&primary, runs, together)),
    ];
    #[allow(clippy::print_stdout, reason = "an example reports on standard output")]
    for (name, (million, hits, distance)) in rates {
        println!(
            "{{\"rays\": \"{name}\", \"mrays_per_second\": {million:.3}, \"hits\": {hits}, \"sum_of_distances\": {distance}}}"
        );
    }
    Ok(())
}

fn primary_rays(center: DVec3, diagonal: f64) -> Vec<Ray> {
    let eye = center + 1.6 * diagonal * DVec3::new(0.0, 0.35, 1.0).normalize();
    let forward = (center - eye).normalize();
    let right = forward.cross(DVec3::Y).normalize();
    let up = right.cross(forward);
    let tan = 20.0_f64.to_radians().tan();
    let ndc = |pixel: u32| 2.0 * (f64::from(pixel) + 0.5) / f64::from(SIZE) - 1.0;
    let direction = |x: u32, y: u32| (forward + tan * ndc(x) * right - tan * ndc(y) * up).normalize();
    (0..SIZE * SIZE).map(|i| Ray::new(eye.as_vec3(), direction(i % SIZE, i / SIZE).as_vec3())).collect()
}

fn random_rays(bvh: &Bvh, primary: &[Ray], diagonal: f64) -> Vec<Ray> {
    let bounce = |(index, ray): (u32, &Ray)| {
        let hit = bvh.closest_hit(ray)?;
        let [a, b, c] = bvh.triangles()[hit.triangle as usize].map(Vec3::as_dvec3);
        let normal = (b - a).cross(c - a).normalize();
        let normal = if normal.dot(ray.direction.as_dvec3()) > 0.0 { -normal } else { normal };
        let smallest = (0..3).min_by(|&i, &j| normal[i].abs().total_cmp(&normal[j].abs()))?;
        let s = normal.cross([DVec3::X, DVec3::Y, DVec3::Z][smallest]).normalize();
        let t = normal.cross(s);
        let (phi, radius2) = (std::f64::consts::TAU * uniform(2 * index), uniform(2 * index + 1));
        let direction = radius2.sqrt() * (phi.cos() * s + phi.sin() * t) + (1.0 - radius2).sqrt() * normal;
        let point = ray.origin.as_dvec3() + f64::from(hit.t) * ray.direction.as_dvec3();
        Some(Ray::new((point + 1e-4 * diagonal * normal).as_vec3(), direction.as_vec3()))
    };
    (0..).zip(primary).filter_map(bounce).collect()
}

fn uniform(k: u32) -> f64 {
    let mut h = k;
    h ^= h >> 16;
    h = h.wrapping_mul(0x7feb_352d);
    h ^= h >> 15;
    h = h.wrapping_mul(0x846c_a68b);
    h ^= h >> 16;
    f64::from(h >> 8) / f64::from(1 << 24)
}

/// Median million rays a second, hits and the sum of their distances.
fn rate(rays: &[Ray], runs: usize, trace: impl Fn(&[Ray]) -> (usize, f64)) -> (f64, usize, f64) {
    let mut found = (0, 0.0);
    let mut rates: Vec<f64> = (0..runs.max(1))
        .map(|_| {
            let start = Instant::now();
            found = trace(rays);
            rays.len() as f64 / start.elapsed().as_secs_f64() * 1e-6
        })
        .collect();
    rates.sort_by(f64::total_cmp);
    (rates[rates.len() / 2], found.0, found.1)
}

/// How many hits, and the sum of their distances.
fn sum(hits: impl Iterator<Item = Hit>) -> (usize, f64) {
    hits.fold((0, 0.0), |(count, total), hit| (count + 1, total + f64::from(hit.t)))
}

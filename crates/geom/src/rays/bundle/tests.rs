//! Every ray of a bundle against the same ray alone, to the bit.

use glam::Vec3;
use proptest::prelude::*;

use super::super::bvh::tests::list;
use super::super::kernels::{Portable, Simd};
use super::super::{Bvh, Hit, Ray};
use super::*;

/// Checks both kernels; returns how many rays hit.
fn check(bvh: &Bvh, rays: &[Ray]) -> usize {
    let alone: Vec<Option<Hit>> = rays.iter().map(|ray| bvh.closest_hit(ray)).collect();
    for simd in [Simd::Portable, Simd::detect()] {
        let mut hits = vec![None; rays.len()];
        bvh.closest_hits_with(simd, rays, &mut hits);
        for ((ray, hit), expected) in rays.iter().zip(&hits).zip(&alone) {
            assert_eq!(hit, expected, "{simd:?}, {ray:?}");
        }
    }
    let mut any = vec![false; rays.len()];
    bvh.any_hits(rays, &mut any);
    assert!(any.iter().zip(&alone).all(|(any, hit)| *any == hit.is_some()), "{any:?}");
    alone.iter().flatten().count()
}

/// A grid of squares over `[-1, 1]^2`, bent, so that rays cross it several times.
fn sheet(side: u8, scale: f32) -> Vec<[Vec3; 3]> {
    let at = |i: u8, j: u8| {
        let (x, y) = (f32::from(i) / f32::from(side) * 2.0 - 1.0, f32::from(j) / f32::from(side) * 2.0 - 1.0);
        scale * Vec3::new(x, y, 0.3 * (7.0 * x).sin() * (5.0 * y).cos())
    };
    let squares = (0..side).flat_map(|i| (0..side).map(move |j| (i, j)));
    squares
        .flat_map(|(i, j)| {
            let [a, b, c, d] = [at(i, j), at(i + 1, j), at(i + 1, j + 1), at(i, j + 1)];
            [[a, b, c], [a, c, d]]
        })
        .collect()
}

/// Rays from a point through neighbouring pixels.
fn fan(origin: Vec3, towards: Vec3, apart: f32, count: u8) -> Vec<Ray> {
    let (right, up) = (towards - origin).normalize().any_orthonormal_pair();
    let pixel = |k: u8| apart * (f32::from(k % 4) * right + f32::from(k / 4) * up);
    (0..count).map(|k| Ray::new(origin, (towards + pixel(k) - origin).normalize())).collect()
}

#[test]
fn neighbouring_pixels_make_a_bundle_and_others_do_not() {
    let rays = fan(Vec3::new(0.4, -0.3, 4.0), Vec3::new(0.1, 0.2, 0.0), 1e-3, 40);
    assert_eq!(Bundle::new(&rays).1, WIDTH);
    assert!(Bundle::new(&rays).0.is_some());
    assert!(Bundle::new(&rays[..FEWEST - 1]).0.is_none());
    let far = Ray::new(rays[0].origin, rays[0].direction + 0.1 * Vec3::X);
    let back = Ray::new(rays[0].origin, -rays[0].direction);
    let nan = Ray::new(Vec3::NAN, rays[0].direction);
    let nowhere = Ray::new(rays[0].origin, Vec3::NAN);
    let endless = Ray { t_max: f32::NAN, ..rays[0] };
    // Its inverse shares are infinite.
    let tiny = Ray::new(rays[0].origin, 1e-20 * rays[0].direction);
    for odd in [far, back, nan, nowhere, endless, tiny] {
        let mut mixed = rays.clone();
        mixed[6] = odd;
        assert_eq!(Bundle::new(&mixed).1, 6, "{odd:?}");
        assert_eq!(Bundle::new(&[odd; WIDTH]).0.is_some(), odd == far || odd == back, "{odd:?}");
    }
}

#[test]
fn a_bundle_that_meets_too_much_is_given_up() {
    let bvh = Bvh::new(sheet(200, 1.0));
    let wide = fan(Vec3::new(0.0, 0.0, 400.0), Vec3::new(0.1, 0.9, 0.0), 0.25, 16);
    let mut bundle = Bundle::new(&wide).0.expect("a bundle");
    assert!(!bundle.walk::<Portable>(&bvh.tree, &mut [NO_ENTRY; SMALL_STACK]));
    assert_eq!(check(&bvh, &wide), 16);
}

#[test]
fn rays_in_planes_and_through_vertices() {
    let bvh = Bvh::new(sheet(8, 1.0));
    let step = Vec3::new(0.25, 0.0, 0.0);
    for (first, direction) in [
        (Vec3::new(-1.0, 0.5, 2.0), Vec3::NEG_Z),
        (Vec3::new(-1.0, -2.0, 0.0), Vec3::Y),
        (Vec3::new(-1.0, -1.0, 2.0), Vec3::new(0.0, 0.25, -1.0)),
        (Vec3::new(-1.0, 0.5, 2.0), Vec3::new(-0.0, 0.0, -1.0)),
        (Vec3::new(-1.0, 0.5, 2.0), Vec3::new(1e-30, -1e-30, -1.0)),
        (Vec3::new(-1.0, 0.5, 2.0), Vec3::new(0.0, 1e-22, -1e-20)),
        (Vec3::new(-1.0, 0.5, 2.0), Vec3::new(0.0, 1e16, -1e18)),
    ] {
        let rays: Vec<Ray> = (0..9_u8).map(|k| Ray::new(first + f32::from(k) * step, direction)).collect();
        check(&bvh, &rays);
    }
}

/// Twice the same triangles: ties go to the lower number, in bundles too.
#[test]
fn ties_go_to_the_first_triangle() {
    let once = sheet(8, 1.0);
    let bvh = Bvh::new([once.clone(), once.clone()].concat());
    let rays = fan(Vec3::new(0.4, -0.3, 4.0), Vec3::new(0.1, 0.2, 0.0), 0.01, 16);
    assert_eq!(check(&bvh, &rays), 16);
    let mut hits = vec![None; rays.len()];
    bvh.closest_hits(&rays, &mut hits);
    assert!(hits.iter().flatten().all(|hit| (hit.triangle as usize) < once.len()));
}

#[test]
fn no_triangles_and_deep_trees() {
    let rays = fan(Vec3::new(-1.0, 0.2, 0.3), Vec3::ZERO, 1e-3, 20);
    assert_eq!(check(&Bvh::new(Vec::new()), &rays), 0);
    check(&Bvh::new(list()), &rays);
}

proptest! {
    /// Fans of all widths towards any place, at all scales, half of them with an end; and parallel rays.
    #[test]
    fn bundles_find_what_single_rays_find(
        exponent in -6_i32..=6,
        origin in prop::array::uniform3(-3.0_f32..3.0),
        target in prop::array::uniform3(-1.0_f32..1.0),
        apart in 1e-7_f32..0.05,
        count in 1_u8..40,
        end in prop::option::of(0.3_f32..1.5),
        is_parallel in any::<bool>(),
    ) {
        let scale = 10.0_f32.powi(exponent);
        let bvh = Bvh::new(sheet(24, scale));
        let (origin, target) = (scale * Vec3::from(origin), scale * Vec3::from(target));
        prop_assume!((target - origin).length() > 1e-3 * scale);
        let mut rays = fan(origin, target, scale * apart, count);
        let direction = rays[0].direction;
        for (k, ray) in rays.iter_mut().enumerate() {
            if is_parallel {
                *ray = Ray::new(ray.origin + scale * apart * k as f32 * Vec3::X, direction);
            }
            ray.t_max = end.map_or(f32::INFINITY, |share| share * (target - origin).length());
        }
        check(&bvh, &rays);
    }

    /// Towards corners and middles of edges, where single precision cannot tell on which side a ray passes.
    #[test]
    fn bundles_through_edges(
        exponent in -6_i32..=6,
        origin in prop::array::uniform3(-3.0_f32..3.0),
    ) {
        let scale = 10.0_f32.powi(exponent);
        let triangles = sheet(12, scale);
        let bvh = Bvh::new(triangles.clone());
        let origin = scale * Vec3::from(origin);
        for [a, b, _] in triangles {
            let towards = |target: Vec3| Ray::new(origin, target - origin);
            check(&bvh, &[[towards(a); 4], [towards(0.5 * (a + b)); 4]].concat());
        }
    }

    /// Rays that leave a surface in one direction, as those to the sun do: their own triangles are the hardest.
    #[test]
    fn bundles_that_leave_a_surface(
        exponent in -6_i32..=6,
        direction in prop::array::uniform3(-1.0_f32..1.0),
        place in prop::array::uniform2(-0.8_f32..0.8),
    ) {
        let scale = 10.0_f32.powi(exponent);
        let bvh = Bvh::new(sheet(24, scale));
        let direction = Vec3::from(direction);
        prop_assume!(direction.length() > 1e-3);
        let eye = scale * Vec3::new(place[0], place[1], 3.0);
        let seen = fan(eye, scale * Vec3::new(place[0], place[1], 0.0), 0.02 * scale, 16);
        let leave = |ray: &Ray| {
            let point = bvh.surface_point(&bvh.closest_hit(ray)?);
            Some(Ray::new(point.origin_towards(direction), direction))
        };
        let rays: Vec<Ray> = seen.iter().filter_map(leave).collect();
        check(&bvh, &rays);
    }
}

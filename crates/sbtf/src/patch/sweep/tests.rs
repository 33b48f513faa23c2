use super::*;
use crate::patch::test_fields::{bumps, grooves, sinusoid};
use crate::random::Random;
use crate::silhouette::dip_of_cosine;
use glam::{DVec2, DVec3};

/// The least of the definition at the kinks of the profile and at 31 points between them, in double precision.
#[allow(clippy::cast_possible_truncation, reason = "a curvature")]
fn dense(field: &HeightField, uv: Vec2, along: Vec2, kappa: f64) -> f64 {
    let bend = crate::patch::Bend { kappa };
    let size = DVec2::new(field.heights().width() as f64, field.heights().height() as f64);
    let (start, rate) = (DVec2::from(uv) * size - 0.5, DVec2::from(along) * size);
    let mut kinks = vec![0.0];
    for axis in 0..2 {
        let lines =
            (-1500..1500).map(|line| (start[axis].floor() + f64::from(line) - start[axis]) / rate[axis]);
        // Where not even the height 0 would hide a ray that the floor does not.
        let end = 2.0 * f64::from(largest_cosine(kappa as f32, field.depth())).asin() / kappa;
        kinks.extend(lines.filter(|s| *s > 0.0 && *s < end));
    }
    kinks.sort_by(f64::total_cmp);
    let mut least = 1.0_f64;
    for pair in kinks.windows(2) {
        for i in 1..=32 {
            let s = pair[0] + (pair[1] - pair[0]) * f64::from(i) / 32.0;
            let at = DVec2::from(uv) + s * DVec2::from(along);
            let p = bend.point(DVec3::new(s, 0.0, f64::from(field.z((at - at.floor()).as_vec2()))));
            if 0.5 * kappa * s < least.asin() && p.x > 0.0 {
                least = least.min(-p.z / p.x.hypot(p.z));
            }
        }
    }
    least.max(0.0)
}

#[test]
fn agrees_with_the_definition() {
    let mut random = Random::new(1, 2, 3);
    for field in [sinusoid(64, 0.1), grooves(96, 0.2), bumps(128, 0.15)] {
        let sweep = Sweep::new(&field);
        for i in 0..150 {
            let uv = Vec2::new(random.unit(), random.unit());
            let azimuth = if i % 5 == 0 { 0.0 } else { std::f32::consts::TAU * random.unit() };
            let along = Vec2::from_angle(azimuth);
            let kappa = [0.02, 0.3, 1.0, 2.5, 4.9][i % 5];
            let found = sweep.silhouette_cosine(uv, along, kappa);
            let expected = dense(&field, uv, along, f64::from(kappa));
            #[allow(clippy::cast_possible_truncation, reason = "a cosine")]
            let dip = |c: f64| f64::from(dip_of_cosine(c as f32, kappa, field.depth()));
            let above = dip(f64::from(found)) - dip(expected);
            // Heights in f32 with errors of 1e-7, and the height right after the entry over a small distance.
            assert!(above.abs() < 1e-4, "{uv} {along} {kappa}: {found} {expected}, dip off by {above}");
        }
    }
}

#[test]
fn closed_forms() {
    // A lid at the bounding surface hides all; a floor is a cylinder.
    let uv = Vec2::new(0.3, 0.7);
    let lid = Sweep::new(&crate::patch::test_fields::level(1.0, 0.1));
    assert_eq!(lid.silhouette_cosine(uv, Vec2::X, 1.0), 0.0);
    let floor = Sweep::new(&crate::patch::test_fields::level(0.0, 0.1));
    for kappa in [1e-3, 0.1, 1.0, 9.9] {
        let (found, expected) = (floor.silhouette_cosine(uv, Vec2::Y, kappa), largest_cosine(kappa, 0.1));
        assert!((found - expected).abs() < 2e-6, "{kappa}: {found} {expected}");
    }
    for kappa in [0.0, -0.0, -1.0, f32::NAN] {
        assert_eq!(floor.silhouette_cosine(uv, Vec2::Y, kappa), 0.0);
    }
}

#[test]
fn hard_queries_give_cosines() {
    let sweep = Sweep::new(&bumps(64, 0.1));
    for uv in [Vec2::ZERO, Vec2::ONE, Vec2::splat(-1e6), Vec2::splat(1e6), Vec2::new(f32::NAN, 1e30)] {
        for kappa in [f32::MIN_POSITIVE, 1e-30, 1e-6, 9.99, 10.0, 30.0, 1e6] {
            for along in [Vec2::X, Vec2::NEG_Y, Vec2::new(1e-20, 1.0), Vec2::splat(0.5_f32.sqrt())] {
                let cosine = sweep.silhouette_cosine(uv, along, kappa);
                assert!((0.0..=1.0).contains(&cosine), "{uv} {kappa} {along}: {cosine}");
            }
        }
    }
}

//! Sequences that are prepared once against pictures that are prepared one by one.

mod support;

use glam::{Mat3, Vec3};
use osculate_render::{
    Camera, Environment, Frame, Light, Material, RenderOptions, Scene, StopRule, render_frames,
};
use support::{object, plane, run, scene, sphere};

fn lit(direction: Vec3, position: Vec3) -> Scene {
    let objects =
        vec![object(sphere(12), Material::default()), object(plane(3.0, -1.0), Material::default())];
    Scene {
        lights: vec![Light::Directional { direction, irradiance: Vec3::new(2.0, 1.5, 1.0) }],
        environment: Environment::Constant(Vec3::splat(0.2)),
        ..scene(objects, 24, position, Vec3::ZERO, 40.0)
    }
}

/// The same bits, but for the rounding of the light's direction: shadows of the same edges.
#[test]
fn frames_are_the_pictures_that_they_stand_for() {
    let (sun, eye) = (Vec3::new(-1.0, -1.5, -0.5), Vec3::new(0.0, 2.0, 4.0));
    let options = RenderOptions { stop: StopRule::Samples(4), seed: 99, ..RenderOptions::default() };
    let other_eye = Vec3::new(3.0, 1.0, 2.0);
    let camera = |position| Camera::look_at(position, Vec3::ZERO, Vec3::Y, 40.0_f32.to_radians());
    let frames = [(eye, 0.0, 5), (other_eye, 0.0, 5), (eye, 0.7, 5), (eye, 0.0, 6)];
    let made = render_frames(
        &lit(sun, eye),
        &frames.map(|(eye, light_turn, seed)| Frame { camera: camera(eye), light_turn, seed }),
        &options,
        &mut || {},
    )
    .expect("a valid scene");
    for ((eye, turn, seed), frame) in frames.into_iter().zip(&made) {
        let alone = lit(Mat3::from_rotation_y(turn) * sun, eye);
        let alone = run(&alone, &RenderOptions { seed, ..options }).film.radiance();
        let worst = frame
            .film
            .radiance()
            .iter()
            .zip(&alone)
            .map(|(a, b)| (*a - *b).abs().max_element())
            .fold(0.0, f32::max);
        assert!(
            if turn == 0.0 { worst == 0.0 } else { worst < 1e-4 },
            "turned by {turn}, seed {seed}: {worst}"
        );
    }
    // And they differ from each other, so that the comparison means something.
    for other in &made[1..] {
        assert_ne!(made[0].film.radiance(), other.film.radiance());
    }
    assert!(made[1..].iter().all(|m| m.preparation.is_zero()) && !made[0].preparation.is_zero());
}

use std::f32::consts::{FRAC_1_PI, PI, TAU};
use std::sync::Arc;

use super::*;
use crate::micro::{Grid, HeightField, TileMesh};
use crate::patch::test_fields::{bumps, grey, grooves, level, sinusoid, strip};
use crate::patch::{FieldTracer, MeshTracer, Shading, Sweep, TileOptions, TileSurface};
use crate::query::Query;
use crate::silhouette::dip_of_cosine;

fn patch(field: &HeightField, kappa: f32, rotation: f32, shading: Shading) -> Patch {
    let options = TileOptions { shading, largest_curvature: kappa.abs().max(0.1), ..TileOptions::default() };
    Patch::new(Arc::new(TileSurface::from_field(field, &options)), kappa, rotation)
}

fn lambert(bounces: u32) -> Transport {
    Transport::new(TransportOptions { bounces, specular: 0.0 })
}

/// A viewer whose ray runs across the patch.
fn viewer(rotation: f32, cosine: f32) -> Vec3 {
    (-(1.0 - cosine * cosine).sqrt() * Vec2::from_angle(rotation)).extend(cosine)
}

fn sphere(random: &mut Random) -> Vec3 {
    let (z, phi) = (1.0 - 2.0 * random.unit(), TAU * random.unit());
    ((1.0 - z * z).sqrt() * Vec2::from_angle(phi)).extend(z)
}

#[test]
fn a_lambert_plane_is_exact() {
    for height in [1.0, 0.3] {
        let patch = patch(&level(height, 0.1), 0.0, 0.4, Shading::Smooth);
        let mut random = Random::new(1, 1, 1);
        for _ in 0..200 {
            let uv = Vec2::new(random.unit(), random.unit());
            // Under 0.02 normals are bent towards the viewer.
            let cosine = 0.03 + 0.97 * random.unit();
            let wi = sphere(&mut random);
            let wo = viewer(0.4, cosine);
            let found = patch.sample(&lambert(4), uv, wo, wi, &mut random).expect("a plane is hit");
            let expected = 0.5 * FRAC_1_PI * wi.z.max(0.0);
            assert!((found.rgb - expected).abs().max_element() < 1e-6, "{wi}: {} {expected}", found.rgb);
            // The ray meets the plane (1 - height) depth below its entry.
            let run = (1.0 - height) * 0.1 * (1.0 - cosine * cosine).sqrt() / cosine;
            let along = run * Vec2::from_angle(0.4);
            assert!((found.offset - along).length() < 1e-5 * (1.0 + run), "{} {along}", found.offset);
        }
    }
}

/// A white material in a white world is invisible, whatever its shape and bend: the law of energy, over lights from the whole sphere.
#[test]
fn white_furnace() {
    let shapes = [grooves(64, 0.3), sinusoid(32, 0.2), bumps(48, 0.3)];
    for (field, kappa) in shapes.iter().zip([0.0, 2.0, -1.5]) {
        let white = HeightField::new(field.heights().clone(), field.depth(), grey(1.0));
        let patch = patch(&white, kappa, 0.7, Shading::Faceted);
        let transport = lambert(200);
        let mut random = Random::new(2, 2, 2);
        let (mut sum, mut squares, mut count) = (0.0_f64, 0.0_f64, 0.0_f64);
        for _ in 0..10_000 {
            let uv = Vec2::new(random.unit(), random.unit());
            let wo = viewer(0.7, 0.1 + 0.9 * random.unit());
            let wi = sphere(&mut random);
            let Some(sample) = patch.sample(&transport, uv, wo, wi, &mut random) else { continue };
            let value = f64::from(sample.rgb.x * 4.0 * PI);
            (sum, squares, count) = (sum + value, squares + value * value, count + 1.0);
        }
        let mean = sum / count;
        let deviation = ((squares / count - mean * mean) / count).sqrt();
        // Facets are their own shading normals, but for those that the viewer grazes below a cosine of 0.02: bent by 0.02 radians at
        // most they lose (1 - cos 0.02) / 2 = 1e-4 of the light, far below the noise.
        assert!(deviation < 0.03 && (mean - 1.0).abs() < 4.0 * deviation, "{kappa}: {mean} +- {deviation}");
    }
}

/// The mean of so many samples of radiance, under light of radiance 1 from everywhere, and its deviation.
fn furnace(count: u32, mut sample: impl FnMut(Vec3, &mut Random) -> Option<PatchSample>) -> [f64; 2] {
    let (mut random, mut sums, mut found) = (Random::new(8, 8, 8), [0.0_f64; 2], 0.0_f64);
    for _ in 0..count {
        let wi = sphere(&mut random);
        let Some(sample) = sample(wi, &mut random) else { continue };
        let value = f64::from(sample.rgb.x * 4.0 * PI);
        (sums, found) = ([sums[0] + value, sums[1] + value * value], found + 1.0);
    }
    let mean = sums[0] / found;
    [mean, ((sums[1] / found - mean * mean) / found).sqrt()]
}

/// A plane whose shading normals are at an angle to it loses the wedge between both horizons, `(1 - cos t) / 2` of the light, and
/// nothing comes back from the plane.
#[test]
fn light_into_the_plane_is_lost() {
    let angle = 0.9_f32;
    let level = strip(0.1);
    let normals = vec![Vec3::new(0.6 * angle.sin(), 0.8 * angle.sin(), angle.cos()); 4];
    let tilted = TileMesh::new(
        level.positions().to_vec(),
        normals,
        level.triangles().to_vec(),
        level.materials().to_vec(),
        level.depth(),
    );
    let expected = f64::from(0.5 * 0.5 * (1.0 + angle.cos()));
    let transport = lambert(50);
    let options = TileOptions::default();
    let patch = Patch::new(Arc::new(TileSurface::from_mesh(&tilted, &options)), 0.0, 0.0);
    let tracer = MeshTracer::new(&tilted, &options);
    let (uv, wo) = (Vec2::splat(0.5), Vec3::Z);
    let by_patch = furnace(60_000, |wi, random| patch.sample(&transport, uv, wo, wi, random));
    let by_mesh = furnace(60_000, |wi, random| {
        tracer.sample(&transport, &Query { uv, wo, wi, kappa_hat: 0.0 }, 1, random)
    });
    for [mean, deviation] in [by_patch, by_mesh] {
        let agrees = (mean - expected).abs() < 4.0 * deviation;
        assert!(agrees && deviation < 0.01 * expected, "{mean} +- {deviation} for {expected}");
    }
}

/// White saw teeth as wide as two texels, whose central differences vanish: the shading normal is up on slopes of 45 degrees. A first
/// vertex loses `l = (1 - cos 45) / 2` into its slope; what meets another slope goes less than 45 degrees up, `l` again, and may all be
/// lost there.
#[test]
fn light_into_slopes_is_lost() {
    let teeth = Grid::from_fn(4, 4, |p| if (p.x * 4.0).floor() % 2.0 == 0.0 { 1.0 } else { 0.0 });
    let field = HeightField::new(teeth, 0.25, grey(1.0));
    let lost = f64::from(0.5 * (1.0 - std::f32::consts::FRAC_PI_4.cos()));
    let transport = lambert(100);
    let patch = patch(&field, 0.0, 0.0, Shading::Smooth);
    let tracer = FieldTracer::new(&field, Shading::Smooth);
    let at = |random: &mut Random| Vec2::new(random.unit(), random.unit());
    let by_patch =
        furnace(30_000, |wi, random| patch.sample(&transport, at(random), viewer(0.0, 0.6), wi, random));
    let by_march = furnace(30_000, |wi, random| {
        let (uv, wo) = (at(random), viewer(0.0, 0.6));
        tracer.sample(&transport, &Query { uv, wo, wi, kappa_hat: 0.0 }, 1, random)
    });
    for [mean, deviation] in [by_patch, by_march] {
        assert!(deviation < 0.01, "{deviation}");
        let (least, most) = (1.0 - 2.0 * lost - 4.0 * deviation, 1.0 - lost + 4.0 * deviation);
        assert!((least..most).contains(&mean), "{mean} +- {deviation}, lost {lost}");
    }
}

/// In a V-shaped groove the first bounce is known: one side is lit as a plane, the other in the shadow of the edge.
#[test]
fn the_first_bounce_in_a_groove() {
    // Edges at u = 0.5 / 64 and half a tile on, a quarter tile deep in between.
    let (depth, edge) = (0.25, 0.5 / 64.0);
    let patch = patch(&grooves(64, depth), 0.0, 0.0, Shading::Faceted);
    let transport = lambert(1);
    let mut random = Random::new(3, 3, 3);
    for _ in 0..500 {
        let run = 0.01 + 0.48 * random.unit();
        let wi = sphere(&mut random);
        let found =
            patch.sample(&transport, Vec2::new(edge + run, 0.3), Vec3::Z, wi, &mut random).expect("a hit");
        // Slopes are 1: down to the middle, up after it.
        let (side, z) = if run < 0.25 { (1.0, -run) } else { (-1.0, run - 0.5) };
        let normal = Vec3::new(side, 0.0, 1.0).normalize();
        // The other edge is 0.5 - run or run away, at height 0.
        let across = if wi.x > 0.0 { 0.5 - run } else { run };
        let climbs = wi.z / wi.x.abs();
        if (climbs - (-z / across)).abs() < 1e-3 || (run - 0.25).abs() < 1e-3 {
            continue;
        }
        let lit = climbs > -z / across;
        let expected = if lit { 0.6 * FRAC_1_PI * normal.dot(wi).max(0.0) } else { 0.0 };
        assert!((found.rgb.x - expected).abs() < 1e-5, "{run} {wi}: {} {expected}", found.rgb.x);
    }
}

/// A second light path tracer without next-event estimation: it follows paths until they leave, and counts what leaves towards a
/// cone around the light.
#[test]
fn many_bounces_agree_with_paths_that_find_the_light_by_chance() {
    let field = sinusoid(32, 0.3);
    let patch = patch(&field, 1.0, 1.1, Shading::Faceted);
    let (uv, wo) = (Vec2::new(0.4, 0.55), viewer(1.1, 0.5));
    let axis = Vec3::new(0.3, -0.2, 0.5).normalize();
    // Lights are drawn from a cone; the other method counts paths into it.
    let least = 0.8_f32;
    let frame = Frame::new(axis);
    let (mut random, count) = (Random::new(4, 4, 4), 25_000);
    let transport = lambert(4);
    let mut event = [0.0_f64; 2];
    let mut chance = [0.0_f64; 2];
    let entry = Entry::new(&patch, uv, wo);
    let solid_angle = TAU * (1.0 - least);
    for _ in 0..count {
        let z = 1.0 - (1.0 - least) * random.unit();
        let wi =
            frame.world_from_local(((1.0 - z * z).sqrt() * Vec2::from_angle(TAU * random.unit())).extend(z));
        let found = patch.sample(&transport, uv, wo, wi, &mut random).expect("a hit");
        let value = f64::from(found.rgb.x * solid_angle);
        event = [event[0] + value, event[1] + value * value];
        // The cone as seen from the entry point's block.
        let (mut ray, mut weight, mut result) = (entry.ray, 1.0_f32, 0.0_f64);
        for bounce in 0..5 {
            let Trace::Hit(hit) = patch.trace::<false>(&ray) else {
                let shift = patch.shift(ray.block, entry.ray.block);
                let out = patch.bend().direction_seen_from(shift.x, ray.direction.as_dvec3());
                let direction = entry.direction(&patch, axis);
                if bounce > 0 && out.dot(direction) > f64::from(least) {
                    result = f64::from(weight);
                }
                break;
            };
            let lit = LitPatch { patch: &patch, home: entry.ray.block, light: DVec3::Z };
            let vertex = lit.vertex(&ray, &hit, &transport).expect("an area");
            let local = crate::brdf::cosine_hemisphere([random.unit(), random.unit()]);
            let direction = vertex.frame.world_from_local(local);
            if direction.dot(vertex.geometric) < 0.0 {
                break;
            }
            weight *= 0.7;
            ray = lit.ray_from(&vertex.start, direction);
        }
        chance = [chance[0] + result, chance[1] + result * result];
    }
    let n = f64::from(count);
    let [a, b] = [event, chance].map(|[sum, squares]| (sum / n, (squares / n - (sum / n).powi(2)) / n));
    let deviation = (a.1 + b.1).sqrt();
    assert!((a.0 - b.0).abs() < 4.0 * deviation && deviation < 0.04 * a.0, "{} {} +- {deviation}", a.0, b.0);
}

#[test]
fn rays_and_sweep_agree_on_silhouettes() {
    let mut random = Random::new(5, 5, 5);
    for field in [sinusoid(64, 0.1), grooves(64, 0.2), bumps(64, 0.15)] {
        let sweep = Sweep::new(&field);
        for (kappa, rotation) in [(0.2, 0.3), (1.0, 2.0), (2.5, 0.0), (4.5, 5.0)] {
            let patch = patch(&field, kappa, rotation, Shading::Smooth);
            let along = Vec2::from_angle(rotation);
            let (mut differ, count) = (0, 400);
            for _ in 0..count {
                let uv = Vec2::new(random.unit(), random.unit());
                let silhouette = sweep.silhouette_cosine(uv, along, kappa);
                let cosine = crate::silhouette::cosine_of_dip(random.unit(), kappa, field.depth());
                let dip = |c| dip_of_cosine(c, kappa, field.depth());
                // Beyond the triangulation's tolerance in dip, with its cliffs, both must say the same.
                if (dip(cosine) - dip(silhouette)).abs() < 0.02 {
                    continue;
                }
                let hit = patch.hits(uv, viewer(rotation, cosine));
                assert_eq!(hit, patch.first_hit(uv, viewer(rotation, cosine)).is_some());
                differ += u32::from(hit != (cosine >= silhouette));
            }
            assert!(differ == 0, "{kappa} {rotation}: {differ} of {count} differ");
        }
    }
}

#[test]
fn hard_queries_are_finite_and_sensible() {
    let transport = Transport::new(TransportOptions::default());
    let mut random = Random::new(6, 6, 6);
    for kappa in [-9.9, -1.0, -1e-9, 0.0, 1e-9, 0.3, 9.9, 10.0, 25.0] {
        let patch = patch(&bumps(48, 0.1), kappa, 2.2, Shading::Smooth);
        for uv in
            [Vec2::ZERO, Vec2::ONE, Vec2::splat(1e6 + 0.25), Vec2::splat(-1e6), Vec2::new(f32::NAN, 0.5)]
        {
            for cosine in [1.0, 0.5, 1e-3, 1e-6] {
                for wi in [Vec3::Z, Vec3::NEG_Z, Vec3::X, Vec3::new(-0.6, 0.0, -0.8)] {
                    let wo = viewer(2.2, cosine);
                    let found = patch.sample(&transport, uv, wo, wi, &mut random);
                    // Straight down there is always something; on flat and hollow surfaces at any angle.
                    assert!(found.is_some() || cosine < 0.9 && kappa > 0.0, "{kappa} {uv} {cosine}");
                    let Some(found) = found else { continue };
                    assert!(
                        found.offset.is_finite() && found.rgb.is_finite(),
                        "{kappa} {uv} {cosine} {wi}: {found:?}"
                    );
                    assert!(found.rgb.min_element() >= 0.0);
                }
            }
        }
        assert!(patch.sample(&transport, Vec2::ZERO, Vec3::NEG_Z, Vec3::Z, &mut random).is_none());
    }
}

/// Lights below the horizon of the entry point reach what has bent away towards them, and only on convex surfaces.
#[test]
fn lights_below_the_horizon() {
    let field = level(0.0, 0.2);
    let wi = Vec3::new(0.99, 0.0, -0.14).normalize();
    let mut random = Random::new(7, 7, 7);
    let mut seen = |kappa: f32| {
        let patch = patch(&field, kappa, 0.0, Shading::Smooth);
        let mut sum = 0.0;
        for _ in 0..64 {
            let uv = Vec2::new(random.unit(), random.unit());
            sum += patch.sample(&lambert(1), uv, viewer(0.0, 0.6), wi, &mut random).map_or(0.0, |s| s.rgb.x);
        }
        sum / 64.0
    };
    assert_eq!(seen(0.0), 0.0);
    // The ray passes the centre at a distance of 0.8 R, so that it meets the inner circle where the radius to it makes an angle of
    // asin(0.8 R / (R - d)) with it, against asin(0.8) at the entry.
    let kappa = 0.9_f32;
    let theta = (0.8 / (1.0 - 0.2 * kappa)).asin() - 0.8_f32.asin();
    let normal = Vec3::new(theta.sin(), 0.0, theta.cos());
    let expected = 0.5 * FRAC_1_PI * normal.dot(wi).max(0.0);
    let found = seen(kappa);
    assert!(expected > 0.01 && (found - expected).abs() < 0.01 * expected, "{found} {expected}");
}

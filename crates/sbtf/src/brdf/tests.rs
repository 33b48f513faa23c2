use super::*;
use crate::chi_square::p_value;
use crate::random::Random;

fn parameters(metallic: f32, roughness: f32, specular: f32) -> BsdfParameters {
    BsdfParameters { base_color: Vec3::ONE, metallic, roughness, specular }
}

fn direction(cosine: f32) -> Vec3 {
    let sine = (1.0 - cosine * cosine).sqrt();
    Vec3::new(0.6 * sine, 0.8 * sine, cosine)
}

/// Mean of the sample weights: the directional albedo.
#[allow(clippy::cast_possible_truncation, reason = "sample points")]
fn albedo(p: &BsdfParameters, cosine: f32, count: u32) -> f64 {
    let table = EnergyTable::new();
    let bsdf = Bsdf::new(p, &table);
    let mut sum = 0.0;
    for i in 0..count {
        // A lattice in three dimensions (powers of the root of x^4 = x + 1): its error falls almost with the count.
        let point = |root: f64| {
            let x = 0.5 + root * f64::from(i);
            (x - x.floor()) as f32
        };
        let (pick, u) = (point(0.819_172_513_4), [point(0.671_043_606_7), point(0.549_700_477_9)]);
        sum += bsdf.sample(direction(cosine), pick, u, &table).map_or(0.0, |s| f64::from(s.weight.x));
    }
    sum / f64::from(count)
}

#[test]
fn white_furnace() {
    for cosine in [0.05, 0.3, 0.7, 1.0] {
        let lambert = albedo(&parameters(0.0, 0.5, 0.0), cosine, 64);
        assert!((lambert - 1.0).abs() < 1e-6, "Lambert at {cosine}: {lambert}");
        for roughness in [0.1, 0.25, 0.5, 0.8, 1.0] {
            for (metallic, specular) in [(0.0, 0.5), (0.0, 1.0), (1.0, 0.5), (0.5, 0.5)] {
                let found = albedo(&parameters(metallic, roughness, specular), cosine, 1 << 14);
                // The table's error, 0.003 away from grazing angles and 0.02 in its first cell, is all that is lost or won.
                let bound = if cosine < 0.1 { 0.04 } else { 0.006 };
                let case =
                    format!("metallic {metallic} specular {specular} roughness {roughness} cosine {cosine}");
                assert!((found - 1.0).abs() < bound, "{case}: {found}");
            }
        }
    }
}

#[test]
fn layer_is_reciprocal() {
    let table = EnergyTable::new();
    let bsdf = Bsdf::new(&parameters(0.0, 0.4, 0.5), &table);
    let (a, b) = (direction(0.3), Vec3::new(-0.48, 0.36, 0.8));
    let (ab, ba) = (bsdf.eval(a, b, &table).0 / b.z, bsdf.eval(b, a, &table).0 / a.z);
    assert!((ab - ba).length() < 1e-5 * ab.length(), "{ab} {ba}");
}

/// Chi-square of the drawn directions against the density, on a grid of cosine and azimuth.
#[test]
fn samples_follow_the_density() {
    const CELLS: (usize, usize) = (10, 20);
    const COUNT: u32 = 200_000;
    let table = EnergyTable::new();
    for (metallic, roughness, cosine) in [(0.0, 0.3, 0.4), (0.0, 0.7, 0.9), (1.0, 0.4, 0.2), (0.5, 0.5, 1.0)]
    {
        let bsdf = Bsdf::new(&parameters(metallic, roughness, 0.5), &table);
        let wo = direction(cosine);
        let mut observed = vec![0.0_f64; CELLS.0 * CELLS.1];
        let mut lost = 0.0_f64;
        for i in 0..COUNT {
            let mut random = Random::new(5, 1, u64::from(i));
            let (pick, u) = (random.unit(), [random.unit(), random.unit()]);
            match bsdf.sample(wo, pick, u, &table) {
                Some(s) => observed[cell(s.wi, CELLS)] += 1.0,
                None => lost += 1.0,
            }
        }
        let mut expected = vec![0.0_f64; observed.len()];
        const FINE: usize = 40;
        for k in 0..CELLS.0 * FINE * CELLS.1 * FINE {
            let z = ((k % (CELLS.0 * FINE)) as f32 + 0.5) / (CELLS.0 * FINE) as f32;
            let phi = std::f32::consts::TAU * ((k / (CELLS.0 * FINE)) as f32 + 0.5) / (CELLS.1 * FINE) as f32;
            let r = (1.0 - z * z).sqrt();
            let wi = Vec3::new(r * phi.cos(), r * phi.sin(), z);
            let area = std::f64::consts::TAU / (CELLS.0 * FINE * CELLS.1 * FINE) as f64;
            expected[cell(wi, CELLS)] += f64::from(bsdf.eval(wo, wi, &table).1) * area * f64::from(COUNT);
        }
        let total: f64 = expected.iter().sum();
        // Drawn directions below the horizon are lost, and the density integrates to the rest.
        assert!((total + lost - f64::from(COUNT)).abs() < 0.01 * f64::from(COUNT), "{total} + {lost}");
        let p = p_value(&observed, &expected);
        assert!(p > 1e-4, "m {metallic} r {roughness} c {cosine}: {p}");
    }
}

#[allow(clippy::cast_possible_truncation, clippy::cast_sign_loss, reason = "cells of a small grid")]
fn cell(w: Vec3, (rows, columns): (usize, usize)) -> usize {
    let row = ((w.z * rows as f32) as usize).min(rows - 1);
    let turn = w.y.atan2(w.x) / std::f32::consts::TAU;
    let column = (((turn - turn.floor()) * columns as f32) as usize).min(columns - 1);
    row * columns + column
}

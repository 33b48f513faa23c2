//! Heights from normals.

use std::f64::consts::TAU;

use glam::Vec3;
use rustfft::FftPlanner;
use rustfft::num_complex::Complex;

use crate::micro::Grid;

type Spectrum = Vec<Complex<f64>>;

/// Heights in UV units, mean 0, whose slopes are those of the normals in the least squares over a tile that repeats (Frankot and
/// Chellappa 1988, equation 21 with the Fourier basis).
///
/// Slopes that belong to no surface, such as noise, are left out; a mean slope too, which no surface that repeats can have. Frequencies of
/// half the sampling rate along an axis have no slope that the samples could show, and are left out along it.
///
/// # Panics
///
/// If a normal does not point out of the surface.
#[must_use]
pub fn integrate(normals: &Grid<Vec3>) -> Grid<f32> {
    let (width, height) = (normals.width(), normals.height());
    assert!(normals.texels().iter().all(|n| n.z > 0.0), "normals out of the surface");
    let slope = |component: fn(&Vec3) -> f32| -> Spectrum {
        let values = normals.texels().iter().map(|n| -f64::from(component(n)) / f64::from(n.z));
        let mut spectrum = values.map(|x| Complex::new(x, 0.0)).collect();
        transform(&mut spectrum, width, height, Way::Forward);
        spectrum
    };
    let (p, q) = (slope(|n| n.x), slope(|n| n.y));
    let mut z: Spectrum = (0..width * height)
        .map(|i| {
            let (u, v) = (frequency(i % width, width), frequency(i / width, height));
            let squared = u * u + v * v;
            if squared == 0.0 { Complex::ZERO } else { (p[i] * u + q[i] * v) / Complex::new(0.0, squared) }
        })
        .collect();
    transform(&mut z, width, height, Way::Back);
    let scale = 1.0 / (width * height) as f64;
    #[allow(clippy::cast_possible_truncation, reason = "heights become single precision here")]
    let texels = z.iter().map(|c| (c.re * scale) as f32).collect();
    Grid::new(width, height, texels)
}

/// Angular frequency of an entry of the spectrum, per tile.
fn frequency(i: usize, n: usize) -> f64 {
    if 2 * i == n {
        0.0
    } else if 2 * i < n {
        TAU * i as f64
    } else {
        -TAU * (n - i) as f64
    }
}

#[derive(Clone, Copy)]
enum Way {
    Forward,
    Back,
}

/// Fourier transform of rows, then of columns.
fn transform(data: &mut Spectrum, width: usize, height: usize, way: Way) {
    let mut planner = FftPlanner::new();
    let mut plan = |n| match way {
        Way::Forward => planner.plan_fft_forward(n),
        Way::Back => planner.plan_fft_inverse(n),
    };
    plan(width).process(data);
    let mut turned = transposed(data, width, height);
    plan(height).process(&mut turned);
    *data = transposed(&turned, height, width);
}

fn transposed(data: &[Complex<f64>], width: usize, height: usize) -> Spectrum {
    (0..width).flat_map(|x| (0..height).map(move |y| data[y * width + x])).collect()
}

#[cfg(test)]
mod tests {
    use super::*;
    use glam::Vec2;

    #[test]
    fn waves_come_back_exactly() {
        // Sizes that are no power of two, odd and even.
        let (width, height) = (45, 34);
        let phase = |p: Vec2| std::f32::consts::TAU * (3.0 * p.x - 2.0 * p.y);
        let surface = Grid::from_fn(width, height, |p| 0.02 * phase(p).sin());
        let normals = Grid::from_fn(width, height, |p| {
            let slope = 0.02 * std::f32::consts::TAU * phase(p).cos();
            Vec3::new(-3.0 * slope, 2.0 * slope, 1.0).normalize()
        });
        let z = integrate(&normals);
        for (a, b) in z.texels().iter().zip(surface.texels()) {
            // Single-precision normals of slope about 0.4: relative 1e-6 of the height.
            assert!((a - b).abs() < 2e-7, "{a} {b}");
        }
    }

    #[test]
    fn a_constant_slope_cannot_repeat() {
        let tilted = Grid::new(8, 8, vec![Vec3::new(0.3, 0.0, 1.0).normalize(); 64]);
        assert!(integrate(&tilted).texels().iter().all(|z| z.abs() < 1e-7));
    }
}

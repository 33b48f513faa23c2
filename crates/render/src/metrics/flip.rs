//! FLIP: the difference that a viewer sees who flips between two pictures.
//!
//! Andersson, Nilsson, Akenine-Möller, Oskarsson, Åström, Fairchild, "FLIP: A Difference Evaluator for Alternating Images", HPG 2020,
//! for pictures of low dynamic range. Symbols and constants are the paper's.

use glam::{Mat3, Vec3};

use super::Image;
use super::filter::{Plane, gaussian, offsets};
use osculate_sbtf::colour::linear_from_srgb;

/// How pictures are looked at.
#[derive(Debug, Clone, Copy, PartialEq)]
pub struct FlipOptions {
    /// Pixels per degree of visual angle. Default 67.02: 0.7 m from a screen 0.7 m and 3840 pixels wide.
    pub pixels_per_degree: f32,
}

impl Default for FlipOptions {
    fn default() -> Self {
        Self { pixels_per_degree: 3840.0 * std::f32::consts::PI / 180.0 }
    }
}

/// Mean difference over all pixels, in `[0, 1]`; 0 for equal pictures.
///
/// # Panics
///
/// If the pictures differ in size.
#[must_use]
pub fn flip(reference: &Image, test: &Image, options: &FlipOptions) -> f64 {
    let map = flip_map(reference, test, options);
    map.iter().map(|&e| f64::from(e)).sum::<f64>() / map.len() as f64
}

/// The difference at every pixel, in `[0, 1]`, row by row from the top.
///
/// # Panics
///
/// If the pictures differ in size.
#[must_use]
pub fn flip_map(reference: &Image, test: &Image, options: &FlipOptions) -> Vec<f32> {
    assert_eq!(reference.size(), test.size(), "pictures of one size");
    let opponents = [reference, test].map(Opponent::new);
    let [a, b] = opponents.each_ref().map(|o| o.perceived(options.pixels_per_degree));
    let [fa, fb] = opponents.each_ref().map(|o| o.features(options.pixels_per_degree));
    let colour = a.iter().zip(&b).map(|(&a, &b)| colour_difference(a, b));
    let feature = fa.iter().zip(&fb).map(|(a, b)| {
        let largest = (a[0] - b[0]).abs().max((a[1] - b[1]).abs());
        (largest * std::f32::consts::FRAC_1_SQRT_2).sqrt()
    });
    colour.zip(feature).map(|(colour, feature)| colour.powf(1.0 - feature)).collect()
}

/// A picture in the linear opponent space `YCxCz`.
struct Opponent {
    planes: [Plane; 3],
}

impl Opponent {
    fn new(picture: &Image) -> Self {
        let to_opponent = |p: Vec3| ycxcz_from_linear(Vec3::from(p.to_array().map(linear_from_srgb)));
        Self { planes: [0, 1, 2].map(|k| picture.plane(|p| to_opponent(p)[k])) }
    }

    /// Filters by the contrast sensitivity of the eye; CIELAB with Hunt's adjustment.
    fn perceived(&self, pixels_per_degree: f32) -> Vec<Vec3> {
        let mut filtered: [Vec<f32>; 3] = Default::default();
        for (k, plane) in self.planes.iter().enumerate() {
            filtered[k] = sensitivity(plane, SENSITIVITY[k], pixels_per_degree);
        }
        (0..filtered[0].len())
            .map(|i| {
                let linear = linear_from_ycxcz(Vec3::new(filtered[0][i], filtered[1][i], filtered[2][i]));
                hunt_lab(linear.clamp(Vec3::ZERO, Vec3::ONE))
            })
            .collect()
    }

    /// Strength of edges and of points in the luminance.
    fn features(&self, pixels_per_degree: f32) -> Vec<[f32; 2]> {
        // The width of a feature in degrees.
        const W: f32 = 0.082;
        let sigma = 0.5 * W * pixels_per_degree;
        let radius = radius_of(sigma);
        let smooth = super::filter::normalised(gaussian(sigma, radius));
        let edge = halves_normalised(offsets(radius).zip(&smooth).map(|(x, g)| -x * g).collect());
        let point = halves_normalised(
            offsets(radius).zip(&smooth).map(|(x, g)| (x * x / (sigma * sigma) - 1.0) * g).collect(),
        );
        let luminance: Vec<f32> = self.planes[0].values().iter().map(|y| (y + 16.0) / 116.0).collect();
        let luminance = Plane::new(self.planes[0].width(), luminance);
        let strength = |kernel: &[f32]| -> Vec<f32> {
            let (x, y) = (luminance.filtered(kernel, &smooth), luminance.filtered(&smooth, kernel));
            x.values().iter().zip(y.values()).map(|(x, y)| x.hypot(*y)).collect()
        };
        strength(&edge).into_iter().zip(strength(&point)).map(|(e, p)| [e, p]).collect()
    }
}

/// Two Gaussians `a sqrt(pi / b) exp(-pi^2 d^2 / b)` for each of achromatic, red-green and blue-yellow: `[a1, b1, a2, b2]`.
const SENSITIVITY: [[f32; 4]; 3] =
    [[1.0, 0.0047, 0.0, 1e-5], [1.0, 0.0053, 0.0, 1e-5], [34.1, 0.04, 13.5, 0.025]];

/// Standard deviation in degrees of a Gaussian with this `b`.
fn degrees(b: f32) -> f32 {
    (0.5 * b).sqrt() / std::f32::consts::PI
}

#[allow(clippy::cast_possible_truncation, clippy::cast_sign_loss, reason = "a few pixels")]
fn radius_of(sigma: f32) -> usize {
    (3.0 * sigma).ceil() as usize
}

fn sensitivity(plane: &Plane, [a1, b1, a2, b2]: [f32; 4], pixels_per_degree: f32) -> Vec<f32> {
    // One radius for all, that of the widest.
    let radius = radius_of(degrees(0.04) * pixels_per_degree);
    let term = |a: f32, b: f32| {
        let kernel = gaussian(degrees(b) * pixels_per_degree, radius);
        let sum: f32 = kernel.iter().sum();
        let scale = a * (std::f32::consts::PI / b).sqrt();
        (scale * sum * sum, plane.filtered(&kernel, &kernel), scale)
    };
    let terms = [term(a1, b1), term(a2, b2)];
    let total: f32 = terms.iter().map(|t| t.0).sum();
    (0..plane.values().len())
        .map(|i| terms.iter().map(|(_, filtered, scale)| scale * filtered.values()[i]).sum::<f32>() / total)
        .collect()
}

/// Scales the positive entries to sum 1, and the negative ones to -1.
fn halves_normalised(mut kernel: Vec<f32>) -> Vec<f32> {
    let half = |keep: fn(&f32) -> bool| kernel.iter().copied().filter(keep).sum::<f32>().abs();
    let (positive, negative) = (half(|k| *k > 0.0), half(|k| *k < 0.0));
    kernel.iter_mut().for_each(|k| *k /= if *k > 0.0 { positive } else { negative });
    kernel
}

/// Rec. 709 primaries, rows X, Y, Z; exact fractions as the paper's implementation has them.
fn xyz_from_linear(rgb: Vec3) -> Vec3 {
    Mat3::from_cols(
        Vec3::new(10_135_552.0 / 24_577_794.0, 2_613_072.0 / 12_288_897.0, 1_425_312.0 / 73_733_382.0),
        Vec3::new(8_788_810.0 / 24_577_794.0, 8_788_810.0 / 12_288_897.0, 8_788_810.0 / 73_733_382.0),
        Vec3::new(4_435_075.0 / 24_577_794.0, 887_015.0 / 12_288_897.0, 70_074_185.0 / 73_733_382.0),
    ) * rgb
}

fn linear_from_xyz(xyz: Vec3) -> Vec3 {
    let inverse =
        Mat3::from_cols(xyz_from_linear(Vec3::X), xyz_from_linear(Vec3::Y), xyz_from_linear(Vec3::Z))
            .inverse();
    inverse * xyz
}

fn white() -> Vec3 {
    xyz_from_linear(Vec3::ONE)
}

fn ycxcz_from_linear(rgb: Vec3) -> Vec3 {
    let p = xyz_from_linear(rgb) / white();
    Vec3::new(116.0 * p.y - 16.0, 500.0 * (p.x - p.y), 200.0 * (p.y - p.z))
}

fn linear_from_ycxcz(c: Vec3) -> Vec3 {
    let y = (c.x + 16.0) / 116.0;
    linear_from_xyz(Vec3::new(y + c.y / 500.0, y, y - c.z / 200.0) * white())
}

/// CIELAB, chroma scaled with lightness after Hunt.
fn hunt_lab(rgb: Vec3) -> Vec3 {
    const DELTA: f32 = 6.0 / 29.0;
    let f = |t: f32| if t > DELTA.powi(3) { t.cbrt() } else { t / (3.0 * DELTA * DELTA) + 4.0 / 29.0 };
    let p = xyz_from_linear(rgb) / white();
    let (x, y, z) = (f(p.x), f(p.y), f(p.z));
    let lightness = 116.0 * y - 16.0;
    Vec3::new(lightness, 0.01 * lightness * 500.0 * (x - y), 0.01 * lightness * 200.0 * (y - z))
}

fn hyab(a: Vec3, b: Vec3) -> f32 {
    (a.x - b.x).abs() + (a.y - b.y).hypot(a.z - b.z)
}

/// The difference of two colours, compressed so that most of `[0, 1]` is for small ones.
fn colour_difference(a: Vec3, b: Vec3) -> f32 {
    const Q: f32 = 0.7;
    const P_C: f32 = 0.4;
    const P_T: f32 = 0.95;
    let largest = hyab(hunt_lab(Vec3::Y), hunt_lab(Vec3::Z)).powf(Q);
    let power = hyab(a, b).powf(Q);
    let knee = P_C * largest;
    if power < knee { P_T / knee * power } else { P_T + (power - knee) / (largest - knee) * (1.0 - P_T) }
}

#[cfg(test)]
mod tests {
    use super::*;

    const SIZE: (usize, usize) = (48, 32);

    /// The pictures of `tools/reference/flip_values.py`.
    fn pictures() -> [Image; 2] {
        let picture = |centre: f32, line: f32, blue: f32| {
            let pixel = |i: usize| {
                let (x, y) = ((i % SIZE.0) as f32, (i / SIZE.0) as f32);
                let disk = if (x - centre).powi(2) + (y - 14.0).powi(2) < 64.0 { 0.6 } else { 0.0 };
                let line = if x == 40.0 { line } else { 0.0 };
                Vec3::new(x / SIZE.0 as f32, 0.2 + disk + line, blue * y / SIZE.1 as f32)
            };
            Image::new(SIZE.0, SIZE.1, (0..SIZE.0 * SIZE.1).map(pixel))
        };
        [picture(20.0, 0.0, 1.0), picture(22.0, 0.3, 0.9)]
    }

    #[test]
    fn agrees_with_the_authors_implementation() {
        let [reference, test] = pictures();
        let map = flip_map(&reference, &test, &FlipOptions::default());
        // flip-evaluator 1.7 computes in f32 too, in another order.
        for ((x, y), expected) in
            [((12, 14), 0.829_848), ((29, 14), 0.961_754), ((40, 5), 0.357_396), ((3, 30), 0.299_397)]
        {
            let found = map[y * SIZE.0 + x];
            assert!((found - expected).abs() < 2e-4, "{x} {y}: {found} instead of {expected}");
        }
        let mean = flip(&reference, &test, &FlipOptions::default());
        assert!((mean - 0.273_889).abs() < 1e-4, "{mean}");
    }

    #[test]
    fn equal_pictures_and_opposites() {
        let [reference, _] = pictures();
        assert_eq!(flip(&reference, &reference, &FlipOptions::default()), 0.0);
        let flat = |c: Vec3| Image::new(24, 24, [c; 576]);
        // The definition makes green against blue the largest difference.
        let worst = flip(&flat(Vec3::Y), &flat(Vec3::Z), &FlipOptions::default());
        assert!((worst - 1.0).abs() < 1e-3, "{worst}");
    }
}

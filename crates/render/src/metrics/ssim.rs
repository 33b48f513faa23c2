//! Structural similarity.

use super::Image;
use super::filter::{gaussian, normalised};

/// Mean structural similarity over pixels and components, in `[-1, 1]`; 1 for equal pictures.
///
/// Wang, Bovik, Sheikh, Simoncelli, "Image quality assessment: from error visibility to structural similarity", IEEE TIP 13(4),
/// 2004: a Gaussian window of 11 pixels and sigma 1.5, `K1 = 0.01`, `K2 = 0.03`, range 1.
///
/// # Panics
///
/// If the pictures differ in size.
#[must_use]
pub fn ssim(reference: &Image, test: &Image) -> f64 {
    const C1: f64 = 0.01 * 0.01;
    const C2: f64 = 0.03 * 0.03;
    assert_eq!(reference.size(), test.size(), "pictures of one size");
    let window = normalised(gaussian(1.5, 5));
    let mut sum = 0.0;
    for component in 0..3 {
        let (a, b) = (reference.plane(|p| p[component]), test.plane(|p| p[component]));
        let product = |f: fn(f32, f32) -> f32| {
            let values = a.values().iter().zip(b.values()).map(|(&x, &y)| f(x, y)).collect();
            super::filter::Plane::new(reference.width, values).filtered(&window, &window)
        };
        let means = [product(|x, _| x), product(|_, y| y)];
        let squares = [product(|x, _| x * x), product(|_, y| y * y), product(|x, y| x * y)];
        for i in 0..reference.pixels.len() {
            let [ma, mb] = [0, 1].map(|k| f64::from(means[k].values()[i]));
            let [saa, sbb, sab] = [0, 1, 2].map(|k| f64::from(squares[k].values()[i]));
            let (va, vb, covariance) = (saa - ma * ma, sbb - mb * mb, sab - ma * mb);
            sum +=
                (2.0 * ma * mb + C1) * (2.0 * covariance + C2) / ((ma * ma + mb * mb + C1) * (va + vb + C2));
        }
    }
    sum / (3 * reference.pixels.len()) as f64
}

#[cfg(test)]
mod tests {
    use glam::Vec3;

    use super::*;

    #[test]
    fn equal_pictures_and_a_change_of_brightness() {
        let ramp =
            |scale: f32| Image::new(32, 32, (0..1024).map(|i| Vec3::splat(scale * (i % 32) as f32 / 32.0)));
        assert!((ssim(&ramp(1.0), &ramp(1.0)) - 1.0).abs() < 1e-12);
        // Constant pictures differ in the first factor only: (2 a b + C1) / (a^2 + b^2 + C1).
        let flat = |value: f32| Image::new(16, 16, [Vec3::splat(value); 256]);
        let expected = (2.0 * 0.4 * 0.6 + 1e-4) / (0.16 + 0.36 + 1e-4);
        assert!((ssim(&flat(0.4), &flat(0.6)) - expected).abs() < 1e-4);
    }
}

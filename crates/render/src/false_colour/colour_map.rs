//! Colour maps, interpolated in a perceptual space (Ottosson's Oklab, 2020).

use glam::Vec3;

use osculate_sbtf::colour::linear_from_srgb;

/// How numbers become colours.
#[derive(Debug, Clone, Copy, PartialEq, Eq, Default)]
pub enum ColourMap {
    /// Blue for negative, white at 0, red for positive.
    #[default]
    Diverging,
    /// Dark violet over green to yellow (the colours of viridis) for magnitudes.
    Sequential,
}

const DIVERGING: [[u8; 3]; 7] = [
    [22, 62, 143],
    [58, 118, 196],
    [150, 192, 228],
    [247, 246, 244],
    [244, 177, 144],
    [214, 92, 72],
    [150, 18, 40],
];

const SEQUENTIAL: [[u8; 3]; 9] = [
    [68, 1, 84],
    [71, 44, 122],
    [59, 81, 139],
    [44, 113, 142],
    [33, 144, 141],
    [39, 173, 129],
    [92, 200, 99],
    [170, 220, 50],
    [253, 231, 37],
];

impl ColourMap {
    /// Linear RGB for a position in `[0, 1]`; positions outside take the colour of the end.
    #[must_use]
    pub fn colour(self, position: f32) -> Vec3 {
        let stops: &[[u8; 3]] = match self {
            Self::Diverging => &DIVERGING,
            Self::Sequential => &SEQUENTIAL,
        };
        let scaled = position.clamp(0.0, 1.0) * (stops.len() - 1) as f32;
        #[allow(clippy::cast_possible_truncation, clippy::cast_sign_loss, reason = "clamped into the table")]
        let cell = (scaled as usize).min(stops.len() - 2);
        let oklab = |i: usize| {
            oklab_from_linear(Vec3::from(stops[i].map(|c| linear_from_srgb(f32::from(c) / 255.0))))
        };
        linear_from_oklab(oklab(cell).lerp(oklab(cell + 1), scaled - cell as f32))
            .clamp(Vec3::ZERO, Vec3::ONE)
    }
}

fn oklab_from_linear(c: Vec3) -> Vec3 {
    let l = Vec3::new(0.412_221_47, 0.536_332_54, 0.051_445_995).dot(c).cbrt();
    let m = Vec3::new(0.211_903_5, 0.680_699_5, 0.107_396_96).dot(c).cbrt();
    let s = Vec3::new(0.088_302_46, 0.281_718_84, 0.629_978_7).dot(c).cbrt();
    let lms = Vec3::new(l, m, s);
    Vec3::new(
        Vec3::new(0.210_454_26, 0.793_617_8, -0.004_072_047).dot(lms),
        Vec3::new(1.977_998_5, -2.428_592_2, 0.450_593_7).dot(lms),
        Vec3::new(0.025_904_037, 0.782_771_77, -0.808_675_77).dot(lms),
    )
}

fn linear_from_oklab(lab: Vec3) -> Vec3 {
    let l = Vec3::new(1.0, 0.396_337_78, 0.215_803_76).dot(lab).powi(3);
    let m = Vec3::new(1.0, -0.105_561_346, -0.063_854_17).dot(lab).powi(3);
    let s = Vec3::new(1.0, -0.089_484_18, -1.291_485_5).dot(lab).powi(3);
    let lms = Vec3::new(l, m, s);
    Vec3::new(
        Vec3::new(4.076_741_7, -3.307_711_6, 0.230_969_93).dot(lms),
        Vec3::new(-1.268_438, 2.609_757_4, -0.341_319_4).dot(lms),
        Vec3::new(-0.004_196_086_3, -0.703_418_6, 1.707_614_7).dot(lms),
    )
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn lightness_is_monotonic_and_the_middle_is_neutral() {
        let lightness = |map: ColourMap, i: i16| oklab_from_linear(map.colour(f32::from(i) / 60.0)).x;
        for i in 0..60 {
            assert!(lightness(ColourMap::Sequential, i + 1) > lightness(ColourMap::Sequential, i), "{i}");
            let (near, far) = (lightness(ColourMap::Diverging, i), lightness(ColourMap::Diverging, i + 1));
            assert!(if i < 30 { far > near } else { far < near }, "{i}: {near} {far}");
        }
        let middle = oklab_from_linear(ColourMap::Diverging.colour(0.5));
        assert!(middle.y.abs() < 0.01 && middle.z.abs() < 0.01, "{middle}");
    }
}

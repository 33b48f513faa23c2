//! What a [`Model`] answers: the scalar definition that training and the compiled kernels are held against.
//!
//! Plain loops in the order of the equations; [`infer`](crate::infer) is the fast way to the same numbers.

use glam::{Vec2, Vec3};

use super::{CurvatureInput, FeatureTexture, Mlp, Model, OffsetForm, OpacityHead, STEEPEST_RAY, azimuth};
use crate::query::{Answer, Query, SeeThrough, SilhouetteBtf};
use crate::silhouette::{cosine_of_dip, largest_cosine};

/// Largest output of the colour network that counts: beyond it `exp` leaves f32.
pub const LARGEST_LOG: f32 = 88.0;

/// `x` in `[low, high]`; NaN becomes `low`, where `clamp` would keep it.
#[must_use]
#[inline(always)]
#[allow(clippy::manual_clamp, reason = "for NaN")]
pub fn bounded(x: f32, low: f32, high: f32) -> f32 {
    x.max(low).min(high)
}

/// The position inside a tile, in `[0, 1]`; 0 for what is not finite.
///
/// f32 keeps it to 2^-24 of the distance from the origin: at tile 1e6, to 1/16.
#[must_use]
#[inline(always)]
pub fn inside_tile(x: f32) -> f32 {
    if x.is_finite() { x - x.floor() } else { 0.0 }
}

impl FeatureTexture {
    /// Bilinear features at a point, one per channel. UV that are not finite look up the corner.
    #[must_use]
    #[allow(
        clippy::cast_possible_truncation,
        clippy::cast_sign_loss,
        reason = "wrapped into the texture first"
    )]
    pub fn lookup(&self, uv: Vec2) -> Vec<f32> {
        let axis = |x: f32, n: usize| {
            let position = inside_tile(x) * n as f32 - 0.5;
            let first = position.floor();
            let low = if first < 0.0 { n - 1 } else { (first as usize).min(n - 1) };
            (low, (low + 1) % n, position - first)
        };
        let (x0, x1, fx) = axis(uv.x, self.shape.width);
        let (y0, y1, fy) = axis(uv.y, self.shape.height);
        let at = |x, y, c| self.texels[(y * self.shape.width + x) * self.shape.channels + c];
        let mix = |a: f32, b: f32, f: f32| a + (b - a) * f;
        let row = |y, c| mix(at(x0, y, c), at(x1, y, c), fx);
        (0..self.shape.channels).map(|c| mix(row(y0, c), row(y1, c), fy)).collect()
    }
}

impl Mlp {
    /// The outputs for these inputs.
    ///
    /// # Panics
    ///
    /// If there are not as many inputs as the first layer has.
    #[must_use]
    pub fn forward(&self, inputs: &[f32]) -> Vec<f32> {
        let mut values = inputs.to_vec();
        for (index, layer) in self.layers.iter().enumerate() {
            assert_eq!(values.len(), layer.inputs, "inputs of layer {index}");
            let output = |(row, bias): (&[f32], &f32)| {
                let sum = row.iter().zip(&values).fold(*bias, |sum, (w, x)| sum + w * x);
                if index + 1 < self.layers.len() { sum.max(0.0) } else { sum }
            };
            values = layer.weights.chunks_exact(layer.inputs).zip(&layer.biases).map(output).collect();
        }
        values
    }
}

impl Model {
    /// Texture coordinates of the hit, from those of the entry point inside its tile: where the colour is looked up.
    #[must_use]
    pub fn hit_uv(&self, uv: Vec2, wo: Vec3, kappa_hat: f32) -> Vec2 {
        let uv = uv.map(inside_tile);
        let kappa_hat = self.architecture.clamp_curvature(kappa_hat);
        let step = azimuth(wo) * self.architecture.way_length(self.architecture.offset_way, wo, kappa_hat);
        let mut inputs = self.offset.texture.taps(uv, step, &self.architecture.offset_taps);
        inputs.extend([wo.x, wo.y]);
        self.push_curvature(&mut inputs, kappa_hat);
        let output = self.offset.mlp.forward(&inputs);
        match self.architecture.offset {
            OffsetForm::Free => uv + Vec2::new(output[0], output[1]),
            OffsetForm::AlongRay => uv - wo.truncate() * (output[0] / wo.z.max(STEEPEST_RAY)),
            OffsetForm::AlongReach => uv + step * output[0],
        }
    }

    fn rgb(&self, hit_uv: Vec2, wo: Vec3, wi: Vec3, kappa_hat: f32) -> Vec3 {
        let mut inputs = self.colour.texture.lookup(hit_uv);
        inputs.extend([wi.x, wi.y, wi.z, wo.x, wo.y]);
        self.push_curvature(&mut inputs, kappa_hat);
        let output = self.colour.mlp.forward(&inputs);
        Vec3::from_slice(&output).map(|x| bounded(x, 0.0, LARGEST_LOG).exp_m1())
    }

    fn push_curvature(&self, inputs: &mut Vec<f32>, kappa_hat: f32) {
        if self.architecture.curvature == CurvatureInput::Given {
            inputs.push(self.architecture.encode_curvature(kappa_hat));
        }
    }
}

impl FeatureTexture {
    /// Features at the taps, tap by tap: at `uv + step * fraction`.
    fn taps(&self, uv: Vec2, step: Vec2, fractions: &[f32]) -> Vec<f32> {
        fractions.iter().flat_map(|&fraction| self.lookup(uv + step * fraction)).collect()
    }
}

impl SilhouetteBtf for Model {
    fn eval(&self, query: &Query) -> Answer {
        let alpha = self.alpha(query.uv, query.wo, query.kappa_hat);
        if alpha == 0.0 {
            return Answer::default();
        }
        let kappa_hat = self.architecture.clamp_curvature(query.kappa_hat);
        let hit_uv = self.hit_uv(query.uv, query.wo, kappa_hat);
        Answer { rgb: self.rgb(hit_uv, query.wo, query.wi, kappa_hat), alpha }
    }

    fn see_through(&self) -> SeeThrough {
        self.architecture.opacity.see_through()
    }

    fn uses_curvature(&self) -> bool {
        self.architecture.uses_curvature()
    }

    fn opaque_from(&self) -> f32 {
        self.architecture.opaque_from()
    }

    fn alpha(&self, uv: Vec2, wo: Vec3, kappa_hat: f32) -> f32 {
        let architecture = &self.architecture;
        // NaN looks at the back too.
        if wo.z.is_nan() || wo.z <= 0.0 {
            return 0.0;
        }
        let Some(module) = &self.opacity else { return 1.0 };
        let kappa_hat = architecture.clamp_curvature(kappa_hat);
        let largest = largest_cosine(kappa_hat, architecture.depth);
        // No dip is deeper than the material, so that this needs no network.
        if architecture.opacity == OpacityHead::Silhouette && wo.z >= largest {
            return 1.0;
        }
        let (uv, along) = (uv.map(inside_tile), azimuth(wo));
        let step = along * architecture.way_length(architecture.opacity_way, wo, kappa_hat);
        let mut inputs = module.texture.taps(uv, step, &architecture.opacity_taps);
        match architecture.opacity {
            OpacityHead::Silhouette => inputs.extend([along.x, along.y]),
            OpacityHead::Direct | OpacityHead::Opaque => inputs.extend([wo.x, wo.y]),
        }
        self.push_curvature(&mut inputs, kappa_hat);
        let output = module.mlp.forward(&inputs)[0];
        match architecture.opacity {
            OpacityHead::Silhouette => {
                let cosine = cosine_of_dip(bounded(output, 0.0, 1.0), kappa_hat, architecture.depth);
                f32::from(u8::from(wo.z >= cosine))
            }
            OpacityHead::Direct | OpacityHead::Opaque => bounded(output, 0.0, 1.0),
        }
    }
}

//! [`Architecture`]: the form of a model, without its numbers.

use serde::{Deserialize, Serialize};

use crate::query::SeeThrough;
use crate::silhouette::largest_cosine;

/// The form of a model.
///
/// Inputs of the networks, in this order:
///
/// | network | inputs |
/// |---|---|
/// | opacity, silhouette head | features of every tap, tap by tap; azimuth of `wo` (unit, x and y); curvature |
/// | opacity, direct head | features of every tap, tap by tap; `wo.x`, `wo.y`; curvature |
/// | offset | features of every tap, tap by tap; `wo.x`, `wo.y`; curvature |
/// | colour | features at the offset position; `wi.x`, `wi.y`, `wi.z`; `wo.x`, `wo.y`; curvature |
///
/// The curvature input is [`Architecture::encode_curvature`], one number, left out with [`CurvatureInput::Absent`].
/// Hidden layers end in a rectifier, the outputs linear.
#[derive(Debug, Clone, PartialEq, Serialize, Deserialize)]
pub struct Architecture {
    /// Depth of the material in UV units.
    pub depth: f32,
    /// Range of `kappa_hat` that the training covers; queries outside are clamped to it, and reported.
    pub kappa_range: [f32; 2],
    /// How opacity is predicted.
    pub opacity: OpacityHead,
    /// How the offset is predicted.
    pub offset: OffsetForm,
    /// Whether the networks know the curvature.
    pub curvature: CurvatureInput,
    /// Where the opacity network's features are fetched: fractions of the length of [`Self::opacity_way`] along the azimuth of `wo`, away from
    /// the viewer. `[0]` is the paper's form.
    pub opacity_taps: Vec<f32>,
    /// Where the offset network's features are fetched: fractions of the length of [`Self::offset_way`]. `[0]` is the paper's form.
    pub offset_taps: Vec<f32>,
    /// The way along which [`Self::opacity_taps`] lie; [`Way::Graze`] where a file does not say.
    #[serde(default = "Way::graze", skip_serializing_if = "Way::is_graze")]
    pub opacity_way: Way,
    /// The way along which [`Self::offset_taps`] lie; [`Way::Descend`] where a file does not say.
    #[serde(default = "Way::descend", skip_serializing_if = "Way::is_descend")]
    pub offset_way: Way,
    /// Feature texture of the opacity module.
    pub opacity_texture: TextureShape,
    /// Feature texture of the offset module.
    pub offset_texture: TextureShape,
    /// Feature texture of the colour module.
    pub colour_texture: TextureShape,
    /// Neurons of a hidden layer.
    pub width: usize,
    /// Number of hidden layers.
    pub hidden_layers: usize,
}

/// How opacity is predicted (paper, section 4.3).
#[derive(Debug, Clone, Copy, PartialEq, Eq, Serialize, Deserialize)]
#[serde(rename_all = "kebab-case")]
pub enum OpacityHead {
    /// One output, the [dip](crate::silhouette) in depths; opaque where `cos_o` is at least the cosine of that dip. For height fields.
    Silhouette,
    /// One output, the opacity itself. For see-through materials.
    Direct,
    /// No opacity module: always opaque, as NeuMIP has it.
    Opaque,
}

impl OpacityHead {
    /// What this form says of the opacity by itself.
    #[must_use]
    pub fn see_through(self) -> SeeThrough {
        match self {
            Self::Silhouette => SeeThrough::WhereConvex,
            Self::Direct => SeeThrough::Anywhere,
            Self::Opaque => SeeThrough::Nowhere,
        }
    }
}

/// How the offset is predicted.
#[derive(Debug, Clone, Copy, PartialEq, Eq, Serialize, Deserialize)]
#[serde(rename_all = "kebab-case")]
pub enum OffsetForm {
    /// Two outputs, the offset itself (paper, eq. 6).
    Free,
    /// One output, a depth: the offset is that times `-wo.xy / max(wo.z, 0.05)` (NeuMIP, section 4.2).
    AlongRay,
    /// One output, a share of [`Architecture::offset_way`] in the direction of the
    /// ray: what is left to learn once direction and length of the way are known. Materials whose rays leave their plane need
    /// [`Free`](Self::Free).
    AlongReach,
}

/// Along which stretch of the surface features are fetched; [`Architecture::way_length`] has the lengths.
#[derive(Debug, Clone, Copy, PartialEq, Eq, Serialize, Deserialize)]
#[serde(rename_all = "kebab-case")]
pub enum Way {
    /// What a ray passes over that dips to the full depth, whatever the ray's own elevation: for the silhouette head, which
    /// asks about all elevations at once.
    Graze,
    /// What the ray passes over before it is `depth` below a flat surface or, if that is shorter, leaves the circle.
    Descend,
    /// What the ray passes over before it leaves the layer that the material lies in, below or above, with the curvature:
    /// whether a see-through material stops it is decided there and nowhere else.
    Through,
}

impl Way {
    fn graze() -> Self {
        Self::Graze
    }

    fn is_graze(&self) -> bool {
        *self == Self::Graze
    }

    fn descend() -> Self {
        Self::Descend
    }

    fn is_descend(&self) -> bool {
        *self == Self::Descend
    }
}

/// Whether the networks know the curvature.
#[derive(Debug, Clone, Copy, PartialEq, Eq, Serialize, Deserialize)]
#[serde(rename_all = "kebab-case")]
pub enum CurvatureInput {
    /// They do.
    Given,
    /// They do not, as in NeuMIP.
    Absent,
}

/// Size of a feature texture.
#[derive(Debug, Clone, Copy, PartialEq, Eq, Serialize, Deserialize)]
pub struct TextureShape {
    /// Texels along u.
    pub width: usize,
    /// Texels along v.
    pub height: usize,
    /// Features per texel.
    pub channels: usize,
}

impl TextureShape {
    /// A square texture.
    #[must_use]
    pub fn square(size: usize, channels: usize) -> Self {
        Self { width: size, height: size, channels }
    }

    /// Numbers in the texture.
    #[must_use]
    pub fn len(&self) -> usize {
        self.width * self.height * self.channels
    }

    /// Whether it holds no number.
    #[must_use]
    pub fn is_empty(&self) -> bool {
        self.len() == 0
    }
}

/// Longest distance at which opacity features are fetched, in UV units.
pub const LONGEST_REACH: f32 = 2.0;

impl Architecture {
    /// The form that measured best: ten taps for the opacity. They reach beyond 1, since the ray that just passes touches the
    /// inner circle half-way; what stands at the entry point itself matters least (`docs/training.md` has the figures).
    #[must_use]
    pub fn taps(depth: f32) -> Self {
        let opacity_taps = vec![0.05, 0.12, 0.2, 0.3, 0.4, 0.5, 0.62, 0.75, 0.9, 1.1];
        let offset_taps = vec![0.0, 0.1, 0.22, 0.35, 0.5, 0.7, 1.0];
        Self { opacity_taps, offset_taps, offset: OffsetForm::AlongReach, ..Self::paper(depth) }
    }

    /// The form for see-through materials: the direct head, and all features along the ray's way through the material.
    #[must_use]
    pub fn see_through(depth: f32) -> Self {
        let form = Self::taps(depth).with_direct_head();
        let offset_taps = vec![0.0, 0.12, 0.25, 0.38, 0.5, 0.62, 0.75, 0.88, 1.0];
        Self { offset_taps, offset_way: Way::Through, width: 32, ..form }
    }

    /// The same with the direct head, whose features lie along the ray's way through the material: whether the ray is stopped depends
    /// on what is at both ends of it as much as between.
    #[must_use]
    pub fn with_direct_head(self) -> Self {
        let opacity_taps =
            vec![0.0, 0.06, 0.14, 0.22, 0.3, 0.38, 0.46, 0.54, 0.62, 0.7, 0.78, 0.86, 0.94, 1.0];
        Self { opacity: OpacityHead::Direct, opacity_taps, opacity_way: Way::Through, ..self }
    }

    /// The paper's form: features at the entry point only.
    #[must_use]
    pub fn paper(depth: f32) -> Self {
        Self {
            depth,
            kappa_range: [-2.5, 2.5],
            opacity: OpacityHead::Silhouette,
            offset: OffsetForm::Free,
            curvature: CurvatureInput::Given,
            opacity_taps: vec![0.0],
            offset_taps: vec![0.0],
            opacity_way: Way::Graze,
            offset_way: Way::Descend,
            opacity_texture: TextureShape::square(256, 8),
            offset_texture: TextureShape::square(256, 8),
            colour_texture: TextureShape::square(256, 8),
            width: 24,
            hidden_layers: 3,
        }
    }

    /// NeuMIP without its pyramid (Kuznetsov et al., "NeuMIP: multi-resolution neural materials", ACM TOG 40(4), 2021): no
    /// curvature, no opacity, offset along the ray.
    #[must_use]
    pub fn neumip(depth: f32) -> Self {
        Self {
            opacity: OpacityHead::Opaque,
            offset: OffsetForm::AlongRay,
            curvature: CurvatureInput::Absent,
            ..Self::paper(depth)
        }
    }

    /// The curvature as networks see it: odd, steep at 0, within `[-1, 1]` inside the trained range. The square root makes the
    /// distances that grazing rays travel, which go with its inverse, change evenly.
    #[must_use]
    #[inline]
    pub fn encode_curvature(&self, kappa_hat: f32) -> f32 {
        let largest = self.kappa_range[0].abs().max(self.kappa_range[1].abs());
        (kappa_hat.abs() / largest).sqrt().copysign(kappa_hat)
    }

    /// Whether any answer of a model of this form depends on the curvature: through a network's input, the silhouette, or the length of the
    /// way along which features are fetched or offsets point.
    #[must_use]
    pub fn uses_curvature(&self) -> bool {
        let apart = |taps: &[f32]| taps.iter().any(|&fraction| fraction != 0.0);
        let opacity = match self.opacity {
            OpacityHead::Silhouette => true,
            OpacityHead::Direct => apart(&self.opacity_taps),
            OpacityHead::Opaque => false,
        };
        let offset = self.offset == OffsetForm::AlongReach || apart(&self.offset_taps);
        self.curvature == CurvatureInput::Given || opacity || offset
    }

    /// See [`SilhouetteBtf::opaque_from`](crate::SilhouetteBtf::opaque_from). No dip is deeper than the material and no curvature counts for
    /// more than the largest of training, so that rays which come steeper than [`largest_cosine`] of both hit.
    #[must_use]
    pub fn opaque_from(&self) -> f32 {
        /// The cosine grows with the curvature but for the last digits of its product and root.
        const ROUNDING: f32 = 1.0 + 1e-6;
        match self.opacity {
            OpacityHead::Silhouette => ROUNDING * largest_cosine(self.kappa_range[1], self.depth),
            OpacityHead::Direct => f32::INFINITY,
            OpacityHead::Opaque => 0.0,
        }
    }

    /// Number of curvature inputs, 0 or 1.
    #[must_use]
    #[inline]
    pub fn curvature_inputs(&self) -> usize {
        usize::from(self.curvature == CurvatureInput::Given)
    }

    /// Inputs of the opacity network.
    #[must_use]
    pub fn opacity_inputs(&self) -> usize {
        self.opacity_taps.len() * self.opacity_texture.channels + 2 + self.curvature_inputs()
    }

    /// Inputs of the offset network.
    #[must_use]
    pub fn offset_inputs(&self) -> usize {
        self.offset_taps.len() * self.offset_texture.channels + 2 + self.curvature_inputs()
    }

    /// Outputs of the offset network.
    #[must_use]
    pub fn offset_outputs(&self) -> usize {
        match self.offset {
            OffsetForm::Free => 2,
            OffsetForm::AlongRay | OffsetForm::AlongReach => 1,
        }
    }

    /// Inputs of the colour network.
    #[must_use]
    pub fn colour_inputs(&self) -> usize {
        self.colour_texture.channels + 5 + self.curvature_inputs()
    }

    /// Sizes of the layers of a network with so many inputs and outputs: inputs, hidden layers, outputs.
    #[must_use]
    pub fn layer_sizes(&self, inputs: usize, outputs: usize) -> Vec<usize> {
        let hidden = std::iter::repeat_n(self.width, self.hidden_layers);
        std::iter::once(inputs).chain(hidden).chain([outputs]).collect()
    }
}

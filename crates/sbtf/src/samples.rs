//! Batches of training samples, as structures of arrays, and the trait that makes them.
//!
//! Opacity and appearance are separate streams. Opacity depends on neither the light nor the transport below the surface, so
//! that its samples cost a hundredth of the others, and silhouettes need more of them; appearance is sampled only where a
//! ray hits.

use std::ops::Range;

use crate::model::TextureShape;

/// Samples of the opacity: all rows have one length.
#[derive(Debug, Clone, Default, PartialEq)]
pub struct OpacityBatch {
    /// Texture coordinates of the entry points.
    pub uv: [Vec<f32>; 2],
    /// Unit directions to the viewer, `wo.z > 0`.
    pub wo: [Vec<f32>; 3],
    /// Curvature along the ray, in 1/UV units.
    pub kappa_hat: Vec<f32>,
    /// The smallest `cos_o` at which a ray of this azimuth still hits, in `[0, 1)`; NaN where the opacity is no step function
    /// of `cos_o` or is not known.
    pub silhouette_cosine: Vec<f32>,
    /// Opacity for `wo`.
    pub alpha: Vec<f32>,
}

/// Samples of the appearance, of rays that hit: all rows have one length.
#[derive(Debug, Clone, Default, PartialEq)]
pub struct AppearanceBatch {
    /// Texture coordinates of the entry points.
    pub uv: [Vec<f32>; 2],
    /// Unit directions to the viewer, `wo.z > 0`.
    pub wo: [Vec<f32>; 3],
    /// Unit directions to the light, from the whole sphere.
    pub wi: [Vec<f32>; 3],
    /// Curvature along the ray, in 1/UV units.
    pub kappa_hat: Vec<f32>,
    /// Texture coordinates of the first hit less those of the entry point.
    pub offset: [Vec<f32>; 2],
    /// An unbiased estimate of [`Answer::rgb`](crate::Answer::rgb).
    pub rgb: [Vec<f32>; 3],
}

/// A batch of either kind.
pub(crate) trait Rows: Default + Send + Sync {
    /// Gives all rows this length.
    fn resize(&mut self, count: usize);
    /// Takes rows over from another batch, to the same places.
    fn copy_rows(&mut self, from: &Self, rows: Range<usize>);
}

macro_rules! rows {
    ($batch:ty, arrays: $($array:ident)*, single: $($row:ident)*) => {
        impl $batch {
            /// Number of samples.
            #[must_use]
            pub fn len(&self) -> usize {
                self.kappa_hat.len()
            }

            /// Whether there is no sample.
            #[must_use]
            pub fn is_empty(&self) -> bool {
                self.len() == 0
            }

            /// Gives all rows this length; new entries are zero.
            pub fn resize(&mut self, count: usize) {
                $(self.$array.iter_mut().for_each(|row| row.resize(count, 0.0));)*
                $(self.$row.resize(count, 0.0);)*
            }

        }

        impl Rows for $batch {
            fn resize(&mut self, count: usize) {
                self.resize(count);
            }

            fn copy_rows(&mut self, from: &Self, rows: Range<usize>) {
                $(for (to, from) in self.$array.iter_mut().zip(&from.$array) {
                    to[rows.clone()].copy_from_slice(&from[rows.clone()]);
                })*
                $(self.$row[rows.clone()].copy_from_slice(&from.$row[rows.clone()]);)*
            }
        }
    };
}
rows!(OpacityBatch, arrays: uv wo, single: kappa_hat silhouette_cosine alpha);
rows!(AppearanceBatch, arrays: uv wo wi offset rgb, single: kappa_hat);

/// Makes training samples, the same ones for the same seed and index whatever thread asks.
pub trait SampleSource: Sync {
    /// Fills the whole batch, of the length that it has, with the `index`-th samples of the stream.
    fn fill_opacity(&self, index: u64, batch: &mut OpacityBatch);

    /// Fills the whole batch, of the length that it has, with the `index`-th samples of the stream.
    fn fill_appearance(&self, index: u64, batch: &mut AppearanceBatch);

    /// Features that a texture of this shape may begin with, texel by texel in rows; `None` if nothing is known of the material but
    /// samples. Channels beyond what is known are noise from `seed`.
    fn first_features(&self, which: Features, shape: TextureShape, seed: u64) -> Option<Vec<f32>> {
        let _ = (which, shape, seed);
        None
    }
}

/// What features are for.
#[derive(Debug, Clone, Copy, PartialEq, Eq)]
pub enum Features {
    /// Where a ray hits, and whether.
    Rays,
    /// How light is reflected there.
    Colour,
}

//! [`PackedTexture`]: a feature texture laid out for the kernels.

use super::aligned::Aligned;
use super::kernels::{BLOCK, GROUP};
use super::lane_math::{LARGEST_INTEGER, small_integer};
use super::stored::{StoredTexture, Texels};
use crate::model::inside_tile;

/// A feature texture in groups of eight channels, each `[height, width + 1, 8]`. Rows end with a copy of their first texel, so that two
/// neighbours are one load.
#[derive(Debug)]
pub(super) struct PackedTexture {
    pub texels: PackedTexels,
    /// Features; those that fill up the last group are zero.
    pub channels: usize,
    /// Numbers in a group.
    pub group_stride: usize,
    /// Feature = offset + scale * number, per channel, filled up to whole groups.
    pub scale: Vec<f32>,
    pub offset: Vec<f32>,
    width: u32,
    height: u32,
}

/// The numbers of a texture.
#[derive(Debug)]
pub(super) enum PackedTexels {
    F32(Aligned<f32>),
    /// Bits of halves.
    F16(Aligned<u16>),
    U8(Aligned<u8>),
}

/// Numbers between neighbouring texels of a group.
#[allow(clippy::cast_possible_truncation, reason = "it is 8")]
const GROUP_STEP: u32 = GROUP as u32;

/// Where points lie between texels.
#[derive(Debug, Clone)]
pub(super) struct Corners<const N: usize = BLOCK> {
    /// Index of the left texel in the lower and in the upper row; the right one is [`GROUP`] further.
    pub rows: [[u32; N]; 2],
    /// Position between left and right, lower and upper, in `[0, 1)`.
    pub fractions: [[f32; N]; 2],
}

/// Where one point lies between texels; see [`Corners`].
#[derive(Debug, Clone, Copy)]
pub(super) struct Corner {
    pub rows: [u32; 2],
    pub fractions: [f32; 2],
}

impl<const N: usize> Corners<N> {
    /// Those of one point.
    #[inline(always)]
    pub fn of(&self, point: usize) -> Corner {
        Corner {
            rows: [self.rows[0][point], self.rows[1][point]],
            fractions: [self.fractions[0][point], self.fractions[1][point]],
        }
    }
}

impl PackedTexture {
    /// Packs a texture.
    ///
    /// # Panics
    ///
    /// If the texture is empty, so large that an index leaves 32 bits, or over four million texels wide or high.
    #[allow(clippy::cast_possible_truncation, reason = "checked first")]
    pub fn new(texture: &StoredTexture) -> Self {
        let shape = texture.shape;
        let group_stride = (shape.width + 1) * shape.height * GROUP;
        let largest = shape.width.max(shape.height);
        assert!(!shape.is_empty() && group_stride <= i32::MAX as usize, "a texture of a sensible size");
        assert!(largest <= LARGEST_INTEGER as usize, "a texture of sensible sides");
        let groups = shape.channels.div_ceil(GROUP);
        let filled = |values: &[f32]| {
            let mut all = vec![0.0; groups * GROUP];
            all[..values.len()].copy_from_slice(values);
            all
        };
        let plain = || (filled(&vec![1.0; shape.channels]), filled(&[]));
        let (texels, (scale, offset)) = match &texture.texels {
            Texels::F32(texels) => (PackedTexels::F32(pack(texels, texture)), plain()),
            Texels::F16(texels) => {
                let bits: Vec<u16> = texels.iter().map(|x| x.to_bits()).collect();
                (PackedTexels::F16(pack(&bits, texture)), plain())
            }
            Texels::U8 { codes, scale, offset } => {
                (PackedTexels::U8(pack(codes, texture)), (filled(scale), filled(offset)))
            }
        };
        let (width, height) = (shape.width as u32, shape.height as u32);
        Self { texels, channels: shape.channels, group_stride, scale, offset, width, height }
    }

    /// Where points lie. Any coordinates, wrapped; those that are not finite are at the corner.
    #[inline(always)]
    pub fn corners<const N: usize>(&self, u: &[f32; N], v: &[f32; N]) -> Corners<N> {
        let mut corners = Corners { rows: [[0; N]; 2], fractions: [[0.0; N]; 2] };
        let pitch = self.width + 1;
        for k in 0..N {
            let (column, x) = axis(u[k], self.width);
            let (row, y) = axis(v[k], self.height);
            let above = if row + 1 == self.height { 0 } else { row + 1 };
            corners.rows[0][k] = (row * pitch + column) * GROUP_STEP;
            corners.rows[1][k] = (above * pitch + column) * GROUP_STEP;
            corners.fractions[0][k] = x;
            corners.fractions[1][k] = y;
        }
        corners
    }

    /// Bytes of the texels.
    pub fn bytes(&self) -> usize {
        match &self.texels {
            PackedTexels::F32(texels) => size_of_val::<[f32]>(texels),
            PackedTexels::F16(texels) => size_of_val::<[u16]>(texels),
            PackedTexels::U8(texels) => texels.len(),
        }
    }
}

/// The texel on the low side of a coordinate, and the position between it and the next.
#[inline(always)]
#[allow(
    clippy::cast_possible_truncation,
    clippy::cast_sign_loss,
    clippy::cast_possible_wrap,
    reason = "sides are at most LARGEST_INTEGER"
)]
fn axis(x: f32, n: u32) -> (u32, f32) {
    let position = inside_tile(x) * n as f32 - 0.5;
    let first = position.floor();
    let last = n as i32 - 1;
    let low = small_integer(first);
    let low = if low < 0 { last } else { low.min(last) };
    (low as u32, position - first)
}

fn pack<T: Copy + Default>(texels: &[T], texture: &StoredTexture) -> Aligned<T> {
    let shape = texture.shape;
    assert_eq!(texels.len(), shape.len(), "one number per texel and channel");
    let groups = shape.channels.div_ceil(GROUP);
    let mut packed = vec![T::default(); groups * (shape.width + 1) * shape.height * GROUP];
    let mut to = packed.chunks_exact_mut(GROUP);
    for group in 0..groups {
        let first = group * GROUP;
        let last = (first + GROUP).min(shape.channels);
        for row in 0..shape.height {
            for column in (0..shape.width).chain([0]) {
                let texel = (row * shape.width + column) * shape.channels;
                if let Some(to) = to.next() {
                    to[..last - first].copy_from_slice(&texels[texel + first..texel + last]);
                }
            }
        }
    }
    Aligned::new(&packed)
}

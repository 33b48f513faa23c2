//! [`PackedTexture`]: a feature texture laid out for the kernels.

use super::aligned::Aligned;
use super::kernels::{BLOCK, GROUP, Row};
use super::lane_math::{LARGEST_INTEGER, inside_tile, small_integer};
use super::stored::{StoredTexture, Texels};

/// A feature texture in groups of eight channels, each `[height, width + 1, 8]`. Rows end with a copy of their first texel, so that two
/// neighbours are one load.
#[derive(Debug)]
pub(super) struct PackedTexture {
    pub texels: PackedTexels,
    /// Features; those that fill up the last group are zero.
    pub channels: usize,
    /// Bytes of a group.
    pub group_bytes: usize,
    /// Feature = offset + scale * number, per channel, filled up to whole groups.
    pub scale: Vec<f32>,
    pub offset: Vec<f32>,
    width: u32,
    height: u32,
    /// Bytes of a texel of a group.
    step: u32,
    /// Bytes of a row of a group.
    pitch: u32,
}

/// The numbers of a texture.
#[derive(Debug)]
pub(super) enum PackedTexels {
    F32(Aligned<f32>),
    /// Bits of halves.
    F16(Aligned<u16>),
    U8(Aligned<u8>),
}

impl PackedTexels {
    /// The first byte.
    #[inline(always)]
    pub fn start(&self) -> *const u8 {
        match self {
            Self::F32(texels) => texels.as_ptr().cast(),
            Self::F16(texels) => texels.as_ptr().cast(),
            Self::U8(texels) => texels.as_ptr(),
        }
    }

    /// Bytes of a number.
    fn number_bytes(&self) -> usize {
        match self {
            Self::F32(_) => 4,
            Self::F16(_) => 2,
            Self::U8(_) => 1,
        }
    }
}

/// Where points lie between texels.
#[derive(Debug, Clone)]
pub(super) struct Corners<const N: usize = BLOCK> {
    /// Bytes from the start of a group to the left texel in the lower and in the upper row; the right one follows.
    pub rows: [[u32; N]; 2],
    /// Position between left and right, lower and upper, in `[0, 1)`.
    pub fractions: [[f32; N]; 2],
}

/// The same of a block of queries, kept elsewhere.
#[derive(Debug, Clone, Copy)]
pub(super) struct Places<'a> {
    pub rows: &'a TexelRows,
    pub fractions: &'a [Row; 2],
    /// What will be fetched next from the texture, if it is known and worth asking for now.
    pub next: Option<&'a TexelRows>,
}

/// Bytes from the start of a group to the left texels of a block's queries, in the lower and in the upper row.
pub(super) type TexelRows = [[u32; BLOCK]; 2];

impl Places<'_> {
    /// Those of one query.
    #[inline(always)]
    pub fn of(self, query: usize) -> Corner {
        Corner {
            rows: [self.rows[0][query], self.rows[1][query]],
            fractions: [self.fractions[0][query], self.fractions[1][query]],
        }
    }
}

/// Where one point lies between texels; see [`Corners`].
#[derive(Debug, Clone, Copy)]
pub(super) struct Corner {
    pub rows: [u32; 2],
    pub fractions: [f32; 2],
}

impl Corners {
    /// As places, of which none is known to be next.
    #[inline(always)]
    pub fn places(&self) -> Places<'_> {
        Places { rows: &self.rows, fractions: &self.fractions, next: None }
    }
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
    /// If the texture is empty, has groups of more than 4 GB, or is over four million texels wide or high.
    #[allow(clippy::cast_possible_truncation, reason = "checked first")]
    pub fn new(texture: &StoredTexture) -> Self {
        let shape = texture.shape;
        let largest = shape.width.max(shape.height);
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
        let step = GROUP * texels.number_bytes();
        let pitch = (shape.width + 1) * step;
        let group_bytes = pitch * shape.height;
        assert!(!shape.is_empty() && u32::try_from(group_bytes).is_ok(), "a texture of a sensible size");
        let (step, pitch) = (step as u32, pitch as u32);
        Self { texels, channels: shape.channels, group_bytes, scale, offset, width, height, step, pitch }
    }

    /// Where points lie. Any coordinates, wrapped; those that are not finite are at the corner.
    #[inline(always)]
    pub fn corners<const N: usize>(&self, u: &[f32; N], v: &[f32; N]) -> Corners<N> {
        let mut corners = Corners { rows: [[0; N]; 2], fractions: [[0.0; N]; 2] };
        let last = self.height - 1;
        // From the last row to the first it is back, which wraps around as it should.
        let back = 0_u32.wrapping_sub(last * self.pitch);
        for k in 0..N {
            let (column, x) = axis(u[k], self.width);
            let (row, y) = axis(v[k], self.height);
            let lower = row * self.pitch + column * self.step;
            let up = if row == last { back } else { self.pitch };
            corners.rows[0][k] = lower;
            corners.rows[1][k] = lower.wrapping_add(up);
            corners.fractions[0][k] = x;
            corners.fractions[1][k] = y;
        }
        corners
    }

    /// Scale and offset of a channel, one that fills up the last group too.
    #[inline(always)]
    pub fn decode(&self, channel: usize) -> [f32; 2] {
        [self.scale[channel], self.offset[channel]]
    }

    /// Bytes of a texel of a group and its right neighbour.
    #[inline(always)]
    pub fn pair_bytes(&self) -> usize {
        2 * self.step as usize
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
    reason = "sides are at most LARGEST_INTEGER"
)]
fn axis(x: f32, n: u32) -> (u32, f32) {
    let position = inside_tile(x) * n as f32 - 0.5;
    let first = position.floor();
    // Left of the first texel is the last: -1 is the largest number of all without a sign.
    let low = (small_integer(first) as u32).min(n - 1);
    (low, position - first)
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

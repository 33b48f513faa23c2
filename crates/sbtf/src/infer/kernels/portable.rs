//! The portable kernels, and the twins that test the others.

use half::f16;

use super::super::ahead::Ahead;
use super::super::packed_texture::{Corner, PackedTexels, PackedTexture, Places};
use super::tile::{self, Vector};
use super::{BLOCK, Buffers, GROUP, Isa, PackedMlp, Row, column};

/// No particular instructions.
#[derive(Debug, Clone, Copy)]
pub struct Portable;

impl<const N: usize> Vector for [f32; N] {
    const LANES: usize = N;
    type Half = Self;

    #[inline(always)]
    unsafe fn half(self) -> Self {
        self
    }

    #[inline(always)]
    unsafe fn splat(x: f32) -> Self {
        [x; N]
    }

    #[inline(always)]
    unsafe fn load(from: *const f32) -> Self {
        // SAFETY: the caller vouches for N numbers; arrays of f32 are aligned as f32 is.
        unsafe { from.cast::<Self>().read() }
    }

    #[inline(always)]
    unsafe fn store(self, to: *mut f32) {
        // SAFETY: as in `load`.
        unsafe { to.cast::<Self>().write(self) }
    }

    // Not fused: without the instruction that is a call of a library function.
    #[inline(always)]
    unsafe fn plus_product(self, a: Self, b: Self) -> Self {
        std::array::from_fn(|k| self[k] + a[k] * b[k])
    }

    #[inline(always)]
    unsafe fn add(self, other: Self) -> Self {
        std::array::from_fn(|k| self[k] + other[k])
    }

    #[inline(always)]
    unsafe fn bring_near(_: *const u8) {}

    #[inline(always)]
    unsafe fn rectified(self) -> Self {
        self.map(|x| if x > 0.0 { x } else { 0.0 })
    }
}

impl Isa for Portable {
    #[inline(always)]
    fn forward_block(self, mlp: &PackedMlp, buffers: Buffers<'_, Row>, ahead: &mut Ahead<'_>) {
        // SAFETY: arrays need no particular instructions.
        unsafe { tile::forward_block::<[f32; 4], 6>(mlp, buffers, ahead) }
    }

    #[inline(always)]
    fn forward_one(self, mlp: &PackedMlp, buffers: Buffers<'_, f32>) {
        // SAFETY: arrays need no particular instructions.
        unsafe { column::forward_one::<[f32; GROUP]>(mlp, buffers) }
    }

    #[inline(always)]
    fn forward_two(self, mlps: [&PackedMlp; 2], buffers: [Buffers<'_, f32>; 2]) {
        // SAFETY: arrays need no particular instructions.
        unsafe { column::forward_two::<[f32; GROUP]>(mlps, buffers) }
    }

    #[inline(always)]
    fn fetch_block(self, texture: &PackedTexture, places: Places<'_>, rows: &mut [Row]) {
        #[allow(clippy::needless_range_loop, reason = "the rows are columns here")]
        for query in 0..BLOCK {
            fetch(texture, places.of(query), |channel, feature| rows[channel][query] = feature);
        }
    }

    #[inline(always)]
    fn fetch_one(self, texture: &PackedTexture, corner: Corner, features: &mut [f32]) {
        fetch(texture, corner, |channel, feature| features[channel] = feature);
    }
}

/// Calls `put` with every channel and its feature.
fn fetch(texture: &PackedTexture, corner: Corner, put: impl FnMut(usize, f32)) {
    match &texture.texels {
        PackedTexels::F32(texels) => fetch_from(texture, texels, |&x| x, corner, put),
        PackedTexels::F16(texels) => {
            fetch_from(texture, texels, |&x| f16::from_bits(x).to_f32(), corner, put);
        }
        PackedTexels::U8(texels) => fetch_from(texture, texels, |&x| f32::from(x), corner, put),
    }
}

fn fetch_from<T>(
    texture: &PackedTexture,
    texels: &[T],
    value: impl Fn(&T) -> f32,
    corner: Corner,
    mut put: impl FnMut(usize, f32),
) {
    let index = |bytes: usize| bytes / size_of::<T>();
    let ([row0, row1], [fx, fy]) = (corner.rows.map(|row| index(row as usize)), corner.fractions);
    for channel in 0..texture.channels {
        let group = index(channel / GROUP * texture.group_bytes) + channel % GROUP;
        let at = |index: usize| value(&texels[group + index]);
        let down = |index: usize| at(row0 + index) + (at(row1 + index) - at(row0 + index)) * fy;
        let (left, right) = (down(0), down(GROUP));
        let mixed = left + (right - left) * fx;
        put(channel, texture.offset[channel] + texture.scale[channel] * mixed);
    }
}

//! Networks over a block: register tiles of a few outputs by a few registers of queries.

use super::super::ahead::Ahead;
use super::super::packed_mlp::{PackedLayer, PackedMlp};
use super::{BLOCK, Buffers, Row};

/// A register of `LANES` numbers.
///
/// # Safety
///
/// Methods may only be called where the processor has the instructions behind them, pointers must be valid for `LANES` numbers.
pub(super) trait Vector: Copy {
    const LANES: usize;
    /// A register of half as many lanes, where it is worth while.
    type Half: Vector;
    const HAS_HALF: bool = false;
    /// The first lanes.
    unsafe fn half(self) -> Self::Half;
    unsafe fn splat(x: f32) -> Self;
    unsafe fn load(from: *const f32) -> Self;
    unsafe fn store(self, to: *mut f32);
    /// `self + a * b`.
    unsafe fn plus_product(self, a: Self, b: Self) -> Self;
    unsafe fn add(self, other: Self) -> Self;
    /// Asks for a cache line that is wanted later. Any address will do.
    unsafe fn bring_near(address: *const u8);
    /// The larger of it and 0; 0 for NaN.
    unsafe fn rectified(self) -> Self;
}

/// Registers of queries per tile.
const WIDE: usize = 2;

/// A network over a block of queries, in tiles of `TILE` outputs.
///
/// # Safety
///
/// The processor has the instructions of `V`.
#[inline(always)]
pub(super) unsafe fn forward_block<V: Vector, const TILE: usize>(
    mlp: &PackedMlp,
    buffers: Buffers<'_, Row>,
    ahead: &mut Ahead<'_>,
) {
    let Buffers { a, b, c } = buffers;
    let last = mlp.layers.len() - 1;
    for (index, layer) in mlp.layers.iter().enumerate() {
        let (from, to): (&[Row], &mut [Row]) = match index {
            0 => (a, b),
            i if i % 2 == 1 => (b, c),
            _ => (c, b),
        };
        assert!(layer.inputs <= from.len() && layer.outputs <= to.len(), "rows for every neuron");
        // SAFETY: the rows were just checked; the caller vouches for the instructions.
        unsafe {
            if index == last {
                layer_block::<V, TILE, false>(mlp, layer, from, to, ahead);
            } else {
                layer_block::<V, TILE, true>(mlp, layer, from, to, ahead);
            }
        }
    }
}

#[inline(always)]
unsafe fn layer_block<V: Vector, const TILE: usize, const RECTIFIED: bool>(
    mlp: &PackedMlp,
    layer: &PackedLayer,
    from: &[Row],
    to: &mut [Row],
    ahead: &mut Ahead<'_>,
) {
    let mut first = 0;
    while first < layer.outputs {
        let left = layer.outputs - first;
        // SAFETY: forwarded from the caller; `first + N` is at most the number of outputs.
        unsafe {
            first += match left {
                _ if left >= TILE => tiles::<V, TILE, RECTIFIED>(mlp, layer, first, from, to, ahead),
                6.. => tiles::<V, 6, RECTIFIED>(mlp, layer, first, from, to, ahead),
                4.. => tiles::<V, 4, RECTIFIED>(mlp, layer, first, from, to, ahead),
                3 => tiles::<V, 3, RECTIFIED>(mlp, layer, first, from, to, ahead),
                2 => tiles::<V, 2, RECTIFIED>(mlp, layer, first, from, to, ahead),
                _ => tiles::<V, 1, RECTIFIED>(mlp, layer, first, from, to, ahead),
            };
        }
    }
}

/// Outputs `first..first + N` of a layer for the whole block; returns `N`.
#[inline(always)]
unsafe fn tiles<V: Vector, const N: usize, const RECTIFIED: bool>(
    mlp: &PackedMlp,
    layer: &PackedLayer,
    first: usize,
    from: &[Row],
    to: &mut [Row],
    ahead: &mut Ahead<'_>,
) -> usize {
    let numbers = mlp.numbers();
    debug_assert!(layer.weights + layer.inputs * layer.stride <= numbers.len());
    // SAFETY: a packed layer lies inside the numbers of its network.
    let (weights, biases) =
        unsafe { (numbers.as_ptr().add(layer.weights + first), numbers.as_ptr().add(layer.biases + first)) };
    for query in (0..BLOCK).step_by(WIDE * V::LANES) {
        // SAFETY: rows have BLOCK numbers, and BLOCK is a multiple of the tile's width; the caller checked the number of rows.
        unsafe {
            let mut sums = [[V::splat(0.0); WIDE]; N];
            for (k, sum) in sums.iter_mut().enumerate() {
                *sum = [V::splat(*biases.add(k)); WIDE];
            }
            let mut x = from.as_ptr().cast::<f32>().add(query);
            let mut w = weights;
            let soon = ahead.take(layer.inputs);
            for input in 0..layer.inputs {
                soon.each(input, |address| V::bring_near(address));
                let values: [V; WIDE] = [V::load(x), V::load(x.add(V::LANES))];
                for (k, sum) in sums.iter_mut().enumerate() {
                    let weight = V::splat(*w.add(k));
                    *sum = [sum[0].plus_product(weight, values[0]), sum[1].plus_product(weight, values[1])];
                }
                x = x.add(BLOCK);
                w = w.add(layer.stride);
            }
            for (k, sum) in sums.iter().enumerate() {
                let y = to.as_mut_ptr().cast::<f32>().add((first + k) * BLOCK + query);
                for (register, &value) in sum.iter().enumerate() {
                    let value = if RECTIFIED { value.rectified() } else { value };
                    value.store(y.add(register * V::LANES));
                }
            }
        }
    }
    N
}

//! The matrix products: register tiles of a few outputs by a few registers of queries, or of many outputs for one query.

use super::super::packed_mlp::{PackedLayer, PackedMlp};
use super::{BLOCK, Buffers, Row};

/// A register of `LANES` numbers.
///
/// # Safety
///
/// Methods may only be called where the processor has the instructions behind them, pointers must be valid for `LANES` numbers.
pub(super) trait Vector: Copy {
    const LANES: usize;
    unsafe fn splat(x: f32) -> Self;
    unsafe fn load(from: *const f32) -> Self;
    unsafe fn store(self, to: *mut f32);
    /// `self + a * b`.
    unsafe fn plus_product(self, a: Self, b: Self) -> Self;
    unsafe fn add(self, other: Self) -> Self;
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
pub(super) unsafe fn forward_block<V: Vector, const TILE: usize>(mlp: &PackedMlp, buffers: Buffers<'_, Row>) {
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
                layer_block::<V, TILE, false>(mlp, layer, from, to);
            } else {
                layer_block::<V, TILE, true>(mlp, layer, from, to);
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
) {
    let mut first = 0;
    while first < layer.outputs {
        let left = layer.outputs - first;
        // SAFETY: forwarded from the caller; `first + N` is at most the number of outputs.
        unsafe {
            first += match left {
                _ if left >= TILE => tiles::<V, TILE, RECTIFIED>(mlp, layer, first, from, to),
                6.. => tiles::<V, 6, RECTIFIED>(mlp, layer, first, from, to),
                4.. => tiles::<V, 4, RECTIFIED>(mlp, layer, first, from, to),
                3 => tiles::<V, 3, RECTIFIED>(mlp, layer, first, from, to),
                2 => tiles::<V, 2, RECTIFIED>(mlp, layer, first, from, to),
                _ => tiles::<V, 1, RECTIFIED>(mlp, layer, first, from, to),
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
            for _ in 0..layer.inputs {
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

/// The network on one query, with registers across outputs; `V` has at most [`COLUMN`](super::COLUMN) lanes.
///
/// # Safety
///
/// The processor has the instructions of `V`.
#[inline(always)]
pub(super) unsafe fn forward_one<V: Vector>(mlp: &PackedMlp, mut buffers: Buffers<'_, f32>) {
    for index in 0..mlp.layers.len() {
        // SAFETY: forwarded from the caller.
        unsafe { layer_one::<V>(mlp, index, &mut buffers) }
    }
}

/// Two networks on one query each, layer by layer in turn.
///
/// # Safety
///
/// As for [`forward_one`].
#[inline(always)]
pub(super) unsafe fn forward_two<V: Vector>(mlps: [&PackedMlp; 2], mut buffers: [Buffers<'_, f32>; 2]) {
    let layers = mlps[0].layers.len().max(mlps[1].layers.len());
    for index in 0..layers {
        for (mlp, buffers) in mlps.iter().zip(&mut buffers) {
            if index < mlp.layers.len() {
                // SAFETY: forwarded from the caller.
                unsafe { layer_one::<V>(mlp, index, buffers) }
            }
        }
    }
}

#[inline(always)]
unsafe fn layer_one<V: Vector>(mlp: &PackedMlp, index: usize, buffers: &mut Buffers<'_, f32>) {
    let Buffers { a, b, c } = buffers;
    let layer = &mlp.layers[index];
    let is_last = index + 1 == mlp.layers.len();
    let (from, to): (&[f32], &mut [f32]) = match index {
        0 => (a, b),
        i if i % 2 == 1 => (b, c),
        _ => (c, b),
    };
    assert!(layer.inputs <= from.len() && layer.stride <= to.len(), "room for every neuron");
    let mut first = 0;
    while first < layer.outputs {
        let registers = (layer.outputs - first).div_ceil(V::LANES).min(3);
        // SAFETY: the room was just checked; the caller vouches for the instructions.
        unsafe {
            match registers {
                3 => column::<V, 3>(mlp, layer, first, from, to, !is_last),
                2 => column::<V, 2>(mlp, layer, first, from, to, !is_last),
                _ => column::<V, 1>(mlp, layer, first, from, to, !is_last),
            }
        }
        first += registers * V::LANES;
    }
}

/// Inputs that are summed side by side for one query: sums that wait for each other would cost four cycles each.
const PARALLEL: usize = 4;

#[inline(always)]
unsafe fn column<V: Vector, const N: usize>(
    mlp: &PackedMlp,
    layer: &PackedLayer,
    first: usize,
    from: &[f32],
    to: &mut [f32],
    rectified: bool,
) {
    // SAFETY: a packed layer lies inside the numbers of its network, with `stride` a multiple of the lanes; the caller checked the room.
    unsafe {
        let numbers = mlp.numbers().as_ptr();
        let weights = numbers.add(layer.weights + first);
        let add = |sums: &mut [V; N], input: usize| {
            let x = V::splat(*from.as_ptr().add(input));
            let w = weights.add(input * layer.stride);
            for (k, sum) in sums.iter_mut().enumerate() {
                *sum = sum.plus_product(x, V::load(w.add(k * V::LANES)));
            }
        };
        let mut sums = [[V::splat(0.0); N]; PARALLEL];
        for (k, sum) in sums[0].iter_mut().enumerate() {
            *sum = V::load(numbers.add(layer.biases + first + k * V::LANES));
        }
        let even = layer.inputs / PARALLEL * PARALLEL;
        for input in (0..even).step_by(PARALLEL) {
            for (k, sum) in sums.iter_mut().enumerate() {
                add(sum, input + k);
            }
        }
        for input in even..layer.inputs {
            add(&mut sums[input - even], input);
        }
        #[allow(clippy::needless_range_loop, reason = "four arrays side by side")]
        for k in 0..N {
            let sum = sums[0][k].add(sums[1][k]).add(sums[2][k].add(sums[3][k]));
            let sum = if rectified { sum.rectified() } else { sum };
            sum.store(to.as_mut_ptr().add(first + k * V::LANES));
        }
    }
}

//! Networks over one query, or two of them side by side: registers run across the outputs of a layer.

use super::super::packed_mlp::{PackedLayer, PackedMlp, USUAL_WIDTH};
use super::tile::Vector;
use super::{Buffers, COLUMN};

/// The network on one query; `V` has at most [`COLUMN`] lanes.
///
/// # Safety
///
/// The processor has the instructions of `V`.
#[inline(always)]
pub(super) unsafe fn forward_one<V: Vector>(mlp: &PackedMlp, mut buffers: Buffers<'_, f32>) {
    // SAFETY: forwarded from the caller.
    unsafe {
        if mlp.is_usual {
            usual::<V, 1>([mlp], [buffers]);
            return;
        }
        for index in 0..mlp.layers.len() {
            layer_one::<V>(mlp, index, &mut buffers);
        }
    }
}

/// Two networks on one query each, layer by layer in turn.
///
/// # Safety
///
/// As for [`forward_one`].
#[inline(always)]
pub(super) unsafe fn forward_two<V: Vector>(mlps: [&PackedMlp; 2], mut buffers: [Buffers<'_, f32>; 2]) {
    // SAFETY: forwarded from the caller.
    unsafe {
        if mlps[0].is_usual && mlps[1].is_usual {
            usual::<V, 2>(mlps, buffers);
            return;
        }
        let layers = mlps[0].layers.len().max(mlps[1].layers.len());
        for index in 0..layers {
            for (mlp, buffers) in mlps.iter().zip(&mut buffers) {
                if index < mlp.layers.len() {
                    layer_one::<V>(mlp, index, buffers);
                }
            }
        }
    }
}

/// What the loops over a layer go by. Where it is known when they are compiled, they are no loops.
#[derive(Debug, Clone, Copy)]
struct Shape {
    inputs: usize,
    outputs: usize,
    stride: usize,
}

/// Networks of the usual shape side by side. Deciding layer by layer what to do takes as many instructions as doing it.
#[inline(always)]
unsafe fn usual<V: Vector, const N: usize>(mlps: [&PackedMlp; N], mut buffers: [Buffers<'_, f32>; N]) {
    const STRIDE: usize = USUAL_WIDTH.next_multiple_of(COLUMN);
    let hidden = Shape { inputs: USUAL_WIDTH, outputs: USUAL_WIDTH, stride: STRIDE };
    // Half a register holds all there are; the numbers of the others are zero.
    let last = Shape { inputs: USUAL_WIDTH, outputs: COLUMN / 2, stride: COLUMN };
    for (mlp, Buffers { a, b, c }) in mlps.iter().zip(&buffers) {
        let room = mlp.layers[0].inputs <= a.len() && STRIDE <= b.len() && STRIDE <= c.len();
        assert!(room && mlp.layers.len() == 4, "room for every neuron");
    }
    // SAFETY: the room was just checked, the shapes when the network was packed.
    unsafe {
        for (mlp, Buffers { a, b, .. }) in mlps.iter().zip(&mut buffers) {
            let layer = &mlp.layers[0];
            columns::<V>(mlp, layer, Shape { inputs: layer.inputs, ..hidden }, a, b, true);
        }
        for (mlp, Buffers { b, c, .. }) in mlps.iter().zip(&mut buffers) {
            columns::<V>(mlp, &mlp.layers[1], hidden, b, c, true);
        }
        for (mlp, Buffers { b, c, .. }) in mlps.iter().zip(&mut buffers) {
            columns::<V>(mlp, &mlp.layers[2], hidden, c, b, true);
        }
        for (mlp, Buffers { b, c, .. }) in mlps.iter().zip(&mut buffers) {
            columns::<V>(mlp, &mlp.layers[3], last, b, c, false);
        }
    }
}

/// A layer of any network.
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
    let &PackedLayer { inputs, outputs, stride, .. } = layer;
    // SAFETY: the room was just checked; the caller vouches for the instructions.
    unsafe { columns::<V>(mlp, layer, Shape { inputs, outputs, stride }, from, to, !is_last) }
}

/// All outputs of a layer, some registers of them at a time.
#[inline(always)]
unsafe fn columns<V: Vector>(
    mlp: &PackedMlp,
    layer: &PackedLayer,
    shape: Shape,
    from: &[f32],
    to: &mut [f32],
    rectified: bool,
) {
    let mut first = 0;
    while first < shape.outputs {
        let left = shape.outputs - first;
        // SAFETY: forwarded from the caller.
        unsafe {
            first += if V::HAS_HALF && left <= V::LANES / 2 {
                column::<V, 0, true>(mlp, layer, shape, first, from, to, rectified)
            } else if V::HAS_HALF && left > V::LANES && left <= V::LANES / 2 * 3 {
                column::<V, 1, true>(mlp, layer, shape, first, from, to, rectified)
            } else {
                match left.div_ceil(V::LANES) {
                    1 => column::<V, 1, false>(mlp, layer, shape, first, from, to, rectified),
                    2 => column::<V, 2, false>(mlp, layer, shape, first, from, to, rectified),
                    _ => column::<V, 3, false>(mlp, layer, shape, first, from, to, rectified),
                }
            };
        }
    }
}

/// Inputs that are summed side by side for one query: sums that wait for each other would cost four cycles each.
const PARALLEL: usize = 4;

/// `N` registers of outputs from `first` on, and half of one if `HALF`; returns how many outputs that is. Half a register is half as much to
/// load, and there are more ways to load it.
#[inline(always)]
unsafe fn column<V: Vector, const N: usize, const HALF: bool>(
    mlp: &PackedMlp,
    layer: &PackedLayer,
    shape: Shape,
    first: usize,
    from: &[f32],
    to: &mut [f32],
    rectified: bool,
) -> usize {
    // SAFETY: a packed layer lies inside the numbers of its network, with `stride` a multiple of the lanes; the caller checked the room.
    unsafe {
        let numbers = mlp.numbers().as_ptr();
        let weights = numbers.add(layer.weights + first);
        let biases = numbers.add(layer.biases + first);
        let add = |(sums, half): (&mut [V; N], &mut V::Half), input: usize| {
            let x = V::splat(*from.as_ptr().add(input));
            let w = weights.add(input * shape.stride);
            for (k, sum) in sums.iter_mut().enumerate() {
                *sum = sum.plus_product(x, V::load(w.add(k * V::LANES)));
            }
            if HALF {
                *half = half.plus_product(x.half(), V::Half::load(w.add(N * V::LANES)));
            }
        };
        let mut sums = [[V::splat(0.0); N]; PARALLEL];
        let mut halves = [V::Half::splat(0.0); PARALLEL];
        for (k, sum) in sums[0].iter_mut().enumerate() {
            *sum = V::load(biases.add(k * V::LANES));
        }
        if HALF {
            halves[0] = V::Half::load(biases.add(N * V::LANES));
        }
        let even = shape.inputs / PARALLEL * PARALLEL;
        for input in (0..even).step_by(PARALLEL) {
            for (k, sum) in sums.iter_mut().zip(&mut halves).enumerate() {
                add(sum, input + k);
            }
        }
        for input in even..shape.inputs {
            add((&mut sums[input - even], &mut halves[input - even]), input);
        }
        #[allow(clippy::needless_range_loop, reason = "four arrays side by side")]
        for k in 0..N {
            let sum = sums[0][k].add(sums[1][k]).add(sums[2][k].add(sums[3][k]));
            let sum = if rectified { sum.rectified() } else { sum };
            sum.store(to.as_mut_ptr().add(first + k * V::LANES));
        }
        if HALF {
            let sum = halves[0].add(halves[1]).add(halves[2].add(halves[3]));
            let sum = if rectified { sum.rectified() } else { sum };
            sum.store(to.as_mut_ptr().add(first + N * V::LANES));
        }
    }
    N * V::LANES + if HALF { V::LANES / 2 } else { 0 }
}

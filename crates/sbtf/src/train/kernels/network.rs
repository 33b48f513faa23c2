//! Forward and backward through a whole network for a block of samples.
//!
//! A *row* is one number of every sample of a block. All layers are the same loop: a tile of a few output rows by a few
//! registers of samples stays in registers while the input rows stream by, each weight broadcast. Backward runs the same
//! loop with the strides of the weights exchanged. Weight gradients keep one accumulator per lane in memory; the lanes are
//! added once per shard.
#![allow(unsafe_code, reason = "SIMD kernels; tested against the portable twin and f64 central differences")]

use super::InstructionSet;
use super::lanes::{Lanes, Portable};
use super::products::{Product, bias_gradients, weight_gradients};
use super::shape::{MOST_LANES, ROW, Shape};

/// Computes all rows of a block from its input rows.
///
/// # Panics
///
/// If a slice does not have the length that [`Shape`] gives it.
pub(crate) fn forward(set: InstructionSet, shape: &Shape, parameters: &[f32], rows: &mut [f32]) {
    assert_eq!(parameters.len(), shape.parameters(), "parameters of the network");
    assert_eq!(rows.len(), shape.rows() * ROW, "rows of a block");
    // SAFETY: `set` is present on this machine, and the lengths were just checked.
    unsafe {
        match set {
            #[cfg(target_arch = "x86_64")]
            InstructionSet::Avx512 => x86::forward_avx512(shape, parameters, rows),
            #[cfg(target_arch = "x86_64")]
            InstructionSet::Avx2 => x86::forward_avx2(shape, parameters, rows),
            InstructionSet::Portable => forward_with::<Portable, 6, 4>(shape, parameters, rows),
        }
    }
}

/// Computes the gradient's input rows from its output rows, and adds to the weight gradients. `rows` are those that
/// [`forward`] left.
///
/// # Panics
///
/// If a slice does not have the length that [`Shape`] gives it.
pub(crate) fn backward(
    set: InstructionSet,
    shape: &Shape,
    parameters: &[f32],
    rows: &[f32],
    gradients: &mut [f32],
    accumulators: &mut [f32],
) {
    assert_eq!(parameters.len(), shape.parameters(), "parameters of the network");
    assert_eq!(rows.len(), shape.rows() * ROW, "rows of a block");
    assert_eq!(gradients.len(), rows.len(), "rows of a block");
    assert_eq!(accumulators.len(), shape.parameters() * MOST_LANES, "accumulators of the network");
    // SAFETY: `set` is present on this machine, and the lengths were just checked.
    unsafe {
        match set {
            #[cfg(target_arch = "x86_64")]
            InstructionSet::Avx512 => x86::backward_avx512(shape, parameters, rows, gradients, accumulators),
            #[cfg(target_arch = "x86_64")]
            InstructionSet::Avx2 => x86::backward_avx2(shape, parameters, rows, gradients, accumulators),
            InstructionSet::Portable => {
                backward_with::<Portable, 6, 4>(shape, parameters, rows, gradients, accumulators);
            }
        }
    }
}

/// Adds the lanes of the accumulators into `gradient` and empties them.
pub(crate) fn drain(set: InstructionSet, accumulators: &mut [f32], gradient: &mut [f32]) {
    let width = match set {
        #[cfg(target_arch = "x86_64")]
        InstructionSet::Avx2 => 8,
        _ => MOST_LANES,
    };
    for (lanes, sum) in accumulators.chunks_exact(width).zip(gradient.iter_mut()) {
        *sum += lanes.iter().sum::<f32>();
    }
    accumulators.fill(0.0);
}

#[cfg(target_arch = "x86_64")]
mod x86 {
    use super::super::lanes::{Avx2, Avx512};
    use super::{Shape, backward_with, forward_with};

    /// # Safety
    ///
    /// As [`forward_with`]; AVX-512F is present.
    #[target_feature(enable = "avx512f")]
    pub(super) unsafe fn forward_avx512(shape: &Shape, parameters: &[f32], rows: &mut [f32]) {
        // SAFETY: the caller's.
        unsafe { forward_with::<Avx512, 6, 4>(shape, parameters, rows) }
    }

    /// # Safety
    ///
    /// As [`forward_with`]; AVX2 and FMA are present.
    #[target_feature(enable = "avx2,fma")]
    pub(super) unsafe fn forward_avx2(shape: &Shape, parameters: &[f32], rows: &mut [f32]) {
        // SAFETY: the caller's.
        unsafe { forward_with::<Avx2, 3, 4>(shape, parameters, rows) }
    }

    /// # Safety
    ///
    /// As [`backward_with`]; AVX-512F is present.
    #[target_feature(enable = "avx512f")]
    pub(super) unsafe fn backward_avx512(
        shape: &Shape,
        parameters: &[f32],
        rows: &[f32],
        gradients: &mut [f32],
        accumulators: &mut [f32],
    ) {
        // SAFETY: the caller's.
        unsafe { backward_with::<Avx512, 6, 4>(shape, parameters, rows, gradients, accumulators) }
    }

    /// # Safety
    ///
    /// As [`backward_with`]; AVX2 and FMA are present.
    #[target_feature(enable = "avx2,fma")]
    pub(super) unsafe fn backward_avx2(
        shape: &Shape,
        parameters: &[f32],
        rows: &[f32],
        gradients: &mut [f32],
        accumulators: &mut [f32],
    ) {
        // SAFETY: the caller's.
        unsafe { backward_with::<Avx2, 3, 4>(shape, parameters, rows, gradients, accumulators) }
    }
}

/// # Safety
///
/// The lengths are those of `shape`; the lanes are present.
#[inline(always)]
unsafe fn forward_with<L: Lanes, const O: usize, const R: usize>(
    shape: &Shape,
    parameters: &[f32],
    rows: &mut [f32],
) {
    let last = shape.first_output();
    for place in shape.layers() {
        let rectified = place.first_output() != last;
        // SAFETY: all places lie inside the slices, and outputs after the inputs.
        unsafe {
            let weights = parameters.as_ptr().add(place.weights);
            let biases = parameters.as_ptr().add(place.biases());
            let base = rows.as_mut_ptr();
            let product = Product {
                weights,
                output_stride: place.inputs,
                input_stride: 1,
                inputs: place.inputs,
                outputs: place.outputs,
                from: base.add(place.first_input * ROW),
                to: base.add(place.first_output() * ROW),
            };
            product.run::<L, O, R>(
                |o| L::splat(*biases.add(o)),
                |sum, _| if rectified { sum.rectify() } else { sum },
            );
        }
    }
}

/// # Safety
///
/// The lengths are those of `shape`; the lanes are present.
#[inline(always)]
unsafe fn backward_with<L: Lanes, const O: usize, const R: usize>(
    shape: &Shape,
    parameters: &[f32],
    rows: &[f32],
    gradients: &mut [f32],
    accumulators: &mut [f32],
) {
    for place in shape.layers().rev() {
        // SAFETY: all places lie inside the slices.
        unsafe {
            let inputs = rows.as_ptr().add(place.first_input * ROW);
            let base = gradients.as_mut_ptr();
            let from = base.add(place.first_output() * ROW);
            let sums = accumulators.as_mut_ptr();
            weight_gradients::<L, O>(&place, from, inputs, sums.add(place.weights * L::WIDTH));
            bias_gradients::<L>(place.outputs, from, sums.add(place.biases() * L::WIDTH));
            let product = Product {
                weights: parameters.as_ptr().add(place.weights),
                output_stride: 1,
                input_stride: place.inputs,
                inputs: place.outputs,
                outputs: place.inputs,
                from,
                to: base.add(place.first_input * ROW),
            };
            // The rectifier before this layer passes gradients where it passed values. The network's own inputs have none.
            let rectified = place.first_input != 0;
            product.run::<L, O, R>(
                |_| L::splat(0.0),
                |sum, at| if rectified { sum.gate(L::load(inputs.add(at))) } else { sum },
            );
        }
    }
}

#[cfg(test)]
mod tests {
    use super::super::shape::BLOCK;
    use super::*;
    use crate::random::Random;

    fn run(set: InstructionSet, shape: &Shape) -> (Vec<f32>, Vec<f32>, Vec<f32>) {
        let mut random = Random::new(7, 1, 0);
        let parameters: Vec<f32> = (0..shape.parameters()).map(|_| random.signed()).collect();
        let (mut rows, mut gradients) = (shape.block(), shape.block());
        rows[..shape.sizes()[0] * ROW].iter_mut().for_each(|x| *x = random.signed());
        let first = shape.first_output() * ROW;
        gradients[first..].iter_mut().for_each(|x| *x = random.signed());
        let (mut sums, mut gradient) = (shape.accumulators(), vec![0.0; shape.parameters()]);
        forward(set, shape, &parameters, &mut rows);
        backward(set, shape, &parameters, &rows, &mut gradients, &mut sums);
        drain(set, &mut sums, &mut gradient);
        (rows, gradients, gradient)
    }

    /// Rows add in one order everywhere, and each step is one fused multiply-add: the bits agree.
    #[test]
    fn instruction_sets_give_the_same_rows() {
        for sizes in [vec![16, 24, 24, 24, 4], vec![59, 24, 24, 24, 1], vec![5, 7, 2]] {
            let shape = Shape::new(sizes);
            let (rows, gradients, weights) = run(InstructionSet::Portable, &shape);
            for set in InstructionSet::present() {
                let (other_rows, other_gradients, other_weights) = run(set, &shape);
                for row in 0..shape.rows() {
                    let range = row * ROW..row * ROW + BLOCK;
                    assert_eq!(rows[range.clone()], other_rows[range.clone()], "{set:?} row {row}");
                    assert_eq!(gradients[range.clone()], other_gradients[range], "{set:?} row {row}");
                }
                // Lanes are added in another order: 256 terms of rounding.
                let scale = weights.iter().fold(0.0_f32, |a, w| a.max(w.abs()));
                for (a, b) in weights.iter().zip(&other_weights) {
                    assert!((a - b).abs() < 256.0 * f32::EPSILON * scale, "{set:?}: {a} {b}");
                }
            }
        }
    }
}

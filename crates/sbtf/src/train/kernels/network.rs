//! Forward and backward through a whole network for a block of samples.
//!
//! A *row* is one number of every sample of a block. All layers are the same loop: a tile of a few output rows by a few
//! registers of samples stays in registers while the input rows stream by, each weight broadcast. Backward runs the same
//! loop with the strides of the weights exchanged. Weight gradients keep one accumulator per lane in memory; the lanes are
//! added once per shard.
#![allow(unsafe_code, reason = "SIMD kernels; tested against the portable twin and f64 central differences")]

use super::InstructionSet;
use super::lanes::{Lanes, Portable};

/// Samples in a block. Few blocks fit the second-level cache less often, small ones spend their time on the weight
/// gradients' accumulators.
pub(crate) const BLOCK: usize = 256;
/// Distance between rows: one cache line more than a block, so that rows do not compete for the same cache sets.
pub(crate) const ROW: usize = BLOCK + 16;
/// Most lanes of any instruction set.
const MOST_LANES: usize = 16;

/// Sizes of the layers, inputs first, and where their numbers are.
#[derive(Debug, Clone, PartialEq, Eq)]
pub(crate) struct Shape {
    sizes: Vec<usize>,
}

impl Shape {
    pub(crate) fn new(sizes: Vec<usize>) -> Self {
        assert!(sizes.len() >= 2 && sizes.iter().all(|&n| n > 0), "layers with at least one number");
        Self { sizes }
    }

    pub(crate) fn sizes(&self) -> &[usize] {
        &self.sizes
    }

    /// Numbers in all layers: weights `[outputs, inputs]`, then biases, layer by layer.
    pub(crate) fn parameters(&self) -> usize {
        self.sizes.windows(2).map(|pair| (pair[0] + 1) * pair[1]).sum()
    }

    /// Rows of inputs and of all layers' outputs.
    fn rows(&self) -> usize {
        self.sizes.iter().sum()
    }

    /// First row of the outputs.
    pub(crate) fn first_output(&self) -> usize {
        self.rows() - self.sizes[self.sizes.len() - 1]
    }

    /// Room for the rows of a block.
    pub(crate) fn block(&self) -> Vec<f32> {
        vec![0.0; self.rows() * ROW]
    }

    /// Room for weight gradients, one per lane.
    pub(crate) fn accumulators(&self) -> Vec<f32> {
        vec![0.0; self.parameters() * MOST_LANES]
    }

    fn layers(&self) -> impl DoubleEndedIterator<Item = Place> {
        let mut place = Place { inputs: 0, outputs: 0, first_input: 0, weights: 0 };
        let places: Vec<Place> = (self.sizes.windows(2))
            .map(|pair| {
                let this = Place { inputs: pair[0], outputs: pair[1], ..place };
                place.first_input += pair[0];
                place.weights += (pair[0] + 1) * pair[1];
                this
            })
            .collect();
        places.into_iter()
    }
}

/// Where a layer's numbers are.
#[derive(Clone, Copy)]
struct Place {
    inputs: usize,
    outputs: usize,
    /// First row of the inputs; outputs follow the inputs.
    first_input: usize,
    /// First weight among the parameters.
    weights: usize,
}

impl Place {
    fn biases(&self) -> usize {
        self.weights + self.inputs * self.outputs
    }
    fn first_output(&self) -> usize {
        self.first_input + self.inputs
    }
}

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

/// `to[o] = finish(start(o) + sum_i weights[o, i] from[i])` for rows.
struct Product {
    weights: *const f32,
    output_stride: usize,
    input_stride: usize,
    inputs: usize,
    outputs: usize,
    from: *const f32,
    to: *mut f32,
}

impl Product {
    /// # Safety
    ///
    /// The pointers reach as far as the counts and strides say; `from` and `to` do not overlap.
    #[inline(always)]
    unsafe fn run<L: Lanes, const O: usize, const R: usize>(
        &self,
        start: impl Fn(usize) -> L + Copy,
        finish: impl Fn(L, usize) -> L + Copy,
    ) {
        // Samples outside, outputs inside: the input rows of a few registers stay in the first-level cache.
        let mut column = 0;
        while column < BLOCK {
            let mut o = 0;
            // SAFETY: tiles lie inside the rows; `R` registers divide a block.
            unsafe {
                while o + O <= self.outputs {
                    self.tile::<L, O, R>(o, column, start, finish);
                    o += O;
                }
                while o < self.outputs {
                    self.tile::<L, 1, R>(o, column, start, finish);
                    o += 1;
                }
            }
            column += R * L::WIDTH;
        }
    }

    /// # Safety
    ///
    /// As [`Product::run`], and the tile lies inside.
    #[inline(always)]
    unsafe fn tile<L: Lanes, const O: usize, const R: usize>(
        &self,
        first: usize,
        column: usize,
        start: impl Fn(usize) -> L,
        finish: impl Fn(L, usize) -> L,
    ) {
        // SAFETY: the caller's.
        unsafe {
            let mut sums: [[L; R]; O] = std::array::from_fn(|o| [start(first + o); R]);
            for i in 0..self.inputs {
                let row = self.from.add(i * ROW + column);
                let values: [L; R] = std::array::from_fn(|r| L::load(row.add(r * L::WIDTH)));
                let weight = self.weights.add(first * self.output_stride + i * self.input_stride);
                for (o, sums) in sums.iter_mut().enumerate() {
                    let weight = L::splat(*weight.add(o * self.output_stride));
                    for (sum, value) in sums.iter_mut().zip(values) {
                        *sum = weight.mul_add(value, *sum);
                    }
                }
            }
            for (o, sums) in sums.iter().enumerate() {
                for (r, &sum) in sums.iter().enumerate() {
                    let at = (first + o) * ROW + column + r * L::WIDTH;
                    finish(sum, at).store(self.to.add(at));
                }
            }
        }
    }
}

/// # Safety
///
/// `gradients` and `values` are the layer's rows, `sums` its accumulators.
#[inline(always)]
unsafe fn weight_gradients<L: Lanes, const O: usize>(
    place: &Place,
    gradients: *const f32,
    values: *const f32,
    sums: *mut f32,
) {
    let mut o = 0;
    while o < place.outputs {
        let many = o + O <= place.outputs;
        let mut i = 0;
        while i < place.inputs {
            let wide = i + 4 <= place.inputs;
            // SAFETY: the tile lies inside the layer.
            unsafe {
                match (many, wide) {
                    (true, true) => outer::<L, O, 4>(place.inputs, o, i, gradients, values, sums),
                    (true, false) => outer::<L, O, 1>(place.inputs, o, i, gradients, values, sums),
                    (false, true) => outer::<L, 1, 4>(place.inputs, o, i, gradients, values, sums),
                    (false, false) => outer::<L, 1, 1>(place.inputs, o, i, gradients, values, sums),
                }
            }
            i += if wide { 4 } else { 1 };
        }
        o += if many { O } else { 1 };
    }
}

/// # Safety
///
/// As [`weight_gradients`]; the tile lies inside the layer.
#[inline(always)]
unsafe fn outer<L: Lanes, const O: usize, const I: usize>(
    inputs: usize,
    o: usize,
    i: usize,
    gradients: *const f32,
    values: *const f32,
    sums: *mut f32,
) {
    // SAFETY: the caller's.
    unsafe {
        let mut tile = [[L::splat(0.0); I]; O];
        let (gradients, values) = (gradients.add(o * ROW), values.add(i * ROW));
        let mut column = 0;
        while column < BLOCK {
            let value: [L; I] = std::array::from_fn(|i| L::load(values.add(i * ROW + column)));
            for (o, sums) in tile.iter_mut().enumerate() {
                let gradient = L::load(gradients.add(o * ROW + column));
                for (sum, value) in sums.iter_mut().zip(value) {
                    *sum = gradient.mul_add(value, *sum);
                }
            }
            column += L::WIDTH;
        }
        for (down, row) in tile.iter().enumerate() {
            for (right, &sum) in row.iter().enumerate() {
                let at = sums.add(((o + down) * inputs + i + right) * L::WIDTH);
                sum.add(L::load(at)).store(at);
            }
        }
    }
}

/// # Safety
///
/// `gradients` are the output rows of a layer, `sums` the accumulators of its biases.
#[inline(always)]
unsafe fn bias_gradients<L: Lanes>(outputs: usize, gradients: *const f32, sums: *mut f32) {
    for o in 0..outputs {
        // SAFETY: the caller's.
        unsafe {
            let at = sums.add(o * L::WIDTH);
            let mut sum = L::load(at);
            let mut column = 0;
            while column < BLOCK {
                sum = sum.add(L::load(gradients.add(o * ROW + column)));
                column += L::WIDTH;
            }
            sum.store(at);
        }
    }
}

#[cfg(test)]
mod tests {
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

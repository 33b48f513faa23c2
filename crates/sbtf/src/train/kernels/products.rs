//! The loops of a layer over rows: products with the weights, and sums for their gradients.
#![allow(unsafe_code, reason = "SIMD kernels; tested with the networks that are made of them")]

use super::lanes::Lanes;
use super::shape::{BLOCK, Place, ROW};

/// `to[o] = finish(start(o) + sum_i weights[o, i] from[i])` for rows.
pub(super) struct Product {
    pub weights: *const f32,
    pub output_stride: usize,
    pub input_stride: usize,
    pub inputs: usize,
    pub outputs: usize,
    pub from: *const f32,
    pub to: *mut f32,
}

impl Product {
    /// # Safety
    ///
    /// The pointers reach as far as the counts and strides say; `from` and `to` do not overlap.
    #[inline(always)]
    pub unsafe fn run<L: Lanes, const O: usize, const R: usize>(
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
pub(super) unsafe fn weight_gradients<L: Lanes, const O: usize>(
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
pub(super) unsafe fn bias_gradients<L: Lanes>(outputs: usize, gradients: *const f32, sums: *mut f32) {
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

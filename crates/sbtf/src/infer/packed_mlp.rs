//! [`PackedMlp`]: a network laid out for the kernels.

use super::aligned::Aligned;
use super::kernels::COLUMN;
use crate::model::Mlp;

/// Neurons of a hidden layer of most networks: the paper's.
pub(super) const USUAL_WIDTH: usize = 24;

/// A network whose weights lie in the order in which kernels read them: per layer the biases, then the weights of the first
/// input to every output, those of the second, and so on.
#[derive(Debug)]
pub(super) struct PackedMlp {
    /// Whether it has three hidden layers of [`USUAL_WIDTH`] neurons and at most half a [`COLUMN`] of outputs.
    pub is_usual: bool,
    pub layers: Vec<PackedLayer>,
    numbers: Aligned<f32>,
}

/// Where a layer lies in the numbers of its network.
#[derive(Debug, Clone, Copy)]
pub(super) struct PackedLayer {
    pub inputs: usize,
    pub outputs: usize,
    /// Outputs, rounded up to a multiple of [`COLUMN`]; the numbers of the rest are zero.
    pub stride: usize,
    /// Index of the first bias.
    pub biases: usize,
    /// Index of the first weight; the weight of input `i` to output `o` is at `i * stride + o` from here.
    pub weights: usize,
}

impl PackedMlp {
    /// Packs a network.
    ///
    /// # Panics
    ///
    /// If it has no layers, or numbers that do not fit its shapes.
    pub fn new(mlp: &Mlp) -> Self {
        assert!(!mlp.layers.is_empty(), "a network has layers");
        let mut numbers = Vec::new();
        let mut layers: Vec<PackedLayer> = Vec::new();
        for layer in &mlp.layers {
            assert_eq!(layer.weights.len(), layer.inputs * layer.outputs, "one weight per pair of neurons");
            assert_eq!(layer.biases.len(), layer.outputs, "one bias per output");
            assert!(layers.last().is_none_or(|l| l.outputs == layer.inputs), "layers fit together");
            let stride = layer.outputs.next_multiple_of(COLUMN);
            let biases = numbers.len();
            let weights = biases + stride;
            numbers.resize(weights + layer.inputs * stride, 0.0);
            numbers[biases..biases + layer.outputs].copy_from_slice(&layer.biases);
            for (output, row) in layer.weights.chunks_exact(layer.inputs).enumerate() {
                for (input, &weight) in row.iter().enumerate() {
                    numbers[weights + input * stride + output] = weight;
                }
            }
            layers.push(PackedLayer {
                inputs: layer.inputs,
                outputs: layer.outputs,
                stride,
                biases,
                weights,
            });
        }
        let widths = layers.iter().map(|layer| layer.outputs);
        let is_usual = layers.len() == 4
            && widths
                .enumerate()
                .all(|(k, outputs)| if k < 3 { outputs == USUAL_WIDTH } else { outputs <= COLUMN / 2 });
        Self { is_usual, layers, numbers: Aligned::new(&numbers) }
    }

    /// All weights and biases.
    #[inline(always)]
    pub fn numbers(&self) -> &[f32] {
        &self.numbers
    }

    /// Multiplications of one query.
    pub fn products(&self) -> usize {
        self.layers.iter().map(|layer| layer.inputs * layer.outputs).sum()
    }

    /// The most outputs of a layer, rounded up to a multiple of [`COLUMN`].
    pub fn widest(&self) -> usize {
        self.layers.iter().map(|layer| layer.stride).max().unwrap_or(0)
    }
}

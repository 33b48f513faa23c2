//! Sizes of a network, and where the numbers of a block lie.

/// Samples in a block. Few blocks fit the second-level cache less often, small ones spend their time on the weight
/// gradients' accumulators.
pub(crate) const BLOCK: usize = 256;
/// Distance between rows: one cache line more than a block, so that rows do not compete for the same cache sets.
pub(crate) const ROW: usize = BLOCK + 16;
/// Most lanes of any instruction set.
pub(super) const MOST_LANES: usize = 16;

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
    pub(super) fn rows(&self) -> usize {
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

    pub(super) fn layers(&self) -> impl DoubleEndedIterator<Item = Place> {
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
pub(super) struct Place {
    pub inputs: usize,
    pub outputs: usize,
    /// First row of the inputs; outputs follow the inputs.
    pub first_input: usize,
    /// First weight among the parameters.
    pub weights: usize,
}

impl Place {
    /// First bias among the parameters.
    pub fn biases(&self) -> usize {
        self.weights + self.inputs * self.outputs
    }

    /// First row of the outputs.
    pub fn first_output(&self) -> usize {
        self.first_input + self.inputs
    }
}

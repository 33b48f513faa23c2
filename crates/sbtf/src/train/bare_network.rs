//! [`BareNetwork`]: the kernels on a network without textures, to be timed beside other programs.

use super::kernels::{AdamStep, BLOCK, InstructionSet, ROW, Shape, adam, backward, drain, forward};
use crate::random::Random;

/// A network that learns random targets from random inputs by mean squared error, on one thread.
#[derive(Debug)]
pub struct BareNetwork {
    set: InstructionSet,
    shape: Shape,
    parameters: Vec<f32>,
    moments: [Vec<f32>; 2],
    accumulators: Vec<f32>,
    /// For each block, input rows, then target rows.
    blocks: Vec<[Vec<f32>; 2]>,
    rows: Vec<f32>,
    gradients: Vec<f32>,
    steps: u64,
}

impl BareNetwork {
    /// A network with these layer sizes, inputs first, and so many samples, rounded up to whole blocks.
    #[must_use]
    pub fn new(sizes: &[usize], samples: usize) -> Self {
        let shape = Shape::new(sizes.to_vec());
        let mut random = Random::new(1, 0, 0);
        let mut numbers = |count: usize| -> Vec<f32> { (0..count).map(|_| random.signed()).collect() };
        let outputs = sizes[sizes.len() - 1];
        Self {
            set: InstructionSet::best(),
            parameters: numbers(shape.parameters()).iter().map(|x| 0.3 * x).collect(),
            moments: [vec![0.0; shape.parameters()], vec![0.0; shape.parameters()]],
            accumulators: shape.accumulators(),
            blocks: (0..samples.div_ceil(BLOCK))
                .map(|_| [numbers(sizes[0] * ROW), numbers(outputs * ROW)])
                .collect(),
            rows: shape.block(),
            gradients: shape.block(),
            steps: 0,
            shape,
        }
    }

    /// Forward, backward and Adam over all samples; returns the mean squared error before.
    pub fn step(&mut self) -> f64 {
        let first = self.shape.first_output() * ROW;
        let outputs = self.shape.sizes()[self.shape.sizes().len() - 1];
        let scale = 2.0 / (self.blocks.len() * BLOCK * outputs) as f32;
        let mut sum = 0.0;
        for [inputs, targets] in &self.blocks {
            self.rows[..inputs.len()].copy_from_slice(inputs);
            forward(self.set, &self.shape, &self.parameters, &mut self.rows);
            let (found, gradients) = (&self.rows[first..], &mut self.gradients[first..]);
            for ((gradient, found), target) in
                gradients.chunks_mut(ROW).zip(found.chunks(ROW)).zip(targets.chunks(ROW))
            {
                let mut squares = 0.0;
                for ((gradient, found), target) in gradient.iter_mut().zip(found).zip(target).take(BLOCK) {
                    let error = found - target;
                    *gradient = scale * error;
                    squares += error * error;
                }
                sum += f64::from(squares);
            }
            backward(
                self.set,
                &self.shape,
                &self.parameters,
                &self.rows,
                &mut self.gradients,
                &mut self.accumulators,
            );
        }
        let mut gradient = vec![0.0; self.parameters.len()];
        drain(self.set, &mut self.accumulators, &mut gradient);
        self.steps += 1;
        let [means, squares] = &mut self.moments;
        adam(self.set, AdamStep::new(1e-3, self.steps), &mut self.parameters, means, squares, &gradient);
        sum / (self.blocks.len() * BLOCK * outputs) as f64
    }

    /// Multiply-adds of a step: forward, by the weights, and by the inputs of all but the first layer.
    #[must_use]
    pub fn multiply_adds(&self) -> usize {
        let sizes = self.shape.sizes();
        let all: usize = sizes.windows(2).map(|pair| pair[0] * pair[1]).sum();
        (3 * all - sizes[0] * sizes[1]) * self.blocks.len() * BLOCK
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn steps_go_down() {
        let mut network = BareNetwork::new(&[3, 24, 2], 1000);
        let before = network.step();
        let after = (0..300).map(|_| network.step()).last().unwrap();
        assert!(after < 0.97 * before, "{before} {after}");
    }
}

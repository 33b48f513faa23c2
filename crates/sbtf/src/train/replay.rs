//! [`Replay`]: steps from samples that are used more than once.
//!
//! A sample of the appearance costs a path, hundreds of times what a network needs to learn from it. Every batch of the source is
//! therefore cut into as many parts as it has uses, and a step is put together from parts of batches of different age, so
//! that no step sees a sample twice and uses of one sample lie steps apart.

use std::collections::VecDeque;

use super::task::Task;
use crate::samples::{Rows, SampleSource};

/// Batches of the source between two uses of a part.
const LAG: u64 = 5;

/// The steps' samples, each used `reuse` times. What a step gets depends on its number alone.
pub(super) struct Replay<'a, T: Task> {
    source: &'a dyn SampleSource,
    count: usize,
    reuse: u64,
    /// Batches by number, ascending.
    kept: VecDeque<(u64, T::Batch)>,
}

impl<'a, T: Task> Replay<'a, T> {
    /// Steps of `count` samples; `reuse` is at least 1.
    pub(super) fn new(source: &'a dyn SampleSource, count: usize, reuse: u32) -> Self {
        Self { source, count, reuse: u64::from(reuse.max(1)), kept: VecDeque::new() }
    }

    /// The samples of a step.
    pub(super) fn fill(&mut self, step: u64, into: &mut T::Batch) {
        into.resize(self.count);
        let newest = step / self.reuse;
        let parts = usize::try_from(self.reuse).unwrap_or(1);
        let count = self.count;
        let bound = |part: usize| part * count / parts;
        let turn = usize::try_from(step % self.reuse).unwrap_or(0);
        let oldest = newest - self.lag(newest, self.reuse - 1);
        self.kept.retain(|&(number, _)| (oldest..=newest).contains(&number));
        for part in 0..parts {
            // Parts and lags are paired anew in each step, so that a part meets every lag once.
            let lag = self.lag(newest, ((part + turn) % parts) as u64);
            let rows = bound(part)..bound(part + 1);
            into.copy_rows(self.batch(newest - lag), rows);
        }
    }

    /// Makes all batches again.
    pub(super) fn forget(&mut self) {
        self.kept.clear();
    }

    /// How much older than the newest batch the `k`-th is. In the beginning there is little to choose from.
    fn lag(&self, newest: u64, k: u64) -> u64 {
        (k * LAG).min(newest * k / self.reuse)
    }

    fn batch(&mut self, number: u64) -> &T::Batch {
        let at = self.kept.partition_point(|&(n, _)| n < number);
        if self.kept.get(at).is_none_or(|&(n, _)| n != number) {
            let mut batch = T::Batch::default();
            batch.resize(self.count);
            T::fill(self.source, number, &mut batch);
            self.kept.insert(at, (number, batch));
        }
        &self.kept[at].1
    }
}

#[cfg(test)]
mod tests {
    use std::collections::{HashMap, HashSet};

    use super::*;
    use crate::samples::{AppearanceBatch, OpacityBatch};
    use crate::train::opacity::OpacityLearner;

    /// Every sample has its batch and row for texture coordinates.
    struct Numbers;

    impl SampleSource for Numbers {
        fn fill_opacity(&self, index: u64, batch: &mut OpacityBatch) {
            for row in 0..batch.len() {
                batch.uv[0][row] = index as f32;
                batch.uv[1][row] = row as f32;
            }
        }

        fn fill_appearance(&self, _: u64, _: &mut AppearanceBatch) {
            unreachable!("opacity alone is asked")
        }
    }

    /// Batch and row of a step's samples.
    #[allow(clippy::cast_possible_truncation, clippy::cast_sign_loss, reason = "small whole numbers")]
    fn samples(replay: &mut Replay<OpacityLearner>, step: u64) -> Vec<[u32; 2]> {
        let mut batch = OpacityBatch::default();
        replay.fill(step, &mut batch);
        (0..batch.len()).map(|i| [batch.uv[0][i] as u32, batch.uv[1][i] as u32]).collect()
    }

    #[test]
    fn samples_are_used_so_often_and_never_twice_in_a_step() {
        const COUNT: usize = 103;
        for reuse in [1, 3, 8] {
            let mut replay = Replay::<OpacityLearner>::new(&Numbers, COUNT, reuse);
            let mut uses: HashMap<[u32; 2], u32> = HashMap::new();
            let steps = 150 * u64::from(reuse);
            for step in 0..steps {
                let found = samples(&mut replay, step);
                assert_eq!(found.len(), COUNT);
                let rows: HashSet<_> = found.iter().collect();
                assert_eq!(rows.len(), COUNT, "step {step}");
                found.into_iter().for_each(|sample| *uses.entry(sample).or_default() += 1);
            }
            // Past the beginning, and old enough to have had all uses.
            let settled = uses.iter().filter(|([batch, _], _)| (40..110).contains(batch));
            let counts: Vec<u32> = settled.map(|(_, &count)| count).collect();
            assert_eq!(counts.len(), 70 * COUNT);
            assert!(counts.iter().all(|&count| count == reuse));
        }
    }

    #[test]
    fn a_step_does_not_depend_on_the_steps_before_it() {
        let mut whole = Replay::<OpacityLearner>::new(&Numbers, 64, 4);
        let all: Vec<_> = (0..200).map(|step| samples(&mut whole, step)).collect();
        for step in [0, 1, 7, 30, 90, 199] {
            let mut late = Replay::<OpacityLearner>::new(&Numbers, 64, 4);
            assert_eq!(samples(&mut late, step), all[usize::try_from(step).unwrap()]);
        }
    }
}

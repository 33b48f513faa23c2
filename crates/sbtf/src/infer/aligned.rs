//! [`Aligned`]: numbers that begin at a cache line.

/// Numbers whose first one is at a multiple of 64 bytes, so that whole registers do not straddle cache lines.
#[derive(Debug)]
pub(super) struct Aligned<T> {
    values: Vec<T>,
    start: usize,
    len: usize,
}

impl<T: Copy + Default> Aligned<T> {
    /// Copies the numbers.
    pub fn new(numbers: &[T]) -> Self {
        let room = 64 / size_of::<T>();
        let mut values = vec![T::default(); numbers.len() + room];
        // The allocation stays where it is until it is dropped.
        let start = values.as_ptr().align_offset(64).min(room);
        values[start..start + numbers.len()].copy_from_slice(numbers);
        Self { values, start, len: numbers.len() }
    }
}

impl<T> std::ops::Deref for Aligned<T> {
    type Target = [T];

    #[inline(always)]
    fn deref(&self) -> &[T] {
        &self.values[self.start..self.start + self.len]
    }
}

//! Numbers in memory where vectors of them are read fast.

use std::ops::{Deref, DerefMut};

/// Numbers that start on a cache line, so that no vector of them lies on two.
pub(crate) struct Aligned<T> {
    values: Vec<T>,
    offset: usize,
}

/// Bytes of a cache line.
const LINE: usize = 64;

impl<T: Copy + Default> Aligned<T> {
    pub(crate) fn zeros(count: usize) -> Self {
        let line = LINE / size_of::<T>();
        let values = vec![T::default(); count + line];
        let offset = values.as_ptr().align_offset(LINE).min(line);
        let mut aligned = Self { values, offset };
        aligned.values.truncate(offset + count);
        aligned
    }
}

impl<T> Deref for Aligned<T> {
    type Target = [T];

    #[inline(always)]
    fn deref(&self) -> &[T] {
        &self.values[self.offset..]
    }
}

impl<T> DerefMut for Aligned<T> {
    #[inline(always)]
    fn deref_mut(&mut self) -> &mut [T] {
        &mut self.values[self.offset..]
    }
}

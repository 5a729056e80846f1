//! Numbers in memory where vectors of them are read fast.

use std::ops::{Deref, DerefMut};

/// Numbers that start on a cache line, so that no vector of them lies on two.
pub(super) struct Aligned {
    values: Vec<f64>,
    offset: usize,
}

impl Aligned {
    pub(super) fn zeros(count: usize) -> Self {
        let line = 8;
        let values = vec![0.0; count + line];
        let offset = values.as_ptr().align_offset(line * size_of::<f64>()).min(line);
        let mut aligned = Self { values, offset };
        aligned.values.truncate(offset + count);
        aligned
    }
}

impl Deref for Aligned {
    type Target = [f64];

    #[inline(always)]
    fn deref(&self) -> &[f64] {
        &self.values[self.offset..]
    }
}

impl DerefMut for Aligned {
    #[inline(always)]
    fn deref_mut(&mut self) -> &mut [f64] {
        &mut self.values[self.offset..]
    }
}

//! How many numbers a vector of this machine holds.

use pulp::{Arch, Simd, WithSimd};

/// Of f64, and of f32.
pub(crate) fn lanes() -> [usize; 2] {
    Arch::new().dispatch(Count)
}

struct Count;

impl WithSimd for Count {
    type Output = [usize; 2];

    #[inline(always)]
    fn with_simd<S: Simd>(self, _: S) -> Self::Output {
        [S::F64_LANES, S::F32_LANES]
    }
}

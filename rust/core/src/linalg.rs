//! Dense and banded linear algebra: the only file that names faer.
//!
//! Dense matrices are nalgebra's `DMatrix` (contiguous, column-major), handed to faer as views.
//! faer returns NaN for a singular matrix and panics on a size mismatch; both are checked here.

use faer::linalg::matmul;
use faer::linalg::solvers::{PartialPivLu, Solve};
use faer::{Accum, MatMut, MatRef, Par};
pub use nalgebra::DMatrix;
use pulp::{Arch, Simd, WithSimd};

use crate::error::{Error, Result};

fn view(a: &DMatrix<f64>) -> MatRef<'_, f64> {
    MatRef::from_column_major_slice(a.as_slice(), a.nrows(), a.ncols())
}

fn view_mut(a: &mut DMatrix<f64>) -> MatMut<'_, f64> {
    let (rows, columns) = a.shape();
    MatMut::from_column_major_slice_mut(a.as_mut_slice(), rows, columns)
}

/// A matrix of zeros. (Zeroed memory; nalgebra's own writes entry by entry.)
pub(crate) fn zeros(rows: usize, columns: usize) -> DMatrix<f64> {
    DMatrix::from_vec(rows, columns, vec![0.0; rows * columns])
}

/// `A B`, sequential: threads go over vehicles and scenarios, not into one product.
#[must_use]
pub fn multiply(a: &DMatrix<f64>, b: &DMatrix<f64>) -> DMatrix<f64> {
    let mut product = zeros(a.nrows(), b.ncols());
    multiply_into(&mut product, a, b);
    product
}

/// `out = A B`.
pub(crate) fn multiply_into(out: &mut DMatrix<f64>, a: &DMatrix<f64>, b: &DMatrix<f64>) {
    debug_assert_eq!((a.ncols(), out.shape()), (b.nrows(), (a.nrows(), b.ncols())));
    matmul::matmul(view_mut(out), Accum::Replace, view(a), view(b), 1.0, Par::Seq);
}

/// `out += alpha A B`.
pub(crate) fn multiply_add(out: &mut DMatrix<f64>, alpha: f64, a: &DMatrix<f64>, b: &DMatrix<f64>) {
    debug_assert_eq!((a.ncols(), out.shape()), (b.nrows(), (a.nrows(), b.ncols())));
    matmul::matmul(view_mut(out), Accum::Add, view(a), view(b), alpha, Par::Seq);
}

/// `alpha A`.
pub(crate) fn multiply_by(a: &DMatrix<f64>, alpha: f64) -> DMatrix<f64> {
    let mut out = a.clone();
    for value in out.as_mut_slice() {
        *value *= alpha;
    }
    out
}

/// `out += alpha x`, entry by entry. (nalgebra's own walks over entries do not vectorise.)
#[inline(always)]
pub(crate) fn add_scaled(out: &mut [f64], alpha: f64, x: &[f64]) {
    for (out, x) in out.iter_mut().zip(x) {
        *out += alpha * x;
    }
}

/// The first entry of `a` that is not finite, as an error.
///
/// # Errors
/// [`Error::NonFinite`].
pub fn check_finite(name: &'static str, a: &DMatrix<f64>) -> Result<()> {
    match a.as_slice().iter().position(|v| !v.is_finite()) {
        None => Ok(()),
        Some(at) => Err(Error::NonFinite {
            name,
            value: a[at],
            row: at % a.nrows(),
            column: at / a.nrows(),
        }),
    }
}

/// LU factors of a square matrix: factor once, solve many.
#[derive(Debug)]
pub struct Lu(PartialPivLu<f64>);

impl Lu {
    /// Factor `a`; `advice` is added to the message if it is singular.
    ///
    /// # Errors
    /// [`Error::Shape`], [`Error::NonFinite`], or [`Error::Singular`] where a pivot is below
    /// `n eps` times the largest entry of its column (a test that no change of units alters).
    pub fn new(name: &'static str, a: &DMatrix<f64>, advice: &'static str) -> Result<Self> {
        let n = a.ncols();
        if a.nrows() != n {
            return Err(Error::Shape { name, got: a.shape(), expected: (n, n) });
        }
        check_finite(name, a)?;
        let lu = view(a).partial_piv_lu();
        let upper = lu.U();
        for column in 0..n {
            let pivot = upper[(column, column)].abs();
            let limit = n as f64 * f64::EPSILON * a.column(column).amax();
            if pivot.is_nan() || pivot <= limit {
                return Err(Error::Singular { name, pivot, column, limit, advice });
            }
        }
        Ok(Self(lu))
    }

    /// Solve `A X = B` in place of `B`.
    pub fn solve_in_place(&self, b: &mut DMatrix<f64>) {
        self.0.solve_in_place(view_mut(b));
    }

    /// `A^-1`.
    #[must_use]
    pub fn inverse(&self) -> DMatrix<f64> {
        let n = self.0.L().nrows();
        let mut inverse = DMatrix::identity(n, n);
        self.solve_in_place(&mut inverse);
        inverse
    }
}

/// A square matrix stored by diagonals, as wide as its entries need.
///
/// `diagonals[d][i]` is the entry in row `i`, column `i + d - half`; entries that would fall
/// outside the matrix are zero. A full matrix is the case `half = n - 1`.
#[derive(Debug, Clone, PartialEq)]
pub struct Banded {
    n: usize,
    half: usize,
    diagonals: Vec<f64>,
}

impl Banded {
    /// The matrix of zeros with room for `half` diagonals on each side.
    #[must_use]
    pub fn zeros(n: usize, half: usize) -> Self {
        let half = half.min(n.saturating_sub(1));
        Self { n, half, diagonals: vec![0.0; n * (2 * half + 1)] }
    }

    /// The entries of a dense square matrix, with the bandwidth found from them.
    ///
    /// # Errors
    /// [`Error::Shape`] or [`Error::NonFinite`].
    pub fn from_dense(name: &'static str, a: &DMatrix<f64>) -> Result<Self> {
        let n = a.ncols();
        if a.nrows() != n {
            return Err(Error::Shape { name, got: a.shape(), expected: (n, n) });
        }
        check_finite(name, a)?;
        let entries = || (0..n).flat_map(|j| (0..n).map(move |i| (i, j)));
        let half =
            entries().filter(|&at| a[at] != 0.0).map(|(i, j)| i.abs_diff(j)).max().unwrap_or(0);
        let mut banded = Self::zeros(n, half);
        for (i, j) in entries().filter(|&(i, j)| i.abs_diff(j) <= half) {
            banded.add(i, j, a[(i, j)]);
        }
        Ok(banded)
    }

    /// An error where an entry is not finite.
    ///
    /// # Errors
    /// [`Error::NonFinite`].
    pub fn check_finite(&self, name: &'static str) -> Result<()> {
        match self.diagonals.iter().position(|v| !v.is_finite()) {
            None => Ok(()),
            Some(at) => {
                let (row, column) = (at % self.n, (at % self.n + at / self.n) - self.half);
                Err(Error::NonFinite { name, value: self.diagonals[at], row, column })
            }
        }
    }

    /// Diagonals on each side of the main one.
    #[must_use]
    pub fn half(&self) -> usize {
        self.half
    }

    /// Rows (and columns).
    #[must_use]
    pub fn len(&self) -> usize {
        self.n
    }

    /// Whether it has no rows.
    #[must_use]
    pub fn is_empty(&self) -> bool {
        self.n == 0
    }

    /// Add `value` to the entry in row `i`, column `j`, which must lie within the band.
    pub fn add(&mut self, i: usize, j: usize, value: f64) {
        let at = self.at(i, j);
        self.diagonals[at] += value;
    }

    /// As a dense matrix.
    #[must_use]
    pub fn to_dense(&self) -> DMatrix<f64> {
        DMatrix::from_fn(self.n, self.n, |i, j| self.get(i, j))
    }

    /// The entry in row `i`, column `j`.
    #[must_use]
    pub fn get(&self, i: usize, j: usize) -> f64 {
        if i.abs_diff(j) > self.half { 0.0 } else { self.diagonals[self.at(i, j)] }
    }

    fn at(&self, i: usize, j: usize) -> usize {
        (j + self.half - i) * self.n + i
    }

    /// `out += alpha X A`.
    pub fn left_multiply_add(&self, alpha: f64, x: &DMatrix<f64>, out: &mut DMatrix<f64>) {
        debug_assert_eq!((x.ncols(), x.shape()), (self.n, out.shape()));
        Arch::new().dispatch(LeftMultiply { band: self, alpha, x, out });
    }

    /// `alpha X A`.
    #[must_use]
    pub fn left_multiply(&self, alpha: f64, x: &DMatrix<f64>) -> DMatrix<f64> {
        let mut out = zeros(x.nrows(), self.n);
        self.left_multiply_add(alpha, x, &mut out);
        out
    }
}

struct LeftMultiply<'a> {
    band: &'a Banded,
    alpha: f64,
    x: &'a DMatrix<f64>,
    out: &'a mut DMatrix<f64>,
}

impl WithSimd for LeftMultiply<'_> {
    type Output = ();

    /// Each column of the product combines a few whole columns, vector by vector in a register.
    #[inline(always)]
    fn with_simd<S: Simd>(self, simd: S) {
        let Self { band: Banded { n, half, .. }, alpha, x, out } = self;
        let rows = x.nrows();
        let mut factors = Vec::with_capacity(2 * half + 1);
        for (j, out) in out.as_mut_slice().chunks_exact_mut(rows).enumerate() {
            let first = j.saturating_sub(*half);
            let last = (j + half + 1).min(*n);
            factors.clear();
            factors.extend((first..last).map(|i| alpha * self.band.get(i, j)));
            let columns = &x.as_slice()[first * rows..last * rows];
            let (vectors, _) = S::as_mut_simd_f64s(out);
            let whole = vectors.len() * S::F64_LANES;
            for (at, out) in vectors.iter_mut().enumerate() {
                let mut sum = *out;
                for (factor, column) in factors.iter().zip(columns.chunks_exact(rows)) {
                    let piece = S::as_simd_f64s(&column[at * S::F64_LANES..]).0[0];
                    sum = simd.mul_add_f64s(simd.splat_f64s(*factor), piece, sum);
                }
                *out = sum;
            }
            for (factor, column) in factors.iter().zip(columns.chunks_exact(rows)) {
                add_scaled(&mut out[whole..], *factor, &column[whole..]);
            }
        }
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn banded_product_equals_dense_product() -> Result<()> {
        let a =
            DMatrix::from_fn(
                7,
                7,
                |i, j| {
                    if i.abs_diff(j) <= 2 { 1.0 + (i * 7 + j) as f64 } else { 0.0 }
                },
            );
        let x = DMatrix::from_fn(45, 7, |i, j| (i as f64 - j as f64).sin());
        let banded = Banded::from_dense("a", &a)?;
        assert_eq!(banded.half, 2);
        assert!((banded.left_multiply(2.0, &x) - multiply(&x, &a) * 2.0).amax() < 1e-12);
        assert_eq!(banded.to_dense(), a);
        Ok(())
    }

    #[test]
    fn a_singular_matrix_is_an_error_whatever_its_units() {
        let singular = DMatrix::from_row_slice(2, 2, &[1.0, 2.0, 2.0, 4.0]);
        for scale in [1e-9, 1.0, 1e9] {
            let error = Lu::new("test matrix", &(&singular * scale), "").err();
            assert!(matches!(error, Some(Error::Singular { name: "test matrix", .. })));
        }
        let scaled = DMatrix::from_diagonal(&nalgebra::DVector::from_vec(vec![1e-12, 1e12]));
        assert!(Lu::new("diagonal", &scaled, "").is_ok());
    }
}

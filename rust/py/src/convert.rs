//! Between numpy and the core: all array conversion, and errors to exceptions.

use numpy::{
    PyArray1, PyArray2, PyArrayMethods, PyReadonlyArray1, PyReadonlyArray2, PyUntypedArrayMethods,
};
use pavefem_core::error::{Error, Kind};
use pavefem_core::linalg::DMatrix;
use pyo3::exceptions::{PyKeyboardInterrupt, PyValueError};
use pyo3::prelude::*;

pyo3::import_exception!(pavefem.errors, SolverError);

/// The exception for an error of the core.
pub(crate) fn exception(error: Error) -> PyErr {
    let message = error.to_string();
    match error.kind() {
        Kind::Input => PyValueError::new_err(message),
        Kind::Solver => SolverError::new_err(message),
        Kind::Stopped => PyKeyboardInterrupt::new_err(message),
    }
}

/// A copy of a vector, whatever its stride.
pub(crate) fn vector(array: &PyReadonlyArray1<'_, f64>) -> Vec<f64> {
    array.as_array().iter().copied().collect()
}

/// A copy of a table, row by row, whatever its strides.
pub(crate) fn rows(array: &PyReadonlyArray2<'_, f64>) -> Vec<f64> {
    array.as_array().iter().copied().collect()
}

/// The rows of a table of `N` columns.
pub(crate) fn records<const N: usize>(
    name: &str,
    array: &PyReadonlyArray2<'_, f64>,
) -> PyResult<Vec<[f64; N]>> {
    let columns = array.shape()[1];
    if columns != N {
        let message = format!("{name} has {columns} columns, expected {N}");
        return Err(PyValueError::new_err(message));
    }
    let values = rows(array);
    Ok(values.as_chunks().0.to_vec())
}

/// A copy of a matrix, whatever its strides.
pub(crate) fn matrix(array: &PyReadonlyArray2<'_, f64>) -> DMatrix<f64> {
    let view = array.as_array();
    let (rows, columns) = view.dim();
    let columns_first = (0..columns).flat_map(|j| (0..rows).map(move |i| view[[i, j]]));
    DMatrix::from_vec(rows, columns, columns_first.collect())
}

/// A matrix as a numpy array.
pub(crate) fn matrix_to_array<'py>(
    py: Python<'py>,
    matrix: &DMatrix<f64>,
) -> PyResult<Bound<'py, PyArray2<f64>>> {
    let values: Vec<f64> = matrix.transpose().as_slice().to_vec();
    table(py, values, matrix.ncols())
}

/// Row-by-row values as a numpy array of `columns` columns.
pub(crate) fn table(
    py: Python<'_>,
    values: Vec<f64>,
    columns: usize,
) -> PyResult<Bound<'_, PyArray2<f64>>> {
    let rows = values.len().checked_div(columns).unwrap_or(0);
    PyArray1::from_vec(py, values).reshape([rows, columns])
}

/// One of a few names, or an error that lists them.
pub(crate) fn choice<T: Copy>(what: &str, given: &str, allowed: &[(&str, T)]) -> PyResult<T> {
    let found = allowed.iter().find(|(name, _)| *name == given);
    found.map(|(_, value)| *value).ok_or_else(|| {
        let names: Vec<String> = allowed.iter().map(|(name, _)| format!("{name:?}")).collect();
        let message = format!("{what} = {given:?}: must be one of {}", names.join(", "));
        PyValueError::new_err(message)
    })
}

/// A whole number that a table holds as a double.
pub(crate) fn index(name: &str, value: f64) -> PyResult<usize> {
    if value >= 0.0 && value.fract() == 0.0 && value < 1e9 {
        Ok(value as usize)
    } else {
        Err(PyValueError::new_err(format!("{name} = {value}: must be a whole number from 0")))
    }
}

//! Asphalt stiffness, element by element over arrays of one length.

use numpy::{PyArray1, PyReadonlyArray1};
use pavefem_core::asphalt;
use pavefem_core::error::Result;
use pyo3::exceptions::PyValueError;
use pyo3::prelude::*;

use crate::convert::{exception, vector};

/// `law` of the i-th of each vector.
fn map<'py, const N: usize>(
    py: Python<'py>,
    arrays: [PyReadonlyArray1<'_, f64>; N],
    law: impl Fn([f64; N]) -> Result<f64>,
) -> PyResult<Bound<'py, PyArray1<f64>>> {
    let vectors = arrays.map(|array| vector(&array));
    let n = vectors[0].len();
    if vectors.iter().any(|vector| vector.len() != n) {
        return Err(PyValueError::new_err("the arrays differ in length"));
    }
    let at = |i: usize| law(std::array::from_fn(|k| vectors[k][i]));
    let values = (0..n).map(at).collect::<Result<Vec<f64>>>().map_err(exception)?;
    Ok(PyArray1::from_vec(py, values))
}

#[pyfunction]
pub(crate) fn binder_stiffness<'py>(
    py: Python<'py>,
    loading_time: PyReadonlyArray1<'_, f64>,
    temperature_c: PyReadonlyArray1<'_, f64>,
    softening_point_c: PyReadonlyArray1<'_, f64>,
    penetration_index: PyReadonlyArray1<'_, f64>,
) -> PyResult<Bound<'py, PyArray1<f64>>> {
    let arrays = [loading_time, temperature_c, softening_point_c, penetration_index];
    map(py, arrays, |[time, temperature, softening, index]| {
        asphalt::binder_stiffness(time, temperature, softening, index)
    })
}

#[pyfunction]
pub(crate) fn mix_modulus<'py>(
    py: Python<'py>,
    binder_stiffness: PyReadonlyArray1<'_, f64>,
    vma: PyReadonlyArray1<'_, f64>,
) -> PyResult<Bound<'py, PyArray1<f64>>> {
    map(py, [binder_stiffness, vma], |[binder, vma]| asphalt::mix_modulus(binder, vma))
}

//! The international roughness index.

use numpy::{PyArray1, PyReadonlyArray1};
use pavefem_core::roughness;
use pyo3::prelude::*;

use crate::convert::vector;
use crate::watch::detached;

#[pyfunction]
#[pyo3(signature = (elevations, spacing, moving_average, segment=None))]
pub(crate) fn iri<'py>(
    py: Python<'py>,
    elevations: PyReadonlyArray1<'_, f64>,
    spacing: f64,
    moving_average: bool,
    segment: Option<f64>,
) -> PyResult<Bound<'py, PyArray1<f64>>> {
    let elevations = vector(&elevations);
    let found = detached(py, None, |watch| {
        roughness::iri(&elevations, spacing, moving_average, segment, watch)
    })?;
    Ok(PyArray1::from_vec(py, found))
}

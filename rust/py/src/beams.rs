//! The closed forms.

use numpy::{PyArray1, PyReadonlyArray1};
use pavefem_core::analytical;
use pyo3::prelude::*;

use crate::convert::{exception, vector};

#[pyclass(frozen, module = "pavefem._core")]
pub(crate) struct WinklerBeam(analytical::WinklerBeam);

#[pymethods]
impl WinklerBeam {
    #[new]
    #[pyo3(signature = (*, bending_stiffness, bending_damping, mass, damping, stiffness))]
    fn new(
        bending_stiffness: f64,
        bending_damping: f64,
        mass: f64,
        damping: f64,
        stiffness: f64,
    ) -> PyResult<Self> {
        let beam = analytical::WinklerBeam {
            bending_stiffness,
            bending_damping,
            mass,
            damping,
            stiffness,
        };
        beam.check().map_err(exception)?;
        Ok(Self(beam))
    }

    #[getter]
    fn decay(&self) -> f64 {
        self.0.decay()
    }

    #[getter]
    fn critical_speed(&self) -> f64 {
        self.0.critical_speed()
    }

    fn static_deflection<'py>(
        &self,
        py: Python<'py>,
        force: f64,
        x: PyReadonlyArray1<'_, f64>,
    ) -> Bound<'py, PyArray1<f64>> {
        let at = |x| self.0.static_deflection_at(force, x);
        PyArray1::from_vec(py, vector(&x).into_iter().map(at).collect())
    }

    fn static_moment(&self, force: f64) -> f64 {
        self.0.static_moment(force)
    }

    fn moving_deflection<'py>(
        &self,
        py: Python<'py>,
        force: f64,
        speed: f64,
        xi: PyReadonlyArray1<'_, f64>,
        print: f64,
    ) -> PyResult<Bound<'py, PyArray1<f64>>> {
        let moving = self.moving_load(speed, print)?;
        let at = |xi| force * moving.deflection(xi);
        Ok(PyArray1::from_vec(py, vector(&xi).into_iter().map(at).collect()))
    }

    fn moving_peak(&self, force: f64, speed: f64, print: f64) -> PyResult<(f64, f64)> {
        let (deflection, xi) = self.moving_load(speed, print)?.peak();
        Ok((force * deflection, xi))
    }
}

impl WinklerBeam {
    fn moving_load(&self, speed: f64, print: f64) -> PyResult<analytical::MovingLoad> {
        self.0.moving_load(speed).and_then(|moving| moving.spread(print)).map_err(exception)
    }
}

#[pyclass(frozen, module = "pavefem._core")]
pub(crate) struct SimplySupportedBeam(analytical::SimplySupportedBeam);

#[pymethods]
impl SimplySupportedBeam {
    #[new]
    #[pyo3(signature = (*, length, bending_stiffness, mass))]
    fn new(length: f64, bending_stiffness: f64, mass: f64) -> PyResult<Self> {
        let beam = analytical::SimplySupportedBeam { length, bending_stiffness, mass };
        beam.check().map_err(exception)?;
        Ok(Self(beam))
    }

    fn static_deflection(&self, force: f64) -> f64 {
        self.0.static_deflection(force)
    }

    fn moving_deflection<'py>(
        &self,
        py: Python<'py>,
        force: f64,
        speed: f64,
        x: f64,
        time: PyReadonlyArray1<'_, f64>,
        modes: usize,
    ) -> Bound<'py, PyArray1<f64>> {
        let at = |time| self.0.moving_load(force, speed, x, time, modes);
        PyArray1::from_vec(py, vector(&time).into_iter().map(at).collect())
    }
}

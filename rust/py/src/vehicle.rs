//! Vehicles and their tire forces.

use numpy::{PyArray1, PyArray2, PyReadonlyArray1, PyReadonlyArray2};
use pavefem_core::vehicle::{self, Body, Interpolation, Point, Profile, Run, Spring, Tire};
use pyo3::prelude::*;

use crate::convert::{choice, exception, index, matrix_to_array, records, table, vector};
use crate::watch::detached;

#[pyclass(frozen, module = "pavefem._core")]
pub(crate) struct Vehicle(vehicle::Vehicle);

#[pymethods]
impl Vehicle {
    /// Rows of bodies: mass, inertia, x, pinned to (NaN for a free body), pin; of springs: upper body
    /// and x, lower body and x, stiffness, damping; of tires: body, x, stiffness, damping.
    #[new]
    fn new(
        bodies: PyReadonlyArray2<'_, f64>,
        springs: PyReadonlyArray2<'_, f64>,
        tires: PyReadonlyArray2<'_, f64>,
    ) -> PyResult<Self> {
        let point = |body: f64, x: f64| Ok::<_, PyErr>(Point { body: index("body", body)?, x });
        let body = |[mass, inertia, x, to, pin]: [f64; 5]| {
            let pin = if to.is_nan() { None } else { Some((index("pinned to", to)?, pin)) };
            Ok(Body { mass, inertia, x, pin })
        };
        let spring = |[upper, ux, lower, lx, stiffness, damping]: [f64; 6]| {
            let (upper, lower) = (point(upper, ux)?, point(lower, lx)?);
            Ok(Spring { upper, lower, stiffness, damping })
        };
        let tire = |[body, x, stiffness, damping]: [f64; 4]| {
            Ok(Tire { point: point(body, x)?, stiffness, damping })
        };
        let bodies: PyResult<Vec<Body>> =
            records("bodies", &bodies)?.into_iter().map(body).collect();
        let springs: PyResult<Vec<Spring>> =
            records("springs", &springs)?.into_iter().map(spring).collect();
        let tires: PyResult<Vec<Tire>> = records("tires", &tires)?.into_iter().map(tire).collect();
        vehicle::Vehicle::new(&bodies?, &springs?, &tires?).map(Self).map_err(exception)
    }

    #[getter]
    fn mass<'py>(&self, py: Python<'py>) -> PyResult<Bound<'py, PyArray2<f64>>> {
        matrix_to_array(py, &self.0.system().mass.to_dense())
    }

    #[getter]
    fn damping<'py>(&self, py: Python<'py>) -> PyResult<Bound<'py, PyArray2<f64>>> {
        matrix_to_array(py, &self.0.system().damping.to_dense())
    }

    #[getter]
    fn stiffness<'py>(&self, py: Python<'py>) -> PyResult<Bound<'py, PyArray2<f64>>> {
        matrix_to_array(py, &self.0.system().stiffness.to_dense())
    }

    #[getter]
    fn static_loads<'py>(&self, py: Python<'py>) -> Bound<'py, PyArray1<f64>> {
        PyArray1::from_slice(py, self.0.static_loads())
    }

    #[expect(clippy::too_many_arguments, reason = "each is a plain number the run needs")]
    #[pyo3(signature = (x, z, interpolation, speed, dt, start, skip, steps, progress=None))]
    fn tire_forces<'py>(
        &self,
        py: Python<'py>,
        x: PyReadonlyArray1<'_, f64>,
        z: PyReadonlyArray1<'_, f64>,
        interpolation: &str,
        speed: f64,
        dt: f64,
        start: f64,
        skip: usize,
        steps: usize,
        progress: Option<Py<PyAny>>,
    ) -> PyResult<Bound<'py, PyArray2<f64>>> {
        let kinds = [("linear", Interpolation::Linear), ("staircase", Interpolation::Staircase)];
        let interpolation = choice("interpolation", interpolation, &kinds)?;
        let (x, z) = (vector(&x), vector(&z));
        let forces = detached(py, progress.as_ref(), |watch| {
            let profile = Profile::new(&x, &z, interpolation)?;
            self.0.tire_forces(&profile, &Run { speed, dt, start, skip, steps }, watch)
        })?;
        table(py, forces, self.0.static_loads().len())
    }
}

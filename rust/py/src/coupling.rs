//! Vehicle and road that feel each other.

use numpy::{PyArray2, PyReadonlyArray1, PyReadonlyArray2};
use pavefem_core::coupling::{self, Coupled};
use pavefem_core::vehicle::Profile;
use pyo3::prelude::*;

use crate::convert::{rows, table, vector};
use crate::pavement::Window;
use crate::vehicle::{RunRow, Vehicle, interpolated};
use crate::watch::detached;

/// Forces of the axles, deflections under them, and the most iterations that a step took.
type Kept<'py> = (Bound<'py, PyArray2<f64>>, Bound<'py, PyArray2<f64>>, usize);

/// Run a vehicle over a profile and a road, `run` being a row as `fleet_forces` takes it.
#[pyfunction]
#[expect(clippy::too_many_arguments, reason = "each is a plain value the run needs")]
#[pyo3(signature = (
    vehicle, run, x, z, interpolation, dt, lift_off, tolerance, road, positions, progress=None
))]
pub(crate) fn two_way<'py>(
    py: Python<'py>,
    vehicle: Py<Vehicle>,
    run: RunRow,
    x: PyReadonlyArray1<'_, f64>,
    z: PyReadonlyArray1<'_, f64>,
    interpolation: &str,
    dt: f64,
    lift_off: bool,
    tolerance: f64,
    road: Py<Window>,
    positions: PyReadonlyArray2<'_, f64>,
    progress: Option<Py<PyAny>>,
) -> PyResult<Kept<'py>> {
    let interpolation = interpolated(interpolation)?;
    let (x, z, positions) = (vector(&x), vector(&z), rows(&positions));
    let passage = vehicle.get().passage(run, dt, lift_off, tolerance);
    let axles = passage.vehicle.static_loads().len();
    let road = &road.get().road;
    let Coupled { forces, under_axles, iterations } = detached(py, progress.as_ref(), |watch| {
        let profile = Profile::new(&x, &z, interpolation)?;
        coupling::two_way(&passage, &profile, road, &positions, watch)
    })?;
    Ok((table(py, forces, axles)?, table(py, under_axles, axles)?, iterations))
}

//! Vehicles and their tire forces.

use std::num::NonZero;

use numpy::{PyArray1, PyArray2, PyReadonlyArray1, PyReadonlyArray2};
use pavefem_core::vehicle::{
    self, Body, Friction, Interpolation, Keep, Passage, Point, Profile, Record, Run, Spring, Tire,
};
use pyo3::exceptions::PyValueError;
use pyo3::prelude::*;

use crate::convert::{choice, exception, index, matrix_to_array, records, table, vector};
use crate::watch::detached;

#[pyclass(frozen, module = "pavefem._core")]
pub(crate) struct Vehicle(pub(crate) vehicle::Vehicle);

#[pymethods]
impl Vehicle {
    /// Rows of bodies: mass, inertia, x, pinned to (NaN for a free body), pin; of springs: upper body
    /// and x, stiffness, damping, friction (NaN for none) and its travel; of their lower ends:
    /// number of the spring, body, x; of tires: body, x, print, stiffness, damping.
    #[new]
    fn new(
        bodies: PyReadonlyArray2<'_, f64>,
        springs: PyReadonlyArray2<'_, f64>,
        ends: PyReadonlyArray2<'_, f64>,
        tires: PyReadonlyArray2<'_, f64>,
    ) -> PyResult<Self> {
        let point = |body: f64, x: f64| Ok::<_, PyErr>(Point { body: index("body", body)?, x });
        let body = |[mass, inertia, x, to, pin]: [f64; 5]| {
            let pin = if to.is_nan() { None } else { Some((index("pinned to", to)?, pin)) };
            Ok(Body { mass, inertia, x, pin })
        };
        let spring = |[body, x, stiffness, damping, force, travel]: [f64; 6]| {
            let friction = (!force.is_nan()).then_some(Friction { force, travel });
            Ok(Spring { upper: point(body, x)?, lower: Vec::new(), stiffness, damping, friction })
        };
        let tire = |[body, x, print, stiffness, damping]: [f64; 5]| {
            Ok(Tire { point: point(body, x)?, print, stiffness, damping })
        };
        let bodies: PyResult<Vec<Body>> =
            records("bodies", &bodies)?.into_iter().map(body).collect();
        let springs: PyResult<Vec<Spring>> =
            records("springs", &springs)?.into_iter().map(spring).collect();
        let tires: PyResult<Vec<Tire>> = records("tires", &tires)?.into_iter().map(tire).collect();
        let mut springs = springs?;
        for [number, body, x] in records("ends", &ends)? {
            let spring = springs.get_mut(index("spring", number)?);
            let spring = spring.ok_or_else(|| PyValueError::new_err("an end of no spring"))?;
            spring.lower.push(point(body, x)?);
        }
        vehicle::Vehicle::new(&bodies?, &springs, &tires?).map(Self).map_err(exception)
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
}

/// Speed, start, steps to skip, steps to keep.
pub(crate) type RunRow = (f64, f64, usize, usize);

impl Vehicle {
    /// A run of it.
    pub(crate) fn passage(
        &self,
        (speed, start, skip, steps): RunRow,
        dt: f64,
        lift_off: bool,
        tolerance: f64,
    ) -> Passage<'_> {
        let run = Run { speed, dt, start, skip, steps, lift_off, tolerance };
        Passage { vehicle: &self.0, run }
    }
}

type Kept<'py> = (Bound<'py, PyArray2<f64>>, Bound<'py, PyArray2<f64>>, Bound<'py, PyArray2<f64>>);

/// Rows of runs: speed, start, steps to skip, steps to keep. For each vehicle: its history, its
/// forces at the stations, and a row of statistics for each axle (mean, standard deviation, lowest,
/// highest, instants off the road).
#[pyfunction]
#[expect(clippy::too_many_arguments, reason = "each is a plain value the runs need")]
#[pyo3(signature = (
    vehicles, runs, x, z, interpolation, dt, lift_off, tolerance, every, stations, threads,
    progress=None
))]
pub(crate) fn fleet_forces<'py>(
    py: Python<'py>,
    vehicles: Vec<Py<Vehicle>>,
    runs: PyReadonlyArray2<'_, f64>,
    x: PyReadonlyArray1<'_, f64>,
    z: PyReadonlyArray1<'_, f64>,
    interpolation: &str,
    dt: f64,
    lift_off: bool,
    tolerance: f64,
    every: Option<usize>,
    stations: PyReadonlyArray1<'_, f64>,
    threads: usize,
    progress: Option<Py<PyAny>>,
) -> PyResult<Vec<Kept<'py>>> {
    let interpolation = interpolated(interpolation)?;
    let (x, z) = (vector(&x), vector(&z));
    let keep = Keep { every, stations: vector(&stations) };
    let threads = NonZero::new(threads)
        .ok_or_else(|| PyValueError::new_err("threads = 0: must be at least 1"))?;
    let runs = records("runs", &runs)?;
    if runs.len() != vehicles.len() {
        let message = format!("runs has {} rows, expected {}", runs.len(), vehicles.len());
        return Err(PyValueError::new_err(message));
    }
    let mut passages = Vec::with_capacity(runs.len());
    for (vehicle, [speed, start, skip, steps]) in vehicles.iter().zip(runs) {
        let row = (speed, start, index("skip", skip)?, index("steps", steps)?);
        passages.push(vehicle.get().passage(row, dt, lift_off, tolerance));
    }
    let found = detached(py, progress.as_ref(), |watch| {
        let profile = Profile::new(&x, &z, interpolation)?;
        vehicle::fleet(&passages, &profile, &keep, threads, watch)
    })?;
    found.into_iter().map(|record| kept(py, record)).collect()
}

/// Run a vehicle, its run being a row as `fleet_forces` takes it, and call `take(forces)` with so many
/// instants at a time; what `take` raises ends the run.
#[pyfunction]
#[expect(clippy::too_many_arguments, reason = "each is a plain value the run needs")]
pub(crate) fn forces_in_blocks(
    py: Python<'_>,
    vehicle: Py<Vehicle>,
    run: RunRow,
    x: PyReadonlyArray1<'_, f64>,
    z: PyReadonlyArray1<'_, f64>,
    interpolation: &str,
    dt: f64,
    lift_off: bool,
    tolerance: f64,
    instants: usize,
    take: Py<PyAny>,
) -> PyResult<()> {
    let interpolation = interpolated(interpolation)?;
    let (x, z) = (vector(&x), vector(&z));
    let passage = vehicle.get().passage(run, dt, lift_off, tolerance);
    let axles = passage.vehicle.static_loads().len();
    let mut raised = None;
    let mut hand_over = |forces: &[f64]| {
        let taken = Python::attach(|py| take.call1(py, (table(py, forces.to_vec(), axles)?,)));
        raised = taken.err();
        raised.is_none()
    };
    let outcome = detached(py, None, |watch| {
        let profile = Profile::new(&x, &z, interpolation)?;
        vehicle::in_blocks(&passage, &profile, instants, &mut hand_over, watch)
    });
    raised.map_or(outcome, Err)
}

pub(crate) fn interpolated(name: &str) -> PyResult<Interpolation> {
    let kinds = [("linear", Interpolation::Linear), ("staircase", Interpolation::Staircase)];
    choice("interpolation", name, &kinds)
}

fn kept(py: Python<'_>, record: Record) -> PyResult<Kept<'_>> {
    let axles = record.axles.len();
    let statistics = record.axles.iter().flat_map(|axle| {
        [axle.mean, axle.deviation, axle.lowest, axle.highest, axle.airborne as f64]
    });
    Ok((
        table(py, record.history, axles)?,
        table(py, record.at_stations, axles)?,
        table(py, statistics.collect(), 5)?,
    ))
}

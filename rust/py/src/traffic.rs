//! Runs of traffic.

use std::num::NonZero;
use std::sync::{Mutex, MutexGuard, PoisonError};

use numpy::{
    PyArray1, PyArray2, PyArrayMethods, PyReadonlyArray1, PyReadonlyArray2, PyReadonlyArray3,
};
use pavefem_core::pavement::{Bed, Section};
use pavefem_core::response::traffic::{
    self, Break, Carriageway, Discretisation, Inputs, Lane, Outcome, Passage, Precision, Ride,
    Surface,
};
use pyo3::exceptions::PyValueError;
use pyo3::prelude::*;
use pyo3::types::{PyBytes, PyDict};

use crate::convert::{choice, exception, index, records, table, vector};
use crate::pavement::{ends, foundation, scheme};
use crate::vehicle::{Vehicle, interpolated};
use crate::watch::detached;

/// Numbers of `vehicles()`, a row for each passage.
const SEEN: usize = 10;

/// Time of what is not the end of anything.
const NEVER: f64 = 9e15;

type Road<'py> =
    (PyReadonlyArray1<'py, f64>, PyReadonlyArray3<'py, f64>, PyReadonlyArray1<'py, f64>);
type Elevations<'py> = (PyReadonlyArray1<'py, f64>, PyReadonlyArray1<'py, f64>, String);

/// A run of traffic, as the core has it.
#[pyclass(frozen, module = "pavefem._core")]
pub(crate) struct Traffic(Mutex<traffic::Traffic>);

impl Traffic {
    fn run(&self) -> MutexGuard<'_, traffic::Traffic> {
        self.0.lock().unwrap_or_else(PoisonError::into_inner)
    }
}

#[pymethods]
impl Traffic {
    /// Roads: lengths of sections, constants of (class, section), thicknesses. Surfaces: x, z, and what is
    /// between. Rows of lanes: road, surface or -1; of passages: vehicle, lane, share, run-in, number of its
    /// first break; of breaks: time, place, speed, class; of stations: lane, place.
    #[new]
    #[expect(clippy::too_many_arguments, reason = "each is a plain value the run needs")]
    #[pyo3(signature = (
        *, roads, element_length, foundation, ends, weights, tire_print, hold, dt, profiles, lanes,
        vehicles, passages, breaks, until, powers, bins, stations, begin, end, part, precision, threads
    ))]
    fn new(
        roads: Vec<Road<'_>>,
        element_length: f64,
        foundation: &str,
        ends: &str,
        weights: &str,
        tire_print: f64,
        hold: &str,
        dt: f64,
        profiles: Vec<Elevations<'_>>,
        lanes: PyReadonlyArray2<'_, f64>,
        vehicles: Vec<Py<Vehicle>>,
        passages: PyReadonlyArray2<'_, f64>,
        breaks: PyReadonlyArray2<'_, f64>,
        until: PyReadonlyArray1<'_, f64>,
        powers: Vec<f64>,
        bins: PyReadonlyArray1<'_, f64>,
        stations: PyReadonlyArray2<'_, f64>,
        begin: i64,
        end: i64,
        part: (f64, f64),
        precision: &str,
        threads: usize,
    ) -> PyResult<Self> {
        let (contact, hold) = scheme(weights, hold, tire_print)?;
        let precisions = [("double", Precision::Double), ("single", Precision::Single)];
        let scheme = Discretisation {
            element_length,
            foundation: self::foundation(foundation)?,
            ends: self::ends(ends)?,
            contact,
            hold,
            dt,
            precision: choice("precision", precision, &precisions)?,
        };
        let roads = roads.iter().map(carriageway).collect::<PyResult<_>>()?;
        let surface = |(x, z, between): &Elevations<'_>| {
            let interpolation = interpolated(between)?;
            Ok(Surface { x: vector(x), z: vector(z), interpolation })
        };
        let surfaces = profiles.iter().map(surface).collect::<PyResult<_>>()?;
        let lane = |[road, surface]: [f64; 2]| {
            let surface = if surface < 0.0 { None } else { Some(index("profile", surface)?) };
            Ok(Lane { road: index("road", road)?, surface })
        };
        let lanes = records("lanes", &lanes)?.into_iter().map(lane).collect::<PyResult<_>>()?;
        let station = |[lane, x]: [f64; 2]| Ok((index("lane", lane)?, x));
        let stations = records("stations", &stations)?;
        let stations = stations.into_iter().map(station).collect::<PyResult<_>>()?;
        let inputs = Inputs {
            scheme,
            roads,
            surfaces,
            lanes,
            vehicles: vehicles.iter().map(|vehicle| vehicle.get().0.clone()).collect(),
            passages: given_passages(&passages, &breaks, &until)?,
            outcome: Outcome { powers, bins: vector(&bins), stations, ticks: begin..end, part },
        };
        let threads = NonZero::new(threads)
            .ok_or_else(|| PyValueError::new_err("threads = 0: must be at least 1"))?;
        let run = traffic::Traffic::new(inputs, threads).map_err(exception)?;
        Ok(Self(Mutex::new(run)))
    }

    #[getter]
    fn nodes<'py>(&self, py: Python<'py>) -> Bound<'py, PyArray1<f64>> {
        PyArray1::from_slice(py, self.run().nodes())
    }

    #[getter]
    fn tick(&self) -> i64 {
        self.run().tick()
    }

    #[getter]
    fn finished(&self) -> bool {
        self.run().is_finished()
    }

    #[getter]
    fn active(&self) -> usize {
        self.run().active()
    }

    #[getter]
    fn vehicle_seconds(&self) -> f64 {
        self.run().vehicle_seconds()
    }

    /// Go on by so many ticks, in whole intervals, but not beyond the end. A row of the stations'
    /// deflections for each tick done.
    #[pyo3(signature = (ticks, progress=None))]
    fn advance<'py>(
        &self,
        py: Python<'py>,
        ticks: i64,
        progress: Option<Py<PyAny>>,
    ) -> PyResult<Bound<'py, PyArray2<f64>>> {
        let (history, columns) = detached(py, progress.as_ref(), |_| {
            let mut run = self.run();
            let (mut history, end) = (Vec::new(), run.tick().saturating_add(ticks));
            while run.tick() < end && !run.is_finished() {
                history.extend(run.advance()?);
            }
            Ok((history, run.outcome().stations.len()))
        })?;
        table(py, history, columns)
    }

    /// What all passes have come to, a dictionary for each lane.
    fn lanes<'py>(&self, py: Python<'py>) -> PyResult<Vec<Bound<'py, PyDict>>> {
        let run = self.run();
        let powers = run.outcome().powers.len();
        let lane = |totals: &traffic::Totals| {
            let found = PyDict::new(py);
            let vectors = [
                ("lowest", &totals.lowest),
                ("highest", &totals.highest),
                ("time_of_lowest", &totals.time_of_lowest),
                ("strain", &totals.strain),
                ("force", &totals.force),
            ];
            for (name, values) in vectors {
                found.set_item(name, PyArray1::from_slice(py, values))?;
            }
            let tables = [
                ("deflection_powers", &totals.deflection_powers),
                ("strain_powers", &totals.strain_powers),
                ("force_powers", &totals.force_powers),
            ];
            for (name, values) in tables {
                found.set_item(name, shaped(py, values, [totals.lowest.len(), powers])?)?;
            }
            found.set_item("passes", PyArray1::from_slice(py, &totals.passes))?;
            let nodes = totals.lowest.len();
            let bins = totals.histogram.len().checked_div(nodes).unwrap_or(0);
            found.set_item("histogram", shaped(py, &totals.histogram, [nodes, bins])?)?;
            Ok(found)
        };
        run.totals().iter().map(lane).collect()
    }

    /// A row for each passage: instants that its forces are of (NaN for a smooth road or one that is not over), the largest DLC of its
    /// axles, its largest force, N, where that was, m, and on which axle; the largest deflection under it,
    /// m, where, m, and the largest strain; when it comes onto the lane and when it leaves, s.
    fn vehicles<'py>(&self, py: Python<'py>) -> PyResult<Bound<'py, PyArray2<f64>>> {
        let run = self.run();
        let dt = run.dt();
        let seen = run.worst().iter().zip(run.rides()).zip(run.stays());
        let rows = seen.flat_map(|((worst, ride), stay)| {
            let [instants, dlc, force, place, axle] = ride.map_or([f64::NAN; 5], |ride| {
                let Ride { instants, dlc, force, axle, place } = ride;
                [instants as f64, dlc, force, place, axle as f64]
            });
            let time = |tick: i64| {
                let seconds = tick as f64 * dt;
                if seconds < NEVER { seconds } else { f64::INFINITY }
            };
            let deepest = if worst.lowest < 0.0 { -worst.lowest } else { 0.0 };
            let (from, to) = (time(stay.start), time(stay.end));
            [instants, dlc, force, place, axle, deepest, worst.place, worst.strain, from, to]
        });
        table(py, rows.collect(), SEEN)
    }

    /// All that is needed to go on from here.
    fn state<'py>(&self, py: Python<'py>) -> Bound<'py, PyBytes> {
        PyBytes::new(py, &self.run().state())
    }

    /// Go on from a state of the same run.
    fn restore(&self, state: &[u8]) -> PyResult<()> {
        self.run().restore(state).map_err(exception)
    }
}

fn carriageway((lengths, constants, thickness): &Road<'_>) -> PyResult<Carriageway> {
    let (lengths, constants) = (lengths.as_array(), constants.as_array());
    let (_, sections, columns) = constants.dim();
    if columns != 6 || sections != lengths.len() {
        let message = format!(
            "constants has shape {:?}: must be (classes, {}, 6)",
            constants.shape(),
            lengths.len()
        );
        return Err(PyValueError::new_err(message));
    }
    let class = |rows: numpy::ndarray::ArrayView2<'_, f64>| {
        let section = |(row, &length): (numpy::ndarray::ArrayView1<'_, f64>, &f64)| Section {
            length,
            bending_stiffness: row[0],
            bending_damping: row[1],
            mass: row[2],
            bed: Bed { stiffness: row[3], damping: row[4], mass: row[5] },
        };
        rows.outer_iter().zip(&lengths).map(section).collect()
    };
    let classes = constants.outer_iter().map(class).collect();
    Ok(Carriageway { classes, thickness: vector(thickness) })
}

fn given_passages(
    passages: &PyReadonlyArray2<'_, f64>,
    breaks: &PyReadonlyArray2<'_, f64>,
    until: &PyReadonlyArray1<'_, f64>,
) -> PyResult<Vec<Passage>> {
    let (rows, until) = (records::<5>("passages", passages)?, vector(until));
    let breaks = records::<4>("breaks", breaks)?;
    if until.len() != rows.len() {
        let message = format!("until has {} numbers, expected {}", until.len(), rows.len());
        return Err(PyValueError::new_err(message));
    }
    let mut firsts =
        rows.iter().map(|row| index("first break", row[4])).collect::<PyResult<Vec<_>>>()?;
    firsts.push(breaks.len());
    let passage =
        |(number, ([vehicle, lane, share, run_in, _], until)): (usize, ([f64; 5], f64))| {
            let own = breaks.get(firsts[number]..firsts[number + 1]).ok_or_else(|| {
                PyValueError::new_err(format!("passage {number}: its breaks are not there"))
            })?;
            let classes = own.iter().map(|row| index("class", row[3])).collect::<PyResult<_>>()?;
            let at = |&[time, place, speed, _]: &[f64; 4]| Break { time, place, speed };
            Ok(Passage {
                vehicle: index("vehicle", vehicle)?,
                lane: index("lane", lane)?,
                share,
                run_in,
                breaks: own.iter().map(at).collect(),
                classes,
                until,
            })
        };
    rows.into_iter().zip(until).enumerate().map(passage).collect()
}

/// Row-by-row values as an array.
fn shaped<'py, T: numpy::Element + Copy>(
    py: Python<'py>,
    values: &[T],
    shape: [usize; 2],
) -> PyResult<Bound<'py, PyArray2<T>>> {
    PyArray1::from_slice(py, values).reshape(shape)
}

//! Strips, their transition matrices, and the steppers.

use numpy::{PyArray1, PyArray2, PyReadonlyArray1, PyReadonlyArray2};
use pavefem_core::error::{Result, Watch};
use pavefem_core::pavement::{self, Bed, Contact, Ends, Foundation, Section, Weights};
use pavefem_core::response::{Hold, Keep, Loads, Quantity, Record, banded, dense, window};
use pavefem_core::transition::{self, Form, Levels, Phi, Series, System};
use pyo3::exceptions::PyValueError;
use pyo3::prelude::*;

use crate::convert::{choice, exception, matrix, matrix_to_array, records, rows, table, vector};
use crate::watch::detached;

#[pyclass(frozen, module = "pavefem._core")]
pub(crate) struct Strip(pavement::Strip);

/// Rows of sections: length, bending stiffness and damping, mass of the beam; then stiffness, damping
/// and mass of the bed.
fn sections(rows: &PyReadonlyArray2<'_, f64>) -> PyResult<Vec<Section>> {
    let section = |[length, bending_stiffness, bending_damping, mass, k, c, m]: [f64; 7]| {
        let bed = Bed { stiffness: k, damping: c, mass: m };
        Section { length, bending_stiffness, bending_damping, mass, bed }
    };
    Ok(records("sections", rows)?.into_iter().map(section).collect())
}

fn mesh(
    sections: &[Section],
    element_length: f64,
    foundation: &str,
    ends: &str,
) -> PyResult<pavement::Mesh> {
    let (foundation, ends) = (self::foundation(foundation)?, self::ends(ends)?);
    pavement::Mesh::new(sections, element_length, foundation, ends).map_err(exception)
}

pub(crate) fn foundation(name: &str) -> PyResult<Foundation> {
    let foundations = [("bars", Foundation::Bars), ("winkler", Foundation::Winkler)];
    choice("foundation", name, &foundations)
}

pub(crate) fn ends(name: &str) -> PyResult<Ends> {
    let held = [("clamped", Ends::Clamped), ("pinned", Ends::Pinned), ("free", Ends::Free)];
    choice("ends", name, &held)
}

pub(crate) fn scheme(weights: &str, hold: &str, print: f64) -> PyResult<(Contact, Hold)> {
    let shares = [("linear", Weights::Linear), ("hermite", Weights::Hermite)];
    let holds = [("zero", Hold::Zero), ("first", Hold::First)];
    let contact = Contact { weights: choice("weights", weights, &shares)?, print };
    Ok((contact, choice("hold", hold, &holds)?))
}

#[pymethods]
impl Strip {
    /// Rows as `sections` takes them.
    #[new]
    fn new(
        sections: PyReadonlyArray2<'_, f64>,
        element_length: f64,
        foundation: &str,
        ends: &str,
    ) -> PyResult<Self> {
        let mesh = mesh(&self::sections(&sections)?, element_length, foundation, ends)?;
        pavement::Strip::of(mesh).map(Self).map_err(exception)
    }

    #[getter]
    fn nodes<'py>(&self, py: Python<'py>) -> Bound<'py, PyArray1<f64>> {
        PyArray1::from_slice(py, self.0.nodes())
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
}

#[pyclass(frozen, module = "pavefem._core")]
pub(crate) struct Transition(transition::Transition);

#[pymethods]
impl Transition {
    #[new]
    fn new(
        py: Python<'_>,
        mass: PyReadonlyArray2<'_, f64>,
        damping: PyReadonlyArray2<'_, f64>,
        stiffness: PyReadonlyArray2<'_, f64>,
        dt: f64,
        form: &str,
    ) -> PyResult<Self> {
        let forms = [
            ("auto", None),
            ("stiffness", Some(Form::Stiffness)),
            ("state", Some(Form::State)),
            ("integral", Some(Form::Integral)),
        ];
        let form = choice("form", form, &forms)?;
        let system = System::from_dense(&matrix(&mass), &matrix(&damping), &matrix(&stiffness))
            .map_err(exception)?;
        detached(py, None, |watch| match form {
            None => transition::Transition::of(&system, dt, watch),
            Some(form) => transition::Transition::new(system, dt, form, watch),
        })
        .map(Self)
    }

    #[staticmethod]
    fn of_strip(py: Python<'_>, strip: &Strip, dt: f64) -> PyResult<Self> {
        let system = strip.0.system();
        detached(py, None, |watch| transition::Transition::of(system, dt, watch)).map(Self)
    }

    /// The transition of a strip from what `to_rows` gave.
    #[staticmethod]
    fn from_rows(
        strip: &Strip,
        dt: f64,
        series: (f64, usize, u32),
        levels: PyReadonlyArray2<'_, f64>,
    ) -> PyResult<Self> {
        let (norm, terms, squarings) = series;
        let rows = matrix(&levels);
        let n = rows.ncols();
        if rows.nrows() != 4 * n && rows.nrows() != 8 * n {
            let message =
                format!("levels has shape {:?}, expected (4 n, n) or (8 n, n)", rows.shape());
            return Err(PyValueError::new_err(message));
        }
        let block = |i: usize| rows.rows(i * n, n).into_owned();
        let levels = Levels {
            time: dt,
            rate: block(0),
            impulse: block(1),
            integrals: vec![block(2), block(3)],
        };
        let squared = (rows.nrows() == 8 * n)
            .then(|| Phi::from_blocks(std::array::from_fn(|i| block(4 + i))));
        let series = Series { norm, terms, squarings };
        let system = strip.0.system().clone();
        transition::Transition::from_levels(system, series, levels, squared)
            .map(Self)
            .map_err(exception)
    }

    /// The rate, impulse, step and ramp responses and, where it was squared as a whole, the blocks of
    /// the transition matrix less one, one below the other: `4n x n` or `8n x n`.
    fn to_rows<'py>(&self, py: Python<'py>) -> PyResult<Bound<'py, PyArray2<f64>>> {
        let levels = self.0.levels();
        let responses = [&levels.rate, &levels.impulse].into_iter().chain(&levels.integrals);
        let squared = self.0.squared().into_iter().flat_map(Phi::blocks);
        let blocks = responses.chain(squared);
        let values = blocks.flat_map(|block| block.transpose().as_slice().to_vec()).collect();
        table(py, values, levels.rate.ncols())
    }

    #[getter]
    fn phi<'py>(&self, py: Python<'py>) -> PyResult<Bound<'py, PyArray2<f64>>> {
        matrix_to_array(py, &self.0.phi().to_dense())
    }

    #[getter]
    fn gamma<'py>(&self, py: Python<'py>) -> PyResult<Bound<'py, PyArray2<f64>>> {
        matrix_to_array(py, &self.0.gamma())
    }

    #[getter]
    fn ramp<'py>(&self, py: Python<'py>) -> PyResult<Bound<'py, PyArray2<f64>>> {
        matrix_to_array(py, &self.0.ramp())
    }

    #[getter]
    fn dt(&self) -> f64 {
        self.0.dt()
    }

    #[getter]
    fn norm(&self) -> f64 {
        self.0.series().norm
    }

    #[getter]
    fn terms(&self) -> usize {
        self.0.series().terms
    }

    #[getter]
    fn squarings(&self) -> u32 {
        self.0.series().squarings
    }
}

/// Names of quantities, whether every node is kept, further places, and every n-th instant.
type Kept<'py> = (Vec<String>, bool, PyReadonlyArray1<'py, f64>, usize);

fn keep((quantities, nodes, stations, every): Kept<'_>) -> PyResult<Keep> {
    let names = [
        ("deflection", Quantity::Deflection),
        ("velocity", Quantity::Velocity),
        ("curvature", Quantity::Curvature),
        ("moment", Quantity::Moment),
        ("reaction", Quantity::Reaction),
    ];
    let quantities = quantities.iter().map(|name| choice("quantity", name, &names));
    let quantities = quantities.collect::<PyResult<_>>()?;
    Ok(Keep { quantities, nodes, stations: vector(&stations), every })
}

/// History, then lowest, highest and the step of the lowest of every node, and its lowest while each
/// axle is the nearest.
type Answer<'py> = (
    Bound<'py, PyArray2<f64>>,
    Bound<'py, PyArray1<f64>>,
    Bound<'py, PyArray1<f64>>,
    Bound<'py, PyArray1<usize>>,
    Bound<'py, PyArray2<f64>>,
);

#[pyclass(frozen, module = "pavefem._core")]
pub(crate) struct Stepper(dense::Stepper);

#[pymethods]
impl Stepper {
    #[new]
    #[pyo3(signature = (strip, transition, weights, hold, keep, *, print=0.0))]
    fn new(
        py: Python<'_>,
        strip: &Strip,
        transition: &Transition,
        weights: &str,
        hold: &str,
        keep: Kept<'_>,
        print: f64,
    ) -> PyResult<Self> {
        let scheme = scheme(weights, hold, print)?;
        let keep = self::keep(keep)?;
        let (strip, transition) = (strip.0.clone(), transition.0.clone());
        detached(py, None, |watch| dense::Stepper::new(strip, transition, scheme, &keep, watch))
            .map(Self)
    }

    #[pyo3(signature = (positions, forces, progress=None))]
    fn run<'py>(
        &self,
        py: Python<'py>,
        positions: PyReadonlyArray2<'_, f64>,
        forces: PyReadonlyArray2<'_, f64>,
        progress: Option<Py<PyAny>>,
    ) -> PyResult<Answer<'py>> {
        run(py, &positions, &forces, progress, self.0.columns(), |loads, watch| {
            self.0.run(loads, watch)
        })
    }
}

/// Run a road under loads without the interpreter, and hand over what it kept.
fn run<'py>(
    py: Python<'py>,
    positions: &PyReadonlyArray2<'_, f64>,
    forces: &PyReadonlyArray2<'_, f64>,
    progress: Option<Py<PyAny>>,
    columns: usize,
    work: impl FnOnce(&Loads<'_>, &mut Watch<'_>) -> Result<Record> + Send,
) -> PyResult<Answer<'py>> {
    let record = under(py, positions, forces, progress, work)?;
    answer(py, record, columns)
}

/// Work on loads without the interpreter.
fn under<T: Send>(
    py: Python<'_>,
    positions: &PyReadonlyArray2<'_, f64>,
    forces: &PyReadonlyArray2<'_, f64>,
    progress: Option<Py<PyAny>>,
    work: impl FnOnce(&Loads<'_>, &mut Watch<'_>) -> Result<T> + Send,
) -> PyResult<T> {
    let axles = positions.as_array().dim().1;
    let (positions, forces) = (rows(positions), rows(forces));
    detached(py, progress.as_ref(), |watch| {
        work(&Loads { axles, positions: &positions, forces: &forces }, watch)
    })
}

fn answer(py: Python<'_>, record: Record, columns: usize) -> PyResult<Answer<'_>> {
    let Record { history, envelope } = record;
    let nodes = envelope.lowest.len();
    Ok((
        table(py, history, columns)?,
        PyArray1::from_vec(py, envelope.lowest),
        PyArray1::from_vec(py, envelope.highest),
        PyArray1::from_vec(py, envelope.lowest_step),
        table(py, envelope.passes, nodes)?,
    ))
}

/// A road stepped by the band of its transition matrix.
#[pyclass(frozen, module = "pavefem._core")]
pub(crate) struct Banded(banded::Road);

#[pymethods]
impl Banded {
    #[new]
    #[pyo3(signature = (sections, element_length, foundation, ends, dt, weights, hold, keep, *, print=0.0))]
    #[expect(clippy::too_many_arguments, reason = "each is a plain number the scheme needs")]
    fn new(
        py: Python<'_>,
        sections: PyReadonlyArray2<'_, f64>,
        element_length: f64,
        foundation: &str,
        ends: &str,
        dt: f64,
        weights: &str,
        hold: &str,
        keep: Kept<'_>,
        print: f64,
    ) -> PyResult<Self> {
        let sections = self::sections(&sections)?;
        let mesh = mesh(&sections, element_length, foundation, ends)?;
        let (scheme, keep) = (scheme(weights, hold, print)?, self::keep(keep)?);
        detached(py, None, |watch| banded::Road::new(mesh, dt, scheme, keep, watch)).map(Self)
    }

    #[getter]
    fn nodes<'py>(&self, py: Python<'py>) -> Bound<'py, PyArray1<f64>> {
        PyArray1::from_slice(py, self.0.nodes())
    }

    #[pyo3(signature = (positions, forces, progress=None))]
    fn run<'py>(
        &self,
        py: Python<'py>,
        positions: PyReadonlyArray2<'_, f64>,
        forces: PyReadonlyArray2<'_, f64>,
        progress: Option<Py<PyAny>>,
    ) -> PyResult<Answer<'py>> {
        run(py, &positions, &forces, progress, self.0.columns(), |loads, watch| {
            self.0.run(loads, watch)
        })
    }
}

/// A road stepped through a window.
#[pyclass(frozen, module = "pavefem._core")]
pub(crate) struct Window {
    pub(crate) road: window::Road,
    extrapolate: bool,
}

#[pymethods]
impl Window {
    #[new]
    #[pyo3(signature = (sections, element_length, foundation, ends, dt, weights, hold, keep, *, print=0.0, extrapolate=false))]
    #[expect(clippy::too_many_arguments, reason = "each is a plain number the scheme needs")]
    fn new(
        sections: PyReadonlyArray2<'_, f64>,
        element_length: f64,
        foundation: &str,
        ends: &str,
        dt: f64,
        weights: &str,
        hold: &str,
        keep: Kept<'_>,
        print: f64,
        extrapolate: bool,
    ) -> PyResult<Self> {
        let sections = self::sections(&sections)?;
        let mesh = mesh(&sections, element_length, foundation, ends)?;
        let keep = self::keep(keep)?;
        let road = window::Road::new(mesh, dt, scheme(weights, hold, print)?, keep);
        road.map(|road| Self { road, extrapolate }).map_err(exception)
    }

    #[getter]
    fn nodes<'py>(&self, py: Python<'py>) -> Bound<'py, PyArray1<f64>> {
        PyArray1::from_slice(py, self.road.nodes())
    }

    #[pyo3(signature = (positions, forces, progress=None))]
    fn run<'py>(
        &self,
        py: Python<'py>,
        positions: PyReadonlyArray2<'_, f64>,
        forces: PyReadonlyArray2<'_, f64>,
        progress: Option<Py<PyAny>>,
    ) -> PyResult<Answer<'py>> {
        run(py, &positions, &forces, progress, self.road.columns(), |loads, watch| {
            if self.extrapolate {
                self.road.run_extrapolated(loads, watch)
            } else {
                self.road.run(loads, watch)
            }
        })
    }

    /// How many instants warm a block up at a speed, m/s; infinite where nothing damps it out.
    fn warm_up(&self, speed: f64) -> PyResult<f64> {
        self.road.warm_up(speed).map_err(exception)
    }

    /// A part of a run, with instants of the run ahead of the loads, and of the loads ahead of what is
    /// kept: the first node, and what `run` gives from that node on.
    #[pyo3(signature = (positions, forces, before, warm_up, progress=None))]
    fn run_block<'py>(
        &self,
        py: Python<'py>,
        positions: PyReadonlyArray2<'_, f64>,
        forces: PyReadonlyArray2<'_, f64>,
        before: usize,
        warm_up: usize,
        progress: Option<Py<PyAny>>,
    ) -> PyResult<(usize, Answer<'py>)> {
        let lead = window::Lead { before, warm_up };
        let block = under(py, &positions, &forces, progress, |loads, watch| {
            self.road.run_block(loads, lead, watch)
        })?;
        Ok((block.first_node, answer(py, block.record, self.road.columns())?))
    }
}

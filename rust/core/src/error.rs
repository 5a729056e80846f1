//! One error type for the whole core; every variant carries the numbers that explain it.

use thiserror::Error;

/// What can go wrong in the core.
#[derive(Debug, Clone, PartialEq, Error)]
#[non_exhaustive]
pub enum Error {
    /// A number the caller gave is outside what the model allows.
    #[error("{name} = {value}: must be {allowed}")]
    Invalid {
        /// The quantity, as the caller knows it.
        name: String,
        /// The value that was given, as text with its unit.
        value: String,
        /// The values that are allowed.
        allowed: String,
    },
    /// Two arrays that belong together differ in size.
    #[error("{name} has shape {got:?}, expected {expected:?}")]
    Shape {
        /// The array.
        name: &'static str,
        /// Its shape.
        got: (usize, usize),
        /// The shape it should have.
        expected: (usize, usize),
    },
    /// A matrix or input holds a NaN or an infinity.
    #[error("{name} is not finite: {value} in row {row}, column {column}")]
    NonFinite {
        /// The array.
        name: &'static str,
        /// The offending value.
        value: f64,
        /// Its row, from 0.
        row: usize,
        /// Its column, from 0.
        column: usize,
    },
    /// A matrix that has to be inverted is singular to working precision.
    #[error(
        "the {name} is singular: pivot {pivot:.3e} in column {column} is below {limit:.3e}{advice}"
    )]
    Singular {
        /// The matrix.
        name: &'static str,
        /// The offending pivot of its LU factors.
        pivot: f64,
        /// The column the pivot belongs to, from 0.
        column: usize,
        /// The smallest pivot accepted: `n eps` times the largest entry of that column.
        limit: f64,
        /// What to do about it, or nothing.
        advice: &'static str,
    },
    /// A difference of nearly equal numbers leaves too few digits.
    #[error(
        "the {name} by the {form} form is lost in rounding, relative error {error:.1e}{advice}"
    )]
    Cancelled {
        /// What was to be computed.
        name: &'static str,
        /// The form it was computed by.
        form: &'static str,
        /// Estimate of its relative error.
        error: f64,
        /// What to do about it, or nothing.
        advice: &'static str,
    },
    /// The response grew beyond what a double can hold.
    #[error("the {quantity} is not finite after step {step} (t = {time} s)")]
    Diverged {
        /// What grew.
        quantity: &'static str,
        /// The step at which it was noticed.
        step: usize,
        /// The time of that step.
        time: f64,
    },
    /// A step was divided as often as it may be, and its two answers still differ.
    #[error(
        "the {quantity} do not settle to {tolerance:e} at {place} m in steps of {step:e} s: \
         use a shorter dt, a larger tolerance or softer friction"
    )]
    Unsettled {
        /// What does not settle.
        quantity: &'static str,
        /// Place of the front axle, m.
        place: f64,
        /// Shortest step that was tried, s.
        step: f64,
        /// Tolerance asked for.
        tolerance: f64,
    },
    /// Tires and the road under them find no common force within a step.
    #[error(
        "tire forces and deflection do not settle at {place} m: after {iterations} iterations of a \
         step of {step:e} s a force still changes by {change:.1e} of its static load; use a shorter dt"
    )]
    Uncoupled {
        /// Place of the front axle on the road, m.
        place: f64,
        /// The step, s.
        step: f64,
        /// Iterations that were done.
        iterations: usize,
        /// Largest change of a force in the last of them, as a part of the static load.
        change: f64,
    },
    /// The dense scheme would need more memory and time than is sensible.
    #[error(
        "a dense transition matrix of {unknowns} unknowns is refused, the limit is {limit}: \
         use a shorter road or longer elements"
    )]
    TooLarge {
        /// Degrees of freedom asked for.
        unknowns: usize,
        /// Degrees of freedom accepted.
        limit: usize,
    },
    /// What a step takes from one node to another does not die away nearby.
    #[error(
        "within a step of {dt:?} s the motion of a node is felt more than {elements} elements of \
         {length:.3} m away, too far for a banded solver: use the window or the dense one, a \
         shorter dt or longer elements"
    )]
    TooWide {
        /// Elements on each side that a band may have.
        elements: usize,
        /// Their length, m.
        length: f64,
        /// Time step, s.
        dt: f64,
    },
    /// The machine has no room for what is to be kept.
    #[error("no memory for the {gigabytes:.1} GB that are to be kept")]
    NoMemory {
        /// What was asked for.
        gigabytes: f64,
    },
    /// The caller asked the run to stop.
    #[error("stopped by the caller after step {step} of {steps}")]
    Stopped {
        /// Steps done.
        step: usize,
        /// Steps asked for.
        steps: usize,
    },
}

/// Whose fault an error is; the binding chooses the exception by it.
#[derive(Debug, Clone, Copy, PartialEq, Eq)]
pub enum Kind {
    /// The input is wrong.
    Input,
    /// The numerics failed.
    Solver,
    /// The caller asked to stop.
    Stopped,
}

impl Error {
    /// Whose fault it is.
    #[must_use]
    pub fn kind(&self) -> Kind {
        match self {
            Self::Invalid { .. }
            | Self::Shape { .. }
            | Self::TooLarge { .. }
            | Self::TooWide { .. }
            | Self::NoMemory { .. } => Kind::Input,
            Self::NonFinite { .. }
            | Self::Singular { .. }
            | Self::Cancelled { .. }
            | Self::Unsettled { .. }
            | Self::Uncoupled { .. }
            | Self::Diverged { .. } => Kind::Solver,
            Self::Stopped { .. } => Kind::Stopped,
        }
    }
}

/// The core's result.
pub type Result<T> = std::result::Result<T, Error>;

/// The error of a value that is not allowed.
pub(crate) fn invalid(
    name: impl Into<String>,
    value: impl ToString,
    allowed: impl Into<String>,
) -> Error {
    Error::Invalid { name: name.into(), value: value.to_string(), allowed: allowed.into() }
}

/// The error of a response that is not finite, noticed after so many steps of `dt`.
pub(crate) fn diverged(quantity: &'static str, step: usize, dt: f64) -> Error {
    Error::Diverged { quantity, step, time: step as f64 * dt }
}

/// `value` if it is finite and `allowed` holds for it.
pub(crate) fn check(
    name: &str,
    value: f64,
    unit: &str,
    allowed: &str,
    holds: impl FnOnce(f64) -> bool,
) -> Result<f64> {
    if value.is_finite() && holds(value) {
        return Ok(value);
    }
    let space = if unit.is_empty() { "" } else { " " };
    Err(invalid(name, format!("{value:?}{space}{unit}"), allowed))
}

/// A whole number if `allowed` holds for it.
pub(crate) fn check_count(
    name: &str,
    count: usize,
    allowed: &str,
    holds: impl FnOnce(usize) -> bool,
) -> Result<usize> {
    if holds(count) { Ok(count) } else { Err(invalid(name, count, allowed)) }
}

/// `value` if it is finite and above zero.
pub(crate) fn positive(name: &str, value: f64, unit: &str) -> Result<f64> {
    check(name, value, unit, "finite and above 0", |v| v > 0.0)
}

/// `value` if it is finite and not below zero.
pub(crate) fn not_negative(name: &str, value: f64, unit: &str) -> Result<f64> {
    check(name, value, unit, "finite and not below 0", |v| v >= 0.0)
}

/// A watcher of a long run: told the steps done and the steps in all, it says whether to go on.
pub type Watch<'a> = dyn FnMut(usize, usize) -> bool + 'a;

/// A watcher that lets a run go on.
pub fn unwatched(_: usize, _: usize) -> bool {
    true
}

/// Tell the watcher; an error if it wants to stop.
pub(crate) fn go_on(watch: &mut Watch<'_>, step: usize, steps: usize) -> Result<()> {
    if watch(step, steps) { Ok(()) } else { Err(Error::Stopped { step, steps }) }
}

/// Make room for `count` numbers, or say that there is none.
pub(crate) fn reserve(values: &mut Vec<f64>, count: usize) -> Result<()> {
    let gigabytes = count as f64 * 8e-9;
    values.try_reserve_exact(count).map_err(|_| Error::NoMemory { gigabytes })
}

//! Long work: without the interpreter lock, stopped by Ctrl-C, telling its progress.

use std::time::{Duration, Instant};

use pavefem_core::error::{Result, Watch};
use pyo3::prelude::*;

use crate::convert::exception;

/// How often a run looks for signals and tells its progress.
const INTERVAL: Duration = Duration::from_millis(100);

/// Run `work` detached from the interpreter. Every [`INTERVAL`] it sees to signals and calls
/// `progress(done, total)`; an exception from either stops the work and is raised.
pub(crate) fn detached<T: Send>(
    py: Python<'_>,
    progress: Option<&Py<PyAny>>,
    work: impl FnOnce(&mut Watch<'_>) -> Result<T> + Send,
) -> PyResult<T> {
    let mut raised = None;
    let outcome = py.detach(|| {
        let mut last = Instant::now();
        let mut watch = |done: usize, total: usize| {
            if last.elapsed() < INTERVAL {
                return true;
            }
            last = Instant::now();
            let seen = Python::attach(|py| {
                py.check_signals()?;
                progress.map_or(Ok(()), |call| call.call1(py, (done, total)).map(|_| ()))
            });
            raised = seen.err();
            raised.is_none()
        };
        work(&mut watch)
    });
    match (raised, outcome) {
        (Some(error), _) => Err(error),
        (None, outcome) => outcome.map_err(exception),
    }
}

"""Evaluate a study: take points from the store, the others from the workers, and keep these."""

from __future__ import annotations

import math
import os
from collections.abc import Mapping, Sequence
from concurrent.futures import Executor
from contextlib import closing
from typing import TYPE_CHECKING, Any, NamedTuple

import numpy as np
from numpy.typing import ArrayLike, NDArray

from pavefem._progress import progress_bar
from pavefem.errors import SweepError
from pavefem.profile import real_array
from pavefem.scenario import Scenario
from pavefem.studies.executors import dispatch, pool_for
from pavefem.studies.outputs import Outputs
from pavefem.studies.points import Outcome, Plan, Row, plan_of
from pavefem.studies.store import Store

if TYPE_CHECKING:
    from distributed import Client


class Answers(NamedTuple):
    """What became of the points of a study.

    Attributes
    ----------
    values : ndarray, shape (points, outputs)
        Outputs; NaN where a point failed.
    errors : list of str, length points
        Why it failed; "" where it did not.
    warnings : list of str, length points
        Which laws it uses outside their range; "" for none.
    """

    values: NDArray[np.float64]
    errors: list[str]
    warnings: list[str]


def evaluate(
    base: Scenario | Mapping[str, Any],
    names: Sequence[str],
    values: ArrayLike,
    outputs: Outputs,
    *,
    executor: Executor | Client | None = None,
    workers: int | None = None,
    store: str | os.PathLike[str] | None = None,
    progress: bool = False,
) -> Answers:
    """Find the outputs of scenarios that differ from `base` by numbers.

    Parameters
    ----------
    base : Scenario or mapping
        What they have in common, or its fields by name.
    names : sequence of str
        Fields that differ, as of `sweep`.
    values : array_like, shape (points, names)
        Their values.
    outputs : str, callable, sequence or mapping
        As of `sweep`.
    executor, workers, store, progress
        As of `sweep`.

    Returns
    -------
    Answers

    Raises
    ------
    ValueError
        If a name is not known, or `values` has another shape or a number that is not finite. What
        fails at a point is among the answers.
    SweepError, OSError
        As of `sweep`.

    Examples
    --------
    >>> import pavefem as pf
    >>> base = pf.Scenario(scheme=pf.Scheme.paper(solver="window"))
    >>> points = [[20.0, 1.3], [30.0, 1.3], [70.0, 1.3]]
    >>> found = evaluate(base, ["temperature_c", "axle_spacing"], points, "max_deflection")
    >>> (found.values.ravel() * 1e3).round(3)
    array([0.661, 1.355,   nan])
    >>> found.errors[2]
    'ValueError: temperature_c = 70.0 degC: must be below the softening point, 60 degC'
    """
    if isinstance(names, str) or not isinstance(names, Sequence | np.ndarray):
        raise ValueError(f"names = {names!r}: must be a list of fields, in the order of columns")
    table = real_array("values", values)
    if table.ndim != 2 or table.shape[1] != len(names):
        raise ValueError(
            f"values has shape {table.shape}: must have a column for each of {[*names]}"
        )
    if not np.isfinite(table).all():
        raise ValueError(f"values has {table[~np.isfinite(table)][0]}: must be finite")
    plan = plan_of(base, names, outputs)
    rows = [tuple(row) for row in table.tolist()]
    axes = dict(zip(names, table.T, strict=True))
    return evaluate_points(plan, rows, axes, executor, workers, store, progress)


def evaluate_points(
    plan: Plan,
    rows: Sequence[Row],
    axes: Mapping[str, Any],
    executor: Executor | Client | None,
    workers: int | None,
    store: str | os.PathLike[str] | None,
    progress: bool,
) -> Answers:
    """Evaluate all points that the store does not have; `axes` says to it where they differ."""
    plan = plan.with_files_for(rows)
    pool = pool_for(executor, plan, workers)
    kept = None if store is None else Store(store, plan, axes, len(rows))
    found = {} if kept is None else kept.read()
    missing = [point for point in plan.in_order(rows) if point not in found]
    try:
        with (
            progress_bar(progress, "points") as report,
            closing(dispatch(pool, rows, missing)) as batches,
        ):
            for outcomes in batches:
                found |= outcomes
                if kept is not None:
                    kept.add(outcomes)
                if report is not None:
                    report(len(found), len(rows))
    except SweepError as error:
        raise SweepError(f"{error}; {_state(found, rows, kept)}") from error.__cause__
    except KeyboardInterrupt as interrupt:
        interrupt.add_note(_state(found, rows, kept))
        raise
    finally:
        if kept is not None:
            kept.flush()
    return _answers(plan, [found[point] for point in range(len(rows))])


def _state(found: Mapping[int, Outcome], rows: Sequence[Row], kept: Store | None) -> str:
    done = f"{len(found)} of {len(rows)} points were done"
    if kept is None:
        return f"{done}, and are lost: store=folder keeps them"
    return f"{done}, and are kept in {kept.folder}: the same call goes on from there"


def _answers(plan: Plan, outcomes: Sequence[Outcome]) -> Answers:
    nothing = [math.nan] * len(plan.outputs)
    values = [nothing if outcome.error else outcome.values for outcome in outcomes]
    return Answers(
        np.array(values, dtype=np.float64).reshape(len(outcomes), len(plan.outputs)),
        [outcome.error for outcome in outcomes],
        [outcome.warning for outcome in outcomes],
    )

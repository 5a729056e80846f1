"""Sweeps: all combinations of values of some fields."""

from __future__ import annotations

import math
import os
import warnings
from collections.abc import Mapping, Sequence, Set
from concurrent.futures import Executor
from importlib.metadata import version
from itertools import product
from numbers import Real
from typing import TYPE_CHECKING, Any, Final, NamedTuple

import numpy as np
import xarray as xr

from pavefem._model import Model
from pavefem.errors import ValidityWarning
from pavefem.scenario import Scenario
from pavefem.simulate import HISTORIES, Keep
from pavefem.studies.evaluation import Answers, evaluate_points
from pavefem.studies.outputs import Outputs
from pavefem.studies.points import Plan, plan_of

if TYPE_CHECKING:
    from distributed import Client

_TOLD: Final = ("error", "warning")
"""Variables of a sweep beside its outputs."""


def sweep(
    base: Scenario | Mapping[str, Any],
    /,
    *,
    outputs: Outputs = "max_deflection",
    keep: Keep = HISTORIES,
    stations: Sequence[float] | None = None,
    executor: Executor | Client | None = None,
    workers: int | None = None,
    store: str | os.PathLike[str] | None = None,
    cache: bool = True,
    progress: bool = False,
    **axes: Any,
) -> xr.Dataset:
    """Run a scenario for all combinations of values of some of its fields.

    Points share what they can: vehicles, tire forces where only the pavement or its temperature
    differs, and the transition matrices of a dense scheme where only the vehicle or the profile
    does. What a point answers does not depend on that, nor on where it is evaluated.

    Parameters
    ----------
    base : Scenario or mapping
        What all points have in common, or its fields by name, as of a scenario file.
    outputs : str, callable, sequence or mapping
        What is kept of each run: ``max_deflection``, ``mid_deflection`` (at mid-length),
        ``rebound``; the largest ``dlc`` (dynamic load coefficient) and ``max_force`` and smallest
        ``min_force`` of all axles, or, as in ``dlc_2``, those of one axle by its number; or a
        function that makes one number of a `Result`. A mapping gives them other names.
    keep, stations
        As of `simulate`: the histories that functions among the outputs find in a result.
    executor : concurrent.futures.Executor or dask.distributed.Client, optional
        Who evaluates the points, in batches of about a second. By default threads of this process
        do, and all cores are used: nearly all of a run is done without the interpreter's lock. A
        process pool must not fork (``mp_context=multiprocessing.get_context("spawn")``).
    workers : int, optional
        How many points are worked on at a time; by default one for each core, or as many as the
        executor has workers.
    store : path, optional
        Folder where points are kept as they are done. The same call with the same folder goes on
        from there, after Ctrl-C or a crash, too; what is damaged is computed again. Functions are
        known by name and code, and with them the values that they bring along.
    cache : bool
        Whether transition matrices are kept between points, and, if there are no more than 256 of
        them, in the cache folder.
    progress : bool
        Show progress when the sweep takes over a second.
    **axes
        Values by field. A field is known by its name if no other has it, else by the end of its
        path or all of it, as in ``**{"pavement.spacing": [0.5, 1.0]}``:

        * ``speed_kmh``, ``temperature_c``, ``run_in`` and other fields of `Scenario`;
        * fields of `Scheme`, and of `Pavement` and `Asphalt` for all sections of the road;
        * ``road.length`` of a road of one section, and ``road.ends``;
        * arguments of the function that built the base's vehicle, such as ``payload`` and
          ``axle_spacing``: one of `pavefem.vehicles`, or of your own marked `vehicles.builder`;
        * ``iri``, m/km, to which the base's profile is scaled.

        Values may be objects, such as profiles, whose names are then the coordinate.

    Returns
    -------
    xarray.Dataset
        A dimension for each field, in the order given, and a variable for each output, with units.
        A point that failed is NaN, and its ``error`` says why; ``warning`` says which empirical
        laws a point uses outside their range. Both are "" where all is well.

    Raises
    ------
    ValueError
        If a field, an output or an executor is not understood, or the store is another sweep's.
    SweepError
        If the executor fails; what was done is in the store.
    FormatError, OSError
        If the store is damaged or cannot be written.

    Warns
    -----
    UserWarning
        If points failed, or chunks of the store were damaged.
    ValidityWarning
        If points use an empirical law outside its range.

    Examples
    --------
    >>> import pavefem as pf
    >>> base = pf.Scenario(scheme=pf.Scheme.paper(solver="window"))
    >>> found = pf.sweep(base, temperature_c=[10.0, 20.0, 30.0], axle_spacing=[1.3, 2.2])
    >>> (found["max_deflection"] * 1e3).round(3).to_numpy()
    array([[0.4  , 0.396],
           [0.661, 0.662],
           [1.355, 1.441]])
    """
    if not axes:
        raise ValueError("no field is swept: give some=[values]")
    read = [_axis(name, values) for name, values in axes.items()]
    plan = plan_of(
        base,
        [*axes],
        outputs,
        choices=[axis.choices for axis in read],
        keep=keep,
        stations=stations,
        cache=cache,
    )
    _check_names(plan)
    rows = [*product(*(axis.entries for axis in read))]
    values = {name: axis.choices or axis.entries for name, axis in zip(axes, read, strict=True)}
    found = evaluate_points(plan, rows, values, executor, workers, store, progress)
    _warn(found)
    return _dataset(plan, read, found)


class _Axis(NamedTuple):
    """Values of a swept field."""

    entries: Sequence[Any]
    """What rows of the plan have of them: the values, or their numbers."""
    choices: tuple[Any, ...] | None
    """The values, where they are objects."""
    labels: Sequence[Any]
    """What the coordinate calls them."""


def _axis(name: str, given: Any) -> _Axis:
    """Read the values of a field: numbers, words, truth values, or objects."""
    if isinstance(given, str | bytes | Mapping | Model | Set) or not hasattr(given, "__iter__"):
        raise ValueError(
            f"{name} = {given!r}: must be a list of values; a single one is the base's"
        )
    values = _listed(name, given) if hasattr(given, "__array__") else [*given]
    values = [value.item() if isinstance(value, np.generic) else value for value in values]
    if not values:
        raise ValueError(f"{name} has no value: must have at least one")
    if not all(isinstance(value, str) for value in values) and not _are_numbers(values):
        return _Axis(range(len(values)), tuple(values), _labels(name, values))
    if len(set(values)) < len(values):
        raise ValueError(f"{name} = {values}: has a value twice")
    wrong = [value for value in values if isinstance(value, float) and not math.isfinite(value)]
    if wrong:
        raise ValueError(f"{name} has {wrong[0]}: must be finite")
    entries = [value if isinstance(value, str | int) else float(value) for value in values]
    return _Axis(entries, None, entries)


def _listed(name: str, given: Any) -> list[Any]:
    """Values of an array of numpy or of those who know it."""
    array = np.asarray(given)
    if array.ndim != 1 or np.ma.is_masked(given):
        what = "masked values" if np.ma.is_masked(given) else f"shape {array.shape}"
        raise ValueError(f"{name} has {what}: must be a list of values")
    return [*array.tolist()]


def _are_numbers(values: Sequence[Any]) -> bool:
    """Whether all are numbers, or all truth values."""
    truths = [isinstance(value, bool) for value in values]
    if any(truths):
        return all(truths)
    return all(isinstance(value, Real) for value in values)


def _labels(name: str, values: Sequence[Any]) -> Sequence[Any]:
    """Names of objects, or their numbers where one has none."""
    names = [
        "none" if value is None else value if isinstance(value, str) else getattr(value, "name", "")
        for value in values
    ]
    if not all(isinstance(label, str) and label for label in names):
        return range(len(values))
    if len(set(names)) < len(names):
        raise ValueError(f"{name} has the names {names}: must differ, to tell the values apart")
    return names


def _check_names(plan: Plan) -> None:
    """Refuse outputs that would stand for something else in the dataset."""
    for output in plan.outputs:
        if output.name in (*_TOLD, *(item.name for item in plan.fields)):
            raise ValueError(f"output {output.name}: the dataset has something else of that name")


def _warn(found: Answers) -> None:
    """Say once, for all points, what their variables say of each."""
    for name, messages, what, kind in (
        ("error", found.errors, "failed", UserWarning),
        ("warning", found.warnings, "use a law outside its range", ValidityWarning),
    ):
        said = [message for message in messages if message]
        if said:
            warnings.warn(
                f"{len(said)} of {len(messages)} points {what}; the variable {name} says why, "
                f"first {said[0]!r}",
                kind,
                stacklevel=3,
            )


def _dataset(plan: Plan, axes: Sequence[_Axis], found: Answers) -> xr.Dataset:
    names = [item.name for item in plan.fields]
    shape = [len(axis.entries) for axis in axes]
    dataset = xr.Dataset(
        coords={
            item.name: (item.name, np.array(axis.labels), item.attributes)
            for item, axis in zip(plan.fields, axes, strict=True)
        },
        attrs={
            "title": "Sweep of a pavement's response to a vehicle",
            "pavefem_version": version("pavefem"),
            "base": plan.base.model_dump_json(),
        },
    )
    for output, column in zip(plan.outputs, found.values.T, strict=True):
        dataset[output.name] = (names, column.reshape(shape), dict(output.attributes))
    dataset["error"] = (
        names,
        np.array(found.errors).reshape(shape),
        {"long_name": "why a point failed"},
    )
    dataset["warning"] = (
        names,
        np.array(found.warnings).reshape(shape),
        {"long_name": "laws used outside their range"},
    )
    return dataset
